"""Memory of the elements of the method of dimensionality reduction (MDR), independent of that of the grid.

Both kinds have one column an element, in order of creation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.materials.creep import Material
from roughvisc.mechanics.materials.prony import Prony, one_less_mean_decay

Array = NDArray[np.float64]


class Exponentials:
    """Internal variables of an exponential series; piecewise-linear force, or second-order backward differences."""

    def __init__(self, material: Prony, capacity: int, *, stiff: bool):
        factor = 0.5 * (1 - material.poisson)
        self.glassy, self.flow = factor * material.glassy, factor * material.fluidity
        self.compliances = factor * np.array(material.compliances)
        self.times = np.array(material.times)
        self.stiff = stiff
        # rows: one for each retarded compliance, the viscous one (its increments in time units), the force
        rows = len(self.times) + 1
        self.now, self.before = np.zeros((rows, capacity)), np.zeros((rows, capacity))
        self.force = np.zeros(capacity)
        self.last_h = 0.0
        self._pending: tuple[float, Array, Array] | None = None

    def restart(self) -> None:
        """After a corner or a jump: the rate is not continuous."""
        self.last_h = 0.0

    def predict(self, h: float, count: int) -> tuple[Array, float]:
        """Displacement left by the past after a step, and compliance to the new force."""
        now, force = self.now[:, :count], self.force[:count]
        weights = np.append(self.compliances, self.flow)
        if h == 0:
            kept, gain = now, np.zeros(len(weights))
        elif not self.stiff:
            x = h / self.times
            b = one_less_mean_decay(x)
            gain = np.append(b, h / 2)
            past = np.append(-np.expm1(-x) - b, h / 2)
            kept = np.append(np.exp(-x), 1.0)[:, None] * now + past[:, None] * force
        else:
            ratio = h / self.last_h if self.last_h else np.inf
            if ratio > 2.4:  # backward Euler at a restart, and where the steps grow too fast for the other
                beta, known = 1.0, now
            else:
                beta = (1 + ratio) / (1 + 2 * ratio)
                known = ((1 + ratio) ** 2 * now - ratio**2 * self.before[:, :count]) / (1 + 2 * ratio)
            x = beta * h / self.times
            gain = np.append(x / (1 + x), beta * h)
            kept = np.append(1 / (1 + x), 1.0)[:, None] * known
        self._pending = (h, kept, gain)
        return weights @ kept, self.glassy + float(weights @ gain)

    def accept(self, force: Array) -> None:
        """End the step with the forces found."""
        assert self._pending is not None
        h, kept, gain = self._pending
        count = len(force)
        if h > 0:
            self.before[:, :count] = self.now[:, :count]
            self.now[:, :count] = kept + gain[:, None] * force
            self.last_h = h
        self.force[:count] = force

    def insert(self, left: int, right: int, weight: float, count: int) -> None:
        """New column ``count``, between two old ones."""
        for field in (self.now, self.before, self.force):
            field[..., count] = (1 - weight) * field[..., left] + weight * field[..., right]
        if self._pending is not None:
            h, kept, gain = self._pending
            column = (1 - weight) * kept[:, left] + weight * kept[:, right]
            self._pending = (h, np.column_stack([kept, column]), gain)


class AllForces:
    """All past forces, with weights from the antiderivative of the compliance: exact for piecewise-linear force."""

    def __init__(self, material: Material, capacity: int, steps: int):
        self.material = material
        self.forces = np.zeros((steps + 1, capacity))
        self.times = np.zeros(steps + 1)
        self.step = 0

    def restart(self) -> None:
        """Nothing to forget: the rule looks at no rate."""

    def predict(self, h: float, count: int) -> tuple[Array, float]:
        k = self.step
        self.times[k + 1] = now = self.times[k] + h
        lags, spans = now - self.times[: k + 2], np.diff(self.times[: k + 2])
        integral = np.asarray(self.material.contact_integral(lags))
        jump = np.asarray(self.material.contact_compliance(lags[1:]))
        mean = np.where(spans > 0, -np.diff(integral) / np.where(spans > 0, spans, 1.0), jump)
        # sum over increments of the force, written as a sum over the forces
        weights = np.append(0.0, mean[:-1]) - mean
        return weights @ self.forces[: k + 1, :count], float(mean[-1])

    def accept(self, force: Array) -> None:
        self.step += 1
        self.forces[self.step, : len(force)] = force

    def insert(self, left: int, right: int, weight: float, count: int) -> None:
        rows = self.forces[: self.step + 1]
        rows[:, count] = (1 - weight) * rows[:, left] + weight * rows[:, right]
