"""The settings that a trade measures: each trades accuracy for speed, memory or disk in its own way."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from roughvisc.errors import InputError
from roughvisc.experiment.coarser import coarser_shape
from roughvisc.settings import ENTRIES, Memory, Method, Settings
from roughvisc.study.statement.case import Case, vary
from roughvisc.study.statement.schema.surface import FileSurface

#: Relative precision of a float with 23 bits of fraction.
FLOAT32 = 2.0**-24
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
        Of the study's ``[solve]`` table.
    time_step : float or None
        Fixed step; None: steps chosen by the tolerance. [s]
    coarsening : float
        How many times longer the cells are; below one: shorter, where the surface is known on any grid.
    method : {"fast", "seed"}
        As in the ``[solve]`` table.
    memory : {"auto", "direct"}
        As in the ``[solve]`` table.
    precision : float or None
        Relative precision of the fields in the file; None: that of the study.
    """

    tolerance: float = Settings.tolerance
    time_step: float | None = None
    coarsening: float = 1.0
    method: Method = Settings.method
    memory: Memory = Settings.memory
    precision: float | None = None

    def __post_init__(self) -> None:
        try:
            Settings(tolerance=self.tolerance, method=self.method, memory=self.memory)
        except InputError as error:
            raise InputError(f"setting: {error}") from error
        if self.time_step is not None and not (0 < self.time_step < math.inf):
            raise InputError(f"setting: time_step is {self.time_step!r}: expected a positive number [s], or None")
        if not (0 < self.coarsening < math.inf):
            raise InputError(f"setting: coarsening is {self.coarsening!r}: expected a positive number")

    @property
    def family(self) -> str:
        """What is varied."""
        if self.method == "seed":
            return "seed paper's algorithm"
        if self.memory == "direct":
            return "direct history"
        if self.precision is not None:
            return "rounded fields"
        if self.coarsening != 1:
            return "coarser grid" if self.coarsening > 1 else "finer grid"
        return "tolerance" if self.time_step is None else "fixed steps"

    def label(self, shape: tuple[int, int]) -> str:
        """The setting in the words of a study file; ``shape`` is that of its grid."""
        words = []
        if self.method == "seed":
            words.append("method = seed")
        if self.time_step is not None:
            words.append(f"time_step = {step_text(self.time_step)}")
        else:
            words.append(f"tolerance = {format_tolerance(self.tolerance)}")
        if self.coarsening != 1:
            words.append(f"{shape[0]} x {shape[1]} cells")
        if self.memory == "direct":
            words.append("memory = direct")
        if self.precision is not None:
            words.append(f"precision = {format_tolerance(self.precision)}")
        return ", ".join(words)


def step_text(step: float) -> str:
    """A time step as a study file takes it.

    Examples
    --------
    >>> step_text(0.02), step_text(1.5), step_text(2.5e-5)
    ('20 ms', '1.5 s', '25 us')
    """
    for factor, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")):
        if step >= factor:
            return f"{step / factor:.6g} {unit}"
    return f"{step:.6g} s"


def format_tolerance(value: float) -> str:
    """A tolerance as one writes it.

    Examples
    --------
    >>> [format_tolerance(one) for one in (0.03, 1e-3, 2.0**-24, 0.25)]
    ['3e-2', '1e-3', '6e-8', '2.5e-1']
    """
    digits, power = f"{value:.1e}".split("e")
    return f"{digits.removesuffix('.0')}e{int(power)}"


def is_data(case: Case) -> bool:
    """Whether the grid of the surface is data, so that another grid is another surface."""
    surface = case.settings.surface
    return isinstance(surface, FileSurface) or getattr(surface, "generate", "") not in _ANY_GRID or _treated(case)


def _treated(case: Case) -> bool:
    """Whether the heights are no longer those of the recipe."""
    surface = case.settings.surface
    steps = ("crop", "rotate90", "invert", "filter", "mirror", "second")
    return any(getattr(surface, step) for step in steps) or any(
        getattr(surface, step) is not False for step in ("level", "outliers", "fill")
    )


def shape_of(case: Case, shape: tuple[int, int], coarsening: float) -> tuple[int, int]:
    """Cells of the grid of a setting, where the study's grid has ``shape``."""
    return shape if coarsening == 1 else coarser_shape(shape, coarsening, not is_data(case))


def changed(case: Case, shape: tuple[int, int], setting: Setting, absent: bool = False) -> Case:
    """The case under a setting; ``absent``: the surface says that there is no material where heights are missing.

    Raises
    ------
    InputError
        If the surface is not known on a finer grid, or a value is refused.
    """
    changes: dict[str, Any] = {
        "solve.boundary": case.settings.solve.boundary,  # on any grid
        "solve.tolerance": setting.tolerance,
        "solve.time_step": "auto" if setting.time_step is None else setting.time_step,
        "solve.method": setting.method,
        "solve.memory": setting.memory,
    }
    if setting.precision is not None:
        changes["keep.precision"] = setting.precision
    if setting.coarsening < 1 and is_data(case):
        found = f"setting: coarsening is {setting.coarsening!r}"
        raise InputError(f"{found}: expected at least 1, the scan has no finer grid")
    if setting.coarsening != 1:
        key, value = grid_change(case, shape, setting.coarsening, absent)
        changes[key] = value
    return vary(case, changes)


def changed_keys(before: Settings, after: Settings) -> dict[str, Any]:
    """Keys of a study, and values, that turn settings into others."""
    return {
        f"{one.table}.{name}": list(value) if isinstance(value, tuple) else value
        for name, one in ENTRIES.items()
        if (value := getattr(after, name)) != getattr(before, name)
    }


def grid_change(case: Case, shape: tuple[int, int], coarsening: float, absent: bool = False) -> tuple[str, list[int]]:
    """Key of a study and its value that make the surface's cells so many times longer.

    An analytic profile is made anew; anything else keeps the waves that the cells can hold, or means over them where
    the material ends within the grid: ``absent``, the surface itself says so. Finer cells hold no more waves.
    """
    cells = shape_of(case, shape, coarsening)
    if not is_data(case):
        return "surface.shape", list(cells)
    mirrored = 2 if case.settings.surface.mirror else 1
    ends = absent or case.settings.surface.missing == "absent"
    return f"surface.{'resample' if ends else 'band_limit'}", [max(2, n // mirrored) for n in cells]


def has_steps(case: Case) -> bool:
    """Whether what the case does takes steps in time, with a memory of those before."""
    return ENTRIES["time_step"].only_over in ("", case.experiment().axis)


def duration_of(case: Case) -> float:
    """Time that steps divide; zero where there are none. [s]"""
    return case.experiment().creep_time(0.0) if has_steps(case) else 0.0


def ladder(case: Case, shape: tuple[int, int]) -> list[Setting]:
    """The settings that a trade measures unless it is told others.

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
            rungs.append(Setting(tolerance, coarsening=coarsening))
    if not is_data(case):
        rungs += [Setting(1e-3, coarsening=c) for c in (0.5, 0.25) if max(shape) / c <= _MOST]
    rungs.append(Setting(1e-3, precision=FLOAT32))
    if duration := duration_of(case):
        rungs.append(Setting(1e-2, memory="direct"))
        steps = [float(f"{duration / count:.3g}") for count in (20, 80)]  # so that a study file with them reads well
        rungs += [Setting(time_step=step, method=method) for method in ("fast", "seed") for step in steps]
    return rungs
