"""The driver: takes the rows that an experiment yields from a problem, one after the other, and has them recorded."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from scipy import fft

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.experiment.grid_error import with_grid_error
from roughvisc.experiment.protocol import Experiment, Outgrown, Rows
from roughvisc.experiment.resources import threads_for
from roughvisc.labels import annotate, in_order, warnings_of, warnings_text
from roughvisc.mechanics.body import separability_error
from roughvisc.mechanics.materials.creep import complete
from roughvisc.problem import Problem
from roughvisc.recorder import Checkpoint, MemoryRecorder, Recorder, RowStore
from roughvisc.steps import TITLE, with_steps
from roughvisc.topography.grid import checked, nominal_area
from roughvisc.variables import RESULT_FORMAT, STEPPED

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
    problem = replace(problem, height=checked(problem.height, "height", least=1)).with_known_boundary(
        experiment.boundary
    )
    for name, found, why in experiment.unsupported(problem.settings):
        raise InputError(f"{name} is {found!r}: {why}")
    problem = experiment.prepared(problem)
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
        wanted = replace(problem, settings=experiment.with_rows_at(settings, places)).on(few, fields=("pressure",))
        found = _solve_once(wanted, loads, MemoryRecorder(), False, count)
        apart = np.abs(found[experiment.axis].values[:, None] - places)  # a slide has others, by half a longer cell
        return found.isel({experiment.axis: apart.argmin(axis=0)})

    return annotate(in_order(with_grid_error(dataset, height, on_coarser))).drop_vars(needed)


def _solve_once(
    problem: Problem, experiment: Experiment, recorder: Recorder, progress: bool | Progress, threads: int
) -> xr.Dataset:
    """Do it on the surface as it is."""
    from roughvisc.progress import reporting  # slow to import

    began = time.perf_counter()
    reached = recorder.latest
    spent, state, count = reached.wall_time - began, reached.state, reached.rows
    with fft.set_workers(threads), reporting(progress, experiment.doing, at=experiment.progress) as report:
        while True:
            rows = experiment.rows(problem, state, in_memory=recorder.in_memory)
            if reached.state is not None:
                log.info("resumes after %s", experiment.progress(reached.done, rows.end))
            try:
                for row in rows:
                    took = spent + time.perf_counter()
                    if row.values:
                        values = {experiment.axis: row.at, **row.values, "wall_time": took}
                        recorder.rows.append({"row": values, "kept": row.kept, "facts": row.facts}, row.fields)
                        count += 1
                    report(row.done, rows.end)
                    if row.state is not None:
                        recorder.update(Checkpoint(row.state, row.done, count, took, reached.transforms))
                break
            except Outgrown as outgrown:
                log.info("contact has outgrown its domain: the run begins anew on a larger one")
                recorder.restart()
                reached, state, count = recorder.latest, outgrown.state, 0
        if not rows.order(recorder.rows):
            raise ConvergenceError("no step was accepted at a kept time: expected a program with at least one segment")
        return dataset_of(problem, experiment, rows, recorder.rows)


def dataset_of(problem: Problem, experiment: Experiment, rows: Rows, records: RowStore) -> xr.Dataset:
    """All rows of a solve as a labelled Dataset; fields in a file are read when they are asked for.

    Parameters
    ----------
    problem, experiment : Problem, Experiment
        What was solved.
    rows : Rows
        Of the experiment, all of them found.
    records : RowStore
        What was recorded of them, at least one row.

    Returns
    -------
    xarray.Dataset
        Over the axis of the experiment, as :mod:`roughvisc.variables` declares it.
    """
    height, axis, settings = rows.height, experiment.axis, problem.settings
    kept = rows.order(records)
    values = [plain["row"] | rows.settled(records, number) for number, plain in enumerate(records.plain)]
    columns = {name: np.array([values[number][name] for number in kept]) for name in values[kept[0]]}
    columns = rows.columns(columns)
    stamp = columns.pop(axis)
    variables: dict[str, Any] = {name: ((axis,), column) for name, column in columns.items()}
    for name in settings.fields:
        frames = records.stacked(partial(rows.field, records, name), kept, (height.shape[0], height.shape[1]))
        variables[name] = ((axis, "x", "y"), frames)
    highest = {} if rows.highest is None else {"highest": rows.highest}
    variables["height"] = (("x", "y"), np.asarray(height.values, dtype=float), highest)
    if "filled" in height.coords:
        variables["filled"] = (("x", "y"), height["filled"].values)
    dataset = xr.Dataset(
        variables,
        coords={axis: (axis, stamp), "x": height["x"].values, "y": height["y"].values},
        attrs={
            "Conventions": "CF-1.11",
            "result_format": RESULT_FORMAT,
            **settings.to_attributes(),
            "history": str(height.attrs.get("history", "")),
        },
    )
    dataset = annotate(in_order(dataset))
    stated = _of_the_scene(problem, experiment) | rows.attributes(dataset)
    stated["warnings"] = warnings_text(warnings_of(stated))
    dataset.attrs |= {name: value for name, value in stated.items() if value != ""}
    return with_steps(dataset, _steps(values)) if axis == "time" else dataset


def _steps(values: list[dict[str, Any]]) -> xr.Dataset:
    """Histories of every accepted step, over ``step``."""
    names = [name for name in STEPPED if name in values[0]]
    columns = {name: ("time", np.array([row[name] for row in values])) for name in names}
    steps = annotate(xr.Dataset(columns, coords={"time": [row["time"] for row in values]}, attrs={"title": TITLE}))
    return steps.drop_indexes("time").rename_dims(time="step")


def _of_the_scene(problem: Problem, experiment: Experiment) -> dict[str, Any]:
    """What an audit asks that the variables do not say, so that a result without a study can be audited too."""
    body, height = problem.body, problem.height
    material = complete(body.material)
    size = max(float(np.ptp(height[axis].values)) for axis in ("x", "y"))
    return {
        **body.attributes(),
        "compliance_at_once": float(material.contact_compliance(0.0)),
        "compliance_at_end": float(material.contact_compliance(experiment.creep_time(size))),
        "poisson": "" if separability_error(body.material) else material.poisson,
        "time_scale": experiment.time_scale,
        "recipe": str(height.attrs.get("recipe", "")),
    }
