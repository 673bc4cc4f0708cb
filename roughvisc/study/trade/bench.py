"""Timed runs of one case under different settings, within a budget of time."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import xarray as xr

from roughvisc.errors import RoughviscError
from roughvisc.study.case import Case
from roughvisc.study.execution.run import compute, unconverged
from roughvisc.study.quantities import Observable, is_sliding, observables_of
from roughvisc.study.trade.ladder import Setting, changed, has_steps, shape_of

Report = Callable[[str, float, float], None]
#: Quantities that are compared, in the order of the results, beside the friction coefficient of a slide.
USUAL = ("pressure", "approach", "contact_area", "contact_area_counted", "mean_gap")
#: Exponents of the time over the inverse tolerance: the number of steps follows its root; iterations hardly change.
_BY_STEPS, _BY_ITERATIONS = 0.5, 0.1

#: Part of the time that is left which a run may take that only tells the time of others.
_LITTLE = 0.05


def quantities_of(case: Case) -> tuple[str, ...]:
    """Return the quantities that can be compared in the results of a case."""
    return (*USUAL, "friction_coefficient") if is_sliding(case.experiment()) else USUAL


def further_quantities_of(case: Case) -> tuple[str, ...]:
    """Return the quantities that are compared on request only: the derived ones, and the prescribed ones."""
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
        The whole result.
    seconds : float
        Wall time. [s]
    steps : int
        Accepted time steps, or rows of an experiment without steps.
    """

    dataset: xr.Dataset
    seconds: float
    steps: int


class TimedRuns:
    """Runs one case under settings, and predicts the time of a run from the largest run so far.

    Parameters
    ----------
    case : Case
        What to run.
    height : xarray.DataArray
        Its surface. [m]
    budget : float
        Wall time of all runs together. [s]
    report : callable
        Called with a setting's name, the current place on the axis, and its end.
    derived : sequence of Observable
        Quantities that are compared beside the usual ones.

    Attributes
    ----------
    quantities : tuple of str
        Quantities that are compared.
    """

    def __init__(
        self, case: Case, height: xr.DataArray, budget: float, report: Report, derived: Sequence[Observable] = ()
    ) -> None:
        self.case, self.shape = case, (height.sizes["x"], height.sizes["y"])
        self.quantities = (*quantities_of(case), *(one.name for one in derived))
        self._derived, self._report = derived, report
        self._until = time.perf_counter() + budget
        self._largest: tuple[Setting, float] | None = None

    @property
    def left(self) -> float:
        """Wall time that is left. [s]"""
        return max(self._until - time.perf_counter(), 0.0)

    def label(self, setting: Setting) -> str:
        """Return a setting in the words of a study file."""
        return setting.label(shape_of(self.case, self.shape, setting.coarsening))

    def work(self, setting: Setting) -> float:
        """Return the work of a setting, in units of its own."""
        return setting.tolerance ** -(_BY_STEPS if has_steps(self.case) else _BY_ITERATIONS) / setting.coarsening**2

    def expected(self, setting: Setting) -> float:
        """Return the expected wall time of a setting; 0 before the first run. [s]"""
        if self._largest is None:
            return 0.0
        done, seconds = self._largest
        return seconds * self.work(setting) / self.work(done)

    def calibrate(self, settings: Sequence[Setting]) -> None:
        """Run the smallest of some settings, and the largest that takes little of the time."""
        settings = sorted(settings, key=self.work)
        with suppress(NotRun):
            self.run(settings[0])  # the first run of a process takes longer
            self.run(settings[0])
            for one in [one for one in settings if self.expected(one) <= _LITTLE * self.left][-1:]:
                self.run(one)

    def run(self, setting: Setting) -> Run:
        """Run the case under a setting.

        Raises
        ------
        NotRun
            If it would take longer than there is time, is refused, or does not converge.
        """
        label, expected, steps = self.label(setting), self.expected(setting), 0
        if expected > self.left:
            raise NotRun(f"would take about {expected:.2g} s, {self.left:.0f} s are left of the budget")

        def passed(now: float, end: float) -> None:
            nonlocal steps
            steps += 1
            self._report(label, now, end)
            if not self.left:
                raise _OutOfTime

        began = time.perf_counter()
        try:
            case = changed(self.case, self.shape, setting)
            dataset = compute(case, progress=passed)
        except _OutOfTime:
            raise NotRun("stopped when the budget was spent") from None
        except RoughviscError as error:
            raise NotRun(str(error).removeprefix(f"{self.case.origin}: ")) from error
        if complaint := unconverged(dataset):
            raise NotRun(complaint)
        took = time.perf_counter() - began
        if self._largest is None or self.work(setting) >= self.work(self._largest[0]):
            self._largest = setting, took
        found = {one.name: (case.experiment().axis, one.of(dataset, case)) for one in self._derived}
        return Run(dataset.assign(found), took, steps)
