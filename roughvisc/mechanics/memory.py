"""Memory of a linear viscoelastic body: from a history of pressure to the displacement after the next step.

The contact compliance is an exponential series,

    C(t) = glassy + fluidity t + sum_i c_i (1 - exp(-t/tau_i)).

``v = K p`` is the displacement per unit compliance under the present pressure. Each exponential has one field ``m_i``
with ``dm_i/dt = (v - m_i)/tau_i``; the fluidity has one with ``dm/dt = v``. The displacement is
``glassy v + sum_i c_i m_i``. A step of length ``h`` is an elastic problem with the compliance ``alpha``,

    displacement = alpha v_new + history,

so that the history costs no convolution. ``v`` is taken as linear within a step; this rule is of second order. It rings
if the body creeps far within a step. BDF2 then replaces it, after a first step with constant ``v``.

The same recursion applies to the pressure. A memory may keep both fields, ``(v, p)``. It then gives the pressure that
causes the present displacement.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np

from roughvisc.mechanics.grid import namespace
from roughvisc.mechanics.materials.prony import Prony, one_less_mean_decay

Array = Any  # an array of NumPy or CuPy
Rule = Literal["linear", "bdf2", "constant"]

#: Orders of the series of ``(1 - (1 + x) exp(-x)) / x``, and its coefficients.
_ORDERS = np.arange(2.0, 16)
_COEFFICIENTS = (-1) ** _ORDERS * (_ORDERS - 1) / np.cumprod(_ORDERS)
#: BDF2 is used if the compliance grows by more than this factor within a step.
STIFF = 3.0
#: BDF2 is stable while steps grow by no more than 1 + sqrt(2) [1]_; after a faster growth it restarts.
#:
#: .. [1] E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section III.5.
LARGEST_GROWTH = 2.4


@dataclass(frozen=True)
class History:
    """Memory at an instant.

    Attributes
    ----------
    fields : array, shape (k, nx, ny)
        Displacement per unit compliance ``v`` [m Pa], and with ``k = 2`` the pressure [Pa].
    modes : array, shape (m, k, nx, ny)
        The fields ``m_i`` of each exponential, and last of the fluidity.
    earlier : array or None
        The modes before the last step, if BDF2 may need them.
    step : float
        Length of the last step; zero if the next one must not use it. [s]
    """

    fields: Array
    modes: Array
    earlier: Array | None = None
    step: float = 0.0


@dataclass(frozen=True)
class Prediction:
    """Elastic problem of a step: ``displacement = compliance K p + carried``.

    Attributes
    ----------
    compliance : float
        ``alpha``. [1/Pa]
    carried : array, shape (nx, ny)
        Displacement due to the history. [m]
    modes : array, shape (m, k, nx, ny)
        Part of the new modes that the history determines.
    new : ndarray, shape (m,)
        Weight of the new fields in the modes.
    step : float
        Length of the step. [s]
    grid : Grid or None
        Cells with the kernel of the step, if the kernel depends on the step; `compliance` is then one.
    """

    compliance: float
    carried: Array
    modes: Array
    new: np.ndarray
    step: float
    grid: Any = None


class Memory:
    """Exponential series of a body in which space and time separate.

    Parameters
    ----------
    series : Prony
        The material.
    duration : float
        Length of the program: no step is longer. [s]
    keeps_pressure : bool
        Whether the pressure that causes the displacement is kept too.
    """

    def __init__(self, series: Prony, duration: float, keeps_pressure: bool = False) -> None:
        factor = 0.5 * (1 - series.poisson)  # of the contact compliance over the shear compliance
        self.series = series
        #: Contact compliance after a time [s], cached because few times recur often. [1/Pa]
        self.compliance = lru_cache(maxsize=64)(lambda time: float(series.contact_compliance(time)))
        self.glassy = factor * series.glassy
        flow = [series.fluidity] if series.fluidity else []
        self.compliances = factor * np.array([*series.compliances, *flow])
        self.times = np.array([*series.times, *([np.inf] if flow else [])])
        #: Contact compliance: of each exponential [1/Pa], of the fluidity [1/(Pa s)], instantaneous [1/Pa].
        self.weights: Any = np.append(self.compliances, self.glassy)
        #: Whether the response is independent of the history.
        self.is_elastic = not bool(self.compliances.any())
        self.fields = 2 if keeps_pressure else 1
        self.may_ring = self.is_stiff(duration)

    def is_stiff(self, step: float) -> bool:
        """Return whether the body creeps too far within a step for a linear ``v``."""
        return step > 0 and self.compliance(step) > STIFF * self.glassy

    def start(self, nothing: Array) -> History:
        """Return the memory of a body at rest, from an array of zeros, shape (nx, ny)."""
        fields = self.kept(nothing, nothing)
        return History(fields, namespace(fields).zeros((self.times.size, *fields.shape), fields.dtype))

    def predict(self, history: History, step: float, rule: Rule | None = None) -> Prediction:
        """Return the elastic problem of a step. [s]"""
        own, earlier, before, new = self.recursion(step, history.step, rule or self.rule(history, step))
        xp = namespace(history.modes)
        modes, carried = xp.empty_like(history.modes), xp.zeros_like(history.fields[0])
        for i, mode in enumerate(modes):
            xp.multiply(history.modes[i], own[i], out=mode)
            if earlier[i] and history.earlier is not None:
                mode += earlier[i] * history.earlier[i]
            if before[i]:
                mode += before[i] * history.fields
            carried += self.response(mode[0], i)
        return self.problem(carried, modes, new, step)

    def advance(self, history: History, prediction: Prediction, unit: Array, pressure: Array) -> History:
        """Return the memory after a step.

        Parameters
        ----------
        history, prediction : History, Prediction
            Memory before the step, and elastic problem of the step. The modes of the prediction are overwritten.
        unit : array, shape (nx, ny)
            Displacement per unit compliance at the end. [m Pa]
        pressure : array, shape (nx, ny)
            Pressure at the end. [Pa]
        """
        fields = self.kept(unit, pressure)
        for mode, weight in zip(prediction.modes, prediction.new, strict=True):
            mode += weight * fields
        # the next step can use BDF2 only if it is stiff and not much longer than this one
        needed = self.may_ring and self.is_stiff(LARGEST_GROWTH * prediction.step)
        return History(fields, prediction.modes, history.modes if needed else None, prediction.step)

    def displacement(self, history: History) -> Array:
        """Return the displacement [m], and with ``k = 2`` the pressure that causes it, times a compliance [-]."""
        total = self.response(history.fields, -1)
        for i, mode in enumerate(history.modes):
            total += self.response(mode, i)
        return self.on_cells(total)

    def at_once(self, history: History) -> Array:
        """Return the instantaneous part of the displacement. [m]"""
        return self.on_cells(self.response(history.fields[:1], -1))[0]

    def after_rest(self, history: History, time: float) -> Array:
        """Return the displacement after a time without pressure; the present pressure must be zero. [m]"""
        own = self.recursion(time, 0.0, "linear")[0]
        total = namespace(history.fields).zeros_like(history.fields[:1])
        for i, mode in enumerate(history.modes):
            total += self.response(mode[:1], i, own[i])
        return self.on_cells(total)[0]

    # The methods below depend on the kept fields, which are transforms if the waves of a body creep differently.

    def kept(self, unit: Array, pressure: Array) -> Array:
        """Return the fields of a history. [m Pa], [Pa]"""
        return unit[None] if self.fields == 1 else namespace(unit).stack([unit, pressure])

    def response(self, field: Array, number: int, part: float = 1.0) -> Array:
        """Return a part of the displacement due to a field of exponential `number`; -1: instantaneous part."""
        return (self.weights[number] * part) * field

    def on_cells(self, total: Array) -> Array:
        """Return the displacement on the cells. [m]"""
        return total

    def problem(self, carried: Array, modes: Array, new: np.ndarray, step: float) -> Prediction:
        """Return the elastic problem of a step from the displacement due to its history, see :class:`Prediction`."""
        alpha = self.glassy + float((self.compliances * new).sum())
        return Prediction(alpha, carried, modes, new, step)

    def unit(self, history: History) -> Array | None:
        """Return the displacement per unit compliance; None if the body has no common kernel. [m Pa]"""
        return history.fields[0]

    def roll(self, history: History, cells: int, axis: int) -> History:
        """Return the memory of a periodic body, in the frame of a profile that has moved along an axis."""

        def rolled(fields: Array) -> Array:
            return namespace(fields).roll(fields, -cells, axis - 2)

        earlier = None if history.earlier is None else rolled(history.earlier)
        return History(rolled(history.fields), rolled(history.modes), earlier, history.step)

    def remaining(self, time: float) -> float:
        """Return the part of an error of the history that relaxation leaves after a time. [s]

        At a held displacement ``glassy v = -sum_i c_i m_i``, so that the modes decay together.
        """
        if self.glassy == 0 or self.is_elastic:
            return 1.0
        rates, parts = self._relaxation
        return float(np.clip((parts * np.exp(-rates * time)).sum() / parts.sum(), 0.0, 1.0))

    @cached_property
    def _relaxation(self) -> tuple[np.ndarray, np.ndarray]:
        """Rates at which errors decay [1/s], and their parts in an error that is equal in all modes."""
        active = self.compliances > 0
        own, weights = 1 / self.times[active], self.compliances[active] / self.glassy
        driven = np.where(own > 0, own, 1.0)
        equal = np.where(own > 0, 1.0, 1 / weights)  # of the fluidity: what relaxes at the rate fluidity / glassy
        # diag(own) + driven weights^T, in a basis in which it is symmetric
        root = np.sqrt(driven * weights)
        rates, basis = np.linalg.eigh(np.diag(own) + np.outer(root, root))
        parts = (root @ basis) * (basis.T @ (np.sqrt(weights / driven) * equal))
        return np.maximum(rates, 0.0), parts

    def rule(self, history: History, step: float) -> Rule:
        """Return the rule of a step. [s]"""
        if not self.may_ring or not self.is_stiff(step):
            return "linear"
        return "bdf2" if history.earlier is not None and step <= LARGEST_GROWTH * history.step else "constant"

    def recursion(self, step: float, last: float, rule: Rule) -> tuple[np.ndarray, ...]:
        """Return the weights of ``m_new = own m + earlier m_before + before v + new v_new``.

        Parameters
        ----------
        step, last : float
            Lengths of the step and of the step before. [s]
        rule : {"linear", "bdf2", "constant"}
            Rule for ``v`` within the step.

        Returns
        -------
        own, earlier, before, new : ndarray, shape (m,)
        """
        ratio, flows, none = step / self.times, np.isinf(self.times), np.zeros(self.times.size)
        if rule == "linear":
            own = np.exp(-ratio)
            new = np.where(flows, step / 2, one_less_mean_decay(ratio))
            before = np.where(flows, step / 2, -np.expm1(-ratio) - new)
            small = ratio < 0.3  # the difference cancels
            early = ratio[small & ~flows, None] ** (_ORDERS - 1)
            before[small & ~flows] = (_COEFFICIENTS * early).sum(axis=-1)
            return own, none, before, new
        if rule == "constant":
            return np.exp(-ratio), none, none, np.where(flows, step, -np.expm1(-ratio))
        growth = step / last
        beta = (1 + growth) / (1 + 2 * growth)
        divisor = 1 + beta * ratio
        own, earlier = (1 + growth) ** 2 / (1 + 2 * growth) / divisor, -(growth**2) / (1 + 2 * growth) / divisor
        return own, earlier, none, beta * np.where(flows, step, ratio) / divisor
