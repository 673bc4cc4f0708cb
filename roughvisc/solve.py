"""The driver: runs an experiment, records its rows and returns them as a Dataset."""

from __future__ import annotations

import logging
import multiprocessing
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from operator import itemgetter
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import fft

from roughvisc.arguments import count
from roughvisc.experiment.accuracy import filled_warning
from roughvisc.experiment.base import Experiment, Outgrown, Row, Rows
from roughvisc.experiment.grid_error import with_grid_error
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.problem import Problem
from roughvisc.labels import CARRIED, TITLE, label
from roughvisc.mechanics.grid import transform_library
from roughvisc.settings import attraction
from roughvisc.topography.grid import nominal_area
from roughvisc.variables import STEP, STEPPED, VARIABLES
from roughvisc.version import program_version

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


@dataclass(eq=False)
class Recorder:
    """Rows of a solve, kept in memory.

    Attributes
    ----------
    latest : Checkpoint
        Checkpoint from which the solve continues.
    plain : list of dict
        Values of the rows, with ``kept``.
    in_memory : bool
        Whether fields stay in memory.
    """

    latest: Checkpoint = Checkpoint()
    plain: list[dict[str, Any]] = field(default_factory=list)
    in_memory: ClassVar[bool] = True
    _arrays: list[dict[str, Array]] = field(default_factory=list)

    def append(self, row: Row, axis: str, wall_time: float) -> None:
        """Record the values and fields of a row on an axis, and the wall time spent so far [s]; states are not kept."""
        if row.values:
            self.plain.append({axis: row.at, **row.values, "wall_time": wall_time, "kept": row.kept})
            self._arrays.append(dict(row.fields))

    def field(self, name: str, rows: Sequence[int], shape: tuple[int, int]) -> Any:
        """Return a field of some rows, an array (rows, x, y). The recorder does not keep it."""
        frames = np.empty((len(rows), *shape))
        for frame, row in zip(frames, rows, strict=True):
            frame[...] = self._arrays[row].pop(name)  # frees its memory
        return frames

    def restart(self) -> None:
        """Delete all rows, because the solve starts again."""
        self.plain = []
        self._arrays = []


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
        As in :func:`roughvisc.simulate`: by default all cores in the main thread of a process that ``multiprocessing``
        did not start, otherwise one.

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
    if count("threads", threads, 1) is None:
        from dask.system import CPU_COUNT  # slow to import

        threads = int(fft.get_workers())
        is_alone = threading.current_thread() is threading.main_thread() and multiprocessing.parent_process() is None
        threads = CPU_COUNT if threads == 1 and is_alone else threads
    problem = experiment.resolved(problem)
    height = problem.height
    settings = problem.settings
    # steady sliding estimates the error of its grid itself
    loading = experiment if settings.grid_error and isinstance(experiment, Loading) else None
    compared = ("pressure", "gap") if attraction(settings) is not None else ("pressure",)
    needed = tuple(name for name in compared if loading and name not in settings.fields)
    problem = replace(problem, settings=replace(settings, fields=(*settings.fields, *needed)))
    bar: AbstractContextManager[Progress | None] = nullcontext(progress if callable(progress) else None)
    if progress is True:
        from roughvisc.progress import reporting  # slow to import

        bar = reporting("pressing" if experiment.axis == "time" else "sliding", experiment.progress)
    with fft.set_workers(threads):
        with bar as report:
            dataset = solve_on_grid(problem, experiment, recorder or Recorder(), report)
        if loading is not None:
            # coarser grids may have another area: convert nominal pressures to loads on the given area
            loads = Loading(loading.program.on_area(nominal_area(height)))

            def on_coarser(few: xr.DataArray, times: list[float]) -> xr.Dataset:
                coarse = replace(problem, height=few, settings=replace(settings, fields=("pressure",), times=times))
                dataset = solve_on_grid(coarse, loads, Recorder())
                # in a slide times differ by half a coarser cell
                apart = np.abs(dataset["time"].values[:, None] - times)
                return dataset.isel(time=apart.argmin(axis=0))

            dataset = with_grid_error(dataset, height, on_coarser).drop_vars(needed)
    if experiment.axis == "time":
        of_steps = [name for name, variable in VARIABLES.items() if variable.is_of_steps]
        dataset = dataset.drop_vars(of_steps, errors="ignore")
    return label(dataset[sorted(dataset.data_vars, key=list[Any](VARIABLES).index)])  # main results first


def solve_on_grid(
    problem: Problem, experiment: Experiment, recorder: Recorder, report: Progress | None = None
) -> xr.Dataset:
    """Solve on the given grid, without the runs on coarser grids and without labels."""
    began = time.perf_counter()
    reached = recorder.latest
    state = reached.state
    spent = reached.wall_time
    while True:
        rows = experiment.rows(problem, state, in_memory=recorder.in_memory)
        if reached.state is not None:
            log.info("resumes after %s", experiment.progress(reached.done, rows.end))
        try:
            for row in rows:
                recorder.append(row, experiment.axis, spent + time.perf_counter() - began)
                if report is not None:
                    report(row.done, rows.end)
                del row  # frees its memory while the next one is computed
            return dataset_of(experiment, rows, recorder)
        except Outgrown as outgrown:
            log.info("contact has outgrown its domain: the run begins again on a larger one")
            recorder.restart()
            reached = recorder.latest
            state = outgrown.args[0]


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
    height = rows.problem.height
    settings = rows.problem.settings
    axis = experiment.axis
    steps = recorder.plain
    kept = list(filter(itemgetter("kept"), steps))
    numbers = np.flatnonzero(list(map(itemgetter("kept"), steps))).tolist()
    attributes: dict[str, Any] = {"highest": rows.profile.highest}
    for name in _ORIGIN:
        if name in height.attrs:
            attributes[name] = height.attrs[name]
    variables: dict[str, Any] = {"height": (("x", "y"), np.asarray(height.values, dtype=float), attributes)}
    columns = {}
    for name in kept[0]:
        if name != "kept":
            kind = VARIABLES[name].dtype if name in VARIABLES else float  # only finish() reads the others
            columns[name] = axis, np.array(list(map(itemgetter(name), kept)), kind)
    coordinates = {axis: columns.pop(axis), "x": height["x"].values, "y": height["y"].values}
    variables |= columns
    for name in settings.fields:
        frames = recorder.field(name, numbers, (height.shape[0], height.shape[1]))
        variables[name] = (axis, "x", "y"), frames
    if "filled" in height.coords:
        variables["filled"] = ("x", "y"), height["filled"].values
    made = {
        "Conventions": "CF-1.11",
        "source": f"{program_version()}; {transform_library()}",
        "history": str(height.attrs.get("history", "")),
        "program": experiment.described(),
        "boundary": settings.boundary,
        "tolerance": settings.tolerance,
    } | experiment.facts(rows.problem.body, height)
    dataset, warnings = rows.finish(xr.Dataset(variables, coordinates, made))

    tables = list[str]()
    lines = list[str]()
    for material in rows.problem.body.materials:
        if material.warning and material.warning not in tables:
            tables.append(material.warning)
    for subject, text in (warnings | {"filled": filled_warning(height), "material": " ".join(tables)}).items():
        if text:
            lines.append(f"{subject}: {' '.join(text.split())}")
    if lines:
        dataset.attrs["warnings"] = "\n".join(lines)
    if axis == "time":
        every = {}
        for name in ("time", *STEPPED):
            if name in steps[0]:
                values = np.array(list(map(itemgetter(name), steps)))
                if name == "convolutions":
                    values = np.diff(values, prepend=0)
                every[name] = STEP, values.astype(VARIABLES[name].dtype)
        dataset.encoding[CARRIED] = label(xr.Dataset(every, attrs={"title": TITLE}).set_coords("time"))
    return dataset
