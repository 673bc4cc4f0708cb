"""Settings of a solve, each declared and checked once, and the problem that they belong to.

The signature of :func:`roughvisc.simulate` repeats the names that users need. :class:`Numerics` holds the others, which
are one argument there. The tables ``[solve]`` and ``[keep]`` of a study, the key of a case and the refusals of an
experiment follow from the fields.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.arguments import listed_names
from roughvisc.errors import InputError
from roughvisc.mechanics.adhesion import Adhesion
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.program import Program, instant
from roughvisc.topography.borders import is_mirrored, is_periodic
from roughvisc.topography.grid import checked
from roughvisc.topography.recipes import BOUNDARIES, indenter_of, recipe_name
from roughvisc.units import listed, number
from roughvisc.variables import FIELDS

if TYPE_CHECKING:
    from roughvisc.experiment.base import Experiment

Array = NDArray[np.float64]
#: :meth:`Problem.resolved` replaces ``auto`` by one of the other values.
Boundary = Literal["auto", "free", "periodic", "mirror"]
Missing = Literal["refuse", "absent"]
Edge = Literal["error", "accept"]
Device = Literal["cpu", "gpu"]

#: Valid words of each setting.
WORDS: dict[str, tuple[str, ...]] = {
    "boundary": get_args(Boundary),
    "missing": get_args(Missing),
    "edge": get_args(Edge),
    "device": get_args(Device),
}
#: Settings without a meaning in steady sliding.
OVER_TIME = ("times", "missing", "edge", "time_step", "adhesion")
#: Smallest tolerance. Rounding errors are of this order, and a run with a smaller tolerance would not end.
FINEST_TOLERANCE = 1e-12
#: Smallest and largest number of cells for which the grid error is estimated by default. The coarser run takes 0.8 to
#: 0.9 of the time of the first run at 32 x 32 cells, 0.4 to 0.5 at 128 x 128, 0.25 to 0.3 at 256 x 256, and 0.2 at
#: 512 x 512: more than a third on fewer cells than the smallest number.
GRID_ERROR_CELLS = 256 * 256, 512 * 512
#: Largest number of kept times.
MOST_TIMES = 1_000_000
#: Times that differ by at most this many units in the last place are equal: rounding of sums and logarithms of times.
_ROUNDING = 64
#: Latest first kept time of a hold, as a part of the hold. [-]
_FIRST = 1e-3
#: Relative numbers of kept times of a ramp or a slide, a hold, and a period of a cycle.
_RAMP, _HOLD, _PERIOD = 2.0, 3.0, 16.0


@dataclass(frozen=True, kw_only=True)
class Numerics:
    """Settings of a solve that are rarely changed.

    Parameters
    ----------
    time_step : "auto" or float or str
        Steps chosen by the tolerance, or a fixed step length. [s]
    device : {"cpu", "gpu"}
        Device that computes the fields. A GPU needs CuPy; its results agree with CPU results within the tolerance.

    Raises
    ------
    InputError
        If a value is invalid.

    Examples
    --------
    >>> Numerics(time_step="10 ms")
    Numerics(time_step=0.01, device='cpu')
    """

    time_step: float | str = "auto"
    device: Device = "cpu"

    def __post_init__(self) -> None:
        for name, words in WORDS.items():
            if (found := getattr(self, name, words[0])) not in words:
                raise InputError(key=name, found=found, expected=" or ".join(map(repr, words)))
        if self.time_step != "auto":
            try:
                step = number(self.time_step, "s", "time_step", above=0)
            except InputError as error:
                raise InputError(key=error.key, found=error.found, expected=f"'auto', or {error.expected}") from None
            object.__setattr__(self, "time_step", step)


@dataclass(frozen=True, kw_only=True)
class Settings(Numerics):
    """Settings of a solve: numerical method and kept quantities; see :func:`roughvisc.simulate`.

    Parameters
    ----------
    boundary, tolerance, times, fields, edge, missing, grid_error, adhesion
        As in :func:`roughvisc.simulate`; any sequence of times or fields becomes a tuple.
    time_step, device
        As in :class:`Numerics`.

    Raises
    ------
    InputError
        If a value is invalid. :func:`roughvisc.experiment.loading.check_program` checks the settings that depend on the
        program or the surface.

    Examples
    --------
    >>> Settings(tolerance=1e-2, times=[1.0, 0.5]).times
    (0.5, 1.0)
    """

    boundary: Boundary = "auto"
    tolerance: float = 1e-3
    times: int | Sequence[float | str] | str | None = None
    fields: Sequence[str] | str = ("pressure", "gap")
    edge: Edge = "error"
    missing: Missing = "refuse"
    grid_error: bool | Literal["auto"] = "auto"
    adhesion: Adhesion | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        tolerance = number(self.tolerance, "1", "tolerance", least=FINEST_TOLERANCE, below=1)
        times: Any = self.times
        if isinstance(times, int | np.integer) and not isinstance(times, bool):
            times = int(number(int(times), "1", "times", least=1, most=MOST_TIMES))
        elif times is not None:
            times = tuple(np.unique(listed(times, "s", "times", "a whole number counts rows")).tolist())
            if not times:
                raise InputError(key="times", found=self.times, expected="at least one time [s], or None")
        names: Any = listed_names(self.fields)
        if not all(name in FIELDS for name in names):
            raise InputError(key="fields", found=self.fields, expected=f"some of {', '.join(FIELDS)}")
        grid_error = self.grid_error if self.grid_error == "auto" else bool(self.grid_error)
        if not isinstance(self.adhesion, Adhesion | None):
            expected = "rv.adhesion(work=..., range=...), or None"
            raise InputError(key="adhesion", found=self.adhesion, expected=expected)
        found = {"tolerance": tolerance, "times": times, "fields": names, "grid_error": grid_error}
        for name, value in found.items():
            object.__setattr__(self, name, value)


def attraction(settings: Settings) -> Adhesion | None:
    """Return the attraction of the surfaces; None without adhesion, or if its work is zero."""
    return settings.adhesion if settings.adhesion is not None and settings.adhesion.work > 0 else None


#: Expected boundary if ``auto`` cannot be resolved.
OPEN_BOUNDARY = """\
one of these, because the surface does not show what lies beyond its border
  a nominally flat scan that stands for a larger surface: boundary = "mirror"; "periodic" if it repeats as it is
  an indenter or a single bump whose contact stays inside: boundary = "free"
  a scan that is itself the whole body: boundary = "free" with edge = "accept\""""


def boundary_of(h: xr.DataArray) -> Literal["free", "periodic"] | None:
    """Return the boundary that a surface was made for; None for scans, plain arrays and all other surfaces.

    The user must state the boundary if this function returns None. The recipe of an indenter counts only if it
    reproduces the heights, because the grid may have to grow. The recipe of waves or roughness, and the record of
    mirroring, count only if the attribute ``period`` gives the sides of the grid and the borders meet
    (:func:`is_periodic`).

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights. [m]

    Returns
    -------
    {"free", "periodic"} or None
        ``free`` for an indenter; ``periodic`` for waves, self-affine roughness and mirrored surfaces.

    Examples
    --------
    >>> from roughvisc.topography.recipes import sphere, wavy
    >>> ball, waves = sphere(1e-2, 1e-3, 8), wavy(1e-6, 1e-3, 1e-3, 8)
    >>> boundary_of(ball), boundary_of(waves), boundary_of(ball + waves)
    ('free', 'periodic', None)
    """
    if indenter_of(h) is not None:
        return "free"
    made = BOUNDARIES.get(recipe_name(h)) == "periodic" and is_periodic(h)
    return "periodic" if made or is_mirrored(h) else None


@dataclass(frozen=True)
class Problem:
    """Surface, body and settings of an experiment.

    Attributes
    ----------
    height : xarray.DataArray, dims (x, y)
        Profile, peaks up. [m]
    body : Body
        The body under it.
    settings : Settings
        Numerical settings and the fields to keep.
    """

    height: xr.DataArray
    body: Body
    settings: Settings

    def resolved(self, experiment: Experiment) -> Problem:
        """Return the problem that an experiment computes: ``auto`` is replaced in boundary and grid error.

        Raises
        ------
        InputError
            If the heights are invalid, the boundary must be stated, or a setting has no meaning in the experiment.
        """
        height, settings = checked(self.height, "height", least=1), self.settings
        boundary, grid_error, (fewest, most) = settings.boundary, settings.grid_error, GRID_ERROR_CELLS
        if boundary == "auto":
            boundary = experiment.boundary or ("free" if settings.edge == "accept" else boundary_of(height))
        if boundary is None:
            raise InputError(key="boundary", found="auto", expected=OPEN_BOUNDARY)
        if grid_error == "auto":  # only if no further field has to be kept
            needs_pressure = experiment.axis == "time" and "pressure" not in settings.fields
            grid_error = fewest <= height.size <= most and not needs_pressure
        settings = replace(settings, boundary=boundary, grid_error=grid_error)
        for name, found, expected in experiment.unsupported(settings, self.body):
            raise InputError(key=name, found=found, expected=expected)
        problem = replace(self, height=height, settings=settings)
        experiment.check_cells(problem)
        return problem


def kept_times(
    program: Program, times: int | Sequence[float] | None, *spacings: tuple[float, float]
) -> tuple[float, ...] | None:
    """Return the times to keep, ascending. [s]

    Times within rounding of a corner of the program are moved to the corner. Times in a slide are moved to the nearest
    time at which a whole number of cells has been slid.

    Parameters
    ----------
    program : Program
        The loading program.
    times : int, sequence of float or None
        Number of times, see :func:`spread_times`; or the times [s]; or None for every accepted step.
    *spacings : tuple of float
        Cell sides of each grid that slides. [m]

    Raises
    ------
    InputError
        If a time lies outside the program.
    """
    if times is None:
        return None
    corners, duration = np.array(program.corners), program.duration
    kept: list[float] = []
    for value in spread_times(program, times) if isinstance(times, int) else np.unique(np.asarray(times, dtype=float)):
        nearest = float(corners[np.argmin(np.abs(corners - value))])
        snapped = nearest if abs(nearest - value) <= _ROUNDING * math.ulp(nearest) else float(value)
        if not 0 <= snapped <= duration:
            raise InputError(f"times holds {value:g} s: expected times from 0 to the program's end at {duration:g} s")
        if not kept or snapped - kept[-1] > _ROUNDING * math.ulp(snapped):
            kept.append(snapped)
    if not (spacings and program.slides):
        return tuple(kept)
    found = np.array(kept)
    for segment, began, end in zip(program.segments, program.corners, program.corners[1:], strict=False):
        if segment.slide is not None:
            cells = math.gcd(*map(segment.slide.cells, spacings))
            for place in np.flatnonzero((found > began) & (found < end)):
                taken = round((found[place] - began) / (end - began) * cells)
                found[place] = instant(began, end, taken, cells)
    return tuple(np.unique(found).tolist())


def spread_times(program: Program, count: int) -> Array:
    """Return a number of times, spread over the program; they are denser where the result changes faster.

    Parameters
    ----------
    program : Program
        The loading program.
    count : int
        Number of times. If the program has more corners, an even selection of corners is kept, with the last one.

    Returns
    -------
    ndarray, shape (n,)
        Ascending; fewer than `count` if the program has no duration. [s]

    Notes
    -----
    All corners of the program are kept. The other times are distributed in the proportion of two per ramp or slide,
    three per hold and sixteen per period of a cycle. In a hold they are spaced evenly in the logarithm of the time
    since its start. This spacing begins at a third of the segment before or a thousandth of the hold, whichever is
    less. In other segments the times are spaced evenly.
    """
    corners = np.unique(program.corners)
    further = count - len(corners)
    if further <= 0:
        return corners[np.linspace(len(corners) - 1, 0, count).round().astype(int)[::-1]]
    weights = np.zeros(len(program.segments))
    for row, segment in enumerate(program.segments):
        if segment.duration > 0:
            periods = segment.duration / segment.period if segment.amplitude else 0.0
            weights[row] = _PERIOD * periods if periods else _HOLD if segment.holds else _RAMP
    if not weights.any():
        return corners
    exact = weights * further / weights.sum()
    numbers = np.floor(exact).astype(int)
    largest_remainders = np.argsort(numbers - exact, kind="stable")[: further - int(numbers.sum())]
    numbers[largest_remainders] += 1

    found, before = [corners], math.inf
    for began, segment, many in zip(program.corners, program.segments, numbers, strict=False):
        if segment.duration > 0:
            parts = np.arange(1, many + 1) / (many + 1)
            if segment.holds and many:
                parts = min(_FIRST, before / (3 * segment.duration)) ** (1 - parts)
            found.append(began + parts * segment.duration)
            before = segment.duration
    return np.unique(np.concatenate(found))
