"""Settings that a trade measures: tolerances and grids."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

from roughvisc.errors import InputError
from roughvisc.experiment.coarser import coarser_shape
from roughvisc.settings import Settings
from roughvisc.study.case import Case, vary
from roughvisc.study.study_file import table_of
from roughvisc.topography.cards import FACE_STEPS

#: Recipes that give the same surface on any grid: only there is the grid a setting and no data.
_ANY_GRID = ("sphere", "cone", "flat_punch", "wavy")
#: Fewest cells a side of a coarser grid that is worth a try.
_FEWEST = 12
#: Most cells a side of a finer one.
_MOST = 1024


@dataclass(frozen=True)
class Setting:
    """One way to compute a case.

    Parameters
    ----------
    tolerance : float
        Of the study's ``[solve]`` table. [-]
    coarsening : float
        Cell size over that of the study. Values below one need a surface that is known on any grid. [-]
    """

    tolerance: float = Settings.tolerance
    coarsening: float = 1.0

    def __post_init__(self) -> None:
        try:
            Settings(tolerance=self.tolerance)
        except InputError as error:
            raise error.prefixed("setting") from error
        if not (0 < self.coarsening < math.inf):
            raise InputError(key="coarsening", found=self.coarsening, expected="a positive number")

    def label(self, shape: tuple[int, int]) -> str:
        """Return the setting in the words of a study file; ``shape`` is that of its grid."""
        grid = "" if self.coarsening == 1 else f", {shape[0]} x {shape[1]} cells"
        return f"tolerance = {format_tolerance(self.tolerance)}{grid}"


def format_tolerance(value: float) -> str:
    """A tolerance as one writes it.

    Examples
    --------
    >>> [format_tolerance(one) for one in (0.03, 1e-3, 0.25)]
    ['3e-2', '1e-3', '2.5e-1']
    """
    digits, power = f"{value:.1e}".split("e")
    return f"{digits.removesuffix('.0')}e{int(power)}"


def is_data(case: Case) -> bool:
    """Whether the grid of the surface is data, so that another grid is another surface."""
    return case.surface.get("generate") not in _ANY_GRID or _is_treated(case)


def _is_treated(case: Case) -> bool:
    """Return whether the heights differ from those of the recipe."""
    return any(case.surface.get(step, False) is not False for step in (*FACE_STEPS, "second"))


def shape_of(case: Case, shape: tuple[int, int], coarsening: float) -> tuple[int, int]:
    """Cells of the grid of a setting, where the study's grid has ``shape``."""
    return shape if coarsening == 1 else coarser_shape(shape, coarsening, not is_data(case))


def changed(case: Case, shape: tuple[int, int], setting: Setting) -> Case:
    """The case under a setting.

    Raises
    ------
    InputError
        If the surface is not known on a finer grid, or a value is refused.
    """
    changes: dict[str, Any] = {
        "solve.boundary": case.settings.boundary,  # on any grid
        "solve.tolerance": setting.tolerance,
    }
    if setting.coarsening < 1 and is_data(case):
        expected = "at least 1, since the scan has no finer grid"
        raise InputError(key="coarsening", found=setting.coarsening, expected=expected)
    if setting.coarsening != 1:
        key, value = grid_change(case, shape, setting.coarsening)
        changes[key] = value
    return vary(case, changes)


def changed_keys(before: Settings, after: Settings) -> dict[str, Any]:
    """Keys of a study, and values, that turn settings into others."""
    return {
        f"{table_of(name)}.{name}": list(value) if isinstance(value, tuple) else value
        for name in (one.name for one in fields(Settings))
        if (value := getattr(after, name)) != getattr(before, name)
    }


def grid_change(case: Case, shape: tuple[int, int], coarsening: float) -> tuple[str, list[int]]:
    """Key of a study and its value that make the surface's cells so many times longer.

    An analytic profile is made anew; anything else keeps the waves that the cells can hold.
    Finer cells hold no more waves.
    """
    cells = shape_of(case, shape, coarsening)
    if not is_data(case):
        return "surface.shape", list(cells)
    return "surface.resample", [max(2, n) for n in cells]


def has_steps(case: Case) -> bool:
    """Whether what the case does takes steps in time, with a memory of those before."""
    return case.experiment().axis == "time"


def ladder(case: Case, shape: tuple[int, int]) -> list[Setting]:
    """Return the settings that a trade measures by default.

    Parameters
    ----------
    case : Case
        What is computed.
    shape : tuple of int
        Cells of its grid.
    """
    rungs = [Setting(tolerance) for tolerance in (1e-1, 3e-2, 1e-2, 3e-3, 1e-3)]
    for coarsening, tolerance in ((4.0, 1e-2), (2.0, 1e-2), (2.0, 1e-3)):
        if min(shape) / coarsening >= _FEWEST:
            rungs.append(Setting(tolerance, coarsening))
    if not is_data(case):
        rungs += [Setting(1e-3, c) for c in (0.5, 0.25) if max(shape) / c <= _MOST]
    return rungs
