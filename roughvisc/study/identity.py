"""The key of a case: a digest of the computation, independent of its notation.

Defaults, units, pairs of equal numbers, cards and the model of a material do not count; the numbers behind them
do.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass, replace
from inspect import Parameter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from roughvisc.arguments import arguments, located, split
from roughvisc.errors import InputError
from roughvisc.experiment.base import Experiment
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.layer import LayeredBody
from roughvisc.mechanics.materials import MODELS
from roughvisc.mechanics.materials.material import Creep, Prony
from roughvisc.settings import Settings, attraction
from roughvisc.study.study_file import in_si
from roughvisc.topography.conditioning import FACE_STEPS, STEPS
from roughvisc.topography.heights import area_in, digest_in
from roughvisc.topography.readers import sha256
from roughvisc.topography.recipes import RECIPES, finest_wave, self_affine
from roughvisc.topography.scans import is_card, measured_file, open_scan, read_card
from roughvisc.units import number

if TYPE_CHECKING:
    import xarray as xr

#: Arguments of a surface that one number or a pair states.
_PAIRS = ("size", "spacing", "shape")
#: Models that a computation converts to a series. Processors may round it differently, so that the arguments count.
_CONVERTED = ("from_relaxation", "creep_table", "relaxation_table", "dynamic_table")
#: Steps that may change the nominal area of a recipe.
_RESIZE = ("crop", "realisation", "resample")


def digest(stated: Any) -> str:
    """Return the SHA-256 of nested values, with numbers rounded to 15 significant digits and without notes."""

    def rounded(number: str) -> str:
        return f"{float(number) + 0.0:.15g}"  # of -0.0 and 0.0 the same

    def without_note(table: dict[str, Any]) -> dict[str, Any]:
        table.pop("note", None)
        return table

    plain = json.loads(
        json.dumps(stated), object_hook=without_note, parse_int=rounded, parse_float=rounded, parse_constant=rounded
    )
    return hashlib.sha256(json.dumps(plain, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


# -------------------------------------------------------------------------------------------------------------- surface


def checksums_of(surface: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return checksums of the scan or recipe of each face and of its surface card, without the origin of the card."""
    checksums = []
    for face in filter(None, (surface, surface.get("second"))):
        if "file" not in face:
            checksums.append((digest(_recipe(face)), ""))
            continue
        path = Path(face["file"])
        card = split(read_card(path)[1], "file")[1] if is_card(path) else {}
        scan = measured_file(path)
        try:
            content = digest(card) if scan is None else digest_in(scan.name) or sha256(scan)
            checksums.append((content, digest(card) if card else ""))
        except InputError as error:
            raise located(error, "surface.file") from error
    return checksums


def surface_identity(surface: Mapping[str, Any], checksums: Sequence[tuple[str, str]]) -> list[Any]:
    """Return the source of each face and its steps, the placing of the second face, and the steps of the profile."""
    second = surface.get("second")
    if not second:
        return _face(surface, checksums[0][0], STEPS)
    placing = {"flip": "x", "offset": [0.0, 0.0]} | split(second, "flip", "offset")[0]
    faces = [_face(face, known, FACE_STEPS) for face, (known, _) in zip((surface, second), checksums, strict=True)]
    return [*faces, placing, _steps(surface, [name for name in STEPS if name not in FACE_STEPS])]


def _face(face: Mapping[str, Any], checksum: str, steps: Sequence[str] | Mapping[str, Any]) -> list[Any]:
    """Return the source of a face and the steps of its card and its own, in the order in which they are applied."""
    if "file" not in face:
        return _with_steps([_recipe(face)], _steps(face, steps))
    path = Path(face["file"])
    card = dict[str, Any]()
    stages = list[dict[str, Any]]()
    if is_card(path):
        card = in_si(read_card(path)[1], "surface", {})
        stages.append(_steps(card, STEPS))
        if "generate" in card:
            return _with_steps([_recipe(card)], *stages, _steps(face, steps))
    options = _stated(open_scan, split(card or face, *arguments(open_scan, 1))[0], 1)
    if unit := options.get("unit"):
        with suppress(InputError):
            parts = unit.split(",") if isinstance(unit, str) else unit
            options["unit"] = [number(f"1 {parts[place].strip()}", "m") for place in (0, -1)]
    return _with_steps([checksum, options], *stages, _steps(face, steps))


def _with_steps(source: list[Any], *stages: dict[str, Any]) -> list[Any]:
    return [source, *filter(None, stages)]


def _recipe(face: Mapping[str, Any]) -> list[Any]:
    """Return the name of a recipe and all its arguments."""
    recipe = RECIPES[face["generate"]]
    stated = _stated(recipe, split(face, *arguments(recipe))[0])
    if recipe is self_affine and stated["shortcut"] is None:
        stated["shortcut"] = finest_wave(stated["size"], stated["shape"], stated["anisotropy"])
    return [face["generate"], stated]


def _steps(face: Mapping[str, Any], names: Sequence[str] | Mapping[str, Any]) -> dict[str, Any]:
    """Return all arguments of each step that is applied."""
    applied = {}
    for name in names:
        value = face.get(name, False)
        step = STEPS[name]
        if value is not False:
            table = value if isinstance(value, Mapping) else {} if value is True else {step.argument: value}
            applied[name] = _stated(step.function, table, 1)
    return applied


def _stated(function: Callable[..., Any], table: Mapping[str, Any], first: int = 0) -> dict[str, Any]:
    """Return the arguments of a function with its defaults; a pair for a number that counts for x and y."""
    stated = {}
    for name, (_, default) in arguments(function, first).items():
        value = table.get(name, None if default is Parameter.empty else default)
        stated[name] = [value, value] if name in _PAIRS and isinstance(value, int | float) else value
    return stated


# ------------------------------------------------------------------------------------------------- body and experiment


def body_identity(body: Body) -> list[Any]:
    """Return the numbers of a body: the series of each material, and the geometry."""
    if isinstance(body, LayeredBody):  # the kernel follows
        return [list(map(_material, body.materials)), body.thicknesses]
    return [_material(body.material), _plain(body.kernel)]


def _material(material: Prony | Creep) -> Any:
    """Return the series of a material, or its function and numbers; of a fitted or converted one the arguments."""
    name = material.model.get("model")
    if name == "pair" and not isinstance(material, Creep) and any(map(_is_converted, _pair(material))):
        return ["pair", *map(_material, _pair(material)), _plain(material.model.get("shift_factor"))]
    if name in _CONVERTED:
        scale = [material.model.get("shift_factor", 1.0), material.model.get("modulus_factor", 1.0)]
        return [name, _plain(_stated(MODELS[name], material.model)), *scale]
    return _plain(material)


def _pair(material: Prony) -> list[Any]:
    return [material.model["a"], material.model["b"]]


def _is_converted(material: Prony | Creep) -> bool:
    return material.model.get("model") in (*_CONVERTED, "pair")


def _plain(value: Any) -> Any:
    """Return a frozen value as lists of numbers and texts."""
    if is_dataclass(value) and not isinstance(value, type):
        parts = {
            attribute.name: getattr(value, attribute.name)
            for attribute in fields(value)
            if attribute.compare or attribute.name == "stands_for"
        }
        return [type(value).__name__, {name: _plain(inner) for name, inner in parts.items()}]
    if isinstance(value, Mapping):
        return {name: _plain(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(inner) for inner in value]
    return value.__name__ if callable(value) else value


def experiment_identity(experiment: Experiment, area: float | None) -> Any:
    """Return the segments of a program or the arguments of steady sliding, with loads if the nominal area is known."""
    if isinstance(experiment, Loading):
        program = experiment.program if area is None else experiment.program.on_area(area)
        return _plain(program.segments)
    if isinstance(experiment, SteadySliding) and area is not None and experiment.pressure is not None:
        experiment = replace(experiment, load=float(f"{experiment.pressure * area:.15g}"), pressure=None)
    return _plain(experiment)


def area_of(surface: Mapping[str, Any], heights: xr.DataArray | None = None) -> float | None:
    """Return the nominal area of a recipe or of heights from Python; None for a scan, whose file is not read.

    Parameters
    ----------
    surface : mapping
        Table of the surface. After steps that may change the area it is None.
    heights : xarray.DataArray, optional
        Heights of the file that the surface names, which need not exist. [m]

    Returns
    -------
    float or None
        Area. [m2]
    """
    if "second" in surface or any(surface.get(name, False) is not False for name in _RESIZE):
        return None
    if "generate" not in surface:
        path = Path(surface["file"])
        return area_in(path, heights) if digest_in(path.name) else None
    size = surface["size"]
    x, y = size if isinstance(size, list | tuple) else (size, size)
    return float(x) * float(y)


def settings_identity(settings: Settings) -> dict[str, Any]:
    """Return the settings without defaults, and the fields in alphabetic order, each once."""
    stated: dict[str, Any] = {"fields": sorted(set(settings.fields))}
    for setting in fields(settings):
        value = attraction(settings) if setting.name == "adhesion" else getattr(settings, setting.name)
        if setting.name != "fields" and value != setting.default:
            stated[setting.name] = _plain(value)
    return stated
