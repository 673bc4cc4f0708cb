"""Loading programs: chains of segments that prescribe load, nominal pressure or approach over time.

A program knows values at corners only. What a hold keeps, or where a ramp starts after a change of control, is
found during the run and handed to :meth:`Segment.value`. A nominal pressure becomes a load where the surface is
known: see :meth:`Program.on_area`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, get_args

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.segment import CONTROLS, PUSHING, UNITS, Control, Segment
from roughvisc.notebook import table
from roughvisc.units import bounded_quantity, said, shown

#: what may be prescribed -> what may be meant where the unit is of another kind: keys and their units
INSTEAD = {control: {other: unit for other, unit in UNITS.items() if other != control} for control in UNITS}

#: Segments that a program tells one by one.
_TOLD = 8


def _said(value: Any, unit: str, key: str, **bounds: Any) -> float:
    """A quantity of a program; what is wrong with it is said as of the same key of a study file."""
    if getattr(value, "shape", None) == ():  # a scalar of NumPy or xarray
        value = value.item()
    try:
        return bounded_quantity(value, unit, **bounds)
    except InputError as error:
        raise InputError(f"{key}: {error}") from None


def _known(control: Any, key: str) -> Any:
    if control not in get_args(Control):
        raise InputError(f"{key}: found {shown(control)}: expected {CONTROLS}")
    return control


@dataclass(frozen=True)
class Program:
    """A loading program: segments in order, from rest at time zero.

    Built as a chain; every call returns a longer program. ``over=0`` is a jump. Quantities are numbers in SI, or
    strings with a unit.

    Parameters
    ----------
    segments : tuple of Segment
        In order; none unless given.
    note : str
        What to say of its origin: how a measured history became segments.

    Examples
    --------
    >>> program = Program().load(2.0, over=0.05).hold(5.0).load(0.0, over="50 ms")
    >>> round(program.duration, 12)
    5.1
    >>> [segment.end for segment in program.segments]
    [2.0, None, 0.0]
    >>> program
    Program: load to 2 N over 50 ms, hold 5 s, load to 0 N over 50 ms
    """

    segments: tuple[Segment, ...] = ()
    note: str = field(default="", compare=False)

    def __repr__(self) -> str:
        """In words; of a long table its first segments."""
        words, more = self._words(), len(self.segments) - _TOLD
        words += [f"and {more} more segments, {said(self.duration, 's')} in all"] if more > 0 else []
        return f"Program: {', '.join(words or ['nothing'])}"

    def _repr_html_(self) -> str:
        rows = [
            (str(number), words, f"until {said(end, 's')}" if end else "")
            for number, (words, end) in enumerate(zip(self._words(), self.corners[1:], strict=False))
        ]
        more = len(self.segments) - _TOLD
        rows += [("...", f"{more} more segments", f"until {said(self.duration, 's')}")] if more > 0 else []
        return table("Program" if rows else "Program: nothing", rows)

    def _words(self) -> list[str]:
        """The first segments."""
        told = self.segments[:_TOLD]
        words = [str(segment) for segment in told]
        for number, (before, segment) in enumerate(pairwise(told), 1):
            if segment.end is None and not segment.amplitude and segment.control == before.control:
                words[number] = f"hold {said(segment.duration, 's')}"  # what else
        return words

    def _then(self, *segments: Segment) -> Program:
        return replace(self, segments=self.segments + segments)

    def _to(self, control: Control, value: Any, over: Any) -> Program:
        """Go to a value of what is controlled, linearly."""
        here = f"program.{len(self.segments)}"
        least = 0.0 if control in PUSHING else None
        end = _said(value, UNITS[control], f"{here}.{control}", least=least, instead=INSTEAD[control])
        return self._then(Segment(control, _said(over, "s", f"{here}.over", least=0), end))

    def __add__(self, other: Program) -> Program:
        """This program followed by another one."""
        return Program(self.segments + other.segments, " ".join(filter(None, (self.note, other.note))))

    def load(self, value: float | str, *, over: float | str) -> Program:
        """Go to a load, linearly.

        Parameters
        ----------
        value : float or str
            Load at the end. [N]
        over : float or str
            How long it takes; zero is a jump. [s]

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If a quantity is negative, not finite or of another kind, in the words of a study file.

        Examples
        --------
        >>> Program().load("1 mN", over="50 ms") == Program().load(1e-3, over=0.05)
        True
        """
        return self._to("load", value, over)

    def pressure(self, value: float | str, *, over: float | str) -> Program:
        """Go to a nominal pressure, linearly: the load over the nominal area of the surface.

        :func:`roughvisc.simulate` takes the whole area of the grid of heights, absent cells included, as it is given.

        Parameters
        ----------
        value : float or str
            Nominal pressure at the end. [Pa]
        over : float or str
            How long it takes; zero is a jump. [s]

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If a quantity is negative, not finite or of another kind, in the words of a study file.

        Examples
        --------
        >>> program = Program().pressure("0.2 MPa", over="50 ms").hold(1.0)
        >>> program.on_area(1e-6).segments[0]
        Segment(control='load', duration=0.05, end=0.2, amplitude=0.0, period=inf)
        """
        return self._to("pressure", value, over)

    def approach(self, value: float | str, *, over: float | str) -> Program:
        """Go to an approach, linearly.

        Parameters
        ----------
        value : float or str
            Approach at the end; negative values lift the profile off. [m]
        over : float or str
            How long it takes; zero is a jump. [s]

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If a quantity is not finite or of another kind, or the time is negative, in the words of a study file.
        """
        return self._to("approach", value, over)

    def hold(self, duration: float | str, control: Control | None = None) -> Program:
        """Keep the load or the approach at the value that it has.

        Parameters
        ----------
        duration : float or str
            How long. [s]
        control : {"load", "approach", "pressure"}, optional
            Which of them; that of the segment before unless given. The other one then follows from the contact: a load,
            then ``hold(..., control="approach")``, is stress relaxation. To hold the nominal pressure is to hold the
            load.

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If the time is negative, not finite or of another kind, in the words of a study file.
        """
        here = f"program.{len(self.segments)}"
        if control is None:
            control = self.segments[-1].control if self.segments else "load"
        kept = _known(control, f"{here}.control")
        return self._then(Segment(kept, _said(duration, "s", f"{here}.hold", least=0)))

    @classmethod
    def table(
        cls, times: Sequence[float | str], values: Sequence[float | str], control: Control = "load", note: str = ""
    ) -> Program:
        """Linear between the rows of a table; two rows at one time are a jump.

        Parameters
        ----------
        times : sequence of float or str
            Ascending from zero; a value other than zero at time zero is a jump. [s]
        values : sequence of float or str
            Load [N], approach [m] or nominal pressure [Pa] at these times.
        control : {"load", "approach", "pressure"}
            Which of them.
        note : str
            Of the program.

        Raises
        ------
        InputError
            If the lengths differ, or the times do not ascend from zero; the offending row is named.
        """
        unit = UNITS[_known(control, "control")]
        if len(times) != len(values) or not len(times):
            raise InputError(f"table has {len(times)} times and {len(values)} values: expected as many, at least one")
        if times[0] != 0 and _said(times[0], "s", "table.times.0"):
            raise InputError(f"table starts at time {times[0]!r} s: expected 0")
        segments = []
        before = 0.0
        for row, (time, value) in enumerate(zip(times, values, strict=True)):
            now, end = _said(time, "s", f"table.times.{row}"), _said(value, unit, f"table.values.{row}")
            if not now >= before:
                raise InputError(f"table row {row}: time {time!r} s after {before!r} s: expected ascending times")
            if row or end:
                segments.append(Segment(control, now - before, end))
            before = now
        return cls(tuple(segments), note)

    @classmethod
    def cycle(
        cls,
        mean: float | str,
        amplitude: float | str,
        period: float | str,
        cycles: float,
        control: Control = "load",
    ) -> Program:
        """A sine wave about a mean, after a jump to that mean.

        To reach the mean otherwise, add: ``Program().load(1.0, over=0.1) + Program.cycle(1.0, 0.5, 2.0, 5)``.

        Parameters
        ----------
        mean, amplitude : float or str
            Of the load [N], the approach [m] or the nominal pressure [Pa].
        period : float or str
            Length of a cycle. [s]
        cycles : float
            How many.
        control : {"load", "approach", "pressure"}
            What oscillates.

        Raises
        ------
        InputError
            If a quantity is of another kind, or load or pressure fall below zero.
        """
        unit, instead = UNITS[_known(control, "control")], INSTEAD[control]
        middle = _said(mean, unit, "cycle.mean", least=0 if control in PUSHING else None, instead=instead)
        height = _said(amplitude, unit, "cycle.amplitude", instead=instead)
        length = _said(period, "s", "cycle.period", above=0)
        duration = length * _said(cycles, "1", "cycle.cycles", above=0)
        return cls((Segment(control, 0.0, middle), Segment(control, duration, middle, height, length)))

    def on_area(self, area: float) -> Program:
        """The program whose nominal pressures are the loads that they are on a surface.

        Parameters
        ----------
        area : float
            Nominal area. [m2]

        Returns
        -------
        Program
            This one where it prescribes no nominal pressure.
        """
        if not self.prescribes_pressure:
            return self
        return replace(self, segments=tuple(segment.on_area(area) for segment in self.segments))

    @property
    def prescribes_pressure(self) -> bool:
        """Whether a nominal pressure is prescribed anywhere."""
        return any(segment.control == "pressure" for segment in self.segments)

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
        """Largest load prescribed anywhere; zero if none is. [N]

        Raises
        ------
        InputError
            If a nominal pressure is prescribed, whose load no one knows without an area.
        """
        if self.prescribes_pressure:
            raise InputError(
                "the program prescribes a nominal pressure: expected loads, as Program.on_area() gives them"
            )
        loads = [(s.end or 0.0) + abs(s.amplitude) for s in self.segments if s.control == "load"]
        return max(loads, default=0.0)
