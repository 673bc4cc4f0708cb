"""Tables of a study from objects of Python: a surface, a material or a body, a program or steady sliding."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.arguments import arguments, split
from roughvisc.errors import InputError
from roughvisc.experiment.accuracy import series_of_run
from roughvisc.experiment.base import Experiment
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.problem import OPEN_BOUNDARY, boundary_of
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.adhesion import Adhesion
from roughvisc.mechanics.body import HALF_SPACE, Body
from roughvisc.mechanics.layer import LayeredBody
from roughvisc.mechanics.materials.material import Creep, Material, Prony, check_material, pair_creep, power_creep
from roughvisc.mechanics.program import Segment
from roughvisc.mechanics.sheet import Sheet
from roughvisc.settings import Settings
from roughvisc.study.study_file import TABLE_OF, body_of, program_of
from roughvisc.topography.heights import file_name, plain_heights
from roughvisc.topography.recipes import RECIPES

#: Largest number of rounding steps between the number of cycles in a table and its quotient of two times.
_ROUNDINGS = 2


def tables_of(
    surface: Any, material: Any, program: Any, settings: Settings, **further: Any
) -> tuple[dict[str, Any], xr.DataArray | None]:
    """Return the tables of a study that state some objects, and the heights if the table names their file.

    Parameters
    ----------
    surface, material, program
        As in :class:`roughvisc.Case`.
    settings : Settings
        Settings of the solve.
    **further
        Tables ``observe`` and ``audit``, and the title; None for an absent one.

    Raises
    ------
    InputError
        If an object cannot be stated. The key names the argument.
    """
    table, heights = surface_table(surface)
    experiment = experiment_of(program)
    tables: dict[str, Any] = {key: value for key, value in further.items() if value is not None}
    tables |= {"surface": table, "material": material_table(material, experiment, settings)}
    tables |= experiment_table(experiment)
    for setting in fields(Settings):
        value = getattr(settings, setting.name)
        if setting.name in TABLE_OF and value != setting.default:
            tables.setdefault(TABLE_OF[setting.name], {})[setting.name] = (
                list(value) if isinstance(value, tuple) else value
            )
    if settings.adhesion is not None:
        tables["adhesion"] = adhesion_table(settings.adhesion)
    if heights is not None and settings.boundary == "auto" and settings.edge != "accept":
        boundary = experiment.boundary or boundary_of(heights)
        if boundary is None:
            raise InputError(key="boundary", found="auto", expected=OPEN_BOUNDARY)
        tables.setdefault("solve", {})["boundary"] = boundary
    return tables, heights


# -------------------------------------------------------------------------------------------------------------- surface


def surface_table(surface: Any) -> tuple[dict[str, Any], xr.DataArray | None]:
    """Return the table of a surface: its recipe if it gives these heights, otherwise their file, and the heights."""
    heights = plain_heights(surface)
    if recipe := _recipe_of(heights):
        return recipe, None
    return {"file": file_name(heights)}, heights


def _recipe_of(h: xr.DataArray) -> dict[str, Any]:
    """Return the table of the recipe that gives exactly these heights; empty without one."""
    with suppress(KeyError, TypeError, ValueError):
        recipe = json.loads(h.attrs["recipe"])
        made = RECIPES[recipe["name"]]
        defaults = {name: default for name, (_, default) in arguments(made).items()}
        stated = {name: value for name, value in recipe["parameters"].items() if value != defaults[name]}
        stated |= {"size": recipe["size"], "shape": recipe["shape"]}
        shorter = split(stated, "shortcut")[1]  # a recipe states its default
        for table in (shorter, stated) if shorter != stated else (stated,):
            if plain_heights(made(**table)).identical(h):
                return {"generate": recipe["name"], **table}
    return {}


# ------------------------------------------------------------------------------------------------------------- material


def material_table(material: Any, experiment: Experiment, settings: Settings) -> dict[str, Any]:
    """Return the table of a material or a body: its model if that gives the same numbers, otherwise its series."""
    body = material if isinstance(material, Body) else Body(check_material(material))
    if isinstance(body, LayeredBody):
        table = _of_material(body.materials[-1])
        for upper, thickness in zip(body.materials[-2::-1], body.thicknesses[::-1], strict=True):
            table = _of_material(upper) | {"thickness": thickness, "on": table}
    else:
        if isinstance(body.material, Creep) and not _is_stated(body.material):
            body = Body(_series_of(body.material, experiment, settings), body.kernel)
        table = _of_material(body.material)
        if isinstance(body.kernel, Sheet):
            table |= {"thickness": body.kernel.thickness, "base": body.kernel.base}
        elif body.kernel != HALF_SPACE:
            expected = "a half-space, rv.sheet or rv.layer; rv.simulate takes a kernel of your own"
            raise InputError(key="material", found=body.kernel, expected=expected)
    if not _is_same(body_of(table), body):
        raise InputError(key="material", found=material, expected="a body that rv.sheet or rv.layer makes")
    return table


def _of_material(material: Material) -> dict[str, Any]:
    """Return the table of a material."""
    with suppress(InputError):
        table = _plain(material.model)
        if table and _is_same(body_of(table), Body(material)):
            return table
    hidden = material.stands_for or material.misfit or not isinstance(material, Prony) or material.longest < math.inf
    if hidden or not isinstance(material, Prony):
        expected = "a material as a constructor of roughvisc returns it, or a series without a limit of time"
        raise InputError(key="material", found=material, expected=expected)
    names = ("glassy", "fluidity", "compliances", "times", "poisson")
    return {"model": "prony"} | {name: _plain(getattr(material, name)) for name in names}


def _plain(value: Any) -> Any:
    """Return an argument of a material as a study file states it: tables, lists, texts and numbers."""
    if isinstance(value, Prony | Creep):
        return _of_material(value)
    if isinstance(value, Mapping):
        return {name: _plain(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(inner) for inner in value]
    return value.item() if isinstance(value, np.generic) else value


def _is_same(body: Body, other: Body) -> bool:
    """Return whether two bodies give the same numbers, including the errors of their fits."""
    return body == other and all(
        (first.misfit, first.stands_for) == (two.misfit, two.stands_for)
        for first, two in zip(body.materials, other.materials, strict=True)
    )


def _is_stated(material: Material) -> bool:
    """Return whether no function of the user's is part of a material."""
    if isinstance(material, Creep) and material.function is pair_creep:
        return all(map(_is_stated, material.parameters))
    return isinstance(material, Prony) or material.function is power_creep


def _series_of(material: Creep, experiment: Experiment, settings: Settings) -> Prony:
    """Return the series that replaces a creep function of the user in a run."""
    if material.function is pair_creep or not isinstance(experiment, Loading):
        expected = "materials without a function of your own, in a pair and in steady sliding; rv.simulate takes them"
        raise InputError(key="material", found=material, expected=expected)
    return series_of_run(material, experiment.program, settings)


# ------------------------------------------------------------------------------------------------------------- adhesion


def adhesion_table(adhesion: Any) -> dict[str, float]:
    """Return the table of an attraction.

    Raises
    ------
    InputError
        If the argument is not an attraction.
    """
    if not isinstance(adhesion, Adhesion):
        raise InputError(key="adhesion", found=adhesion, expected="rv.adhesion(work=..., range=...), or None")
    return {"work": adhesion.work, "range": adhesion.range}


# ----------------------------------------------------------------------------------------------------------- experiment


def experiment_of(program: Any) -> Experiment:
    """Return the experiment of a program; steady sliding is one itself, with its speeds in order."""
    return program if isinstance(program, SteadySliding) else Loading(program)


def experiment_table(experiment: Experiment) -> dict[str, Any]:
    """Return the table ``friction`` of steady sliding, or the tables ``program``."""
    if isinstance(experiment, SteadySliding):
        stated = {argument.name: getattr(experiment, argument.name) for argument in fields(experiment)}
        stated["speeds"] = list(stated["speeds"])
        return {"friction": {name: value for name, value in stated.items() if value is not None}}
    assert isinstance(experiment, Loading)
    segments = list(experiment.program.segments)
    tables: list[dict[str, Any]] = []
    while segments:
        segment = segments.pop(0)
        if segments and segments[0].amplitude:  # a jump to the mean, and the wave
            tables.append(_of_cycle(segments.pop(0)))
        elif segment.slide is not None:
            tables.append(
                {"slide": segment.slide.distance, "over": segment.duration, "direction": segment.slide.direction}
            )
        elif segment.end is None:
            tables.append({"hold": segment.duration, "control": segment.control})
        else:
            tables.append({segment.control: segment.end, "over": segment.duration})
    if program_of(tables, can_pull=True) != experiment.program:
        expected = "segments that the methods of rv.Program make"
        raise InputError(key="program", found=experiment.program, expected=expected)
    return {"program": tables}


def _of_cycle(wave: Segment) -> dict[str, Any]:
    """Return the table of a cycle, with the number of cycles that gives the duration exactly."""
    count = wave.duration / wave.period
    near = [count]
    for direction in (-math.inf, math.inf):
        step = count
        for _ in range(_ROUNDINGS):
            step = math.nextafter(step, direction)
            near.append(step)
    exact = [cycles for cycles in [float(round(count)), *near] if cycles * wave.period == wave.duration]
    cycle = {"mean": wave.end, "amplitude": wave.amplitude, "period": wave.period, "cycles": (exact or near)[0]}
    return {"cycle": cycle, "control": wave.control}
