r"""Contact of one instant with adhesion: gap and pressure of an elastic body that a rigid surface attracts.

The gap ``g >= 0`` is a local minimum of the energy

    E(g) = u.A u / 2 - w sum exp(-g / rho) - load * approach,        u = g - given + approach,

where ``A`` maps displacement to pressure. An open cell carries the tension ``a(g) = w / rho exp(-g / rho)``. In a
contact cell the pressure ``Au`` is at least ``-a(0)``.

The method is constrained conjugate gradients in the gap: pressure and gap exchange their roles in
:mod:`roughvisc.mechanics.contact.solver`, and the kernel is the preconditioner. ``A`` is known for waves only. In free
space the unknowns are therefore the displacements at all points of the transforms. Points beyond the cells carry no
pressure, as absent cells do.

``E`` has several minima. The energy falls in every step, and no step changes a gap within reach of the attraction by
more than the range. The solution is thus the state into which the given one relaxes.

Lengths are divided by the range ``rho`` and pressures by the largest tension ``w / rho``.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from roughvisc.errors import ConvergenceError
from roughvisc.mechanics.contact.passes import inner
from roughvisc.mechanics.grid import Grid

Array = Any  # an array of NumPy or CuPy
#: Gap beyond which the tension counts as zero, in ranges.
REACH = 36.0
#: Largest change of a gap in one step, in ranges, in cells whose tension is at least this part of the largest one.
LEAP = 1.0
FELT = 0.01
#: Largest change of a gap from the given state to the first guess, in ranges.
GUESSED = 0.5
#: Change of the step length from one iteration to the next: smallest, largest, and largest after a cut step.
SHRINK = 0.3
GROW = 3.0
GROW_AFTER_CUT = 1.3
#: Longest step, in trials, and shortest one: a projected-gradient step replaces a shorter step.
LONGEST = 30.0
SHORTEST = 1e-3
#: Iterations in which the decrement must halve.
PATIENCE = 30
#: Safety factor of the estimated error.
CAUTION = 2.0
#: Part of a negative load below which the tension of open surfaces cannot carry it: they separate.
PULLED_OFF = 0.5
#: Relative rounding error of an energy.
ROUNDED = 1e-13


class PulledOff(Exception):
    """The contact does not carry a negative load."""


class Unstable(Exception):
    """The energy has no minimum along a step: the given state may have been unstable."""


class AdhesiveState(NamedTuple):
    """Solved contact problem with adhesion. Pressures are over the contact modulus.

    Attributes
    ----------
    pressure : array, shape (nx, ny)
        Pressure, negative under tension; zero at absent cells. [-]
    displacement : array, shape (nx, ny)
        Displacement of the body. [m]
    gap : array, shape (nx, ny)
        Gap between the surfaces, exactly zero in contact, infinite at absent cells. [m]
    approach : float
        Rigid-body approach. [m]
    load : float
        Sum of the pressure over the cells. [-]
    error : float
        Estimated relative error of the pressure, L1 norm.
    iterations : int
        Number of steps.
    is_unstable : bool
        Whether the energy had no minimum along a step: the given state may have been unstable.
    """

    pressure: Array
    displacement: Array
    gap: Array
    approach: float
    load: float
    error: float
    iterations: int
    is_unstable: bool


class Elastic:
    """Elastic response on all points of the transforms, in units of the range and of the largest tension.

    Parameters
    ----------
    grid : Grid
        Cells.
    work, reach : float
        Work of adhesion over the contact modulus, and its range. [m]
    load : float or None
        Sum of the pressure over the cells [-]; None if the approach is given.
    present : array of bool, shape (nx, ny), or None
        Cells with material; None: all.

    Attributes
    ----------
    cells : tuple of slice
        The cells among the points.
    is_cell : array of bool
        Points at which the surfaces interact.
    symbol, stiffness, kernel : array
        Factors of waves: displacement over pressure, its inverse, and the preconditioner.
    mean_response : float
        Displacement under a uniform pressure.
    uniform : float
        Mean pressure of all points, if the load is given; otherwise zero.
    keeps_mean : bool
        Whether the approach determines the mean gap.
    """

    def __init__(self, grid: Grid, work: float, reach: float, load: float | None, present: Array | None) -> None:
        xp = grid.xp
        self.grid = grid
        self.under_load = load is not None
        self.cells = slice(0, grid.shape[0]), slice(0, grid.shape[1])
        self.is_cell = xp.zeros(grid.points, bool)
        self.is_cell[self.cells] = True if present is None else present
        self.symbol = grid.symbol * (work / reach**2)
        self.mean_response = float(self.symbol[0, 0])
        self.is_blind = self.mean_response == 0
        self.keeps_mean = self.is_blind and not self.under_load
        self.stiffness = xp.divide(1.0, self.symbol, out=xp.zeros_like(self.symbol), where=self.symbol > 0)
        if self.under_load:
            self.stiffness[0, 0] = 0
        self.kernel = self.symbol.copy()
        self.kernel[0, 0] = self.mean_response or float(self.symbol.max())
        self.uniform = load / (work / reach) / math.prod(grid.points) if load is not None else 0.0

    def response(self, change: Array) -> Array:
        """Return the pressure that a displacement at all points causes."""
        return self.grid.filtered(change, self.stiffness)

    def pressure(self, displacement: Array, level: float) -> Array:
        """Return the pressure of displacements less the approach `level`."""
        counts = not (self.under_load or self.is_blind)
        return self.response(displacement + level if counts else displacement) + self.uniform

    def tension(self, gap: Array) -> Array:
        """Return the tension at all points."""
        xp = self.grid.xp
        return xp.exp(-xp.clip(gap, 0, REACH)) * self.is_cell

    def cut(self, gap: Array, total: float | None) -> Array:
        """Return gaps cut at zero, and scaled if the approach determines their sum `total`."""
        xp = self.grid.xp
        gap = xp.where(self.is_cell, xp.maximum(gap, 0), gap)
        if total is None:
            return gap
        positive = gap * self.is_cell
        return gap + positive * ((total - float(gap.sum())) / float(positive.sum()))

    def projected(self, field: Array, free: Array) -> Array:
        """Return a field on the free points, without its mean if the approach determines the mean gap."""
        field = field * free
        return field - free * (float(field.sum()) / int(free.sum())) if self.keeps_mean else field


class Balance(NamedTuple):
    """Forces of a state, their residual, and the points that may move.

    Attributes
    ----------
    tension, residual : array
        Tension, and pressure plus tension less its mean.
    is_open, free : array of bool
        Points out of contact, and points that may move.
    mean : float
        Pressure that keeps the mean gap.
    """

    tension: Array
    residual: Array
    is_open: Array
    free: Array
    mean: float


class Previous(NamedTuple):
    """Last step: change of the gap, its response with the change of tension, and the curvature of the energy."""

    change: Array
    response: Array
    curvature: float


def solve_adhesive(
    grid: Grid,
    given: Array,
    work: float,
    reach: float,
    *,
    approach: float,
    load: float | None = None,
    tolerance: float = 1e-4,
    start: Array | None = None,
    start_gap: Array | None = None,
    least_size: float = 0.0,
    present: Array | None = None,
    stops_if_unstable: bool = False,
    max_iterations: int = 5_000,
) -> AdhesiveState:
    """Return the contact state into which a given state relaxes under a given load or approach.

    Parameters
    ----------
    grid : Grid
        Cells.
    given : array, shape (nx, ny)
        Gap without pressure at zero approach. [m]
    work : float
        Work of adhesion over the contact modulus. [m]
    reach : float
        Range of the attraction. [m]
    approach : float
        Approach; under a given load the approach of the first guess. [m]
    load : float, optional
        Sum of the pressure over the cells. [-] Default: the approach is given.
    tolerance : float
        Relative error of the pressure, L1 norm.
    start : array, shape (nx, ny), optional
        Pressure of the first guess. Default: the undeformed surface. [-]
    start_gap : array, shape (nx, ny), optional
        Gap of the given state. The first guess changes no gap by more than half the range. Default: follows from
        pressure and approach. [m]
    least_size : float
        The error is relative to the integral of the absolute pressure, but at least to this value. [-]
    present : array of bool, shape (nx, ny), optional
        Cells with material. Default: all.
    stops_if_unstable : bool
        Whether to raise `Unstable` as soon as the energy has no minimum along a step.
    max_iterations : int
        Largest number of steps.

    Raises
    ------
    PulledOff
        If the contact does not carry a negative load.
    Unstable
        If `stops_if_unstable`, and the given state may have been unstable.
    ConvergenceError
        If the tolerance is not reached.
    """
    body = Elastic(grid, work, reach, load, present)
    peak = work / reach
    heights, gap, level = first_guess(body, given / reach, approach / reach, start, start_gap, peak, reach)
    pressure = body.pressure(gap - heights, level)
    length = 1.0
    error = math.inf
    is_unstable = False
    stalled = 0
    lowest = math.inf
    requested = math.nan
    last_decrement = math.nan
    last = None
    steepest = float(body.stiffness.max())
    for iteration in range(max_iterations + 1):
        state = balance(body, gap, pressure)
        pulls = load is not None and load < 0 and bool(state.is_open.all())
        if pulls and float(state.tension.sum()) < -PULLED_OFF * body.uniform * gap.size:
            raise PulledOff
        step = body.projected(grid.filtered(state.residual * state.free, body.kernel), state.free)
        decrement = inner(step, state.residual)
        total = max(float(abs(pressure - state.mean).sum()), least_size / peak)
        if iteration:
            foreseen = CAUTION * requested * math.sqrt(max(decrement, 0.0) / last_decrement)
            error = max(foreseen, float(abs(state.residual * state.free).sum())) / total
        if error <= tolerance or decrement <= 1e-26 * total:
            break
        if iteration == max_iterations:
            reached = f"{error:.2g} after {iteration} iterations: expected at most {tolerance:.2g}"
            raise ConvergenceError(f"the adhesive contact is not solved: found an error of {reached}")
        lowest, stalled = (decrement, 0) if decrement < lowest / 2 else (lowest, stalled + 1)

        direction = conjugate(body, step, state, last)
        change = None
        slope = 0.0
        if stalled <= PATIENCE:
            change, slope, length = trial(body, gap, step, direction, state, length)
        if change is None:  # a projected-gradient step always descends
            total_gap = float(gap.sum()) if body.keeps_mean else None
            change = body.cut(gap - state.residual * state.free / steepest, total_gap) - gap
            length = 1.0
            lowest = decrement
            stalled = 0
            slope = inner(change, state.residual)
            if not slope < 0:
                break  # the minimum, to rounding
        response = body.response(change)
        bend = state.tension * change
        elastic = inner(change, response)
        curvature = elastic - inner(bend, change)
        best = min(-slope / curvature, LONGEST) if curvature > 0 else LONGEST
        is_unstable |= curvature <= 0
        if is_unstable and stops_if_unstable:
            raise Unstable
        fraction, was_cut = part_of_trial(body, gap, change, state, best)
        gap, fraction = descend(body, gap, change, state, fraction, slope - inner(state.tension, change), elastic)
        pressure += fraction * response
        requested = float(abs(response).sum()) / length
        last_decrement = max(decrement, 1e-300)
        last = Previous(change, response - bend, curvature) if curvature > 0 else None
        length *= min(max(best, SHRINK), GROW_AFTER_CUT if was_cut else GROW)

    if math.isinf(error):  # the given state is the solution
        error = float(abs(state.residual * state.free).sum()) / total
    displaced = gap - heights
    if body.under_load:
        level = body.uniform * body.mean_response - float(displaced.mean())
    cells = body.cells
    xp = grid.xp
    net = xp.where(state.is_open, -state.tension, pressure - state.mean)[cells] * peak
    apart = xp.where(body.is_cell, gap, math.inf)[cells] * reach
    displacement = (displaced + level)[cells] * reach
    return AdhesiveState(net, displacement, apart, level * reach, float(net.sum()), error, iteration, is_unstable)


def first_guess(
    body: Elastic,
    given: Array,
    level: float,
    start: Array | None,
    start_gap: Array | None,
    peak: float,
    reach: float,
) -> tuple[Array, Array, float]:
    """Return the undeformed gap at zero approach, the first guess of the gap, and the approach, all in ranges."""
    grid = body.grid
    cells = body.cells
    xp = grid.xp
    heights = xp.zeros(grid.points)
    heights[cells] = given
    heights[~body.is_cell] = 0
    displaced = xp.full(grid.points, -level)
    if start is not None:
        pushed = xp.zeros(grid.points)
        pushed[cells] = start / peak
        displaced += grid.filtered(pushed, body.symbol)
    gap = heights + displaced
    if start_gap is not None:
        before = xp.where(body.is_cell[cells], start_gap / reach, displaced[cells])
        guessed = gap[cells]
        touches = before == 0
        if body.under_load and touches.any():  # the approach is unknown: contact cells remain in contact
            guessed = guessed - float(guessed[touches].mean())
        moved = before + xp.clip(guessed - before, -GUESSED, GUESSED)
        remains = touches & (pushed[cells] > -1)
        gap[cells] = xp.where(body.is_cell[cells], xp.where(remains, 0.0, moved), before)
    total = float(heights.sum()) - level * heights.size if body.keeps_mean else None
    return heights, body.cut(gap, total), level


def balance(body: Elastic, gap: Array, pressure: Array) -> Balance:
    """Return the forces of a state that are not in balance. A contact cell moves only if it is pulled off."""
    tension = body.tension(gap)
    is_open = (gap > 0) | ~body.is_cell
    residual = pressure + tension
    mean = float(residual[is_open].mean()) if body.keeps_mean else 0.0
    residual -= mean
    return Balance(tension, residual, is_open, is_open | (residual < 0), mean)


def conjugate(body: Elastic, step: Array, state: Balance, last: Previous | None) -> Array:
    """Return the direction of a step, conjugate to the last step on the points that are free now."""
    if last is None:
        return step
    factor = inner(step, last.response) / last.curvature
    if not factor > 0:
        return step
    turned = step - factor * body.projected(last.change, state.free)
    return turned if inner(turned, state.residual) > 0 else step


def trial(
    body: Elastic, gap: Array, step: Array, direction: Array, state: Balance, length: float
) -> tuple[Array | None, float, float]:
    """Return a change of the gap along which the energy falls, its slope, and the length; None if all are too short."""
    while length >= SHORTEST:
        change = body.cut(gap - length * direction, float(gap.sum()) if body.keeps_mean else None) - gap
        slope = inner(change, state.residual)
        if slope < 0:
            return change, slope, length
        length = length / 4
        direction = step
    return None, 0.0, length


def part_of_trial(body: Elastic, gap: Array, change: Array, state: Balance, best: float) -> tuple[float, bool]:
    """Return the part of a trial to take, and whether the trial closes cells.

    A step beyond the trial stops at the first cell that closes. No gap within reach changes by more than `LEAP`.
    """
    xp = body.grid.xp
    closes = bool((state.is_open & body.is_cell & (gap + change == 0)).any())
    fraction = best
    if closes:
        fraction = 1.0 if best > 0.5 else best
    elif best > 1:
        nearest = float((-change / xp.where(gap > 0, gap, math.inf) * body.is_cell).max())
        fraction = min(best, 1 / max(nearest, 1e-30))
    farthest = float((abs(change) * (state.tension > FELT)).max())
    return (min(fraction, LEAP / farthest) if farthest > 0 else fraction), closes


def descend(
    body: Elastic, gap: Array, change: Array, state: Balance, fraction: float, linear: float, elastic: float
) -> tuple[Array, float]:
    """Return the gap after a part of a trial that does not raise the energy, and this part.

    The tension bends downwards, so that a quadratic estimate may be too long.

    Parameters
    ----------
    body, gap, change, state, fraction
        Body, gap, trial, forces, and part of the trial to try first.
    linear, elastic : float
        Derivative of the energy without attraction along the trial, and its second derivative.
    """
    xp = body.grid.xp
    before = float(state.tension.sum())
    while True:
        moved = gap + fraction * change
        moved = xp.where(body.is_cell, xp.maximum(moved, 0), moved)
        after = float(body.tension(moved).sum())
        rise = fraction * linear + fraction**2 * elastic / 2 + before - after
        if rise <= ROUNDED * before or fraction < 1e-8:
            return moved, fraction
        fraction /= 3
