"""The driver: runs an experiment, records its rows and returns them as a Dataset."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy import fft

from roughvisc.experiment.base import Experiment, Outgrown, Problem, Rows
from roughvisc.experiment.grid_error import with_grid_error
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.resources import threads_for
from roughvisc.labels import ISSUED, TITLE, label, warnings_of, with_steps
from roughvisc.topography.grid import nominal_area
from roughvisc.topography.indenters import highest
from roughvisc.variables import OF_STEPS, STEP, STEPPED, VARIABLES

log = logging.getLogger("roughvisc")
Array = NDArray[Any]
Progress = Callable[[float, float], None]
#: Attributes of a surface that stay with its heights: the source, and the number of filled points.
_ORIGIN = ("source_file", "format", "instrument", "channel", "recipe", "filled_points")


@dataclass(frozen=True)
class Checkpoint:
    """Progress of a solve.

    Attributes
    ----------
    state : Any
        State from which the rows of the experiment continue; None at the start.
    done : float
        Progress, in the unit of the end of the rows.
    rows : int
        Number of recorded rows, including rows of steps that are not kept.
    wall_time : float
        Wall time spent so far. [s]
    """

    state: Any = None
    done: float = 0.0
    rows: int = 0
    wall_time: float = 0.0


class Recorder:
    """Rows of a solve, kept in memory.

    Attributes
    ----------
    latest : Checkpoint
        Checkpoint from which the solve continues.
    plain : list of dict
        Values of the rows, with ``kept`` and ``place``.
    in_memory : bool
        Whether fields stay in memory.
    """

    in_memory = True

    def __init__(self) -> None:
        self.latest = Checkpoint()
        self.plain: list[dict[str, Any]] = []
        self._arrays: list[Mapping[str, Array]] = []

    def append(self, plain: dict[str, Any], arrays: Mapping[str, Array]) -> None:
        """Record the values and the fields of a row; the caller must not change the arrays afterwards."""
        self.plain.append(plain)
        self._arrays.append(arrays)

    def update(self, reached: Checkpoint) -> None:
        """Record the progress, from which a stopped solve can continue. A solve in memory keeps no state."""

    def field(self, name: str, rows: Sequence[int], shape: tuple[int, int]) -> Any:
        """Return a field of some rows, an array (rows, x, y)."""
        return np.stack([self._arrays[row][name] for row in rows])

    def restart(self) -> None:
        """Delete all rows, because the solve starts again."""
        self.plain, self._arrays = [], []


def solve(
    problem: Problem,
    experiment: Experiment,
    recorder: Recorder | None = None,
    *,
    progress: bool | Progress = False,
    threads: int | None = None,
) -> xr.Dataset:
    """Run an experiment and return its result.

    Parameters
    ----------
    problem : Problem
        Surface, body and settings.
    experiment : Experiment
        A loading or steady sliding.
    recorder : Recorder, optional
        Records the rows, and contains the checkpoint from which the run continues. Default: in memory, from the start.
    progress : bool or callable
        A progress bar, or a function called with the progress and its end.
    threads : int, optional
        As in :func:`roughvisc.simulate`.

    Returns
    -------
    xarray.Dataset
        The whole result, over the axis of the experiment.

    Raises
    ------
    InputError
        If the input is invalid; raised before anything is computed.
    ConvergenceError
        If the contact of a step or at a speed is not solved.
    """
    problem = problem.resolved(experiment)
    height, settings = problem.height, problem.settings
    needed = () if "pressure" in settings.fields or not isinstance(experiment, Loading) else ("pressure",)
    if settings.grid_error:
        problem = replace(problem, settings=replace(settings, fields=(*settings.fields, *needed)))
    bar: AbstractContextManager[Progress | None] = nullcontext(progress if callable(progress) else None)
    if progress is True:
        from roughvisc.progress import reporting  # slow to import

        bar = reporting("pressing" if experiment.axis == "time" else "sliding", experiment.progress)
    with fft.set_workers(threads_for(threads)):
        with bar as report:
            dataset = solve_on_grid(problem, experiment, recorder or Recorder(), report)
        for subject, text in warnings_of(dataset.attrs).items():
            if subject not in ISSUED:
                log.warning("%s", text)
        if settings.grid_error and isinstance(experiment, Loading):
            # coarser grids may have another area: convert nominal pressures to loads on the given area
            loads = Loading(experiment.program.on_area(nominal_area(height)))

            def on_coarser(few: xr.DataArray, times: list[float]) -> xr.Dataset:
                coarse = replace(problem, height=few, settings=replace(settings, fields=("pressure",), times=times))
                found = solve_on_grid(coarse, loads, Recorder())
                apart = np.abs(found["time"].values[:, None] - times)  # in a slide times differ by half a coarser cell
                return found.isel(time=apart.argmin(axis=0))

            dataset = with_grid_error(dataset, height, on_coarser).drop_vars(needed)
    kept = [name for name in dataset.data_vars if experiment.axis != "time" or name not in OF_STEPS]
    return label(dataset[sorted(kept, key=list(VARIABLES).index)])  # main results first


def solve_on_grid(
    problem: Problem, experiment: Experiment, recorder: Recorder, report: Progress | None = None
) -> xr.Dataset:
    """Solve on the given grid, without the runs on coarser grids and without labels."""
    began, reached = time.perf_counter(), recorder.latest
    state, count, spent = reached.state, reached.rows, reached.wall_time
    while True:
        rows = experiment.rows(problem, state, in_memory=recorder.in_memory)
        if reached.state is not None:
            log.info("resumes after %s", experiment.progress(reached.done, rows.end))
        try:
            for row in rows:
                took = spent + time.perf_counter() - began
                if row.values:
                    values = {experiment.axis: row.at, **row.values, "wall_time": took}
                    recorder.append(values | {"kept": row.kept, "place": row.place}, row.fields)
                    count += 1
                if report is not None:
                    report(row.done, rows.end)
                if row.state is not None:
                    recorder.update(Checkpoint(row.state, row.done, count, took))
            return dataset_of(experiment, rows, recorder)
        except Outgrown as outgrown:
            log.info("contact has outgrown its domain: the run begins again on a larger one")
            recorder.restart()
            reached, state, count = recorder.latest, outgrown.args[0], 0


def dataset_of(experiment: Experiment, rows: Rows, recorder: Recorder) -> xr.Dataset:
    """Return all rows of a solve as a Dataset; fields in a file are read when they are needed.

    Parameters
    ----------
    experiment : Experiment
        A loading or steady sliding.
    rows : Rows
        Rows of the experiment, complete.
    recorder : Recorder
        Recorder of these rows.

    Returns
    -------
    xarray.Dataset
        Over the axis of the experiment, not labelled yet.
    """
    height, settings, axis = rows.problem.height, rows.problem.settings, experiment.axis
    steps = pd.DataFrame(recorder.plain)
    kept = steps[steps["kept"]].sort_values("place", kind="stable")
    attributes = {"highest": highest(height)} | {name: height.attrs[name] for name in _ORIGIN if name in height.attrs}
    variables: dict[str, Any] = {"height": (("x", "y"), np.asarray(height.values, dtype=float), attributes)}
    for name in kept.columns.drop(["kept", "place", axis]):
        variables[name] = axis, kept[name].to_numpy()
    for name in settings.fields:
        field = recorder.field(name, kept.index.tolist(), (height.shape[0], height.shape[1]))
        variables[name] = (axis, "x", "y"), field
    if "filled" in height.coords:
        variables["filled"] = ("x", "y"), height["filled"].values
    coordinates = {axis: kept[axis].to_numpy(), "x": height["x"].values, "y": height["y"].values}
    made = {"Conventions": "CF-1.11", "boundary": settings.boundary, "tolerance": settings.tolerance}
    made["history"] = str(height.attrs.get("history", ""))
    dataset = rows.finish(xr.Dataset(variables, coordinates, made))
    if axis != "time":
        return dataset
    steps["convolutions"] = np.diff(steps["convolutions"], prepend=0)
    every = {name: (STEP, steps[name].to_numpy()) for name in ("time", *STEPPED) if name in steps}
    return with_steps(dataset, label(xr.Dataset(every, attrs={"title": TITLE}).set_coords("time")))
