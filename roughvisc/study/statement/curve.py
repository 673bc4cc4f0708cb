"""Curves of friction: which speeds, under which load, in which direction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.slide import Direction
from roughvisc.units import unit_for

DIRECTIONS: tuple[str, ...] = get_args(Direction)


@dataclass(frozen=True, kw_only=True)
class SteadySliding:
    """What is asked of steady sliding, beside a surface, a material and settings; see :func:`roughvisc.friction`.

    Parameters
    ----------
    speeds, load, pressure, direction, last_octave
        As :func:`roughvisc.friction` has them; the speeds become a tuple.

    Raises
    ------
    InputError
        If a value is none of those expected.

    Examples
    --------
    >>> SteadySliding(speeds=[1e-3, 1.0], load=2.0)
    Steady sliding: 2 speeds from 1 mm/s to 1 m/s along x, under 2 N
    """

    speeds: Sequence[float] | float
    load: float | None = None
    pressure: float | None = None
    direction: Direction = "x"
    last_octave: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "speeds", _speeds(self.speeds))
        if self.direction not in DIRECTIONS:
            raise InputError(f"direction is {self.direction!r}: expected {' or '.join(map(repr, DIRECTIONS))}")
        if (self.load is None) == (self.pressure is None):
            raise InputError(f"load is {self.load!r} and pressure is {self.pressure!r}: expected one of them")
        for name, value, unit in (("load", self.load, "N"), ("pressure", self.pressure, "Pa")):
            if value is not None and not (isinstance(value, int | float) and 0 < value < math.inf):
                raise InputError(f"{name} is {value!r}: expected a positive number [{unit}]")

    def __repr__(self) -> str:
        ends = list(dict.fromkeys(unit_for([one], "m/s").text(one) for one in (min(self.asked), max(self.asked))))
        count = f"{len(self.asked)} speeds from " if len(self.asked) > 1 else ""
        pressed = (self.load, "N") if self.load is not None else (self.pressure, "Pa")
        under = unit_for([pressed[0] or 0.0], pressed[1]).text(pressed[0] or 0.0)
        return f"Steady sliding: {count}{' to '.join(ends)} along {self.direction}, under {under}"

    @property
    def asked(self) -> tuple[float, ...]:
        """The speeds, in the order given. [m/s]"""
        assert isinstance(self.speeds, tuple)
        return self.speeds

    def at(self, done: float, count: float) -> str:
        """How far a run has come that has done so many speeds, as one reads it."""
        return f"speed {done:.0f} of {count:.0f}"

    def force(self, area: float) -> float:
        """Load on a surface of an area [m2]. [N]"""
        return float(self.load) if self.load is not None else float(self.pressure or 0.0) * area


def _speeds(speeds: Any) -> tuple[float, ...]:
    try:
        found = np.atleast_1d(np.asarray(speeds, dtype=float))
    except (TypeError, ValueError):
        found = np.array([])
    if found.ndim != 1 or not found.size or not (np.isfinite(found) & (found > 0)).all():
        raise InputError(f"speeds is {speeds!r}: expected positive numbers [m/s]")
    return tuple(found.tolist())
