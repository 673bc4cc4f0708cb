"""Timed runs of one case under different settings, within a budget of time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import xarray as xr

from roughvisc.errors import RoughviscError
from roughvisc.experiment.profile import Profile, uses_window
from roughvisc.experiment.resources import PROCESS
from roughvisc.study.cost.coarse_grids import foretold
from roughvisc.study.cost.estimate import ConvolutionTimer, solved_on, stages_of, work
from roughvisc.study.execution.run import compute, unconverged
from roughvisc.study.quantities import Observable, observables_of
from roughvisc.study.statement.case import Case
from roughvisc.study.storage.store import open_result, result_path, write_result
from roughvisc.study.trade.ladder import Setting, changed, duration_of, has_steps, shape_of
from roughvisc.topography.grid import nominal_area
from roughvisc.variables.axes import AXES

Report = Callable[[str, float, float], None]
#: What is compared, in the order of the results, beside the friction coefficient where something slides.
QUANTITIES = ("pressure", "approach", "contact_area", "contact_area_counted", "mean_gap")
#: A run that took less is repeated, up to so many times in all; the fastest counts. [s]
_SHORT, _REPEATS = 1.0, 3
#: A run that took more corrects what is expected of the others. [s]
_TELLING = 0.2
#: What a run takes beside its transforms, whatever the grid: in all, and a step. [s]
_ONCE, _STEP = 0.02, 1e-3
#: Tolerance of the coarse marches from which the first times are told.
_MARCHED = 1e-2
#: What a row takes more of convolutions for a tolerance ten times sharper, where no steps follow the tolerance.
_DECADE = 0.25
#: Convolutions a step of the seed paper's solver takes, over those of the preconditioned one; measured: 8 to 15.
_SEED_SOLVE = 12.0


def quantities_of(case: Case) -> tuple[str, ...]:
    """What can be compared in the results of a case."""
    experiment = case.experiment()
    names = (*QUANTITIES, "friction_coefficient") if experiment.largest_speed > 0 else QUANTITIES
    return tuple(name for name in names if name in AXES[experiment.axis].variables)


def further_quantities_of(case: Case) -> tuple[str, ...]:
    """What else can be: what is derived from the fields of the results, and what is given in most."""
    usual = quantities_of(case)
    return tuple(name for name in observables_of(case) if name not in usual)


class NotRun(RoughviscError):
    """A setting that was not measured, and why."""


class _OutOfTime(Exception):
    """A run has taken all the time there is."""


@dataclass(frozen=True)
class Run:
    """A run and what it cost.

    Attributes
    ----------
    dataset : xarray.Dataset
        The result as its file gives it.
    seconds : float
        Wall time of computing and writing it, the fastest of its repetitions. [s]
    steps : int
        Accepted time steps, or rows of what has none.
    peak_memory, disk_size : float
        Counted from its arrays, and of its file. [byte]
    """

    dataset: xr.Dataset
    seconds: float
    steps: int
    peak_memory: float
    disk_size: float


class TimedRuns:
    """Runs one case under settings, and tells how long they will take.

    Parameters
    ----------
    case : Case
        What to run.
    height : xarray.DataArray
        Its surface. [m]
    folder : Path
        For temporary files.
    budget : float
        Wall time of all runs together. [s]
    report : callable
        Called with a setting's name, how far it is, and of how much.
    derived : sequence of Observable
        What is compared of the results beside the usual.

    Attributes
    ----------
    quantities : tuple of str
        What is compared of the results.
    """

    def __init__(
        self,
        case: Case,
        height: xr.DataArray,
        folder: Path,
        budget: float,
        report: Report,
        derived: Sequence[Observable] = (),
    ) -> None:
        self.case, self.shape = case, (height.sizes["x"], height.sizes["y"])
        self.quantities = (*quantities_of(case), *(one.name for one in derived))
        self._derived = derived
        self._absent = height.attrs.get("missing") == "absent"
        self._path, self._report = result_path(folder, "run"), report
        self._until = time.perf_counter() + budget
        self._found = foretold(changed(case, self.shape, Setting(_MARCHED)), height)
        settings = replace(case.solving(), method="fast", missing="absent")
        self._convolution = ConvolutionTimer().seconds(height, settings.boundary, case.body().kernel)
        options = {"follow": uses_window(settings), "mirror": case.experiment().largest_speed == 0}
        profile = Profile(height, settings.missing, kernel=case.body().kernel, **options)
        self._part = solved_on(stages_of(profile, grows=False), self._found).part  # of the cells
        self._calibration = 1.0

    @property
    def left(self) -> float:
        """Wall time that is left. [s]"""
        return max(self._until - time.perf_counter(), 0.0)

    def label(self, setting: Setting) -> str:
        """A setting in the words of a study file."""
        return setting.label(shape_of(self.case, self.shape, setting.coarsening))

    def expected(self, setting: Setting) -> float:
        """Wall time that a setting is expected to take; runs that took a while correct it. [s]"""
        cells, size = 1 / setting.coarsening**2, math.prod(self.shape)
        steps, each = self._found.steps, self._found.convolutions / max(self._found.steps, 1.0)
        if setting.time_step is not None:
            steps = duration_of(self.case) / setting.time_step
        elif has_steps(self.case):
            steps *= math.sqrt(_MARCHED / setting.tolerance)
        else:
            each *= max(1.0 + _DECADE * math.log10(_MARCHED / setting.tolerance), _DECADE)
        if setting.method == "seed":
            convolutions = steps**2 / 2 + steps * each * _SEED_SOLVE
        else:
            convolutions = steps * each * cells**0.15 * work(self._part * size) / work(size)
        return _ONCE + _STEP * steps + convolutions * self._convolution * cells * self._calibration

    def run(self, setting: Setting) -> Run:
        """Run the case under a setting.

        Raises
        ------
        NotRun
            If it would take longer than there is time, is refused, or does not converge.
        """
        label, expected = self.label(setting), self.expected(setting)
        if expected > self.left:
            raise NotRun(f"would take about {expected:.2g} s, {self.left:.0f} s are left of the budget")
        try:
            case = changed(self.case, self.shape, setting, self._absent)
            took, dataset, steps = self._timed(case, label)
            if setting.method == "fast" and took > _TELLING:
                self._calibration *= max(took, 1e-3) / max(expected, 1e-3)
            for _ in range(_REPEATS - 1):
                if took < min(_SHORT, self.left / 10):
                    took = min(took, self._timed(case, label)[0])
        except _OutOfTime:
            raise NotRun("stopped when the budget was spent") from None
        except RoughviscError as error:
            text = str(error).removeprefix(f"{self.case.origin}: ")
            raise NotRun(text) from error
        if complaint := unconverged(dataset):
            raise NotRun(complaint)
        with open_result(self._path) as kept:
            dataset = kept.load()
        found = {one.name: (case.experiment().axis, one.of(dataset, case)) for one in self._derived}
        return Run(dataset.assign(found), took, steps, self._memory(case, dataset, steps), self._path.stat().st_size)

    def _timed(self, case: Case, label: str) -> tuple[float, xr.Dataset, int]:
        steps = 0

        def passed(now: float, end: float) -> None:
            nonlocal steps
            steps += 1
            self._report(label, now, end)
            if not self.left:
                raise _OutOfTime

        began = time.perf_counter()
        dataset = compute(case, progress=passed)
        write_result(dataset, self._path, precision=case.settings.keep.precision)
        return time.perf_counter() - began, dataset, steps

    def _memory(self, case: Case, dataset: xr.Dataset, steps: int) -> float:
        """As a plan counts it, with the steps that were taken. [byte]"""
        experiment, area = case.experiment(), nominal_area(dataset)
        counts = {
            "steps": float(steps),
            "rows": float(dataset.sizes[experiment.axis]),
            "contact": float(dataset["contact_area_counted"].max()) / area,
            "part": self._part,
        }
        cells = dataset.sizes["x"] * dataset.sizes["y"]
        return PROCESS + experiment.bytes_needed(case.solving(), case.body(), cells, area, **counts)
