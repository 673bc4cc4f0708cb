"""Steady sliding: a surface that slides at given speeds gives rows over speed."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, ClassVar, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.experiment.notes import (
    border_note,
    contact_stands_alone,
    creep_left,
    slope_note,
    speeds_note,
    surface_stands_alone,
    table_note,
    wake_note,
)
from roughvisc.experiment.profile import Profile
from roughvisc.experiment.protocol import Experiment, Row, Rows
from roughvisc.experiment.resources import curve_bytes, require_memory
from roughvisc.experiment.sliding_grid import AxisTransform, CoarserFaces, SlidingGrid, areas, on_rows
from roughvisc.labels import warnings_text
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.grid import Boundary
from roughvisc.mechanics.program import Direction
from roughvisc.mechanics.sliding.steady import SteadyState
from roughvisc.problem import Problem
from roughvisc.recorder import RowStore
from roughvisc.settings import Settings
from roughvisc.topography.framing import mirror
from roughvisc.units import unit_for
from roughvisc.variables import STATUS_MEANINGS

log = logging.getLogger("roughvisc")

Array = NDArray[np.float64]

#: Speeds of a plan's coarse curves: of more, evenly spread ones.
_FEW = 7

#: What a row states of a speed whose contact is not solved; the rest is missing.
_OF_UNSOLVED = ("force", "nominal_pressure", "pressure_residual", "friction_residual", "iterations", "status")
#: Fields that a row may have.
_FIELDS = ("pressure", "gap")

DIRECTIONS: tuple[str, ...] = get_args(Direction)


@dataclass(frozen=True, kw_only=True)
class SteadySliding(Experiment):
    """What is asked of steady sliding, beside a surface, a material and settings; see :func:`roughvisc.friction`.

    Parameters
    ----------
    speeds, load, pressure, direction
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

    axis: ClassVar[str] = "speed"
    table: ClassVar[str] = "friction"
    called: ClassVar[str] = "steady sliding"
    doing: ClassVar[str] = "sliding"
    boundary: ClassVar[Boundary] = "periodic"
    states_grid_error: ClassVar[bool] = True
    #: Measured at 256 and 1024 squared.
    convolution_cost: ClassVar[float] = 2.1

    def __post_init__(self) -> None:
        object.__setattr__(self, "speeds", _speeds(self.speeds))
        if self.direction not in DIRECTIONS:
            raise InputError(key="direction", found=self.direction, expected=" or ".join(map(repr, DIRECTIONS)))
        if (self.load is None) == (self.pressure is None):
            raise InputError(key="load", found=self.load, expected=f"either this or the pressure ({self.pressure!r})")
        for name, value, unit in (("load", self.load, "N"), ("pressure", self.pressure, "Pa")):
            if value is not None and not (isinstance(value, int | float) and 0 < value < math.inf):
                raise InputError(key=name, found=value, expected=f"a positive number [{unit}]")

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

    def rows(self, problem: Problem, state: int | None = None, *, in_memory: bool = True) -> SlidingRows:
        """The steady state at each speed, from the lowest to the highest; the state counts those that are found."""
        return SlidingRows(problem, self, state or 0)

    def unsupported(self, settings: Settings) -> Iterator[tuple[str, Any, str]]:
        """What has no meaning where a whole surface slides, repeats without end, and never started."""
        if settings.boundary not in ("periodic", "mirror"):
            yield "boundary", settings.boundary, "steady sliding repeats: expected 'periodic' or 'mirror'"
        if settings.boundary == "mirror" and self.load is not None:
            yield (
                "boundary",
                "mirror",
                "the surface is unfolded to four times its area: expected a pressure",
            )
        if "displacement" in settings.fields:
            yield "fields", "displacement", f"of steady sliding expected some of {', '.join(_FIELDS)}"
        if settings.missing != "refuse":
            yield "missing", settings.missing, "a surface that slides has no holes: expected fill = true"
        yield from super().unsupported(settings)

    def prepared(self, problem: Problem) -> Problem:
        """Return the problem on the unfolded surface under the mirror boundary: sliding breaks the symmetry."""
        if problem.settings.boundary != "mirror":
            return problem
        log.info("the surface is unfolded: it slides with its mirror images, on four times as many cells")
        return problem.on(mirror(problem.height), boundary="periodic")

    def content(self) -> Any:
        """What differs from the defaults."""
        found = {one.name: getattr(self, one.name) for one in fields(self) if getattr(self, one.name) != one.default}
        return found | {"speeds": list(self.asked)}

    def progress(self, done: float, end: float) -> str:
        """The number of speeds that are found."""
        return f"speed {done:.0f} of {end:.0f}"

    def creep_time(self, size: float) -> float:
        """Of the longest wave, at the lowest speed. [s]"""
        return size / min(self.asked)

    @property
    def largest_speed(self) -> float:
        """The largest of the speeds. [m/s]"""
        return max(self.asked)

    def cheaper(self) -> tuple[SteadySliding, int, float]:
        """Some of the speeds, evenly spread."""
        order = np.argsort(self.asked)
        few = order[np.unique(np.linspace(0, len(order) - 1, min(_FEW, len(order))).astype(int))]
        few_speeds = replace(self, speeds=[self.asked[number] for number in few])
        return few_speeds, len(order), 1.0

    def force(self, area: float) -> float:
        """Load on a surface of an area [m2]. [N]"""
        return float(self.load) if self.load is not None else float(self.pressure or 0.0) * area


def _speeds(speeds: Any) -> tuple[float, ...]:
    try:
        found = np.atleast_1d(np.asarray(speeds, dtype=float))
    except (TypeError, ValueError):
        found = np.array([])
    if found.ndim != 1 or not found.size or not (np.isfinite(found) & (found > 0)).all():
        raise InputError(key="speeds", found=speeds, expected="positive numbers [m/s]")
    return tuple(found.tolist())


class SlidingRows(Rows):
    """Steady states of one curve, from the lowest speed to the highest.

    Parameters
    ----------
    problem : Problem
        Surface, body and settings.
    curve : SteadySliding
        What is asked.
    found : int
        Speeds that are found already, the lowest ones.
    """

    def __init__(self, problem: Problem, curve: SteadySliding, found: int = 0) -> None:
        self._body, self._curve, self._settings, self._done = problem.body, curve, problem.settings, found
        self._profile = Profile(problem.height, "refuse")
        shape = (self._profile.gap.shape[0], self._profile.gap.shape[1])
        require_memory(shape, partial(curve_bytes, problem.settings))
        if not self._profile.present.all():  # of a punch, which says so itself
            raise InputError("height is missing at some points: expected none, because the surface repeats")
        super().__init__(self._profile.height, (), float(len(curve.asked)), self._profile.highest)
        self._turn = AxisTransform.of(curve.direction)
        self._force = curve.force(self._profile.nominal_area)
        self._face = SlidingGrid.of(self._profile, self._turn)
        self._alone = surface_stands_alone(self._profile.height)
        #: Part of the creep that is left where the next contact comes, by the speed.
        self._creep_left: dict[float, float] = {}
        self._coarser = CoarserFaces(self._face) if problem.settings.grid_error else None

    def __iter__(self) -> Iterator[Row]:
        """Slide at each speed."""
        for done, number in enumerate(np.argsort(self._curve.asked)[self._done :], self._done + 1):
            yield self._at(int(number), done)

    def _at(self, number: int, done: int) -> Row:
        """Slide at the speed of that number; so many are then done."""
        speed, tolerance = self._curve.asked[number], self._settings.tolerance
        # once a speed: a table takes a fit
        law = self._body.over_frequencies(speed * self._face.waves, 0.1 * tolerance)
        sliding = self._face.sliding(speed, law)
        found = self._face.slide(sliding, self._force, tolerance)
        row, fields = self._row(found)
        row["friction_force_across"] = sliding.force_across(on_rows(found.pressure, sliding))
        if self._coarser is not None:
            row |= self._coarser.errors(found, speed, law, self._force, tolerance)
        if not found.converged:
            row = {name: value if name in _OF_UNSOLVED else math.nan for name, value in row.items()}
            fields = {name: np.full_like(field, math.nan) for name, field in fields.items()}
        row["convolutions"] = sliding.convolutions
        facts = {"number": number, "creep_left": self._creep(found, speed, law) if found.converged else 0.0}
        return Row(speed, row, fields, state=done, facts=facts, done=float(done))

    def _row(self, found: SteadyState) -> tuple[dict[str, Any], dict[str, Array]]:
        """Numbers and fields of a state, in the frame of the profile."""
        profile, force = self._profile, self._force
        pressure, displacement = self._turn.back(found.pressure), self._turn.back(found.displacement)
        contact = pressure > 0
        counted, area = areas(contact, profile.spacing)
        gap = np.maximum(profile.gap + displacement - found.approach, 0.0)
        gap[contact] = 0.0
        whole = "full_contact" if contact.all() else "converged"
        row = {
            "force": force,
            "nominal_pressure": force / profile.nominal_area,
            "approach": found.approach,
            "contact_area": area,
            "contact_area_counted": counted,
            "contact_fraction": profile.contact_fraction(area),
            "mean_gap": float(gap.mean()),
            "friction_coefficient": found.power_force / force,
            "friction_force": found.power_force,
            "stated_error": max(found.residual, found.friction_residual),
            "pressure_residual": found.residual,
            "friction_residual": found.friction_residual,
            "iterations": found.vectors,
            "status": STATUS_MEANINGS.index(whole if found.converged else "not_converged"),
        }
        fields = {"pressure": np.ascontiguousarray(pressure), "gap": gap}
        return row, {name: fields[name] for name in self._settings.fields}

    def _creep(self, found: SteadyState, speed: float, law: Body) -> float:
        """Part of the creep that has not recovered where the next contact comes; 0 unless the contact stands alone."""
        if not (contact_stands_alone(found.pressure, 0) if self._alone is None else self._alone):
            return 0.0
        ages = self._face.period / speed, np.inf
        return max(creep_left(*(float(one.contact_compliance(age)) for age in ages)) for one in law.materials)

    def order(self, records: RowStore) -> list[int]:
        """In the order in which the speeds were given."""
        facts = [plain["facts"] for plain in records.plain]
        self._creep_left = {self._curve.asked[one["number"]]: one["creep_left"] for one in facts}
        return [int(place) for place in np.argsort([one["number"] for one in facts])]

    def attributes(self, dataset: xr.Dataset) -> dict[str, Any]:
        """Return the direction, and warnings; these are logged too."""
        warnings = {
            "slope": slope_note(self.height, "periodic", np.inf),
            "border": border_note(self.height, xr.Dataset()),
            "wake": wake_note(self._creep_left, self._face.period),
        }
        for note in filter(None, warnings.values()):
            log.warning("%s", note)
        stated = {"speeds": speeds_note(dataset), "material": table_note(self._body.materials)}
        return {
            "direction": self._curve.direction,
            "warnings": warnings_text(stated | warnings),
        }
