"""Loading programs: chains of segments that prescribe load or approach over time.

A program knows values at corners only. What a hold keeps, or where a ramp starts after a change of control, is
found during the run and handed to :meth:`Segment.value`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from roughvisc.errors import InputError

Control = Literal["load", "approach"]
_UNITS = {"load": "N", "approach": "m"}


@dataclass(frozen=True)
class Segment:
    """One piece of a program.

    Parameters
    ----------
    control : {"load", "approach"}
        What is prescribed.
    duration : float
        Length of the segment; zero is a jump. [s]
    end : float or None
        Value at the end, reached linearly; None keeps the value found at the start. [N or m]
    amplitude, period : float
        A sine wave about the value ``end``, which must also be the value at the start. [N or m], [s]
    """

    control: Control
    duration: float
    end: float | None = None
    amplitude: float = 0.0
    period: float = math.inf

    def __post_init__(self) -> None:
        if self.control not in _UNITS:
            raise InputError(f"control is {self.control!r}: expected 'load' or 'approach'")
        if not (math.isfinite(self.duration) and self.duration >= 0):
            raise InputError(f"duration of a {self.control} segment is {self.duration!r}: expected a number >= 0 [s]")
        if self.end is not None and not math.isfinite(self.end):
            raise InputError(f"{self.control} is {self.end!r}: expected a finite number [{_UNITS[self.control]}]")
        lowest = (self.end or 0.0) - abs(self.amplitude)
        if self.control == "load" and lowest < 0:
            raise InputError(f"load reaches {lowest!r} N: expected no negative load, contact here has no adhesion")
        if self.amplitude and not (self.period > 0 and math.isfinite(self.period)):
            raise InputError(f"period of a cycle is {self.period!r}: expected a positive number [s]")

    def value(self, elapsed: float, start: float) -> float:
        """Prescribed value [N or m] a time [s] after the start of the segment, which began at ``start``."""
        if self.amplitude:
            mean = start if self.end is None else self.end
            return mean + self.amplitude * math.sin(2 * math.pi * elapsed / self.period)
        if self.end is None:
            return start
        if elapsed >= self.duration * (1 - 1e-12):  # times are sums of durations, rounded
            return self.end
        return start + (self.end - start) * (elapsed / self.duration)

    def turns(self, after: float, before: float) -> Iterator[float]:
        """Instants strictly between two others at which a cycle turns back, from the start of the segment. [s]"""
        if not self.amplitude:
            return
        quarter = self.period / 4
        number = 2 * max(math.floor((after / quarter - 1) / 2), 0) + 1
        while number * quarter < before:
            if number * quarter > after:
                yield number * quarter
            number += 2

    def highest(self, start: float) -> float:
        """The largest value prescribed anywhere in the segment, which began at ``start``. [N or m]"""
        if self.amplitude:
            return (start if self.end is None else self.end) + abs(self.amplitude)
        return max(start, start if self.end is None else self.end)

    def is_nothing(self, start: float) -> bool:
        """Whether zero is prescribed throughout."""
        return not self.amplitude and start == 0 and not self.end


@dataclass(frozen=True)
class Program:
    """A loading program: segments in order, from rest at time zero.

    Built as a chain; every call returns a longer program. ``over=0`` is a jump.

    Parameters
    ----------
    segments : tuple of Segment
        In order; none unless given.

    Examples
    --------
    >>> program = Program().load(2.0, over=0.05).hold(5.0).load(0.0, over=0.05)
    >>> round(program.duration, 12)
    5.1
    >>> [segment.end for segment in program.segments]
    [2.0, None, 0.0]
    """

    segments: tuple[Segment, ...] = ()

    def _then(self, *segments: Segment) -> Program:
        return Program(self.segments + segments)

    def __add__(self, other: Program) -> Program:
        """This program followed by another one."""
        return self._then(*other.segments)

    def load(self, value: float, *, over: float) -> Program:
        """Go to a load, linearly.

        Parameters
        ----------
        value : float
            Load at the end. [N]
        over : float
            How long it takes; zero is a jump. [s]

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If a number is negative or not finite.
        """
        return self._then(Segment("load", over, value))

    def approach(self, value: float, *, over: float) -> Program:
        """Go to an approach, linearly.

        Parameters
        ----------
        value : float
            Approach at the end; negative values lift the profile off. [m]
        over : float
            How long it takes; zero is a jump. [s]

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If a number is not finite, or the time is negative.
        """
        return self._then(Segment("approach", over, value))

    def hold(self, duration: float, control: Control | None = None) -> Program:
        """Keep the load or the approach at the value that it has.

        Parameters
        ----------
        duration : float
            How long. [s]
        control : {"load", "approach"}, optional
            Which of them; that of the segment before unless given. The other one then follows from the contact: a load,
            then ``hold(..., control="approach")``, is stress relaxation.

        Returns
        -------
        Program
        """
        if not self.segments and control is None:
            control = "load"
        return self._then(Segment(control or self.segments[-1].control, duration))

    @classmethod
    def table(cls, times: Sequence[float], values: Sequence[float], control: Control = "load") -> Program:
        """Linear between the rows of a table; two rows at one time are a jump.

        Parameters
        ----------
        times : sequence of float
            Ascending from zero; a value other than zero at time zero is a jump. [s]
        values : sequence of float
            Load [N] or approach [m] at these times.

        Raises
        ------
        InputError
            If the lengths differ, or the times do not ascend from zero; the offending row is named.
        """
        if len(times) != len(values) or not len(times):
            raise InputError(f"table has {len(times)} times and {len(values)} values: expected as many, at least one")
        if times[0] != 0:
            raise InputError(f"table starts at time {times[0]!r} s: expected 0")
        program = cls()
        before = 0.0
        for row, (time, value) in enumerate(zip(times, values, strict=True)):
            if not time >= before:
                raise InputError(f"table row {row}: time {time!r} s after {before!r} s: expected ascending times")
            if row or value:
                program = program._then(Segment(control, float(time) - before, float(value)))
            before = float(time)
        return program

    @classmethod
    def cycle(cls, mean: float, amplitude: float, period: float, cycles: float, control: Control = "load") -> Program:
        """A sine wave about a mean, after a jump to that mean.

        To reach the mean otherwise, add: ``Program().load(1.0, over=0.1) + Program.cycle(1.0, 0.5, 2.0, 5)``.

        Parameters
        ----------
        mean, amplitude : float
            Of the load [N] or the approach [m].
        period : float
            Length of a cycle. [s]
        cycles : float
            How many.
        """
        return cls((Segment(control, 0.0, mean), Segment(control, period * cycles, mean, amplitude, period)))

    def gives(self, number: int) -> bool:
        """Whether the program states what a segment prescribes; a hold may keep what was found.

        Parameters
        ----------
        number : int
            Index of the segment.
        """
        control = self.segments[number].control
        for segment in reversed(self.segments[: number + 1]):
            if segment.control != control or segment.end is not None:
                return segment.control == control
        return True

    @property
    def duration(self) -> float:
        """Length of the program. [s]"""
        return self._corners[-1]

    @property
    def corners(self) -> list[float]:
        """Start of the program and end of each segment. [s]"""
        return list(self._corners)

    @cached_property
    def _corners(self) -> tuple[float, ...]:
        return (0.0, *np.cumsum([segment.duration for segment in self.segments]).tolist())

    @property
    def largest_load(self) -> float:
        """Largest load prescribed anywhere; zero if none is. [N]"""
        loads = [(s.end or 0.0) + abs(s.amplitude) for s in self.segments if s.control == "load"]
        return max(loads, default=0.0)
