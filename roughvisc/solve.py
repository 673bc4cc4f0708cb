"""The driver: takes the rows that an experiment yields from a problem, one after the other, and has them recorded."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import xarray as xr
from scipy import fft

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.experiment.available import threads_for
from roughvisc.experiment.grid_error import with_grid_error
from roughvisc.experiment.malloc import retain_arena
from roughvisc.experiment.protocol import Experiment
from roughvisc.labels import annotate
from roughvisc.mechanics.fields.reuse import reused
from roughvisc.problem import Problem
from roughvisc.recorder import MemoryRecorder, Recorder
from roughvisc.result import dataset_of
from roughvisc.topography.grid import checked, nominal_area

log = logging.getLogger("roughvisc")

Progress = Callable[[float, float], None]


def solve(
    problem: Problem,
    experiment: Experiment,
    recorder: Recorder | None = None,
    *,
    progress: bool | Progress = False,
    threads: int | None = None,
) -> xr.Dataset:
    """Do an experiment with a problem.

    Parameters
    ----------
    problem : Problem
        Surface, body and settings.
    experiment : Experiment
        What is done.
    recorder : Recorder, optional
        Takes what is computed, and knows where to go on from. Default: in memory, from the beginning.
    progress : bool or callable
        A progress bar, or a function called with how far it is of how much.
    threads : int, optional
        As :func:`roughvisc.simulate` has them.

    Returns
    -------
    xarray.Dataset
        The whole result, over the axis of the experiment.

    Raises
    ------
    InputError
        If the input is wrong; nothing has been computed then.
    ConvergenceError
        If there is no row.
    """
    problem = replace(problem, height=checked(problem.height, "height", least=1))
    for name, found, why in experiment.unsupported(problem.settings):
        raise InputError(f"{name} is {found!r}: {why}")
    problem.check_cells()
    height, settings, count = problem.height, problem.settings, threads_for(threads)
    again = settings.grid_error and not experiment.states_grid_error
    needed = ("pressure",) if again and "pressure" not in settings.fields else ()
    dataset = _solve_once(
        problem.on(height, fields=(*settings.fields, *needed)),
        experiment,
        recorder or MemoryRecorder(),
        progress,
        count,
    )
    if not again:
        return dataset

    loads = experiment.on_area(nominal_area(height))  # coarser grids may be of other sizes

    def on_coarser(few: xr.DataArray, places: list[float]) -> xr.Dataset:
        wanted = replace(problem, height=few, settings=experiment.with_rows_at(settings, places))
        found = _solve_once(wanted.on(few, fields=("pressure",)), loads, MemoryRecorder(), False, count)
        apart = np.abs(found[experiment.axis].values[:, None] - places)  # a slide has others, by half a longer cell
        return found.isel({experiment.axis: apart.argmin(axis=0)})

    return annotate(with_grid_error(dataset, height, on_coarser)).drop_vars(needed)


def _solve_once(
    problem: Problem, experiment: Experiment, recorder: Recorder, progress: bool | Progress, threads: int
) -> xr.Dataset:
    """Do it on the surface as it is."""
    from roughvisc.progress import reporting  # slow to import

    began = time.perf_counter()
    reached = recorder.latest
    spent = reached.wall_time - began
    with fft.set_workers(threads), retain_arena(8 * problem.height.size):
        rows = experiment.rows(problem, reached.state, in_memory=recorder.in_memory)
        if reached.state is not None:
            log.info("goes on after %s", experiment.progress(reached.done, rows.end))
            reached = replace(reached, state=None)
        with reused(), reporting(progress, experiment.doing, at=experiment.progress) as report:
            for row in rows:
                reached = reached.after(row.state, row.done, bool(row.values), spent + time.perf_counter())
                if row.values:
                    values = {experiment.axis: row.at, **row.values, "wall_time": reached.wall_time}
                    recorder.rows.append({"row": values, "kept": row.kept, "facts": row.facts}, row.fields)
                report(row.done, rows.end)
                if row.state is not None:
                    recorder.passed(reached)
                reached = replace(reached, state=None)  # the recorder holds it if it is needed
                del row  # its fields are not needed while the next one is computed
        if not rows.order(recorder.rows):
            raise ConvergenceError("no step was accepted at a kept time: expected a program with at least one segment")
        return dataset_of(problem, experiment, rows, recorder.rows)
