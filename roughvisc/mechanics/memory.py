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

:func:`choose_memory` chooses the series of a body for a program, with the error of the series.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from roughvisc.mechanics.body import Body, wave_limits
from roughvisc.mechanics.grid import Grid, namespace
from roughvisc.mechanics.layer import LayeredBody, LayerSeries, crept, interpolated, layer_series
from roughvisc.mechanics.materials.material import Material, Prony, known_times, parts_of_step
from roughvisc.mechanics.materials.series import series

Array = Any  # an array of NumPy or CuPy
Rule = Literal["linear", "bdf2", "constant"]

#: BDF2 is used if the compliance grows by more than this factor within a step.
STIFF = 3.0
#: BDF2 is stable while steps grow by no more than 1 + sqrt(2) [1]_; after a faster growth it restarts.
#:
#: .. [1] E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section III.5.
LARGEST_GROWTH = 2.4
#: Largest error of a series that replaces a material, as a fraction of the tolerance.
SERIES_SHARE = 0.1
#: Part of this error for the series of the materials of a layered body; the rest is for the series of its waves.
MATERIALS_SHARE = 0.3


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

    Attributes
    ----------
    series_error : float
        Largest relative error of the compliance at time zero and from the shortest age on; zero if the memory is exact.
    misfit : float
        Largest relative deviation of the series from the rows of a table, zero if it is within their noise.
    note : str
        The model in words.
    """

    def __init__(self, series: Prony, duration: float, keeps_pressure: bool = False) -> None:
        #: The series.
        self.series = series
        factor = 0.5 * (1 - series.poisson)  # of the contact compliance over the shear compliance
        #: Contact compliance after a time [s], cached because few times recur often. [1/Pa]
        self.compliance = cast(Callable[[float], float], lru_cache(maxsize=64)(series.contact_compliance))
        self.glassy = factor * series.glassy
        #: Contact compliance at the end of the program. [1/Pa]
        self.final = self.compliance(duration)
        flow = [series.fluidity] if series.fluidity else []
        self.compliances = factor * np.array([*series.compliances, *flow])
        self.times = np.array([*series.times, *([np.inf] if flow else [])])
        #: Contact compliance: of each exponential [1/Pa], of the fluidity [1/(Pa s)], instantaneous [1/Pa].
        self.weights: Any = np.append(self.compliances, self.glassy)
        #: Whether the response is independent of the history.
        self.is_elastic = not bool(self.compliances.any())
        #: Rates at which errors of the history decay while the displacement is held. The modes decay together, because
        #: ``glassy v = -sum_i c_i m_i``. [1/s]
        self.rates = np.zeros(1)
        #: Parts, not normalized, of an error that is equal in all modes: each decays at one of these rates.
        self.parts = np.ones(1)
        #: Parts of the relaxation function that relax at these rates.
        self.relaxing = np.zeros(1)
        if self.glassy > 0 and not self.is_elastic:
            active = self.compliances > 0
            own = 1 / self.times[active]
            weights = self.compliances[active] / self.glassy
            driven = np.where(own > 0, own, 1.0)
            equal = np.where(own > 0, 1.0, 1 / weights)  # of the fluidity: what relaxes at the rate fluidity / glassy
            # eigenvalues of diag(own) + driven weights^T, which this scaling makes symmetric
            root = np.sqrt(driven * weights)
            rates, basis = np.linalg.eigh(np.diag(own) + np.outer(root, root))
            self.rates = np.maximum(rates, 0.0)
            self.parts = (root @ basis) * (basis.T @ (np.sqrt(weights / driven) * equal))
            self.relaxing = (root @ basis) ** 2 / np.maximum(rates, 1e-300)
        #: Number of fields of a history.
        self.field_count = 2 if keeps_pressure else 1
        self.series_error = 0.0
        self.misfit = 0.0
        count = len(series.times)
        #: Shortest age at which the error of the series is known [s], and error below it, see :func:`early_error`.
        self.shortest = 0.0
        self.early = 0.0
        terms = [f"{count} exponential{'s' * (count > 1)}"] * (count > 0) + ["viscous flow"] * (series.fluidity > 0)
        self.note = " and ".join(terms) or "no memory: elastic"
        self.may_ring = self.grows(duration, STIFF)

    def grows(self, step: float, factor: float) -> bool:
        """Return whether the compliance grows by more than a factor within a step of some length [s]."""
        least = factor * self.glassy
        return self.final > least and self.compliance(step) > least

    def start(self, nothing: Array) -> History:
        """Return the memory of a body at rest, from an array of zeros, shape (nx, ny)."""
        xp = namespace(nothing)
        shape = (self.field_count, *nothing.shape)
        return History(xp.zeros(shape, nothing.dtype), xp.zeros((self.times.size, *shape), nothing.dtype))

    def predict(self, history: History, step: float, rule: Rule | None = None) -> Prediction:
        """Return the elastic problem of a step. [s]"""
        if rule is None:
            follows = history.earlier is not None and step <= LARGEST_GROWTH * history.step
            longest = step if history.earlier is None else max(step, history.step)
            rings = self.may_ring and self.grows(longest, STIFF)
            rule = ("bdf2" if follows else "constant") if rings else "linear"
        own, earlier, before, new = self.recursion(step, history.step, rule)
        xp = namespace(history.modes)
        modes = xp.empty_like(history.modes)
        carried = xp.zeros_like(history.fields[0])
        for i, mode in enumerate(modes):
            xp.multiply(history.modes[i], own[i], out=mode)
            if earlier[i] and history.earlier is not None:
                mode += earlier[i] * history.earlier[i]
            if before[i]:
                mode += before[i] * history.fields
            carried += self.weights[i] * mode[0]
        alpha = self.glassy + float((self.compliances * new).sum())
        return Prediction(alpha, carried, modes, new, step)

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
        fields = unit[None] if self.field_count == 1 else namespace(unit).stack([unit, pressure])
        for mode, weight in zip(prediction.modes, prediction.new, strict=True):
            mode += weight * fields
        # the next step can use BDF2 only if it is stiff and not much longer than this one
        needed = self.may_ring and self.grows(LARGEST_GROWTH * prediction.step, STIFF)
        return History(fields, prediction.modes, history.modes if needed else None, prediction.step)

    def displacement(self, history: History, left: Any = 1.0) -> Array:
        """Return the displacement and, if the memory keeps it, the pressure that causes it.

        Parameters
        ----------
        history : History
            Memory at an instant.
        left : float or ndarray, shape (m,)
            Part of each mode that is left; zero gives the instantaneous displacement.

        Returns
        -------
        array, shape (k, nx, ny)
            Displacement [m], and pressure times a compliance [-].
        """
        total = self.weights[-1] * history.fields
        parts = np.broadcast_to(left, self.times.shape)
        for weight, remaining, mode in zip(self.weights[:-1], parts, history.modes, strict=True):
            if remaining:
                total += weight * (mode if remaining == 1 else remaining * mode)
        return total

    def after_rest(self, history: History, time: float) -> Array:
        """Return the displacement after a time without pressure; the present pressure must be zero. [m]"""
        return self.displacement(history, self.recursion(time, 0.0, "linear")[0])[0]

    def roll(self, history: History, cells: int, axis: int) -> History:
        """Return the memory of a periodic body, in the frame of a profile that has moved along an axis."""
        fields = self.rolled(history.fields, cells, axis)
        modes = self.rolled(history.modes, cells, axis)
        earlier = None if history.earlier is None else self.rolled(history.earlier, cells, axis)
        return History(fields, modes, earlier, history.step)

    def rolled(self, fields: Array, cells: int, axis: int) -> Array:
        """Return fields in the frame of a profile that has moved along an axis."""
        return namespace(fields).roll(fields, -cells, axis - 2)

    def remaining(self, time: float) -> float:
        """Return the part of an error of the history that relaxation leaves after a time. [s]

        The displacement is held: it is fixed in the contact, under a given load up to the approach.
        """
        left = float((self.parts * np.exp(-self.rates * time)).sum() / self.parts.sum())
        return min(max(left, 0.0), 1.0)

    def grown_after(self, factor: float, longest: float) -> float:
        """Return the time after which the compliance has grown by a factor, at most the longest time. [s]"""
        if not self.grows(longest, factor):
            return longest
        rate = float((self.compliances / np.where(np.isinf(self.times), 1.0, self.times)).sum())
        low = (factor - 1) * self.glassy / rate  # the compliance is concave
        high = longest
        while high > 1.05 * low:
            middle = math.sqrt(low * high)
            low, high = (low, middle) if self.grows(middle, factor) else (middle, high)
        return low

    def crept(self, time: ArrayLike) -> tuple[Any, Any]:
        """Return the integral of the contact compliance from zero to some times, and its integral. [s/Pa, s2/Pa]"""
        t = np.asarray(time, dtype=float)
        flows = np.isinf(self.times)
        first, second = integrals_of_retarded(t[..., None], np.where(flows, 1.0, self.times))
        first = np.where(flows, t[..., None] ** 2 / 2, first)
        second = np.where(flows, t[..., None] ** 3 / 6, second)
        return self.glassy * t + first @ self.compliances, self.glassy * t**2 / 2 + second @ self.compliances

    def relaxation(self, time: float) -> float:
        """Return the relaxation function over its first value, see :meth:`relaxed`."""
        return 1.0 - float((self.relaxing * -np.expm1(-self.rates * time)).sum())

    def relaxed(self, time: ArrayLike) -> tuple[Any, Any]:
        """Return the integral of the relaxation function over its first value, and its integral. [s, s2]

        A body without instantaneous compliance, or with layers that creep differently, has no such function here.
        """
        t = np.asarray(time, dtype=float)
        relaxes = self.relaxing > 0
        first, second = integrals_of_retarded(t[..., None], 1 / np.where(relaxes, self.rates, 1.0))
        return t - first @ self.relaxing, t**2 / 2 - second @ self.relaxing

    def error_of_young(self, age: float) -> float:
        """Return the relative error of a displacement due to the ages at which the series is not known.

        Parameters
        ----------
        age : float
            Age of a pressure that has increased steadily since; positive. [s]
        """
        if self.early == 0:
            return 0.0
        return 1.0 if age < self.shortest else self.early * float(self.crept(self.shortest)[0] / self.crept(age)[0])

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
        ratio = step / self.times
        flows = np.isinf(self.times)
        none = np.zeros(self.times.size)
        if rule == "linear":
            before, after = parts_of_step(ratio)
            return np.exp(-ratio), none, np.where(flows, step / 2, before), np.where(flows, step / 2, after)
        if rule == "constant":
            return np.exp(-ratio), none, none, np.where(flows, step, -np.expm1(-ratio))
        growth = step / last
        beta = (1 + growth) / (1 + 2 * growth)
        divisor = 1 + beta * ratio
        own = (1 + growth) ** 2 / (1 + 2 * growth) / divisor
        earlier = -(growth**2) / (1 + 2 * growth) / divisor
        return own, earlier, none, beta * np.where(flows, step, ratio) / divisor


class LayerMemory(Memory):
    """Exponential series of the waves of a layered body. Fields and modes of a history are transforms of pressures.

    If space and time do not separate, the creep depends on the wave, with the same times of the exponentials for all
    waves:

        C(q, t) = C_0(q) + fluidity(q) t + sum_m C_m(q) (1 - exp(-t/tau_m)).

    The recursion of :class:`Memory` applies to the transform of the pressure. Symbols replace the compliances: ``C_0``
    and each ``C_m`` are separate kernels. The compliance ``alpha`` of the elastic problem of a step becomes a symbol
    too, so that the kernel of a step depends on its length: ``displacement_q = alpha_q p_q + history_q``.

    The wave of the grid that creeps most represents the body in the choice of rules and lengths of steps.

    Parameters
    ----------
    waves : LayerSeries
        Series of the body.
    duration : float
        Length of the program: no step is longer. [s]
    grid : Grid or None
        Cells and boundary; its kernel is not used. None if only the number of exponentials is of interest.
    """

    def __init__(self, waves: LayerSeries, duration: float, grid: Grid | None) -> None:
        limits = (waves.q[0], waves.q[-1]) if grid is None else wave_limits(grid.period, grid.spacing)
        super().__init__(waves.fastest_wave(*limits), duration)
        self.rates = np.zeros(1)  # a common rate does not exist
        self.parts = np.ones(1)
        self.relaxing = np.zeros(1)
        self.waves = waves
        self.grid = cast(Grid, grid)
        if grid is not None:
            #: Symbol of each exponential [m/Pa], of the fluidity [m/(Pa s)], and of the instantaneous response. [m/Pa]
            alone = np.eye(len(waves.compliances))
            self.weights = [
                grid.xp.asarray(grid.symbol_of(waves.kernel(compliances), is_whole=False)) for compliances in alone
            ]

    def start(self, nothing: Array) -> History:
        """Return the memory of a body at rest, from an array of zeros, shape (nx, ny)."""
        return super().start(self.grid.spectrum(nothing))

    def predict(self, history: History, step: float, rule: Rule | None = None) -> Prediction:
        """Return the elastic problem of a step [s], with its kernel; its compliance is one, or zero if it is rigid."""
        prediction = super().predict(history, step, rule)
        (*symbols, at_once) = self.weights
        symbol = sum((factor * mode for factor, mode in zip(prediction.new, symbols, strict=True) if factor), at_once)
        cells = self.grid
        kernel = self.waves.kernel(np.append(prediction.new, 1.0))
        grid = Grid(cells.shape, cells.spacing, cells.boundary, kernel=kernel, symbol=symbol, xp=cells.xp)
        return replace(
            prediction, compliance=float(symbol.any()), carried=cells.field_of(prediction.carried), grid=grid
        )

    def advance(self, history: History, prediction: Prediction, unit: Array, pressure: Array) -> History:
        """Return the memory after a step, from the pressure at its end."""
        return super().advance(history, prediction, self.grid.spectrum(pressure), pressure)

    def displacement(self, history: History, left: Any = 1.0) -> Array:
        """Return the displacement, shape (1, nx, ny). [m]"""
        return self.grid.field_of(super().displacement(history, left)[0])[None]

    def rolled(self, fields: Array, cells: int, axis: int) -> Array:
        """Return transforms in the frame of a profile that has moved along an axis."""
        return fields * self.grid.turn(cells, axis)


def choose_memory(
    body: Body, duration: float, tolerance: float, shortest: float, grid: Any = None, keeps_pressure: bool = False
) -> Memory:
    """Return the memory of a body for a program.

    Parameters
    ----------
    body : Body
        A body.
    duration : float
        Length of the program. [s]
    tolerance : float
        Relative error that the whole computation may have.
    shortest : float
        Shortest time at which the compliance matters, apart from zero. [s]
    grid : Grid, optional
        Cells; needed for a layered body only.
    keeps_pressure : bool
        Whether the memory also keeps the pressure that causes the displacement.

    Returns
    -------
    Memory
        A series within a tenth of the tolerance if the material is passive.

    Raises
    ------
    InputError
        If the material is not known over the whole program.
    """
    share = SERIES_SHARE * tolerance
    if isinstance(body, LayeredBody) and not body.separates:
        memory: Memory = _of_layers(body, duration, share, shortest, grid)
    else:
        fitted, error = _series(body.material, shortest, duration, share)
        memory = Memory(fitted, duration, keeps_pressure)
        memory.series_error = error
        memory.misfit = body.material.misfit * (duration > 0)
        if error > 0 and duration > 0:
            memory.shortest = shortest
            known = getattr(body.material, "replaces", None)
            exact = body.material.creep_compliance
            memory.early = known.early if known else early_error(exact, fitted.creep_compliance, shortest)
        within = f" in place of the compliance, within {error:.1e} of it at time zero and from {shortest:.1g} s"
        memory.note = "; ".join(filter(None, (memory.note + within * bool(error), body.material.note)))
    if memory.series_error > tolerance:
        memory.note += "; no positive series comes nearer: the material is not passive"
    return memory


def integrals_of_retarded(time: Array, tau: Array) -> tuple[Array, Array]:
    """Return the integral of ``1 - exp(-t/tau)`` from zero to a time [s], and the integral of this integral. [s2]"""
    ratio = time / tau
    first = tau * (ratio + np.expm1(-ratio))
    small = ratio**3 * (1 / 6 - ratio / 24)
    return first, tau**2 * np.where(ratio < 1e-3, small, ratio**2 / 2 - ratio - np.expm1(-ratio))


def early_error(exact: Callable[[Any], Any], series: Callable[[Any], Any], shortest: float) -> float:
    """Return the error of a series below the shortest age at which it is known. [s]

    It is the integral of the deviation of the series from the compliance up to this age, over the integral of the
    series. Both functions return compliances of ages, the last axis; the result is the largest of all.
    """
    ages = shortest * np.geomspace(1e-8, 1.0, 400)
    compliance = series(ages)
    deviation = np.trapezoid(abs(compliance - exact(ages)) * ages, np.log(ages))
    return float(np.max(deviation / np.trapezoid(compliance * ages, np.log(ages))))


def _of_layers(body: LayeredBody, duration: float, share: float, shortest: float, grid: Any) -> Memory:
    """Return the memory of a layered body: exponentials that all waves share."""
    given = body.materials
    fitted, errors = zip(
        *(_series(material, shortest, duration, MATERIALS_SHARE * share) for material in given), strict=True
    )
    # the series of the waves need not be much more accurate than the series of the materials
    waves = layer_series(body.of(fitted), shortest, duration, max(share - max(errors), SERIES_SHARE * max(errors)))
    memory = LayerMemory(waves, duration, grid)
    memory.series_error = waves.error + max(errors)
    memory.misfit = max(material.misfit for material in given)
    if duration > 0:
        memory.shortest = shortest
        pairs = zip(given, fitted, errors, strict=True)
        of_materials = (early_error(a.creep_compliance, b.creep_compliance, shortest) for a, b, error in pairs if error)
        few = waves.q[:: max(waves.q.size // 20, 1)]
        bodies = body.of(fitted)
        course = interpolated(few, waves.q, waves.compliances)
        of_waves = early_error(lambda t: bodies.creep(few, t), lambda t: (crept(waves.times, t) @ course).T, shortest)
        memory.early = max(of_materials, default=0.0) + of_waves
    note = "the instantaneous compliance of each wave"
    if waves.times:
        within = f"within {memory.series_error:.1e} of these from {shortest:.1g} s on"
        note = f"{memory.note} that all waves share, each with compliances of its own, {within}"
    memory.note = "; ".join(filter(None, (note, *(material.note for material in given))))
    return memory


def _series(material: Material, shortest: float, duration: float, tolerance: float) -> tuple[Prony, float]:
    """Return the series of a material and its error; a program of jumps needs the instantaneous compliance only."""
    if isinstance(material, Prony) and material.longest == math.inf:
        return material, 0.0
    if isinstance(material, Prony) and material.replaces is not None:
        known_times(duration, material.longest)
        return replace(material, longest=math.inf, replaces=None), material.replaces.error
    if duration > 0:
        return series(material, shortest, duration, tolerance)
    glassy = float(material.creep_compliance(0.0))
    return Prony(glassy, 0.0 if glassy else 1.0, poisson=material.poisson), 0.0
