"""Contact that grows to one maximum and then recedes (Ting, Graham), for materials in exponentials."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from references.growing_contact import ContactRelaxation, with_decays
from references.indenters import Indenter, places
from references.quadrature import bisect, integrate
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.program import Program

Array = NDArray[np.float64]
Function = Callable[[Array], Array]

_DEGREE = 15


@dataclass(frozen=True)
class _Pieces:
    """Piecewise polynomial on panels that grow away from each corner and are nowhere long."""

    edges: Array
    coefficients: Array  # (degree + 1, panels)

    @classmethod
    def of(cls, function: Function, corners: Sequence[float]) -> _Pieces:
        half = np.append(0.25 ** np.arange(12, 1, -1), np.arange(1, 5) / 8)
        unit = np.concatenate([[0.0], half, 1 - half[-2::-1]])
        edges = np.concatenate([low + (high - low) * unit for low, high in pairwise(corners)])
        edges = np.append(edges, corners[-1])
        nodes = np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))
        low, high = edges[:-1], edges[1:]
        values = function((low + (high - low) * (nodes[:, None] + 1) / 2).ravel()).reshape(len(nodes), -1)
        return cls(edges, np.asarray(chebyshev.chebfit(nodes, values, _DEGREE), dtype=np.float64))

    def __call__(self, t: ArrayLike, *, left: bool = False, derivative: bool = False) -> Array:
        """Value, the limit from the right or the left at a corner; or derivative."""
        t = np.asarray(t, dtype=float)
        panel = np.searchsorted(self.edges, t, side="left" if left else "right") - 1
        panel = np.clip(panel, 0, len(self.edges) - 2)
        low, width = self.edges[panel], np.diff(self.edges)[panel]
        local = 2 * (t - low) / width - 1
        coefficients = self.coefficients
        if derivative:
            coefficients = np.asarray(chebyshev.chebder(coefficients), dtype=np.float64)
            local_slope = chebyshev.chebval(local, coefficients[:, panel], tensor=False)
            return np.asarray(local_slope * 2 / width)
        return np.asarray(chebyshev.chebval(local, coefficients[:, panel], tensor=False))


def _between(
    corners: Sequence[float], function: Callable[..., Array], lower: Array, upper: Array, *more: Array
) -> Array:
    """Integral from ``lower`` to ``upper``, split at the corners; ``function(s, *more)``."""
    total = np.zeros(np.broadcast(lower, upper).shape)
    for low, high in pairwise(corners):
        start, stop = np.clip(lower, low, high), np.clip(upper, low, high)
        if np.any(stop > start):
            total = total + integrate(lambda near, far, s, *rest: function(s + near, *rest), start, stop, start, *more)
    return total


def _fading(function: Function, corners: Sequence[float], t: Array, rates: Callable[[Array], Array]) -> Array:
    """``int_0^t rates(t - s) (f(t) - f(s)) ds``: what hereditary integrals have beside ``f(t)`` times a kernel."""
    return _between(corners, lambda s, now, f: rates(now - s) * (f - function(s)), np.zeros(t.shape), t, t, function(t))


def _load_of(force: Program | Function, end: float | None) -> tuple[Function, list[float]]:
    """The load as a function, and the instants at which it or its rate jumps, with the last one."""
    if not isinstance(force, Program):
        if end is None or not end > 0:
            raise InputError("a load given as a function needs `end`, the positive time up to which it holds [s]")
        return lambda t: np.asarray(force(t), dtype=float), [0.0, float(end)]
    starts, values, slopes = [], [], []
    value = 0.0
    for segment, start in zip(force.segments, force.corners, strict=False):
        if segment.control != "load" or segment.amplitude or segment.slide:
            raise InputError("a single maximum is implemented for ramps, holds and jumps of load, or a function")
        final = value if segment.end is None else segment.end
        if segment.duration > 0:
            starts.append(start)
            values.append(value)
            slopes.append((final - value) / segment.duration)
        value = final
    if not starts:
        raise InputError("the program has no duration")
    begin, at, rate = np.array(starts), np.array(values), np.array(slopes)

    def load(t: Array) -> Array:
        piece = np.clip(np.searchsorted(begin, t, side="right") - 1, 0, len(begin) - 1)
        return at[piece] + rate[piece] * (t - begin[piece])

    return load, [*starts, force.duration]


@dataclass(frozen=True)
class SingleMaximum:
    """Contact that grows to one maximum and then shrinks; made by :func:`ting`.

    Parameters
    ----------
    indenter : Indenter
        The rigid indenter.
    material : Prony
        The half-space.
    relaxation : ContactRelaxation
        Its relaxing contact modulus.
    load : callable
        Load at times. [N]
    corners : tuple of float
        Where the load or its rate jumps, the maximum of the contact, and the end. [s]
    time_of_maximum : float
        When the contact is largest; not before the load is. [s]
    """

    indenter: Indenter
    material: Prony
    relaxation: ContactRelaxation
    load: Function
    corners: tuple[float, ...]
    time_of_maximum: float
    _growth: _Pieces  # scaled force int C dW up to the maximum
    _fading_growth: tuple[_Pieces, ...]
    _fading_depth: tuple[_Pieces, ...]
    _centre: list[_Pieces]

    def _grown(self, t: ArrayLike, left: bool) -> Array:
        return np.maximum(self._growth(t, left=left), 0.0)

    def _held(self, t1: Array, t: Array, left: bool) -> Array:
        """``int_0^t1 E(t - s) d(int C dW)(s)``: what the contact of the instant ``t1`` carries at ``t``."""
        total = self.relaxation.equilibrium * self._growth(t1, left=left)
        modes = zip(self.relaxation.moduli, self.relaxation.times, self._fading_growth, strict=True)
        for modulus, time, memory in modes:
            total = total + modulus * np.exp(-(t - t1) / time) * memory(t1, left=left)
        return np.asarray(total)

    def _twin(self, t: Array) -> tuple[Array, Array]:
        """Instant of loading with the same contact radius, and the scaled force it stands for."""
        growing = t < self.time_of_maximum
        late = np.maximum(t, self.time_of_maximum)
        load = np.maximum(self.load(late), 0.0)
        t1 = bisect(
            lambda s: self._held(s, late, True) - load, np.zeros(t.shape), np.full(t.shape, self.time_of_maximum), 90
        )
        # a jump of the loading covers a range of radii: the rest of the load decides where in it
        for corner in self.corners:
            if corner < self.time_of_maximum:
                t1 = np.where(np.abs(t1 - corner) <= 1e-14 * self.corners[-1], corner, t1)
        from_rest = t1 == 0
        before = np.where(from_rest, 0.0, self._held(t1, late, True))
        grown = np.where(from_rest, 0.0, self._grown(t1, True)) + (load - before) / self.relaxation(late - t1)
        return np.where(growing, t, t1), np.where(growing, self._grown(t, False), np.maximum(grown, 0.0))

    def radius(self, t: ArrayLike) -> Array:
        """Contact radius. [m]"""
        t = np.asarray(t, dtype=float)
        return self.indenter.radius_at_scaled_force(self._twin(t)[1])

    def _central_force(self, t: Array) -> Array:
        """Force ``F(0, t)`` of the central element: ``int E d(approach)`` up to the twin instant."""
        t1, grown = self._twin(t)
        depth = self.indenter.reduced(self.indenter.radius_at_scaled_force(grown))
        from_rest = t1 == 0
        growing = t < self.time_of_maximum
        twin_depth = self.indenter.reduced(self.indenter.radius_at_scaled_force(self._grown(t1, True)))
        total = self.relaxation.equilibrium * np.where(growing, depth, twin_depth)
        modes = zip(self.relaxation.moduli, self.relaxation.times, self._fading_depth, strict=True)
        for modulus, time, memory in modes:
            faded = np.where(growing, memory(t1), memory(t1, left=True))
            total = total + modulus * np.exp(-(t - t1) / time) * faded
        twin = np.where(from_rest, 0.0, twin_depth)
        jumped = np.where(growing, 0.0, self.relaxation(t - t1) * (depth - twin))
        return np.where(from_rest & ~growing, 0.0, total) + jumped

    def approach(self, t: ArrayLike) -> Array:
        """Approach; once the load is zero, where the indenter would touch. [m]"""
        t = np.asarray(t, dtype=float)
        growing = self.indenter.reduced(self.radius(t))
        if not np.any(t >= self.time_of_maximum):
            return growing
        if not self._centre:
            self._centre.append(_Pieces.of(self._central_force, self.corners))
        centre = self._centre[0]
        now = self._central_force(t)
        late = np.maximum(t, self.time_of_maximum)

        def creep(s: Array, now: Array, final: Array) -> Array:
            return _creep_rate(self.material, now - s) * (final - centre(s))

        memory = _between(self.corners, creep, np.zeros(t.shape), late, late, now)
        return np.where(t < self.time_of_maximum, growing, self.material.contact_compliance(late) * now - memory)

    def pressure(self, r: ArrayLike, t: ArrayLike) -> Array:
        """Pressure at ``r`` [m] and ``t`` [s], which are broadcast; infinite under the apex of a cone. [Pa]"""
        r, t = places(r, t)
        t1, grown = self._twin(t)
        radius = self.indenter.radius_at_scaled_force(grown)
        at = self.indenter.scaled_force(r)
        entry = bisect(lambda s: self._grown(s, True) - at, np.zeros(r.shape), t1, 90)
        entry = np.where(at <= self._grown(0.0, False), 0.0, entry)
        final = self.indenter.scaled_pressure(r, radius)

        def growth(s: Array, r: Array, now: Array, final: Array) -> Array:
            then = self.indenter.scaled_pressure(r, self.indenter.radius_at_scaled_force(self._grown(s, True)))
            with np.errstate(invalid="ignore"):
                return self.relaxation.rate(now - s) * (final - np.minimum(then, final))

        memory = np.where(np.isinf(final), 0.0, _between(self.corners, growth, entry, t1, r, t, final))
        return np.where(r < radius, self.relaxation(t - entry) * final + memory, 0.0)


def _creep_rate(material: Prony, t: Array) -> Array:
    """``dC/dt`` of the contact compliance. [1/(Pa s)]"""
    times = np.array(material.times)
    rate = with_decays(material.fluidity, np.array(material.compliances) / times, times, t)
    return np.asarray(0.5 * (1 - material.poisson) * rate)


def ting(indenter: Indenter, material: Prony, force: Program | Function, end: float | None = None) -> SingleMaximum:
    r"""Contact under a load that makes it grow to one maximum and then shrink (Ting, Graham).

    Parameters
    ----------
    indenter : Indenter
        A sphere (:class:`Paraboloid`) or a :class:`Cone`.
    material : Prony
        Exponential series with an instantaneous compliance.
    force : Program or callable
        Ramps, holds and jumps of load; or a smooth function of an array of times, which starts at zero or at a
        jump. [N]
    end : float, optional
        Where a function of time ends. [s]

    Returns
    -------
    SingleMaximum
        ``radius(t)``, ``approach(t)``, ``pressure(r, t)``, ``time_of_maximum``.

    Raises
    ------
    InputError
        If the material cannot jump, the program prescribes something else than load, or the contact grows again.

    Notes
    -----
    With ``L = int C dW`` an elastic contact of unit modulus under the force ``L`` has the radius sought as long as
    ``L`` grows. After its maximum at ``t_m`` the radius is that of the earlier instant ``t_1`` for which

    .. math:: \int_{0^-}^{t_1} E(t - s) \, dL(s) = W(t)

    and everything entered later has left no trace in the pressure, but has in the approach:

    .. math:: p = \frac{1}{\pi} \int_r^{a(t)} E(t - t_x) \frac{g'(x)}{\sqrt{x^2 - r^2}} dx, \qquad
              \delta = \int C(t - s) \, dF_0(s), \qquad F_0 = \int_{0^-}^{t_1} E(t - s) \, dg(a(s))

    with ``t_x`` the instant at which the edge passed ``x``.

    References
    ----------
    .. [1] T. C. T. Ting, "The contact stresses between a rigid indenter and a viscoelastic half-space",
       *J. Appl. Mech.* 33 (1966) 845-854.
    .. [2] G. A. C. Graham, "The contact problem in the linear theory of viscoelasticity", *Int. J. Eng. Sci.* 3
       (1965) 27-46.
    """
    relaxation = ContactRelaxation.of(material)
    load, corners = _load_of(force, end)

    def growth(t: Array) -> Array:
        return material.contact_compliance(t) * load(t) - _fading(load, corners, t, lambda v: _creep_rate(material, v))

    whole = _Pieces.of(growth, corners)
    panels = [np.linspace(low, high, 9) for low, high in pairwise(whole.edges)]
    samples = np.unique(np.concatenate(panels))
    values = whole(samples, left=True)
    top = int(np.argmax(values))
    low, high = samples[max(top - 1, 0)], samples[min(top + 1, len(samples) - 1)]
    if samples[top] in corners and (top == len(samples) - 1 or whole(samples[top]) < values[top] * (1 - 1e-12)):
        maximum = float(samples[top])  # the end, or a jump down
    else:
        maximum = float(bisect(lambda t: -whole(t, derivative=True), low, high))
    if np.any(np.diff(values[: top + 1]) < -1e-12 * values[top]):
        raise InputError("the contact shrinks and grows again: expected a single maximum")
    snapped = [c for c in corners if abs(c - maximum) <= 1e-7 * corners[-1]]  # the growth is stationary there
    maximum = snapped[0] if snapped else maximum
    rising = [*(c for c in corners if c < maximum), maximum]
    loading = _Pieces.of(lambda t: np.maximum(growth(t), 0.0), rising)

    def depth(t: Array) -> Array:
        return indenter.reduced(indenter.radius_at_scaled_force(np.maximum(loading(t), 0.0)))

    def fading(function: Function, time: float) -> _Pieces:
        def memory(t: Array) -> Array:
            return function(t) * np.exp(-t / time) + _fading(function, rising, t, lambda v: np.exp(-v / time) / time)

        return _Pieces.of(memory, rising)

    times = [float(time) for time in relaxation.times]
    contact = SingleMaximum(
        indenter=indenter,
        material=material,
        relaxation=relaxation,
        load=load,
        corners=tuple(sorted({*corners, maximum})),
        time_of_maximum=maximum,
        _growth=loading,
        _fading_growth=tuple(fading(loading, time) for time in times),
        _fading_depth=tuple(fading(depth, time) for time in times),
        _centre=[],
    )
    later = [np.linspace(low, high, 60) for low, high in pairwise(contact.corners) if high > maximum]
    if later:
        shrinking = contact.radius(np.concatenate(later))
        if np.any(np.diff(shrinking) > 1e-9 * shrinking[0]):
            raise InputError("the contact shrinks and grows again: expected a single maximum")
    return contact
