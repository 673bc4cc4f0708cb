"""Axisymmetric viscoelastic contact under any history by the method of dimensionality reduction (MDR).

With the Abel transforms

    F(x, t) = 2 int_x^inf r p(r, t) / sqrt(r^2 - x^2) dr,     w(x, t) = d/dx int_0^x r u(r, t) / sqrt(x^2 - r^2) dr

of pressure and displacement, contact with a half-space of contact compliance ``C(t)`` becomes, for every ``x`` alone,

    w = int C(t - s) dF(s),   w = approach - g(x) where the element touches,   F = 0 where it does not,

and the force is ``2 int F dx`` over the contact. This holds for loading, unloading, opening and closing, as
long as the contact is a disc; the run stops where it is not. On a sheet the elements are not independent. Nothing here
is shared with the solver on a grid.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from references.element_memory import AllForces, Exponentials
from references.indenters import Indenter
from references.sheet import OnSheet
from roughvisc.errors import ConvergenceError, InputError
from roughvisc.mechanics.materials.creep import Material
from roughvisc.mechanics.materials.prony import Prony, one_less_mean_decay
from roughvisc.mechanics.program import Program, Segment

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactHistory:
    """Contact at given times.

    Parameters
    ----------
    times, radius, approach, force : ndarray
        [s], [m], [m], [N]. The state after a jump, where the material can jump.
    work : ndarray
        Work of the force since the start, ``int W d(approach)``; jumps are the limit of fast ramps. [J]
    error : float
        Largest change made by the last extrapolation in time, of any of the four over its own maximum. [-]
    """

    times: Array
    radius: Array
    approach: Array
    force: Array
    work: Array
    error: float


class _OutOfElements(Exception):
    """The contact reached the last element."""


class _ElementRow:
    """The elements: where they are, and the equilibrium of a step.

    The edge of the contact becomes an element after every step: forces have kinks there and nowhere else.
    """

    def __init__(self, indenter: Indenter, outermost: float, count: int, capacity: int):
        self.x = np.zeros(capacity)
        self.x[:count] = outermost * (np.arange(count) / (count - 1)) ** 2
        self.g = np.zeros(capacity)
        self.g[:count] = indenter.reduced(self.x[:count])
        self.indenter = indenter
        self.count = count
        self.order = np.arange(count)

    def area(self, x: Array, y: Array, level: float) -> tuple[float, float]:
        """``int (level - y)_+ dx`` of the interpolant, and the length over which it is positive."""
        d = level - y
        d0, d1, width = d[:-1], d[1:], np.diff(x)
        low, high = np.minimum(d0, d1), np.maximum(d0, d1)
        crossing = (low < 0) & (high > 0)
        share = np.where(crossing, high / np.where(crossing, high - low, 1.0), high > 0)
        total = np.where(crossing, high * share, np.where(high > 0, d0 + d1, 0.0)) @ width / 2
        return float(total), float(share @ width)

    def level_for(self, x: Array, y: Array, area: float, guess: float) -> float:
        """Level under which the interpolant encloses an area: Newton's method on a convex function."""
        bottom, top = float(np.min(y)), float(np.max(y))
        if self.area(x, y, top)[0] < area:
            raise _OutOfElements
        level = guess if bottom < guess < top else top
        for _ in range(200):
            found, slope = self.area(x, y, level)
            step = (area - found) / slope if slope > 0 else np.inf
            before, level = level, min(level + step, top)  # a hardly touching start would throw it far away
            if abs(level - before) <= 4e-16 * (abs(level) + abs(bottom)):
                break
        return max(level, bottom)


def _edge(x: Array, y: Array, level: float, strict: bool) -> tuple[int, float]:
    """Index of the last touching element and the radius; (-1, 0) where nothing touches."""
    touching = level > y
    if not touching.any():
        return -1, 0.0
    last = int(len(y) - 1 - np.argmax(touching[::-1]))
    if last == len(y) - 1:
        raise _OutOfElements
    depth = level - y[: last + 1]
    if strict and np.any(depth < -0.01 * np.max(depth)):
        raise ConvergenceError("the contact is no longer a disc: the reduction to independent elements does not hold")
    return last, float(x[last] + (x[last + 1] - x[last]) * depth[-1] / (y[last + 1] - y[last]))


class _Run:
    """One pass through a program at one resolution."""

    def __init__(self, indenter: Indenter, memory: Exponentials | AllForces, row: _ElementRow, *, strict: bool):
        self.indenter, self.memory, self.row, self.strict = indenter, memory, row, strict
        self.radius = self.approach = self.force = self.work = 0.0
        self.largest_radius = 0.0
        self.pending_load: float | None = None  # set by a jump that the material could not follow

    @property
    def state(self) -> Array:
        return np.array([self.radius, self.approach, self.force, self.work])

    def value(self, control: str) -> float:
        """Where a segment under this control starts."""
        if control == "approach":
            return self.approach
        return self.force if self.pending_load is None else self.pending_load

    def advance(self, h: float, control: str, value: float) -> None:
        """One step, to a prescribed value."""
        row = self.row
        free, compliance = self.memory.predict(h, row.count)
        x, y = row.x[row.order], (row.g[: row.count] + free)[row.order]
        if control == "approach":
            level = value
        elif value <= 0:
            level = float(np.min(y))
        else:
            level = row.level_for(x, y, value * compliance / 2, self.approach)
        last, radius = _edge(x, y, level, self.strict)
        depth = np.maximum(level - (row.g[: row.count] + free), 0.0)
        if last >= 0:
            weight = (radius - x[last]) / (x[last + 1] - x[last])
            if 1e-3 < weight < 1 - 1e-3:
                left, right, new = int(row.order[last]), int(row.order[last + 1]), row.count
                self.memory.insert(left, right, weight, new)
                row.x[new], row.g[new] = radius, self.indenter.reduced(radius)
                at_edge = (1 - weight) * free[left] + weight * free[right] + row.g[new]
                depth = np.append(depth, max(level - at_edge, 0.0))
                row.order = np.insert(row.order, last + 1, new)
                row.count += 1
        self.memory.accept(depth / compliance)
        force = value if control == "load" else 2 / compliance * row.area(x, y, level)[0]
        self.work += (self.value("load") + force) / 2 * (level - self.approach)
        self.pending_load = None
        self.radius, self.approach, self.force = radius, level, force
        self.largest_radius = max(self.largest_radius, radius)

    def jump(self, control: str, value: float, increments: int) -> None:
        """A jump as the limit of a fast ramp; its work needs the path."""
        start = self.value(control)
        for i in range(1, increments + 1):
            u = i / increments  # slow at both ends, where force may grow as a power of approach
            self.advance(0.0, control, start + (value - start) * u**3 * (10 - 15 * u + 6 * u**2))


def _instants_of(segment: Segment, start: float, stops: Array, steps: int, refine: int, fastest: float) -> Array:
    """Instants after the start of a segment: fine after the corner, landing on the stops, nested when refined."""
    length = segment.duration
    if length == 0:
        return np.zeros(16 * refine)
    if segment.amplitude:  # uniform but for the first quarter of a period
        steps = int(np.ceil(steps * max(1.0, length / segment.period)))
        bend = min(segment.period / (2 * length), 0.5)

        def instant(u: Array) -> Array:
            return np.where(u < bend, u**2 / (2 * bend), u - bend / 2) / (1 - bend / 2)

    else:  # quadratic, then exponential, so that all decades down to the fastest mode are seen
        stretch = np.arcsinh(np.sqrt(min(max(1.0, length / fastest), 1e12)))
        closing = segment.control == "load" and segment.end == 0  # quadratic again where the contact vanishes

        def instant(u: Array) -> Array:
            if closing:
                u = u * (2 - u)
            return np.asarray((np.sinh(stretch * u) / np.sinh(stretch)) ** 2)

    fine = np.linspace(0, 1, 20001)
    inner = [stop - start for stop in stops if start < stop < start + length]
    marks = [0.0, *(np.interp(np.array(inner) / length, instant(fine), fine) if inner else []), 1.0]
    instants = []
    for (u0, u1), (t0, t1) in zip(pairwise(marks), pairwise([0.0, *inner, length]), strict=True):
        count = refine * max(1, int(np.ceil(steps * (u1 - u0) - 1e-9)))
        part = instant(u0 + (u1 - u0) * np.arange(count + 1) / count)
        instants.append(t0 + (t1 - t0) * (part[1:] - part[0]) / (part[-1] - part[0]))
        instants[-1][-1] = t1
    return np.concatenate(instants)


def _fastest_change(material: Material) -> float:
    """Shortest time on which a material changes; infinite if unknown. [s]"""
    if not isinstance(material, Prony):
        return np.inf
    times = list(material.times)
    if material.glassy:
        times += list(material.relaxation_spectrum()[2])
    return min(times, default=np.inf)


def _same_instant(times: Array, instant: float) -> NDArray[np.bool_]:
    """Which of the times an instant is: a time less the start of its segment, plus that, may be a rounding off."""
    return np.abs(times - instant) <= 4 * np.finfo(float).eps * times


def _outermost(indenter: Indenter, material: Material, program: Program) -> float:
    """A radius that the contact cannot pass: under the largest load or approach, kept all the time."""
    scaled = program.largest_load * float(material.contact_compliance(program.duration))
    approaches = [(s.end or 0.0) + abs(s.amplitude) for s in program.segments if s.control == "approach"]
    by_approach = float(indenter.radius_at_approach(max([0.0, *approaches])))
    return 1.05 * max(float(indenter.radius_at_scaled_force(scaled)), by_approach)


def _rings(material: Material, meshes: Sequence[Array]) -> bool:
    """Whether the rule of piecewise-linear force would ring: old force weighs more than half the new one."""
    if not isinstance(material, Prony):
        return False
    if material.glassy == 0:
        return True
    h = max(float(np.max(np.diff(mesh, prepend=0.0), initial=0.0)) for mesh in meshes)
    compliances, x = np.array(material.compliances), h / np.array(material.times)
    b = one_less_mean_decay(x)
    old = material.fluidity * h / 2 + compliances @ (-np.expm1(-x) - b)
    new = material.glassy + material.fluidity * h / 2 + compliances @ b
    return bool(old > 0.5 * new)


def _pass(
    indenter: Indenter,
    material: Material,
    program: Program,
    times: Array,
    *,
    resolution: tuple[int, int, int],
    outermost: float,
    stiff: bool,
    strict: bool = True,
) -> tuple[Array, float]:
    """Radius, approach, force and work at the times, and the largest radius, at one resolution."""
    steps, refine, elements = resolution
    corners, fastest = program.corners, _fastest_change(material)
    meshes = [
        _instants_of(segment, start, times, steps, refine, fastest)
        for segment, start in zip(program.segments, corners, strict=False)
    ]
    total = sum(len(mesh) for mesh in meshes)
    memory: Exponentials | AllForces
    if isinstance(material, Prony):
        memory = Exponentials(material, elements + total, stiff=stiff)
    else:
        memory = AllForces(material, elements + total, total)
    can_jump = float(material.contact_compliance(0.0)) > 0
    run = _Run(indenter, memory, _ElementRow(indenter, outermost, elements, elements + total), strict=strict)
    kept = np.zeros((4, len(times)))
    for segment, start, end, mesh in zip(program.segments, corners, corners[1:], meshes, strict=False):
        memory.restart()
        if segment.duration == 0:
            if can_jump:
                if segment.end is not None:
                    run.jump(segment.control, segment.end, len(mesh))
            elif segment.control == "approach":
                raise InputError("a jump of approach needs a material with instantaneous compliance")
            else:
                run.pending_load = segment.end
            at = _same_instant(times, end)
            kept[:, at] = run.state[:, None] if can_jump or end == 0 else kept[:, at]
            continue
        begin = run.value(segment.control)
        before = 0.0
        for instant in mesh:
            run.advance(float(instant) - before, segment.control, segment.value(float(instant), begin))
            before = float(instant)
            at = _same_instant(times, start + before if before < segment.duration else end)
            kept[:, at] = run.state[:, None]
    return kept, run.largest_radius


def _growing_row(run: Callable[..., tuple[Array, float]], outermost: float) -> tuple[tuple[Array, float], float]:
    """A pass, with the row of elements as long as it has to be."""
    for _ in range(40):
        try:
            return run(outermost=outermost), outermost
        except _OutOfElements:
            outermost *= 1.5
    raise ConvergenceError("the contact radius grows beyond all bounds")


def reduced_contact(
    indenter: Indenter,
    material: Material,
    program: Program,
    times: ArrayLike | None = None,
    *,
    steps: int = 100,
    refinements: int = 3,
    elements: int = 4000,
) -> ContactHistory:
    r"""Contact of a sphere or a cone with a viscoelastic half-space through any history.

    Parameters
    ----------
    indenter : Indenter
        A :class:`Paraboloid` or a :class:`Cone` on a half-space.
    material : Material
        Anything with ``contact_compliance(t)`` and ``contact_integral(t)``.
    program : Program
        Loads and approaches, with ramps, jumps, holds, cycles and changes of control.
    times : array_like of float, optional
        Ascending instants to keep, stepped onto exactly; the corners of the program if not given. [s]
    steps : int
        Steps for each segment of the program, and for each period of a cycle, at the coarsest resolution.
    refinements : int
        Resolutions in time, each twice as fine as the one before: two for extrapolation, three for an error as well.
    elements : int
        Elements between the axis and the largest contact radius, to which every edge of the contact is added.

    Returns
    -------
    ContactHistory
        ``times``, ``radius``, ``approach``, ``force``, ``work``, ``error``.

    Raises
    ------
    InputError
        If the indenter is on a sheet, the program jumps in approach and the material cannot, or a time lies outside of
        the program.
    ConvergenceError
        If the contact ceases to be a disc.

    Notes
    -----
    Elements touch and part one by one; the force of an element is linear in time between instants and its
    displacement exact for that, or, for exponential series that would ring, follows from second-order backward
    differences. Both converge with the square of the step, which the extrapolation uses. The integral over the
    elements is that of the linear interpolant.

    Against :func:`ting` and :func:`lee_radok` the defaults give, of the value itself, the approach to 3e-7 and the
    radius to 3e-6 under a sphere on Maxwell, Zener (also 1:100) and two-mode materials, and both to 3e-6 on a
    Kelvin-Voigt solid; ``steps=400`` brings the approach to 1e-7 and the
    radius to 3e-7 in general, and both to 3e-7 for Kelvin-Voigt.

    While the contact is open under zero load the approach is where it would touch. A jump of load on a
    material without instantaneous compliance leaves contact and force as they were; the steps after it see
    the new load.

    Examples
    --------
    >>> from references.indenters import Paraboloid
    >>> from roughvisc.mechanics.materials.models import elastic
    >>> press = Program().load(4 / 3, over=0.0).load(0.0, over=1.0)
    >>> found = reduced_contact(Paraboloid(1.0), elastic(0.25), press, [0.0, 1.0], steps=20)
    >>> found.radius.round(4), found.work.round(4)
    (array([1., 0.]), array([0.5333, 0.    ]))
    """
    if isinstance(indenter, OnSheet):
        raise InputError(
            f"indenter is on a sheet ({indenter.sheet!r}), and the reduction to independent elements holds on a "
            "half-space only: expected a Paraboloid or a Cone; lee_radok holds on a sheet, and simulate takes any "
            "program"
        )
    corners = program.corners
    instants = np.unique(corners) if times is None else np.asarray(times, dtype=float)
    if instants.ndim != 1 or np.any(np.diff(instants) <= 0) or not np.all((instants >= 0) & (instants <= corners[-1])):
        raise InputError(f"times must ascend within the program, which lasts {corners[-1]!r} s")
    if program.slides:
        raise InputError("the program slides, and the indenter is taken to stay where it is: expected no slide")
    if refinements < 1:
        raise InputError(f"refinements is {refinements!r}: expected at least 1")
    coarse = [
        _instants_of(segment, start, instants, steps, 1, _fastest_change(material))
        for segment, start in zip(program.segments, corners, strict=False)
    ]
    stiff = _rings(material, coarse)
    outermost = _outermost(indenter, material, program)
    run = partial(_pass, indenter, material, program, instants, stiff=stiff)
    # a coarse pass shows how far the contact really goes
    coarsest = max(20, steps // 4), 1, 400
    (_, largest), outermost = _growing_row(partial(run, resolution=coarsest, strict=False), outermost)
    outermost = 1.1 * largest if largest else outermost
    levels = []
    for level in range(refinements):
        resolution = steps, 2**level, elements
        (kept, _), outermost = _growing_row(partial(run, resolution=resolution), outermost)
        levels.append(kept)
    better = [fine + (fine - rough) / 3 for rough, fine in pairwise(levels)] or levels
    error = np.inf
    if len(better) > 1:
        scale = np.maximum(np.max(np.abs(better[-1]), axis=1), 1e-300)
        error = float(np.max(np.max(np.abs(better[-1] - better[-2]), axis=1) / scale))
    radius, approach, force, work = better[-1]
    return ContactHistory(instants, radius, approach, force, work, error)
