"""What is prescribed for a march, as arrays and numbers."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.arrays import lowest
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.hereditary.memory import Memory, mean_compliance, old_weight
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.stepping.program import Program, Slide

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
    operator : Grid
        Grid and boundary.
    gap : ndarray, shape (nx, ny)
        Undeformed gap at first touch, zero at the highest peak, which may lie between the cells; any finite number
        where absent. [m]
    material, memory : Prony, Memory
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

    operator: Grid
    gap: Array
    material: Prony
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
        return lowest(field, self.present, self.operator.threads)

    @cached_property
    def compliance(self) -> Callable[[float], float]:
        """Contact compliance at a time, no later than the end; asked for the same few times over and over. [1/Pa]"""
        material, end = self.material, self.program.duration
        return lru_cache(maxsize=32)(lambda t: float(material.contact_compliance(min(t, end))))

    @cached_property
    def mean_compliance(self) -> Callable[[float], float]:
        """Mean contact compliance over the first so many seconds of creep. [1/Pa]"""
        material, end = self.material, self.program.duration
        return lru_cache(maxsize=32)(lambda step: mean_compliance(material, min(step, end)))

    def stiff_ratio(self, step: float) -> float:
        """As :func:`~roughvisc.mechanics.hereditary.memory.old_weight`, no longer than the program."""
        return old_weight(self.compliance(step), self.mean_compliance(step))

    @cached_property
    def glassy(self) -> float:
        """Instantaneous contact compliance. [1/Pa]"""
        return self.compliance(0.0)

    @cached_property
    def final(self) -> float:
        """Contact compliance after all of the program. [1/Pa]"""
        return self.compliance(self.program.duration)

    @property
    def can_jump(self) -> bool:
        """Whether the material has an instantaneous compliance."""
        return self.glassy > 0

    @property
    def is_viscoelastic(self) -> bool:
        """Whether the past matters: without creep nothing that is computed depends on the steps."""
        return self.final > self.glassy

    def lacks_instantaneous_compliance(self, length: float) -> bool:
        """Whether hardly any of a step's compliance is there at once."""
        return self.glassy < _SOFT * self.compliance(length)

    @cached_property
    def is_soft(self) -> bool:
        """Whether hardly any of the compliance after all of the program is there at once."""
        return self.lacks_instantaneous_compliance(self.program.duration)

    @cached_property
    def motions(self) -> tuple[Slide, ...]:
        """What friction is against in each segment: its slide, the last one, or the first; empty if none slides."""
        slides = [segment.slide for segment in self.program.segments]
        last = next((slide for slide in slides if slide is not None), None)
        return () if last is None else tuple(last := slide or last for slide in slides)

    def keeps(self, time: float) -> bool:
        """Whether a time is kept. [s]"""
        return self.times is None or time in self._kept

    def next_kept(self, time: float) -> float:
        """The first time to step onto after another, infinite if there is none. [s]"""
        times = self.times or ()
        at = bisect_right(times, time)
        return times[at] if at < len(times) else math.inf

    @cached_property
    def _kept(self) -> frozenset[float]:
        return frozenset(self.times or ())
