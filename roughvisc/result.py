"""The Dataset that the recorded rows of an experiment form."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.experiment.protocol import Experiment, Rows
from roughvisc.labels import annotate
from roughvisc.mechanics.bodies.body import separability_error
from roughvisc.mechanics.materials.protocol import complete
from roughvisc.problem import Problem
from roughvisc.recorder import RowStore
from roughvisc.topography.grid import TAPER
from roughvisc.variables import RESULT_FORMAT, STEPPED, of_step


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
    if len(kept) < len(values):
        for name in (axis, *(name for name in STEPPED if name in columns)):
            variables[of_step(name)] = (("step",), np.array([row[name] for row in values]))
    for name in settings.fields:
        frames = records.stacked(partial(rows.field, records, name), kept, (height.shape[0], height.shape[1]))
        variables[name] = ((axis, "x", "y"), frames)
    highest = {} if rows.highest is None else {"highest": rows.highest}
    variables["height"] = (("x", "y"), np.asarray(height.values, dtype=float), highest)
    if "filled" in height.coords:
        variables["filled"] = (("x", "y"), height["filled"].values)
    taper = {name: height[name].variable for name in TAPER if name in height.coords}
    dataset = xr.Dataset(
        variables,
        coords={axis: (axis, stamp), "x": height["x"].values, "y": height["y"].values, **taper},
        attrs={
            "Conventions": "CF-1.11",
            "result_format": RESULT_FORMAT,
            **settings.to_attributes(),
            "history": str(height.attrs.get("history", "")),
        },
    )
    dataset = annotate(dataset)
    said = _of_the_scene(problem, experiment) | rows.attributes(dataset)
    dataset.attrs |= {name: value for name, value in said.items() if value != ""}
    return dataset


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
