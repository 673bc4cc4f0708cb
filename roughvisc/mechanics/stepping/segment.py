"""One segment of a loading program: what it prescribes over its length."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.slide import Slide
from roughvisc.units import said, shown

Control = Literal["load", "approach", "pressure"]
#: what may be prescribed -> its unit
UNITS: dict[str, str] = {"load": "N", "approach": "m", "pressure": "Pa"}
#: what contact without adhesion cannot carry below zero
PUSHING = ("load", "pressure")
#: in words
CONTROLS = "'load', 'approach' or 'pressure'"


@dataclass(frozen=True)
class Segment:
    """One piece of a program.

    Parameters
    ----------
    control : {"load", "approach", "pressure"}
        What is prescribed; the pressure is a nominal one.
    duration : float
        Length of the segment; zero is a jump. [s]
    end : float or None
        Value at the end, reached linearly; None keeps the value found at the start. [N, m or Pa]
    amplitude, period : float
        A sine wave about the value ``end``, which must also be the value at the start. [N, m or Pa], [s]
    slide : Slide or None
        How the profile moves along the surface meanwhile, while what is controlled keeps its value.
    """

    control: Control
    duration: float
    end: float | None = None
    amplitude: float = 0.0
    period: float = math.inf
    slide: Slide | None = None

    def __post_init__(self) -> None:
        if self.control not in UNITS:
            raise InputError(f"control: found {shown(self.control)}: expected {CONTROLS}")
        if not (math.isfinite(self.duration) and self.duration >= 0):
            raise InputError(f"duration of a {self.control} segment is {self.duration!r}: expected a number >= 0 [s]")
        if self.end is not None and not math.isfinite(self.end):
            raise InputError(f"{self.control} is {self.end!r}: expected a finite number [{UNITS[self.control]}]")
        lowest = (self.end or 0.0) - abs(self.amplitude)
        if self.control in PUSHING and lowest < 0:
            reached = f"{self.control} reaches {lowest!r} {UNITS[self.control]}"
            raise InputError(f"{reached}: expected no negative {self.control}, contact here has no adhesion")
        if self.amplitude and not (self.period > 0 and math.isfinite(self.period)):
            raise InputError(f"period of a cycle is {self.period!r}: expected a positive number [s]")
        if self.slide is not None and (self.end is not None or self.amplitude or self.duration == 0):
            raise InputError("a slide takes time and keeps what is controlled: expected no end, no wave, duration > 0")

    def __str__(self) -> str:
        """In words, such as ``load to 2 N over 50 ms``."""
        lasting, unit = said(self.duration, "s"), UNITS[self.control]
        named = "nominal pressure" if self.control == "pressure" else self.control
        if self.amplitude:
            wave = f"{said(self.end or 0.0, unit)} ± {said(self.amplitude, unit)}"
            return f"{named} {wave} in {self.duration / self.period:g} cycles of {said(self.period, 's')}"
        if self.slide is not None:
            way = f"slide {said(self.slide.distance, 'm')} along {self.slide.direction}"
            return f"{way} over {lasting} at {said(self.slide.distance / self.duration, 'm/s')}"
        if self.end is None:
            return f"hold {named} {lasting}"
        reached = f"{named} to {said(self.end, unit)}"
        return f"{reached} over {lasting}" if self.duration else f"{reached} at once"

    @property
    def holds(self) -> bool:
        """Whether nothing moves: what is controlled keeps its value, and the profile its place."""
        return self.end is None and not self.amplitude and self.slide is None

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

    def on_area(self, area: float) -> Segment:
        """A segment of nominal pressure as one of load on an area [m2]; any other as it is."""
        if self.control != "pressure":
            return self
        end = None if self.end is None else float(f"{self.end * area:.15g}")
        return replace(self, control="load", end=end, amplitude=float(f"{self.amplitude * area:.15g}"))
