"""Input and solution of the time stepping: the scene, its corners, and the point that a step reaches."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from roughvisc.mechanics.adhesion import Adhesion
from roughvisc.mechanics.grid import Grid, namespace, to_host
from roughvisc.mechanics.memory import History, Memory
from roughvisc.mechanics.program import Program, Slide

Array = Any  # an array of NumPy or CuPy

#: A pair of steps is soft if its compliance grows by more than this factor, and a program if a pair of its length were.
SOFT = 10.0


@dataclass(frozen=True)
class Corner:
    """Transition from one segment of a program to the next.

    Attributes
    ----------
    is_smooth : bool
        Whether pairs of steps may keep their length: neither segment is a jump or a slide, the control stays, and the
        corner is not abrupt.
    is_abrupt : bool
        Whether the load of a contact jumps, because the body has no instantaneous compliance.
    """

    is_smooth: bool
    is_abrupt: bool


def corners_of(program: Program, can_jump: bool) -> list[Corner]:
    """Return the corners of a program, for a body that has (`can_jump`) or lacks an instantaneous compliance."""
    corners = []
    for last, following in pairwise((*program.segments, *program.segments[-1:])):
        changes = following.control != last.control
        lasts = last.duration > 0 and last.slide is None and following.duration > 0 and following.slide is None
        abrupt = not can_jump and (changes or last.control == "approach")
        corners.append(Corner(lasts and not changes and not abrupt, abrupt))
    return corners


@dataclass
class Scene:
    """Input of the time stepping: surface, body, program and accuracy.

    Attributes
    ----------
    grid : Grid
        Cells, boundary and body.
    gap : array, shape (nx, ny)
        Gap of the undeformed surfaces at zero approach; any finite number at absent cells. [m]
    memory : Memory
        Material.
    program : Program
        Load or approach against time, and slides.
    kept : tuple of float or None
        Times of the kept rows, ascending; None: times of all steps. [s]
    tolerance : float
        Relative error of pressure (L1 norm), approach and force at kept times.
    time_step : float or None
        Fixed step; None: the tolerance controls the steps. [s]
    present : array of bool or None
        Cells with material; None: all.
    adhesion : Adhesion or None
        Attraction of the surfaces; None: none.
    solid : array of bool or ellipsis
        Index of the cells with material.
    can_jump : bool
        Whether the body has an instantaneous compliance.
    becomes_soft : bool
        Whether hardly any of the compliance at the end of the program is instantaneous.
    transitions : list of Corner
        Corner at the end of each segment.
    motions : list of Slide or None
        Slide of each segment for the friction: its own, the last one, or the first; None without slides.
    """

    grid: Grid
    gap: Array
    memory: Memory
    program: Program
    kept: tuple[float, ...] | None = None
    tolerance: float = 1e-3
    time_step: float | None = None
    present: Array | None = None
    adhesion: Adhesion | None = None
    solid: Any = field(init=False)
    can_jump: bool = field(init=False)
    becomes_soft: bool = field(init=False)
    transitions: list[Corner] = field(init=False)
    motions: list[Slide | None] = field(init=False)

    def __post_init__(self) -> None:
        self.solid = ... if self.present is None else self.present
        self.can_jump = self.memory.compliance(0.0) > 0
        self.becomes_soft = self.memory.grows(self.program.duration, SOFT)
        self.transitions = corners_of(self.program, self.can_jump)
        motion = None
        self.motions = []
        for segment in reversed(self.program.segments):
            motion = segment.slide or motion
        for segment in self.program.segments:
            motion = segment.slide or motion
            self.motions.append(motion)

    @property
    def least_force(self) -> float:
        """Smallest force that relative errors are divided by: with adhesion the largest tension of a cell. [N]"""
        return 1e-300 if self.adhesion is None else self.adhesion.strength * self.grid.cell_area

    def contact_pressure(self, point: Point, pressure: Array) -> Array:
        """Return the pressure of a point [Pa] in contact, zero elsewhere: with adhesion without the tension there."""
        if self.adhesion is None:
            return pressure
        return (pressure + self.adhesion.strength) * (0.0 if point.gap is None else point.gap == 0)

    def keeps(self, time: float) -> bool:
        """Return whether a time is kept. [s]"""
        return self.kept is None or self.next_kept(math.nextafter(time, -math.inf)) == time

    def kept_within(self, after: float, until: float) -> tuple[float, ...]:
        """Return the kept times after a time, until another one; none if every step is kept. [s]"""
        kept = self.kept or ()
        return kept[bisect_right(kept, after) : bisect_right(kept, until)]

    def last_kept(self, time: float) -> float:
        """Return the last kept time not after a time [s]; minus infinity if there is none, or if every step is kept."""
        kept = self.kept or ()
        index = bisect_right(kept, time)
        return kept[index - 1] if index else -math.inf

    def next_kept(self, time: float) -> float:
        """Return the first kept time after a time; infinite if there is none, or if every step is kept. [s]"""
        kept = self.kept or ()
        index = bisect_right(kept, time)
        return kept[index] if index < len(kept) else math.inf


@dataclass(frozen=True)
class Packed:
    """Field that is zero outside the contact. NumPy accepts it as an array.

    Attributes
    ----------
    shape : tuple of int
        Shape of the field.
    cells : array of int, shape (n,)
        Contact cells, as flat indices.
    values : array, shape (n,)
        Values there.
    """

    shape: tuple[int, int]
    cells: Array
    values: Array

    @property
    def nbytes(self) -> int:
        """Memory. [byte]"""
        return int(self.cells.nbytes + self.values.nbytes)

    def field(self) -> Array:
        """Return the whole field, an array of the kind of its values."""
        field = namespace(self.values).zeros(math.prod(self.shape))
        field[self.cells] = self.values
        return field.reshape(self.shape)

    def get(self) -> Packed:
        """Return the field with its arrays on the host."""
        return Packed(self.shape, to_host(self.cells), to_host(self.values))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.asarray(self.get().field(), dtype)


def unpacked(field: Array | Packed) -> Array:
    """Return a field at all cells."""
    return field.field() if isinstance(field, Packed) else field


@dataclass(frozen=True)
class Point:
    """Solution at an instant.

    Attributes
    ----------
    time : float
        Time. [s]
    stored_pressure : array, shape (nx, ny), or Packed
        Pressure. [Pa]
    force, approach : float
        Normal force and approach. [N, m]
    history : History
        Memory of the body.
    previous : tuple or None
        Time, stored pressure, and displacement per unit compliance of the last point: for the next first guess, and for
        the length of the step.
    segment_start : float
        Force [N] or approach [m] at the start of the segment.
    is_late : bool
        Whether the prescribed value has jumped and the body has no instantaneous compliance.
    solver_error, solver_error_approach : float
        Errors of the contact solver: relative error of the pressure (L1 norm), and error of the approach. [-, m]
    gap : array, shape (nx, ny), or None
        With adhesion, gap between the surfaces: exactly zero in contact, infinite at absent cells. [m]
    integral : float or None
        With adhesion, integral of the absolute pressure. [N]
    is_unstable : bool
        With adhesion, whether the state before may have been unstable.
    """

    time: float
    stored_pressure: Array | Packed
    force: float
    approach: float
    history: History
    previous: tuple[float, Array | Packed, Array | None] | None = None
    segment_start: float = 0.0
    is_late: bool = False
    solver_error: float = 0.0
    solver_error_approach: float = 0.0
    gap: Array | None = None
    integral: float | None = None
    is_unstable: bool = False

    @property
    def pressure(self) -> Array:
        """Pressure at all cells, shape (nx, ny). [Pa]"""
        return unpacked(self.stored_pressure)

    @property
    def contact(self) -> Array:
        """Cells in contact, shape (nx, ny), bool."""
        return self.pressure > 0 if self.gap is None else self.gap == 0

    @property
    def size(self) -> float:
        """Force to which errors are relative: with adhesion the integral of the absolute pressure. [N]"""
        return self.force if self.integral is None else self.integral

    @property
    def is_open(self) -> bool:
        """Whether no force acts between the surfaces. With adhesion a force acts at every gap."""
        return self.force == 0 and self.gap is None
