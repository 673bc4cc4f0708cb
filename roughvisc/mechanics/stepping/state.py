"""Values of a march that change from step to step: state, step length control, trial and accepted step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.arrays import cut_at_zero, empty, threads_of, weighted
from roughvisc.mechanics.hereditary.memory import Rule
from roughvisc.mechanics.sparse import Sparse, Sum
from roughvisc.mechanics.stepping.energy import Energy
from roughvisc.mechanics.stepping.program import Control, Slid
from roughvisc.mechanics.stepping.scene import Scene

Array = NDArray[np.float64]
#: A pressure near the one sought, and its displacement at unit compliance where that is known. [Pa], [Pa m]
Guess = tuple[Array, Array | None]
#: In place of one that is not held.
NO_CONTACT = Sparse.whole(np.zeros((0, 0)))


_EXCESS = ("stored_excess", "dissipated_excess")


@dataclass(frozen=True)
class Uncertainty:
    """What the time steps leave unknown at an instant, by the companion that takes steps twice as long.

    Attributes
    ----------
    pressure : float
        Of the pressure, its absolute values summed. [N]
    approach, force : float
        [m], [N]
    work, dissipated : float
        [J]
    friction : float
        Of the tangential force, in a slide. [N]
    inside, outside : float
        Area in contact that may be none, and area out of contact that may be in it. [m2]
    stored_excess, dissipated_excess : float
        What steps of finite length add to these energies, to leading order. [J]
    """

    pressure: float = 0.0
    approach: float = 0.0
    force: float = 0.0
    work: float = 0.0
    dissipated: float = 0.0
    friction: float = 0.0
    inside: float = 0.0
    outside: float = 0.0
    stored_excess: float = 0.0
    dissipated_excess: float = 0.0

    def or_worse(self, other: Uncertainty, part: float) -> Uncertainty:
        """The larger of both, part by part; what steps add to the energies lies a part of the way to the other's."""
        here, there = vars(self), vars(other)
        worse = dict(zip(here, map(max, here.values(), there.values()), strict=True))
        for name in _EXCESS:
            worse[name] = (1 - part) * here[name] + part * there[name]
        return Uncertainty(**worse)

    def relative(self, force: float, approach: float) -> float:
        """The largest of pressure, force and approach over what these have come to so far [N], [m]. [-]"""
        by_force = max(self.pressure, self.force) / force if force > 0 else 0.0
        return max(by_force, self.approach / approach if approach > 0 else 0.0)


# A step that is tried again is shortened to meet what is allowed, of which it aims at the square of the first number,
# and within the other two. The third is taken where there is no estimate.
_AIM, _SHORTEST, _LONGEST = 0.7, 0.2, 0.5
# A shorter step whose error is above this part of the longer one's was in vain: halving it gains a factor of two at
# least, unless a cell enters, which makes the pressure jump however short the step is.
_IN_VAIN = 0.93
# Steps are shortened where what is stated exceeds the first part of the tolerance and has grown by more than a factor
# since it was last told, and lengthened again where it is below the second part. Their share stays between two limits.
_MOST_USED, _LEAST_USED = 0.7, 0.3
_GROWING, _SHARPEST, _BLUNTEST = 1.03, 0.125, 1.0


@dataclass(frozen=True)
class ControllerState:
    """What the choice of the next step remembers.

    Attributes
    ----------
    suggestion : float
        Length of the next step; zero after an event. [s]
    sharpness : float
        Part of their usual share of the tolerance that the next steps may use, by the error accumulated so far. [-]
    ignore_pressure_error : bool
        Whether the next estimate leaves the pressure out, once.
    rejected_error : float
        Estimate of the last attempt at the present step, if it was rejected; else infinite. [-]
    """

    suggestion: float = 0.0
    sharpness: float = 1.0
    ignore_pressure_error: bool = False
    rejected_error: float = math.inf

    def shortening_failed(self, error: float) -> bool:
        """Whether a shorter step was hardly better than the one that was rejected before."""
        return error > _IN_VAIN * self.rejected_error

    def rejected(self, length: float, error: float, allowed: float) -> ControllerState:
        """After a step of some length [s] whose error, NaN where there is no estimate, is not allowed."""
        if math.isnan(error):
            return replace(self, suggestion=_SHORTEST * length, rejected_error=math.inf)
        shrink = min(max(_AIM * math.sqrt(allowed / error), _SHORTEST), _LONGEST)
        return replace(self, suggestion=shrink * length, rejected_error=error)

    def accepted(self, suggestion: float, error: float, allowed: float, fresh: bool) -> ControllerState:
        """After an accepted step; ``fresh``: it was the first after an event, whose error the second one finds.

        If it was accepted because shortening did not help, the pressure has jumped. The next estimate ignores the
        pressure, or it would count that jump again.
        """
        ignored = self.shortening_failed(error) and error > allowed
        rejected_error = self.rejected_error if fresh else math.inf
        return ControllerState(suggestion, self.sharpness, ignored, rejected_error)

    def adapt_sharpness(self, used: float, earlier: float) -> ControllerState:
        """Adapt to the stated error over the tolerance, now and when it was last known."""
        if used > _MOST_USED and used > _GROWING * earlier:  # what stays whatever the steps is none of their doing
            wanted = max(_MOST_USED / used, 0.5)
        elif used < _LEAST_USED:
            wanted = 1.5
        else:
            return self
        # in steps of sqrt(2): what rounding does to small differences must not show in the length of steps
        wanted = 2 ** (0.5 * round(2 * math.log2(wanted)))
        return replace(self, sharpness=min(max(self.sharpness * wanted, _SHARPEST), _BLUNTEST))


@dataclass(frozen=True)
class Instant:
    """A state of the surfaces at one time.

    Attributes
    ----------
    time : float
        [s]
    contact : Sparse
        The cells in contact and their pressure. [Pa]
    force, approach : float
        [N], [m]
    unit_displacement : ndarray, shape (nx, ny), or None
        Displacement that the pressure causes at unit compliance; None where that is not known. [Pa m]
    """

    time: float
    contact: Sparse
    force: float
    approach: float
    unit_displacement: Array | None = None

    @property
    def pressure(self) -> Array:
        """Pressure on all cells, not to be changed; had anew each time where the contact is sparse. [Pa]"""
        return self.contact.field()

    def without_fields(self) -> Instant:
        """Its numbers."""
        return Instant(self.time, NO_CONTACT, self.force, self.approach)


@dataclass(frozen=True)
class Trajectory:
    """A history at its present instant, as steps of some length give it.

    Attributes
    ----------
    now, before : Instant
        The present instant, and the one before if the next step may extrapolate from it.
    memory : object
        State of the memory at the present instant.
    start : float
        Value at the start of the segment of what it controls. [N or m]
    work : float
        Work of the pressure on the displacement since the start; jumps count as quasi-static. [J]
    energy : Energy
        What of it is stored and what is dissipated.
    unresolved : bool
        Whether a jump was prescribed that the material cannot follow at once.
    """

    now: Instant
    memory: Any
    before: Instant | None = None
    start: float = 0.0
    work: float = 0.0
    energy: Energy = field(default_factory=Energy)
    unresolved: bool = False

    def extrapolated(self, length: float) -> tuple[Array, bool]:
        """Pressure a step ahead by the last two, cut at zero, and whether it was; the last where there is no other.

        In memory of its own. [Pa]
        """
        now, before = self.now.contact, self.before
        if before is None or length == 0:
            return now.times(1.0), False
        ratio = length / (self.now.time - before.time)
        pressure = now.times(1 + ratio)
        before.contact.add_to(pressure, -ratio)
        return pressure, cut_at_zero(pressure, now.threads)

    def first_guess(self, length: float) -> Guess:
        """The extrapolated pressure and its unit displacement, in memory of their own.

        The latter is None where it would cost a convolution: where pressure is cut at zero.
        """
        pressure, was_cut = self.extrapolated(length)
        known, before = self.now.unit_displacement, self.before
        if was_cut or known is None:
            return pressure, None
        threads = threads_of(known.size)
        if before is None or length == 0:
            return pressure, weighted([(1.0, known)], empty(known.shape), threads)
        if before.unit_displacement is None:
            return pressure, None
        ratio = length / (self.now.time - before.time)
        terms = [(1 + ratio, known), (-ratio, before.unit_displacement)]
        return pressure, weighted(terms, empty(known.shape), threads)


#: A trajectory, or the whole state of a march.
AnyTrajectory = TypeVar("AnyTrajectory", bound=Trajectory)


@dataclass(frozen=True)
class State(Trajectory):
    """All that a march needs to go on: a plain value.

    Attributes
    ----------
    segment : int
        Index of the segment of the program.
    began : float
        Time at which the segment began. [s]
    largest_force, largest_approach, largest_work : float
        So far. [N], [m], [J]
    contact_since : float
        Time at which the surfaces last came into contact. [s]
    companion : Trajectory or None
        The same history in steps twice as long, as far as it has come; None while it is no other than this one.
    behind : int
        Accepted steps since the companion was last at the present instant.
    uncertainty : Uncertainty
        As of then.
    slid : Slid or None
        How far the profile has slid; None before any slide.
    pace : ControllerState
        How long the next step should be.
    iterations, convolutions : int
        Spent so far, rejected steps included.
    """

    segment: int = 0
    began: float = 0.0
    largest_force: float = 0.0
    largest_approach: float = 0.0
    largest_work: float = 0.0
    contact_since: float = 0.0
    companion: Trajectory | None = None
    behind: int = 0
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    slid: Slid | None = None
    pace: ControllerState = field(default_factory=ControllerState)
    iterations: int = 0
    convolutions: int = 0

    def with_each(self, change: Callable[[Any], Any]) -> State:
        """The state and its companion, both changed in the same way."""
        return replace(change(self), companion=self.companion and change(self.companion))


@dataclass(frozen=True)
class Step:
    """An accepted step.

    Attributes
    ----------
    shown : Instant
        What to report: the state's present instant, its pressure resolved where the material cannot jump.
    displaced : Sum
        Total displacement of the half-space then. [m]
    effective : ndarray or None
        Effective pressure ``q``, the displacement's source, where the memory is one of pressures. [-]
    level : float
        Rigid-body approach that belongs to the displacement: ``gap = undeformed gap + displacement - level``. [m]
    control : {"load", "approach"}
        What was prescribed.
    given : bool
        Whether the program stated its value; else it was found before, and kept.
    solver_error : float
        Estimated error of the pressure that the contact solver leaves (L1). [-]
    solver_error_approach : float
        Error of the approach under a load that the contact solver leaves. [m]
    uncertainty : Uncertainty
        Error that the time steps leave.
    scene : Scene
        The scene, on the grid that it has by now.
    state : State
        The state after the step.
    """

    shown: Instant
    displaced: Sum
    effective: Array | None
    level: float
    control: Control
    given: bool
    solver_error: float
    solver_error_approach: float
    uncertainty: Uncertainty
    scene: Scene
    state: State

    @property
    def displacement(self) -> Array:
        """Total displacement of all cells, not to be changed; added up anew each time if it is a sum. [m]"""
        return self.displaced.field()

    def on_rows(self, field: Sparse | Sum, rows: slice) -> Array:
        """Its pressure [Pa] or its total displacement [m] on some rows of cells, not to be changed."""
        columns = self.scene.operator.shape[1]
        return field.part(slice(rows.start * columns, rows.stop * columns)).reshape(-1, columns)

    def with_fields(self) -> Step:
        """The same with all its fields at hand, for what asks for them again and again."""
        if self.shown.contact.cells is None and self.displaced.is_whole:
            return self
        shown = replace(self.shown, contact=Sparse.whole(self.shown.pressure))
        return replace(self, shown=shown, displaced=Sum.whole(self.displacement))

    @property
    def stored(self) -> float:
        """Energy stored in the springs of the material. [J]"""
        return self.state.energy.stored - self.uncertainty.stored_excess

    @property
    def dissipated(self) -> float:
        """Energy dissipated in its dashpots so far. [J]"""
        return self.state.energy.dissipated - self.uncertainty.dissipated_excess

    @property
    def work(self) -> float:
        """Work of the pressure on the displacement since the start. [J]"""
        return self.stored + self.dissipated


@dataclass(frozen=True)
class Trial:
    """A step that is not yet accepted; its total displacement is None where the memory will tell it."""

    instant: Instant
    displacement: Array | None
    effective: Array | None
    length: float
    rule: Rule
    control: Control = "load"
    solver_error: float = 0.0
    solver_error_approach: float = 0.0
    iterations: int = 0
    convolutions: int = 0
    slides: bool = False

    @property
    def is_open(self) -> bool:
        """Whether the surfaces are apart."""
        return self.instant.force == 0
