"""Reference run at the finest affordable settings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.experiment.coarser import pressure_distance
from roughvisc.experiment.grid_error import TWO_GRIDS, grid_uncertainty
from roughvisc.study.trade.bench import NotRun, Run, TimedRuns
from roughvisc.study.trade.ladder import Setting
from roughvisc.study.trade.reference import relative
from roughvisc.variables.axes import AXES, axis_of

#: The reference's tolerance is the sharpest measured one over this.
_SHARPER = 5.0
#: How many times longer the cells are on which it is run again.
_SECOND, _THIRD = 2.0, 4.0


def _finest_grids(rungs: Sequence[Setting], data: bool) -> list[float]:
    """Grids that the finest run may be on, by how many times longer their cells are, the finest first."""
    measured = {setting.coarsening for setting in rungs}
    return [1.0] if data else sorted(c for c in measured if c <= max(1.0, min(measured)))


def all_grids(rungs: Sequence[Setting], data: bool) -> list[float]:
    """Grids of all runs, by how many times longer their cells are: of the settings, and of the finest run."""
    compared = {part * grid for grid in _finest_grids(rungs, data) for part in (1.0, _SECOND, _THIRD)}
    return sorted(compared | {setting.coarsening for setting in rungs if setting.coarsening >= 1 or not data})


class ReferenceRun:
    """The finest run of a case, on the finest grid that half of the time allows, and how far it may be off.

    Parameters
    ----------
    bench : TimedRuns
        Where it is run.
    rungs : sequence of Setting
        What is to be measured against it.
    data : bool
        Whether the grid is data: then it is on that one.

    Attributes
    ----------
    name : str
        What it is.
    time, grid : dict
        Quantity -> relative error that steps and grid may have left in it; missing where that is not known.

    Raises
    ------
    InputError
        If it would take longer than half of the time there is, or fails.
    """

    def __init__(self, bench: TimedRuns, rungs: Sequence[Setting], data: bool) -> None:
        fast = [setting for setting in rungs if setting.method == "fast"] or list(rungs)
        self.sharpest = min(setting.tolerance for setting in fast)
        candidates = [Setting(self.sharpest / _SHARPER, coarsening=grid) for grid in _finest_grids(rungs, data)]
        allowed = bench.left / 2
        self._setting = next((one for one in candidates if bench.expected(one) <= allowed), candidates[-1])
        self._bench = bench
        self._coarser: dict[float, dict[str, float]] = {}
        expected = bench.expected(self._setting)
        if expected > allowed:
            where = f"{bench.case.origin}: " if bench.case.origin else ""
            raise InputError(
                f"{where}surface: the reference run would take about {expected:.3g} s, "
                f"more than half of the {bench.left:.0f} s allowed: give a larger budget, or resample the surface"
            )
        try:
            self.run: Run = bench.run(self._setting)
        except NotRun as error:
            where = f"{bench.case.origin}: " if bench.case.origin else ""
            raise InputError(f"{where}the reference run: {error}") from error
        self.name = f"finest run: {bench.label(self._setting)}"
        self.time, self.grid = self._uncertainties()

    def check(self, setting: Setting) -> None:
        """Refuse a setting that is finer than what it would be measured against."""
        if setting.coarsening < self._setting.coarsening:
            raise NotRun("finer than the run to measure it against, for which there is no time")

    def errors(self, dataset: xr.Dataset) -> dict[str, float]:
        """Of a result with the same rows."""
        return differences(dataset, self.run.dataset, self._bench.quantities)

    def of_coarsening(self, factor: float) -> dict[str, float]:
        """Errors that a grid alone makes: of a run on it that is as sharp as the finest one."""
        if factor == self._setting.coarsening:
            return dict.fromkeys(self._bench.quantities, 0.0)
        if factor not in self._coarser:
            try:
                run = self._bench.run(replace(self._setting, coarsening=factor))
                self._coarser[factor] = self.errors(run.dataset)
            except NotRun:
                self._coarser[factor] = dict.fromkeys(self._bench.quantities, math.nan)
        return self._coarser[factor]

    def _uncertainties(self) -> tuple[dict[str, float], dict[str, float]]:
        """What the steps and what the grid leave unknown; missing where the runs for it cannot be had."""
        bench, setting = self._bench, self._setting
        unknown = dict.fromkeys(bench.quantities, math.nan)
        in_time = unknown
        try:
            looser = self.errors(bench.run(replace(setting, tolerance=self.sharpest)).dataset)
            in_time = {name: time_uncertainty(value, _SHARPER) for name, value in looser.items()}
            second = bench.run(replace(setting, coarsening=_SECOND * setting.coarsening)).dataset
        except NotRun:
            return in_time, unknown
        near = self._coarser[_SECOND * setting.coarsening] = self.errors(second)
        try:
            third = bench.run(replace(setting, coarsening=_THIRD * setting.coarsening)).dataset
        except NotRun:
            far = unknown
        else:
            far = differences(third, second, bench.quantities)
            self._coarser[_THIRD * setting.coarsening] = self.errors(third)
        fine = self.run.dataset
        ratio = math.sqrt(fine.sizes["x"] * fine.sizes["y"] / (second.sizes["x"] * second.sizes["y"]))
        moving = "friction_coefficient" in fine
        return in_time, {
            name: float(grid_uncertainty(name, near[name], far[name], ratio, moving=moving))
            for name in bench.quantities
        }


def differences(found: xr.Dataset, wanted: xr.Dataset, quantities: Sequence[str]) -> dict[str, float]:
    """Differences between results with the same rows: the worst of the rows, over the largest value of the second.

    The pressure's is its absolute difference summed (L1) over the largest force. What neither has in a row, such as
    friction before anything is pressed, does not differ there.

    Raises
    ------
    NotRun
        If the rows lie at other places.
    """
    rows = axis_of(wanted.dims)
    if found[rows].shape != wanted[rows].shape or not np.allclose(found[rows], wanted[rows], rtol=1e-9, atol=0):
        raise NotRun(f"its {AXES[rows].rows} are others than those of the run to measure it against")
    largest = float(wanted["force"].max())
    errors = dict.fromkeys(quantities, math.nan)
    for name in quantities:
        if name == "pressure":
            errors[name] = float(pressure_distance(found, wanted).max()) / largest if largest else math.nan
        elif name in found and name in wanted:
            one, other = found[name].values, wanted[name].values
            errors[name] = relative(np.where(np.isnan(one) & np.isnan(other), 0.0, one - other), other)
    return errors


def time_uncertainty(near: float, sharper: float) -> float:
    """What the steps leave unknown, from the difference to a run whose tolerance is so many times looser.

    The error follows the tolerance, unevenly: the safety factor is 3.
    """
    return TWO_GRIDS * near / (sharper - 1)
