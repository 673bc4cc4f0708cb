"""Loading programs: chains of segments that prescribe load, nominal pressure or approach over time.

A program knows values at corners only. What a hold keeps, or where a ramp starts after a change of control, is
found during the run and handed to :meth:`Segment.value`. A nominal pressure becomes a load where the surface is
known: see :meth:`Program.on_area`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.segment import PUSHING, UNITS, Control, Segment
from roughvisc.mechanics.stepping.slide import Direction, Slide
from roughvisc.mechanics.stepping.words import INSTEAD, TOLD, known_control, known_direction, told
from roughvisc.notebook import table
from roughvisc.units import said, stated_quantity


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
        words, more = told(self.segments), len(self.segments) - TOLD
        words += [f"and {more} more segments, {said(self.duration, 's')} in all"] if more > 0 else []
        return f"Program: {', '.join(words or ['nothing'])}"

    def _repr_html_(self) -> str:
        rows = [
            (str(number), words, f"until {said(end, 's')}" if end else "")
            for number, (words, end) in enumerate(zip(told(self.segments), self.corners[1:], strict=False))
        ]
        more = len(self.segments) - TOLD
        rows += [("...", f"{more} more segments", f"until {said(self.duration, 's')}")] if more > 0 else []
        return table("Program" if rows else "Program: nothing", rows)

    def _then(self, *segments: Segment) -> Program:
        return replace(self, segments=self.segments + segments)

    def _to(self, control: Control, value: Any, over: Any) -> Program:
        """Go to a value of what is controlled, linearly."""
        here = f"program.{len(self.segments)}"
        least = 0.0 if control in PUSHING else None
        end = stated_quantity(value, UNITS[control], f"{here}.{control}", least=least, instead=INSTEAD[control])
        return self._then(Segment(control, stated_quantity(over, "s", f"{here}.over", least=0), end))

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

        :func:`roughvisc.simulate` takes the whole area of the grid of heights, absent cells included, as it is given;
        of a tapered surface the integral of the taper's weight.

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
        Segment(control='load', duration=0.05, end=0.2, amplitude=0.0, period=inf, slide=None)
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
        kept = known_control(control, f"{here}.control")
        return self._then(Segment(kept, stated_quantity(duration, "s", f"{here}.hold", least=0)))

    def slide(
        self,
        distance: float | str,
        *,
        speed: float | str | None = None,
        over: float | str | None = None,
        direction: Direction = "x",
    ) -> Program:
        """Slide the profile along the surface at constant speed; what is controlled keeps the value that it has.

        Parameters
        ----------
        distance : float or str
            How far; the profile moves by whole cells of its grid, one a time step, to the nearest one. [m]
        speed, over : float or str
            Speed [m/s], or how long it takes [s]: one of them.
        direction : {"x", "-x", "y", "-y"}
            In which the profile moves.

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If a quantity is not positive, not finite or of another kind, in the words of a study file.

        Examples
        --------
        >>> press = Program().load(2.0, over=0.05)
        >>> press.slide("2 mm", speed="1 mm/s").hold(1.0).slide("2 mm", over=2.0, direction="-x")
        Program: load to 2 N over 50 ms, slide 2 mm along x over 2 s at 1 mm/s, hold 1 s, slide 2 mm along -x over 2 s at 1 mm/s
        """  # noqa: E501 - one line of output
        here = f"program.{len(self.segments)}"
        far = stated_quantity(distance, "m", f"{here}.slide", above=0)
        if (speed is None) == (over is None):
            raise InputError(f"{here}: speed is {speed!r} and over is {over!r}: expected one of them")
        if speed is None:
            lasting = stated_quantity(over, "s", f"{here}.over", above=0)
        else:
            lasting = far / stated_quantity(speed, "m/s", f"{here}.speed", above=0)
        control = self.segments[-1].control if self.segments else "load"
        return self._then(Segment(control, lasting, slide=Slide(far, known_direction(direction, f"{here}.direction"))))

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
        unit = UNITS[known_control(control, "control")]
        if len(times) != len(values) or not len(times):
            raise InputError(f"table has {len(times)} times and {len(values)} values: expected as many, at least one")
        if times[0] != 0 and stated_quantity(times[0], "s", "table.times.0"):
            raise InputError(f"table starts at time {times[0]!r} s: expected 0")
        segments = []
        before = 0.0
        for row, (time, value) in enumerate(zip(times, values, strict=True)):
            now, end = (
                stated_quantity(time, "s", f"table.times.{row}"),
                stated_quantity(value, unit, f"table.values.{row}"),
            )
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
        unit, instead = UNITS[known_control(control, "control")], INSTEAD[control]
        middle = stated_quantity(mean, unit, "cycle.mean", least=0 if control in PUSHING else None, instead=instead)
        height = stated_quantity(amplitude, unit, "cycle.amplitude", instead=instead)
        length = stated_quantity(period, "s", "cycle.period", above=0)
        duration = length * stated_quantity(cycles, "1", "cycle.cycles", above=0)
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

    @cached_property
    def slides(self) -> bool:
        """Whether the profile slides anywhere."""
        return any(segment.slide is not None for segment in self.segments)

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

    @property
    def time_scale(self) -> float:
        """Shortest time in which what is prescribed changes by its largest value; infinite if nothing does. [s]

        A jump counts as long as what follows it: it stands for a change that is fast for the material, and slow for
        waves. Where a ramp starts from a value that is found, it counts from zero.
        """
        sizes: dict[str, float] = {}
        for one in self.segments:
            sizes[one.control] = max(sizes.get(one.control, 0.0), abs(one.end or 0.0) + abs(one.amplitude))
        scales, before, jumped = [np.inf], {"load": 0.0, "pressure": 0.0, "approach": 0.0}, False
        for one in self.segments:
            change = 0.0 if one.end is None else abs(one.end - before[one.control])
            before[one.control] = before[one.control] if one.end is None else one.end
            if one.duration == 0:
                jumped = jumped or change > 0
                continue
            rate = change / one.duration + 2 * np.pi * abs(one.amplitude) / one.period
            scales += [sizes[one.control] / rate] if rate > 0 else []
            scales += [one.duration] if jumped else []
            jumped = False
        return float(min(scales))
