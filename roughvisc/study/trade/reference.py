"""Reference of a trade: the finest run of the case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.experiment.coarser import pressure_distance
from roughvisc.experiment.grid_error import TWO_GRIDS, grid_uncertainty
from roughvisc.study.trade.bench import NotRun, TimedRuns
from roughvisc.study.trade.ladder import Setting
from roughvisc.variables import AXES, axis_of

Array = NDArray[np.float64]
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
        self._sharpest = min(setting.tolerance for setting in rungs)
        candidates = [Setting(self._sharpest / _SHARPER, coarsening=grid) for grid in _finest_grids(rungs, data)]
        allowed = bench.left / 2
        self._bench = bench
        self._setting = next((one for one in candidates if bench.expected(one) <= allowed), candidates[-1])
        where = f"{bench.case.origin}: " if bench.case.origin else ""
        if (expected := bench.expected(self._setting)) > allowed:
            raise InputError(
                f"{where}surface: the reference run would take about {expected:.3g} s, "
                f"more than half of the {bench.left:.0f} s allowed: give a larger budget, or resample the surface"
            )
        try:
            self._dataset = bench.run(self._setting).dataset
        except NotRun as error:
            raise InputError(f"{where}the reference run: {error}") from error
        self.name = f"finest run: {bench.label(self._setting)}"
        self._of_coarsening = {self._setting.coarsening: dict.fromkeys(bench.quantities, 0.0)}
        self.time, self.grid = self._uncertainties()

    def check(self, setting: Setting) -> None:
        """Refuse a setting that is finer than what it would be measured against."""
        if setting.coarsening < self._setting.coarsening:
            raise NotRun("finer than the run to measure it against, for which there is no time")

    def errors(self, dataset: xr.Dataset) -> dict[str, float]:
        """Of a result with the same rows."""
        return differences(dataset, self._dataset, self._bench.quantities)

    def of_coarsening(self, factor: float) -> dict[str, float]:
        """Errors that a grid alone makes: of a run on it that is as sharp as the finest one."""
        if factor not in self._of_coarsening:
            self._run_on(factor)
        return self._of_coarsening[factor]

    def _run_on(self, factor: float) -> xr.Dataset | None:
        """The run on cells so many times longer, whose errors are kept; None where it cannot be had."""
        try:
            found = self._bench.run(replace(self._setting, coarsening=factor)).dataset
            self._of_coarsening[factor] = self.errors(found)
        except NotRun:
            self._of_coarsening[factor] = dict.fromkeys(self._bench.quantities, math.nan)
            return None
        return found

    def _uncertainties(self) -> tuple[dict[str, float], dict[str, float]]:
        """What the steps and what the grid leave unknown; missing where the runs for it cannot be had."""
        names, own, fine = self._bench.quantities, self._setting.coarsening, self._dataset
        unknown = dict.fromkeys(names, math.nan)
        try:
            looser = self.errors(self._bench.run(replace(self._setting, tolerance=self._sharpest)).dataset)
        except NotRun:
            return unknown, unknown
        # the error follows the tolerance, unevenly: hence the larger safety factor
        in_time = {name: TWO_GRIDS * value / (_SHARPER - 1) for name, value in looser.items()}
        if (second := self._run_on(_SECOND * own)) is None:
            return in_time, unknown
        third = self._run_on(_THIRD * own)
        near = self._of_coarsening[_SECOND * own]
        far = unknown if third is None else differences(third, second, names)
        ratio = math.sqrt(fine.sizes["x"] * fine.sizes["y"] / (second.sizes["x"] * second.sizes["y"]))
        moving = "friction_coefficient" in fine
        return in_time, {
            name: float(grid_uncertainty(name, near[name], far[name], ratio, moving=moving)) for name in names
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


def relative(difference: Array, values: Array) -> float:
    """Largest difference over the largest value; missing where all values are zero."""
    largest = float(np.fmax.reduce(np.abs(values), initial=0.0))
    return float(np.max(np.abs(difference))) / largest if largest else np.nan
