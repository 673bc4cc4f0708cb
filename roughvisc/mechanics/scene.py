"""What is prescribed, and what changes while a march goes on: plain values, all of them frozen."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.halfspace import HalfSpace
from roughvisc.mechanics.loading import Program
from roughvisc.mechanics.materials import Material
from roughvisc.mechanics.memory import Memory, Rule

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# A step where the instantaneous compliance is below this part of the step's creep starts by backward Euler, and
# shows its pressure through one discarded short solve.
_SOFT = 0.1


@dataclass(frozen=True)
class Scene:
    """What is prescribed: nothing in it changes while the march goes on.

    Attributes
    ----------
    halfspace : HalfSpace
        Grid and boundary.
    gap : ndarray, shape (nx, ny)
        Undeformed gap at first touch, zero at the highest peak, which may lie between the cells; any finite number
        where absent. [m]
    material, memory : Material, Memory
        The material and the form in which its past is kept.
    program : Program
        What is prescribed, when.
    times : tuple of float or None
        Times to step onto exactly, ascending; None: none but the program's corners. [s]
    tolerance : float
        On the relative error in time of pressure (L1) and approach, relative to the largest values so far.
    time_step : float or None
        Fixed step; None chooses steps by the tolerance. [s]
    present : ndarray of bool or None
        Cells where there is material; None: all.
    accept_edge : bool
        In free space, whether cells at the border of the grid may carry pressure.
    enlarge : callable or None
        Where the grid gets too small for the contact: gives this scene on a larger grid and the cell of it at which
        the present grid begins, or None if the profile is not known farther out. The memory must be one of pressures.
    outside : float
        Least undeformed gap of the domain beyond the grid; infinite where the grid is all of it. [m]
    """

    halfspace: HalfSpace
    gap: Array
    material: Material
    memory: Memory
    program: Program
    times: tuple[float, ...] | None = None
    tolerance: float = 1e-3
    time_step: float | None = None
    present: Mask | None = None
    accept_edge: bool = False
    enlarge: Callable[[Scene], tuple[Scene, tuple[int, int]] | None] | None = None
    outside: float = math.inf

    def lowest(self, field: Array) -> float:
        """Least value over the present cells."""
        return float(np.min(field if self.present is None else field[self.present]))

    def compliance(self, t: float) -> float:
        """Contact compliance. [1/Pa]"""
        return float(self.material.contact_compliance(min(t, self.program.duration)))

    @property
    def can_jump(self) -> bool:
        """Whether the material has an instantaneous compliance."""
        return self.compliance(0.0) > 0

    def is_soft(self, length: float) -> bool:
        """Whether hardly any of a step's compliance is there at once."""
        return self.compliance(0.0) < _SOFT * self.compliance(length)

    def keeps(self, time: float) -> bool:
        """Whether a time is kept. [s]"""
        return self.times is None or time in self.times


@dataclass(frozen=True)
class Instant:
    """A state of the surfaces at one time.

    Attributes
    ----------
    time : float
        [s]
    pressure : ndarray, shape (nx, ny)
        [Pa]
    force, approach : float
        [N], [m]
    unit_displacement : ndarray, shape (nx, ny), or None
        Displacement that the pressure causes at unit compliance; None where that is not known. [Pa m]
    """

    time: float
    pressure: Array
    force: float
    approach: float
    unit_displacement: Array | None = None


@dataclass(frozen=True)
class State:
    """All that a march needs to go on: a plain value.

    Attributes
    ----------
    now, before : Instant
        The present instant, and the one before if the next step may extrapolate from it.
    displacement : ndarray, shape (nx, ny)
        Total displacement of the half-space at the present instant. [m]
    memory : object
        State of the memory at the present instant.
    segment : int
        Index of the segment of the program.
    began, start : float
        Time at which the segment began [s], and the value of what it controls then [N or m].
    suggestion : float
        Length of the next step; zero after an event. [s]
    largest_force, largest_approach : float
        So far. [N], [m]
    contact_since : float
        Time at which the surfaces last came into contact. [s]
    work : float
        Work of the pressure on the displacement since the start; jumps count as quasi-static. [J]
    unresolved : bool
        Whether a jump was prescribed that the material cannot follow at once.
    blind : bool
        Whether the next estimate leaves the pressure out, once.
    rejected_error : float
        Estimate of the last attempt at this step, if it was rejected.
    iterations, convolutions : int
        Spent so far, rejected steps included.
    """

    now: Instant
    displacement: Array
    memory: Any
    before: Instant | None = None
    segment: int = 0
    began: float = 0.0
    start: float = 0.0
    suggestion: float = 0.0
    largest_force: float = 0.0
    largest_approach: float = 0.0
    contact_since: float = 0.0
    work: float = 0.0
    unresolved: bool = False
    blind: bool = False
    rejected_error: float = math.inf
    iterations: int = 0
    convolutions: int = 0

    def extrapolated(self, length: float) -> Array:
        """Pressure a step ahead by the last two, cut at zero; the last one where there is no other. [Pa]"""
        if self.before is None or length == 0:
            return self.now.pressure
        ahead = _beyond(self.before.pressure, self.now.pressure, self._ratio(length), 1.0)
        return np.maximum(ahead, 0, out=ahead)

    def first_guess(self, length: float, scale: float) -> tuple[Array, Array | None]:
        """The extrapolated pressure and its unit displacement, both scaled, in memory of their own.

        The latter is None where it would cost a convolution: where pressure is cut at zero.
        """
        now, before = self.now, self.before
        if before is None or length == 0:
            return now.pressure * scale, None if now.unit_displacement is None else now.unit_displacement * scale
        ratio = self._ratio(length)
        pressure = _beyond(before.pressure, now.pressure, ratio, scale)
        if np.min(pressure) < 0:
            return np.maximum(pressure, 0, out=pressure), None
        if now.unit_displacement is None or before.unit_displacement is None:
            return pressure, None
        return pressure, _beyond(before.unit_displacement, now.unit_displacement, ratio, scale)

    def _ratio(self, length: float) -> float:
        """Of a step's length to that of the last one."""
        assert self.before is not None
        return length / (self.now.time - self.before.time)


def _beyond(before: Array, now: Array, ratio: float, scale: float) -> Array:
    """``scale * (now + ratio * (now - before))``."""
    there = now - before
    there *= ratio
    there += now
    there *= scale
    return there


@dataclass(frozen=True)
class Step:
    """An accepted step.

    Attributes
    ----------
    shown : Instant
        What to report: the state's present instant, its pressure resolved where the material cannot jump.
    displacement : ndarray, shape (nx, ny)
        Total displacement of the half-space then. [m]
    effective : ndarray or None
        Effective pressure ``q``, the displacement's source, where the memory is one of pressures. [-]
    level : float
        Rigid-body approach that belongs to the displacement: ``gap = undeformed gap + displacement - level``. [m]
    bound : float
        Bound on the relative error of the pressure left by the contact solver, in the energy norm.
    time_error : float
        Estimated relative error in time of this step; NaN where no estimate was made.
    converged : bool
        Whether the contact solver reached its tolerance.
    scene : Scene
        The scene, on the grid that it has by now.
    state : State
        The state after the step.
    """

    shown: Instant
    displacement: Array
    effective: Array | None
    level: float
    bound: float
    time_error: float
    converged: bool
    scene: Scene
    state: State


@dataclass(frozen=True)
class Trial:
    """A step that was computed and is not yet accepted."""

    instant: Instant
    displacement: Array
    effective: Array | None
    length: float
    rule: Rule
    bound: float = 0.0
    converged: bool = True
    iterations: int = 0
    convolutions: int = 0

    @property
    def apart(self) -> bool:
        """Whether the surfaces are apart."""
        return self.instant.force == 0
