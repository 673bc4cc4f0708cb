"""Loading programs: chains of segments that prescribe load, nominal pressure or approach over time.

A program states values at corners only. The value that a hold keeps, or from which a ramp starts after a change of
control, follows during the run and is an argument of :meth:`Program.prescribed`. :meth:`Program.on_area`
converts nominal pressures to loads on a known area.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, update_wrapper
from itertools import accumulate, pairwise
from typing import Any, Concatenate, Generic, Literal, ParamSpec, get_args

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.units import Quantity, format_quantity, number

#: Direction of motion of the profile.
Direction = Literal["x", "-x", "y", "-y"]


@dataclass(frozen=True)
class Slide:
    """A stroke of the profile along the surface, at constant speed.

    Parameters
    ----------
    distance : float
        Requested distance; the profile slides by the nearest whole number of cells. [m]
    direction : {"x", "-x", "y", "-y"}
        Direction of motion of the profile.
    """

    distance: float
    direction: Direction = "x"

    @property
    def axis(self) -> int:
        """Axis of the grid along the motion."""
        return 0 if self.direction.endswith("x") else 1

    @property
    def sense(self) -> int:
        """1 if the profile moves towards larger coordinates, else -1."""
        return -1 if self.direction.startswith("-") else 1

    def cells(self, spacing: tuple[float, float]) -> int:
        """Return the number of cells that the profile slides, one per step.

        Parameters
        ----------
        spacing : tuple of float
            Cell sides. [m]

        Raises
        ------
        InputError
            If the distance is less than half a cell.
        """
        side = spacing[self.axis]
        count = math.floor(self.distance / side * (1 + 1e-12) + 0.5)
        if count < 1:
            least = f"at least half a cell of {format_quantity(side, 'm')}, or a finer grid"
            raise InputError(key="slide", found=self.distance, expected=least)
        return count


def instant(began: float, end: float, taken: int, cells: int) -> float:
    """Return the time at which a slide has taken a number of cells. [s]

    Parameters
    ----------
    began, end : float
        Start and end of the slide. [s]
    taken, cells : int
        Number of cells taken, and of the whole slide.
    """
    return end if taken >= cells else began + (end - began) * (taken / cells)


Control = Literal["load", "approach", "pressure"]
#: Controlled quantity -> its unit.
UNITS: dict[str, str] = {"load": "N", "approach": "m", "pressure": "Pa"}
#: Least value of the quantities that are negative only in contact with adhesion.
LEAST = {"load": 0.0, "pressure": 0.0}


@dataclass(frozen=True)
class Segment:
    """One piece of a program.

    Parameters
    ----------
    control : {"load", "approach", "pressure"}
        Prescribed quantity; the pressure is the nominal one.
    duration : float
        Length of the segment; zero is a jump. [s]
    end : float or None
        Value at the end, reached linearly; None keeps the value found at the start. [N, m or Pa]
    amplitude, period : float
        Amplitude and period of a sine wave about ``end``, which must also be the value at the start. [N, m or Pa], [s]
    slide : Slide or None
        Motion of the profile along the surface, during which the controlled quantity keeps its value.
    """

    control: Control
    duration: float
    end: float | None = None
    amplitude: float = 0.0
    period: float = math.inf
    slide: Slide | None = None

    def __str__(self) -> str:
        """Return the segment in words, such as ``load to 2 N over 50 ms``."""
        lasting = format_quantity(self.duration, "s")
        unit = UNITS[self.control]
        named = "nominal pressure" if self.control == "pressure" else self.control
        if self.amplitude:
            wave = f"{format_quantity(self.end or 0.0, unit)} ± {format_quantity(self.amplitude, unit)}"
            return f"{named} {wave} in {self.duration / self.period:g} cycles of {format_quantity(self.period, 's')}"
        if self.slide is not None:
            way = f"slide {format_quantity(self.slide.distance, 'm')} along {self.slide.direction}"
            return f"{way} over {lasting} at {format_quantity(self.slide.distance / self.duration, 'm/s')}"
        if self.end is None:
            return f"hold {named} {lasting}"
        reached = f"{named} to {format_quantity(self.end, unit)}"
        return f"{reached} over {lasting}" if self.duration else f"{reached} at once"

    @property
    def holds(self) -> bool:
        """Whether the controlled quantity and the position of the profile are constant."""
        return self.end is None and not self.amplitude and self.slide is None

    def turns(self, after: float, before: float) -> list[float]:
        """Return the turning points of a cycle strictly between two times since its start. [s]"""
        quarter = self.period / 4  # infinite without a cycle
        first, last = (math.floor(time / quarter) for time in (after, before))
        return [n * quarter for n in range(first, last + 1) if n % 2 and after < n * quarter < before]

    def highest(self, start: float) -> float:
        """Return the largest prescribed value of the segment; ``start`` is the value at the start. [N or m]"""
        return max(start, start if self.end is None else self.end) + abs(self.amplitude)


# Segments that the text of a program lists.
_LISTED = 8

_Arguments = ParamSpec("_Arguments")


class _Continuing(Generic[_Arguments]):
    """Decorator of a method that adds to a program; on the class it adds to the empty program.

    A class method would also be found on a chained program, which it would drop.
    """

    def __init__(self, method: Callable[Concatenate[Program, _Arguments], Program]) -> None:
        update_wrapper(self, method)  # type: ignore[arg-type]  # copies name and docstring, and is not called
        self._method = method

    def __get__(self, program: Program | None, owner: type[Program]) -> Callable[_Arguments, Program]:
        """Return the method bound to a program, or to an empty one."""
        return self._method.__get__(owner() if program is None else program)


@dataclass(frozen=True)
class Program:
    """A loading program: segments in order, from rest at time zero.

    Programs are built by chained calls; every call returns a longer program. ``over=0`` is a jump. Quantities are
    numbers in SI, or strings with a unit.

    Parameters
    ----------
    segments : tuple of Segment
        Segments in order; default: none.
    note : str
        Origin of the program, for example the conversion of a measured history.

    Raises
    ------
    InputError
        If a segment is invalid; the key of the error is the method.

    See Also
    --------
    roughvisc.read_program, roughvisc.simulate, roughvisc.SteadySliding

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
        return f"Program: {self.in_words(_LISTED)}"

    def in_words(self, listed: int) -> str:
        """Return the first segments in words, and the number of others.

        Parameters
        ----------
        listed : int
            Largest number of segments in words.
        """
        words = [str(segment) for segment in self.segments[:listed]]
        for place, (before, segment) in enumerate(pairwise(self.segments[:listed]), 1):
            if segment.holds and segment.control == before.control:
                words[place] = f"hold {format_quantity(segment.duration, 's')}"
        more = len(self.segments) - listed
        if more > 0:
            words.append(f"and {more} more segments, {format_quantity(self.duration, 's')} in all")
        return ", ".join(words) or "nothing"

    def _to(self, control: Control, value: Any, over: Any) -> Program:
        """Ramp linearly to a value of a controlled quantity."""
        end = number(value, UNITS[control], control)
        return self + Program((Segment(control, number(over, "s", "over", least=0), end),))

    def __add__(self, other: Program) -> Program:
        """Return this program followed by another one, whose first ramp begins at the last value of this program."""
        return Program(self.segments + other.segments, " ".join(filter(None, (self.note, other.note))))

    def load(self, value: float | str, *, over: float | str) -> Program:
        """Ramp linearly to a load.

        Parameters
        ----------
        value : float or str
            Load at the end; negative only with adhesion. [N]
        over : float or str
            Duration of the ramp; zero is a jump. [s]

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If a quantity is not finite or of another kind, or the time is negative, in the words of a study file.

        Examples
        --------
        >>> Program().load("1 mN", over="50 ms") == Program().load(1e-3, over=0.05)
        True
        """
        return self._to("load", value, over)

    def pressure(self, value: float | str, *, over: float | str) -> Program:
        """Ramp linearly to a nominal pressure, the load over the nominal area of the surface.

        :func:`roughvisc.simulate` uses the whole area of the given grid, absent cells included.

        Parameters
        ----------
        value : float or str
            Nominal pressure at the end; negative only with adhesion. [Pa]
        over : float or str
            Duration of the ramp; zero is a jump. [s]

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If a quantity is not finite or of another kind, or the time is negative, in the words of a study file.

        Examples
        --------
        >>> program = Program().pressure("0.2 MPa", over="50 ms").hold(1.0)
        >>> program.on_area(1e-6).segments[0]
        Segment(control='load', duration=0.05, end=0.2, amplitude=0.0, period=inf, slide=None)
        """
        return self._to("pressure", value, over)

    def approach(self, value: float | str, *, over: float | str) -> Program:
        """Ramp linearly to an approach.

        Parameters
        ----------
        value : float or str
            Approach at the end; negative values lift the profile off. [m]
        over : float or str
            Duration of the ramp; zero is a jump. [s]

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
        """Hold the load or the approach at its current value.

        Parameters
        ----------
        duration : float or str
            Duration of the hold. [s]
        control : {"load", "approach", "pressure"}, optional
            Quantity to hold. Default: the quantity of the previous segment. The other quantity follows from the
            contact: a load, then ``hold(..., control="approach")``, is stress relaxation. Holding the nominal pressure
            is the same as holding the load.

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If the time is negative, not finite or of another kind, in the words of a study file.
        """
        if control is None:
            control = self.segments[-1].control if self.segments else "load"
        kept = one_of("control", control, UNITS)
        return self + Program((Segment(kept, number(duration, "s", "hold", least=0)),))

    def slide(
        self,
        distance: float | str,
        *,
        speed: float | str | None = None,
        over: float | str | None = None,
        direction: Direction = "x",
    ) -> Program:
        """Slide the profile along the surface at constant speed; the controlled quantity keeps its value.

        Parameters
        ----------
        distance : float or str
            Sliding distance, rounded to whole cells; the profile moves by one cell per time step. [m]
        speed, over : float or str
            Speed [m/s] or duration [s]; give exactly one.
        direction : {"x", "-x", "y", "-y"}
            Direction of motion of the profile.

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
        far = number(distance, "m", "slide", above=0)
        if (speed is None) == (over is None):
            raise InputError(key="speed", found=speed, expected=f"either this or over, which is {over!r}")
        one_of("direction", direction, get_args(Direction))
        if speed is not None:
            over = far / number(speed, "m/s", "speed", above=0)
        lasting = number(over, "s", "over", above=0)
        control = self.segments[-1].control if self.segments else "load"
        return self + Program((Segment(control, lasting, slide=Slide(far, direction)),))

    @_Continuing
    def table(
        self, times: Sequence[float | str], values: Sequence[float | str], control: Control = "load", note: str = ""
    ) -> Program:
        """Interpolate linearly between the rows of a table; two rows at the same time are a jump.

        ``Program.table(...)`` is a program of the table alone. On a program, the table continues it.

        Parameters
        ----------
        times : sequence of float or str
            Times since the end of the program so far, in increasing order from zero. [s]
        values : sequence of float or str
            Load [N], approach [m] or nominal pressure [Pa] at these times. If the first value differs from the end of
            the program so far, it is reached by a jump.
        control : {"load", "approach", "pressure"}
            Quantity of the values.
        note : str
            Note of the program.

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If the lengths differ, or the times do not increase from zero; the message names the row.

        Examples
        --------
        >>> Program().load(2.0, over=1.0).table([0, 1], [0.5, 1.0])
        Program: load to 2 N over 1 s, load to 500 mN at once, load to 1 N over 1 s
        """
        unit = UNITS[one_of("control", control, UNITS)]
        for key, column, si in (("times", times, "s"), ("values", values, unit)):
            if isinstance(column, str | bytes | Mapping) or not hasattr(column, "__len__"):
                raise InputError(key=key, found=column, expected=f"a list [{si}]")
        if len(times) != len(values) or not len(times):
            expected = f"as many values as times, {len(times)}, at least one"
            raise InputError(key="values", found=len(values), expected=expected)
        instants = [number(time, "s", f"times.{row}") for row, time in enumerate(times)]
        ends = [number(value, unit, f"values.{row}") for row, value in enumerate(values)]
        if instants[0] != 0:
            raise InputError(key="times.0", found=times[0], expected="zero")
        segments = []
        for row, (before, now) in enumerate(pairwise([0.0, *instants])):
            if now < before:
                raise InputError(key=f"times.{row}", found=times[row], expected=f"at least {before!r} s")
            segments.append(Segment(control, now - before, ends[row]))
        last = self.segments[-1] if self.segments else Segment(control, 0.0, 0.0)  # a program begins at zero
        if ends[0] == 0 and (last.control, last.end) == (control, 0.0):
            del segments[0]  # no jump
        return self + Program(tuple(segments), note)

    @_Continuing
    def cycle(
        self, mean: float | str, amplitude: float | str, period: float | str, cycles: float, control: Control = "load"
    ) -> Program:
        """Apply a sine wave about a mean, after a jump to the mean.

        ``Program.cycle(...)`` is a program of the wave alone. On a program, the wave continues it; ramp to the mean
        first to avoid the jump.

        Parameters
        ----------
        mean, amplitude : float or str
            Mean and amplitude of the load [N], the approach [m] or the nominal pressure [Pa].
        period : float or str
            Length of a cycle. [s]
        cycles : float
            Number of cycles.
        control : {"load", "approach", "pressure"}
            The oscillating quantity.

        Returns
        -------
        Program

        Raises
        ------
        InputError
            If a quantity has a wrong type or unit.

        Examples
        --------
        >>> Program().load(1.0, over=0.1).cycle(mean=1.0, amplitude=0.5, period=2.0, cycles=5).duration
        10.1
        """
        unit = UNITS[one_of("control", control, UNITS)]
        middle = number(mean, unit, "mean")
        height = number(amplitude, unit, "amplitude")
        length = number(period, "s", "period", above=0)
        duration = number(length * number(cycles, "1", "cycles", above=0, most=1e6), "s", "cycles")
        return self + Program((Segment(control, 0.0, middle), Segment(control, duration, middle, height, length)))

    def on_area(self, area: Quantity) -> Program:
        """Convert nominal pressures to loads on a surface.

        Parameters
        ----------
        area : float or str
            Nominal area. [m2]

        Returns
        -------
        Program
            The same program if it prescribes no nominal pressure.
        """
        size = number(area, "m^2", "area", above=0)
        segments = []
        for segment in self.segments:
            if segment.control == "pressure":
                end = None if segment.end is None else float(f"{segment.end * size:.15g}")
                segment = replace(segment, control="load", end=end, amplitude=float(f"{segment.amplitude * size:.15g}"))
            segments.append(segment)
        return self if tuple(segments) == self.segments else replace(self, segments=tuple(segments))

    @cached_property
    def lowest_load(self) -> float:
        """Lowest load [N] or nominal pressure [Pa] prescribed anywhere, at most zero."""
        return min(
            [
                0.0,
                *(
                    (segment.end or 0.0) - abs(segment.amplitude)
                    for segment in self.segments
                    if segment.control in LEAST
                ),
            ]
        )

    @cached_property
    def slides(self) -> bool:
        """Whether the profile slides anywhere."""
        return any(segment.slide is not None for segment in self.segments)

    @cached_property
    def cycles(self) -> list[tuple[float, float, int]]:
        """Start [s], period [s] and number of whole cycles of each segment that oscillates."""
        cycles = []
        for start, segment in zip(self.corners, self.segments, strict=False):
            if segment.amplitude:
                cycles.append((start, segment.period, math.floor(segment.duration / segment.period * (1 + 1e-9))))
        return cycles

    def prescribed(self, number: int, time: float, start: float) -> float:
        """Return the prescribed value of segment `number` at a time [s].

        Parameters
        ----------
        number : int
            Index of the segment.
        time : float
            Time since the start of the program. [s]
        start : float
            Value at the start of the segment. [N or m]
        """
        segment = self.segments[number]
        elapsed = time - self.corners[number]
        end = start if segment.end is None else segment.end
        if segment.amplitude:
            return end + segment.amplitude * math.sin(2 * math.pi * elapsed / segment.period)
        if elapsed >= segment.duration * (1 - 1e-12):  # times are sums of durations, rounded
            return end
        return start + (end - start) * (elapsed / segment.duration)

    @cached_property
    def prescribes(self) -> list[bool]:
        """Whether the program prescribes the value of each segment; a hold may keep a computed value instead."""
        flags = list[bool]()
        control = self.segments[0].control if self.segments else "load"
        for segment in self.segments:
            is_prescribed = segment.end is not None or (segment.control == control and (not flags or flags[-1]))
            control = segment.control
            flags.append(is_prescribed)
        return flags

    @cached_property
    def starts(self) -> list[float]:
        """Value at the start of each segment, in N or m; NaN if the solution determines it."""
        values = list[float]()
        control = self.segments[0].control if self.segments else "load"
        reached = 0.0
        for index, segment in enumerate(self.segments):
            values.append(reached if segment.control == control else math.nan)
            control = segment.control
            reached = self.prescribed(index, self.corners[index + 1], values[-1])
        return values

    def known(self, time: float) -> tuple[Control, float]:
        """Return the control at a time [s], and the prescribed value [N or m]; NaN if the solution determines it."""
        index = min(bisect_left(self.corners, time, 1), len(self.segments)) - 1
        return self.segments[index].control, self.prescribed(index, time, self.starts[index])

    @cached_property
    def duration(self) -> float:
        """Length of the program. [s]"""
        return self.corners[-1]

    @cached_property
    def corners(self) -> list[float]:
        """Start of the program and end of each segment. [s]"""
        return list(accumulate((segment.duration for segment in self.segments), initial=0.0))

    @cached_property
    def largest_load(self) -> float:
        """Largest load prescribed anywhere; zero if none is. A nominal pressure has no load without an area. [N]"""
        return max(
            [
                0.0,
                *(
                    (segment.end or 0.0) + abs(segment.amplitude)
                    for segment in self.segments
                    if segment.control == "load"
                ),
            ]
        )

    @cached_property
    def time_scale(self) -> float:
        """Shortest time in which a controlled quantity changes by its largest value; infinite without a change. [s]

        A jump counts as long as the segment after it: it represents a change that is fast for the material, but slow
        for elastic waves. A ramp from a computed value counts from zero.
        """
        sizes = dict.fromkeys(UNITS, 0.0)
        before = dict.fromkeys(UNITS, 0.0)
        for segment in self.segments:
            sizes[segment.control] = max(sizes[segment.control], abs(segment.end or 0.0) + abs(segment.amplitude))
        scales = [math.inf]
        jumped = False
        for segment in self.segments:
            end = before[segment.control] if segment.end is None else segment.end
            change = abs(end - before[segment.control])
            before[segment.control] = end
            if segment.duration > 0:
                rate = change / segment.duration + 2 * math.pi * abs(segment.amplitude) / segment.period
                scales += [sizes[segment.control] / rate] if rate > 0 else []
                scales += [segment.duration] if jumped else []
            jumped = segment.duration == 0 and (jumped or change > 0)
        return min(scales)
