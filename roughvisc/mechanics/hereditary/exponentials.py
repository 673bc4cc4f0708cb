"""Memory in exponentials: the hereditary integral as a recursion from step to step.

A memory reduces one time step to an elastic problem,

    ``q_n = alpha p_n + carried``,    ``u_n = K q_n``,

with a scalar ``alpha`` [1/Pa] and a known field. It is linear, so it acts as well on the displacement at unit
compliance, ``v = K p``, which the contact solver has anyway: then the whole history costs no convolution. It knows
nothing of contact, transforms or grids; its state is a plain value.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.arrays import Cells, empty, inner, summed, threads_of, weighted
from roughvisc.mechanics.hereditary.memory import ActsOn, Rule
from roughvisc.mechanics.materials.prony import Prony, by_size, one_less_mean_decay

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModesState:
    """State of an exponential series.

    Attributes
    ----------
    modes : ndarray, shape (m, nx, ny) or (m, 2, nx, ny)
        Internal variables ``z_i`` with ``tau_i z_i' = field - z_i``; for a fluidity ``z' = field``.
    field : ndarray, shape (nx, ny) or (2, nx, ny)
        Field at the present instant.
    earlier : ndarray or None
        ``modes`` one step ago, where the next step may use them by the two-step rule.
    step : float
        Length of the last step. [s]
    """

    modes: NDArray[Any]
    field: NDArray[Any]
    earlier: NDArray[Any] | None = None
    step: float = 0.0


@dataclass(frozen=True)
class Modes:
    """Recursive memory of a Prony series: one field for each exponential, none for an elastic material.

    Parameters
    ----------
    material : Prony
        The series.
    acts_on : {"displacement", "pressure", "both"}
        What the fields are; the pressure form survives a change of grid and costs one convolution a step, both
        together survive it and cost none.
    """

    material: Prony
    acts_on: ActsOn = "displacement"
    rules: tuple[Rule, ...] = ("linear", "bdf2", "euler", "right")

    def start(self, shape: tuple[int, int]) -> ModesState:
        """State at rest."""
        field = (2, *shape) if self.acts_on == "both" else shape
        return ModesState(np.zeros((len(self.weights), *field)), np.zeros(field))

    def predict(self, state: ModesState, step: float, rule: Rule) -> tuple[float, Array]:
        """``alpha`` [1/Pa] and the carried field of a step ahead. [s]"""
        alpha, terms = self.terms(state, step, rule)
        return alpha, weighted(terms, empty(state.field.shape), threads_of(state.field.size))

    def terms(self, state: ModesState, step: float, rule: Rule) -> tuple[float, list[tuple[float, Array]]]:
        """The same, the carried field as the terms of which it is the sum."""
        own, earlier, before, after = self.coefficients(state, step, rule)
        weights = self.weights
        alpha = self.factor * self.material.glassy + summed(weights * after)
        terms = [(summed(weights * before), state.field), *zip(weights * own, state.modes, strict=True)]
        if rule == "bdf2" and state.earlier is not None:
            terms += zip(weights * earlier, state.earlier, strict=True)
        return alpha, terms

    def advance(self, state: ModesState, step: float, rule: Rule, field: Array) -> ModesState:
        """State after a step at whose end the field was ``field``."""
        if step == 0:
            return ModesState(state.modes, field, None, 0.0)
        own, earlier, before, after = self.coefficients(state, step, rule)
        modes = empty(state.modes.shape)
        for i, mode in enumerate(modes):
            terms = [(own[i], state.modes[i])]
            if earlier[i] and state.earlier is not None:
                terms.append((earlier[i], state.earlier[i]))
            if before[i]:
                terms.append((before[i], state.field))
            weighted([*terms, (after[i], field)], mode, threads_of(field.size))
        return ModesState(modes, field, state.modes if "bdf2" in self.rules else None, step)

    def restart(self, state: ModesState) -> ModesState:
        """State whose next step does not reach behind the present instant."""
        return ModesState(state.modes, state.field)

    def roll(self, state: ModesState, cells: int, axis: int) -> ModesState:
        """State of a periodic body seen from a profile that has moved by so many cells along an axis."""
        modes, field = (np.roll(fields, -cells, axis - 2) for fields in (state.modes, state.field))
        earlier = None if state.earlier is None else np.roll(state.earlier, -cells, axis - 2)
        return ModesState(modes, field, earlier, state.step)

    def enlarged(
        self,
        state: ModesState,
        shape: tuple[int, int],
        offset: tuple[int, int],
        displaced: Callable[[Array], Array],
    ) -> ModesState:
        """State on a larger grid: pressure is zero in what is new, and displaces all of it."""
        if self.acts_on == "displacement":
            raise ValueError("displacements reach beyond the grid: a memory of them alone cannot be enlarged")

        def moved(fields: Array) -> Array:
            larger = padded(fields, shape, offset)
            for pair in larger.reshape(-1, 2, *shape) if self.acts_on == "both" else ():
                pair[1] = displaced(pair[0])
            return larger

        earlier = None if state.earlier is None else moved(state.earlier)
        return ModesState(moved(state.modes), moved(state.field), earlier, state.step)

    @cached_property
    def factor(self) -> float:
        """Contact compliance over shear compliance. [-]"""
        return 0.5 * (1 - self.material.poisson)

    def products(self, modes: Array, displacement: Array, cells: Cells, pressure: Array) -> Array:
        """Inner product ``p K z_i`` of a pressure with each exponential, summed over the cells. [Pa2 m]

        The pressure is that on some cells and zero elsewhere; ``displacement`` is that by it at unit compliance.
        """
        fields = modes[: len(self.material.times)]
        if self.acts_on == "pressure":  # the kernel is symmetric; where nothing was ever in contact z is zero
            return np.einsum("mxy,xy->m", fields, displacement)
        displaced, threads = fields[:, 1] if self.acts_on == "both" else fields, threads_of(displacement.size)
        return np.array([inner(field, cells, pressure, threads) for field in displaced])

    #: Inner product of a pressure at rest with itself.
    no_products: ClassVar[float] = 0.0

    def at_once(self, product: float) -> float:
        """Energy that the instantaneous compliance stores, from ``<p, p>``. [J]"""
        return 0.5 * self.factor * self.material.glassy * product

    def of_elements(self, product: float) -> float:
        """The part of inner products of pressures that goes with each exponential: all share one kernel."""
        return product

    def of_flow(self, product: float) -> float:
        """Energy that a fluidity dissipates, from ``<p, p>`` times the time. [J]"""
        return self.factor * self.material.fluidity * product

    @cached_property
    def weights(self) -> Array:
        """Contact compliance of each mode, [1/Pa]; a fluidity, [1/(Pa s)], comes last."""
        fluidity = [self.material.fluidity] if self.material.fluidity else []
        return self.factor * np.array([*self.material.compliances, *fluidity])

    def coefficients(self, state: ModesState, step: float, rule: Rule) -> tuple[Array, Array, Array, Array]:
        """``z_n = own z_(n-1) + earlier z_(n-2) + before field_(n-1) + after field_n``, a fluidity last."""
        if rule == "bdf2" and state.earlier is None:
            raise ValueError("the two-step rule needs two states: start with 'linear' or 'euler'")
        return _coefficients(self.material.times, self.material.fluidity, step, state.step, rule)


@lru_cache(maxsize=8)
def _coefficients(
    times: tuple[float, ...], fluidity: float, step: float, last: float, rule: Rule
) -> tuple[Array, Array, Array, Array]:
    """Of a step after another: a trial, the state after it and its energies ask for the same ones."""
    found = _step_coefficients(step / np.array(times), step, last, rule)
    if fluidity:
        flowing = _flow_coefficients(step, last, rule)
        own, earlier, before, after = (np.append(mode, flow) for mode, flow in zip(found, flowing, strict=True))
        found = own, earlier, before, after
    for each in found:
        each.setflags(write=False)
    return found


def _step_coefficients(x: Array, step: float, last: float, rule: Rule) -> tuple[Array, Array, Array, Array]:
    """Coefficients of retarded modes, ``x = step / time``; all positive but ``earlier``, for any ``x >= 0``."""
    zero = np.zeros_like(x)
    if rule == "linear":
        after = one_less_mean_decay(x)
        # the two forms of (1 - (1 + x) exp(-x)) / x each cancel on the other's side
        before = by_size(x, 0.3, lambda x: -np.expm1(-x) - after, lambda x: (1 - (1 + x) * np.exp(-x)) / x)
        return np.exp(-x), zero, before, after
    if rule == "right":
        return np.exp(-x), zero, zero, -np.expm1(-x)
    if rule == "euler":
        return 1 / (1 + x), zero, zero, x / (1 + x)
    own, earlier, beta = _two_step(step, last)
    return own / (1 + beta * x), earlier / (1 + beta * x), zero, beta * x / (1 + beta * x)


def _flow_coefficients(step: float, last: float, rule: Rule) -> tuple[float, float, float, float]:
    """The same for a fluidity, ``z' = field``."""
    if rule == "linear":
        return 1.0, 0.0, step / 2, step / 2
    if rule in ("right", "euler"):
        return 1.0, 0.0, 0.0, step
    own, earlier, beta = _two_step(step, last)
    return own, earlier, 0.0, beta * step


def _two_step(step: float, last: float) -> tuple[float, float, float]:
    """Variable-step BDF2: ``z_n = own z_(n-1) + earlier z_(n-2) + beta step z_n'``."""
    ratio = step / last
    return (1 + ratio) ** 2 / (1 + 2 * ratio), -(ratio**2) / (1 + 2 * ratio), (1 + ratio) / (1 + 2 * ratio)


def padded(fields: Array, shape: tuple[int, int], offset: tuple[int, int]) -> Array:
    """Fields on a larger grid, zero in the new cells; the last two axes are the grid's."""
    larger = np.zeros((*fields.shape[:-2], *shape))
    nx, ny = fields.shape[-2:]
    if not (0 <= offset[0] <= shape[0] - nx and 0 <= offset[1] <= shape[1] - ny):
        raise ValueError(f"a grid of {shape} cells does not contain one of {(nx, ny)} cells that begins at {offset}")
    larger[..., offset[0] : offset[0] + nx, offset[1] : offset[1] + ny] = fields
    return larger
