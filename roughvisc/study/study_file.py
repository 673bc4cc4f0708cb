"""Parts of a case from the tables of a study file: surface, body, experiment and settings; units of its keys.

A table contains the arguments of one function, which checks them; see :mod:`roughvisc.arguments`.
"""

from __future__ import annotations

import logging
import re
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields, replace
from itertools import filterfalse
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from roughvisc.arguments import (
    a_table,
    arguments,
    call,
    check,
    dotted,
    located,
    one_key,
    one_of,
    refuse_unknown,
    split,
    suits,
    units_of,
)
from roughvisc.errors import InputError
from roughvisc.experiment.base import Experiment
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.problem import OPEN_BOUNDARY
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.adhesion import adhesion
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.layer import layer
from roughvisc.mechanics.materials import MODELS
from roughvisc.mechanics.materials.material import LARGEST_SHIFT, Material, arrhenius, shift, stiffened, thermal, wlf
from roughvisc.mechanics.program import UNITS, Program
from roughvisc.mechanics.sheet import sheet
from roughvisc.observables import OBSERVABLES
from roughvisc.settings import Settings
from roughvisc.study.machine_history import read_history
from roughvisc.study.material_file import with_columns
from roughvisc.study.properties import properties
from roughvisc.study.sweep_table import value_at
from roughvisc.tables import Wanted, read_table
from roughvisc.topography.conditioning import STEPS
from roughvisc.topography.framing import combine
from roughvisc.topography.recipes import RECIPES
from roughvisc.topography.scans import check_surface, open_scan, surface_boundary
from roughvisc.units import format_quantity, number

log = logging.getLogger("roughvisc")

#: Tables of a study, without its sweep.
TABLES = ("title", "surface", "material", "adhesion", "program", "friction", "solve", "keep", "observe", "audit")
#: Keys of a temperature, which every model has, and of a body that is not a half-space.
TEMPERATURE = ("temperature", "reference_temperature", "wlf_c1", "wlf_c2", "activation_energy", "shift_factor")
GEOMETRY = ("thickness", "base", "on")
#: Method of each segment of a program, by the key of its first argument; and methods whose arguments are a table.
SEGMENTS: dict[str, Callable[..., Program]] = {
    name: getattr(Program, name) for name in ("load", "pressure", "approach", "hold", "slide")
}
PROGRAMS: dict[str, Callable[..., Program]] = {name: getattr(Program, name).__func__ for name in ("cycle", "table")}
#: Table of each setting; adhesion is a table itself.
TABLE_OF = {one.name: "solve" for one in fields(Settings) if one.name != "adhesion"} | {"missing": "surface"}
TABLE_OF |= dict.fromkeys(("fields", "times"), "keep")
_KEYS_OF = {table: [name for name, one in TABLE_OF.items() if one == table] for table in ("solve", "keep")}
#: Observable -> fields, one of which it needs.
_NEEDS = {"leakage": ("gap",), "conductance": ("pressure", "gap")}
#: Largest number of speeds of ``from``, ``to`` and ``count``.
_MOST_SPEEDS = 1000
#: Modulus below which a number without a unit is probably one in MPa: the softest brain tissues and hydrogels that are
#: measured have 100 Pa, and the stiffest rubbers have less than 100 MPa. [Pa]
_SOFTEST = 100.0
#: Largest excess of a kept time over the end of a program, relative to the duration.
_ROUNDING = 1e-12


#: Columns of the CSV file of ``generate = "spectrum"``, by argument.
SPECTRUM = {"wavevectors": Wanted("wavevector", "1/m"), "densities": Wanted("density", "m^4")}

# ----------------------------------------------------------------------------------------------------------------
# units

_TAKING: tuple[Callable[..., Any], ...] = (
    open_scan,
    combine,
    *RECIPES.values(),
    *(step.function for step in STEPS.values()),
    *MODELS.values(),
    wlf,
)
_TAKING += (arrhenius, sheet, adhesion, SteadySliding, Settings, *OBSERVABLES.values(), properties)
#: Unit of each key, from the functions that take the arguments; ``"1"`` for a pure number.
_UNITS = {name: unit for function in _TAKING for name, unit in units_of(function).items()}
_UNITS |= {name: units_of(step.function).get(step.argument, "") for name, step in STEPS.items()}
_UNITS |= {"wlf_c2": "K", "shift_factor": "1", "modulus_factor": "1", "from": "m/s", "to": "m/s", "time_step": "s"}
_UNITS |= UNITS | {"over": "s", "hold": "s", "period": "s", "times": "s", "slide": "m", "speed": "m/s", "cycles": "1"}


def in_si(value: Any, key: str, tables: Mapping[str, Any], folder: Path | None = None) -> Any:
    """Return a value of a study in SI, with absolute paths.

    Parameters
    ----------
    value : object
        A value, or a list or a table of values.
    key : str
        Dotted key of the value.
    tables : mapping
        Tables of the case, for units that depend on another key.
    folder : Path, optional
        Folder of relative paths. Without one, paths are not checked: the files of a stored case may have moved.

    Returns
    -------
    object
        The value, in which numbers replace texts with a unit. Other texts are unchanged.

    Raises
    ------
    InputError
        If a file does not exist, or an integer exceeds the largest number of double precision.
    """
    if key.endswith(".file"):
        if not isinstance(value, str) or not value:
            raise InputError(key=key, found=value, expected="the path of a file")
        path = (folder / Path(value).expanduser()).resolve() if folder else Path(value)
        if folder and not path.is_file():
            raise InputError(key=key, found=value, expected=f"an existing file, but there is none at {path}")
        return str(path)
    if isinstance(value, Mapping | list | tuple):
        parts = dict(value if isinstance(value, Mapping) else enumerate(value))
        for name, inner in parts.items():
            parts[name] = in_si(inner, f"{key}.{name}" if key else name, tables, folder)
        return parts if isinstance(value, Mapping) else list(parts.values())
    if isinstance(value, bool) or value is None:
        return value
    unit = unit_of(key, tables)
    if unit and isinstance(value, str):
        with suppress(InputError):
            return number(value, unit, difference=key.endswith("wlf_c2"))
    if isinstance(value, int):
        if abs(value) > sys.float_info.max:
            raise InputError(key=key, found=value, expected="a number with fewer digits")
        value = float(value) if unit not in ("", "1") else value
    if folder and unit == "Pa" and key.startswith("material.") and isinstance(value, float) and 0 < value < _SOFTEST:
        log.warning('%s = %g is %g Pa, softer than any gel: write the unit, as in "%g MPa"', key, value, value, value)
    return value


def unit_of(key: str, case: Mapping[str, Any] = MappingProxyType({})) -> str:
    """Return the unit of the value at a dotted key of a study: ``"1"`` for a pure number, empty if it has none.

    Parameters
    ----------
    key : str
        Dotted key, such as ``"program.0.load"``.
    case : mapping, optional
        The case as JSON, for units that depend on another key.

    Examples
    --------
    >>> unit_of("program.0.load"), unit_of("surface.seed"), unit_of("program.1.cycle.mean")
    ('N', '', '')
    >>> unit_of("program.0.cycle.amplitude", {"program": [{"cycle": {}, "control": "approach"}]})
    'm'
    """
    table, *path = key.split(".")
    names = list(filterfalse(str.isdecimal, path))
    if not names or key == "keep.times":  # a number in keep.times is a number of times
        return ""
    if table == "program" and names[-1] in ("mean", "amplitude", "values"):
        segment = value_at(case, f"program.{path[0]}", None)
        return UNITS.get(str(segment.get("control", "load")), "") if isinstance(segment, Mapping) else ""
    return _UNITS.get(names[-1], "")


# ----------------------------------------------------------------------------------------------------------------
# files


def with_files(data: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """Return the tables of a study, independent of its folder and of the files of its material and program.

    Parameters
    ----------
    data : mapping
        Tables of the TOML file.
    folder : Path or None
        Folder of relative paths. Without one, paths are kept and not checked.

    Returns
    -------
    dict
        The tables in SI, with absolute paths of scans, the content of CSV files, and speeds in order.
    """
    refuse_unknown("", data, TABLES)
    for name in ("surface", "material"):
        if name not in data:
            raise InputError(f"{name}: missing: expected a table [{name}]", key=name, expected=f"a table [{name}]")
    tables = in_si(data, "", data, folder)
    tables["surface"] = with_spectrum("surface", tables["surface"])
    tables["material"] = with_columns("material", tables["material"])
    if isinstance(segments := tables.get("program"), list):
        for place, stated in enumerate(segments):
            segments[place] = with_rows(f"program.{place}", stated)
    if isinstance(friction := tables.get("friction"), Mapping) and "speeds" in friction:
        tables["friction"] = {**friction, "speeds": speeds_of("friction.speeds", friction["speeds"])}
    return tables


def without_late_times(tables: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[float, ...]]:
    """Return the tables of a study without the listed times after the end of its program, and these times. [s]

    Parameters
    ----------
    tables : mapping
        As :func:`with_files` returns them. If no time would be left, they are returned unchanged.
    """
    times = value_at(tables, "keep.times", None)
    late: list[float] = []
    if isinstance(times, list) and "program" in tables:
        end = program_of(tables["program"], "adhesion" in tables).duration * (1 + _ROUNDING)
        late = [time for time in times if isinstance(time, int | float) and time > end]
    if not 0 < len(late) < len(times or ()):
        return dict(tables), ()
    kept = [time for time in times if time not in late]
    return {**tables, "keep": {**tables["keep"], "times": kept}}, tuple(late)


def with_spectrum(where: str, stated: Any) -> Any:
    """Return a table of a surface with the columns of the CSV file of its spectrum, without the name of the file."""
    if not isinstance(stated, Mapping):
        return stated
    table = dict(stated)
    if "second" in table:
        table["second"] = with_spectrum(f"{where}.second", table["second"])
    if table.get("generate") != "spectrum" or "file" not in table:
        return table
    file = table.pop("file")
    for key in SPECTRUM.keys() & table.keys():
        raise InputError(key=f"{where}.file", found=file, expected=f"either a file or {key}")
    try:
        columns, _ = read_table(file, SPECTRUM)
    except InputError as error:
        raise located(error, f"{where}.file") from error
    return table | {key: values.tolist() for key, values in columns.items()}


def with_rows(where: str, stated: Any) -> Any:
    """Return a segment of a program with the rows of its file, without the name of the file."""
    table = stated.get("table") if isinstance(stated, Mapping) else None
    if not isinstance(table, Mapping) or "file" not in table:
        return stated
    if "control" in stated:
        expected = "the name of a column in its place, such as approach = 'Displacement'"
        raise InputError(key=f"{where}.table.control", found=stated["control"], expected=expected)
    file, columns = split(table, "file")
    control, times, values, note = call(read_history, f"{where}.table", columns, file["file"])
    return {**stated, "table": {"times": times, "values": values, "note": note}, "control": control}


def speeds_of(where: str, stated: Any) -> list[float]:
    """Return speeds in increasing order, from one speed, a list, or ``from``, ``to`` and ``count``. [m/s]"""
    if not isinstance(stated, Mapping):
        listed = stated if isinstance(stated, list) else [stated]
        return sorted({number(stated_speed, "m/s", where) for stated_speed in listed})
    refuse_unknown(where, stated, ("from", "to", "count"))
    first, last = (number(stated.get(key), "m/s", f"{where}.{key}", above=0) for key in ("from", "to"))
    count: Any = stated.get("count")
    if not suits(count, int) or not 2 <= count <= _MOST_SPEEDS:
        raise InputError(key=f"{where}.count", found=count, expected=f"a whole number from 2 to {_MOST_SPEEDS}")
    if not first < last:
        raise InputError(
            key=f"{where}.from", found=stated["from"], expected=f"a speed below {format_quantity(last, 'm/s')}"
        )
    return [float(f"{speed:.12g}") for speed in np.geomspace(first, last, count)]


# ----------------------------------------------------------------------------------------------------------------
# parts


def parts_of(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parts of a case by the names of its fields, after all checks that do not need the heights.

    Parameters
    ----------
    tables : mapping
        As :func:`with_files` returns them, in SI.
    """
    title = tables.get("title", "untitled")
    if not isinstance(title, str) or not title.strip():
        raise InputError(key="title", found=title, expected="a text")
    check_surface(tables["surface"])
    body = body_of(tables["material"])
    if ("friction" in tables) == ("program" in tables):
        expected = "either a list of [[program]] tables or a table [friction]"
        found = [name for name in ("program", "friction") if name in tables]
        raise InputError(key="program", found=found, expected=expected)
    if "program" in tables:
        experiment: Experiment = Loading(program_of(tables["program"], "adhesion" in tables))
    else:
        experiment = call(SteadySliding, "friction", a_table("friction", tables["friction"]))
    settings = settings_of(tables, experiment, body)
    observe = a_table("observe", tables.get("observe", {}))
    refuse_unknown("observe", observe, OBSERVABLES)
    for name, stated in observe.items():
        arguments = a_table(f"observe.{name}", stated)
        check(OBSERVABLES[name], f"observe.{name}", arguments)
        if not set(_NEEDS[name]) & set(settings.fields):
            expected = f"{' or '.join(map(repr, _NEEDS[name]))} in keep.fields"
            raise InputError(key=f"observe.{name}", found=arguments, expected=expected)
    if "audit" in tables:
        check(properties, "audit", a_table("audit", tables["audit"]), data=0)
    return {"title": title, "body": body, "experiment": experiment, "settings": settings}


def body_of(table: Mapping[str, Any], where: str = "material") -> Body:
    """Return a half-space of the material of a table, a sheet, or a layer on the body of its table ``on``."""
    geometry, rest = split(table, *GEOMETRY)
    material = material_of(rest, where)
    if "on" in geometry:
        below = body_of(a_table(f"{where}.on", geometry["on"]), f"{where}.on")
        return call(layer, where, geometry | {"on": below}, material)
    return call(sheet, where, geometry, material) if geometry else Body(material)


def material_of(table: Mapping[str, Any], where: str = "material") -> Material:
    """Return the material of a table, at its temperature."""
    model = one_of(f"{where}.model", table.get("model"), MODELS)
    stated, own = split_thermal(table)
    scaling, own = split(own, "model", "modulus_factor")
    if model == "pair":
        parts = split(own, "a", "b")[0]
        own |= {key: material_of(a_table(f"{where}.{key}", inner), f"{where}.{key}") for key, inner in parts.items()}
    material = call(MODELS[model], where, own)
    factor = shift_factor(stated, where)
    if "temperature" in stated:
        constants = split(stated, "temperature")[1]
        material = call(thermal, where, constants, material).at(stated["temperature"])
    elif factor != 1:
        material = shift(material, factor)
    stiffer = number(scaling.get("modulus_factor", 1), "1", f"{where}.modulus_factor", above=0)
    return material if stiffer == 1 else stiffened(material, stiffer)


def split_thermal(table: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the keys of a temperature that shift any model, and all other keys.

    A temperature belongs to a model that takes one: to a table of measurements if its rows have temperatures.
    """
    known = arguments(MODELS[str(table["model"])]) if table.get("model") in MODELS else {}
    belongs = "temperature" in known and ("temperatures" in table or "temperatures" not in known)
    return split(table, *(name for name in TEMPERATURE if not (belongs and name in known)))


def shift_factor(table: Mapping[str, Any], where: str = "material") -> float:
    """Return the factor of all times of a material at its temperature; 1 without a temperature."""
    stated = split_thermal(table)[0]
    if not stated:
        return 1.0
    key = "shift_factor" if "shift_factor" in stated else "temperature"
    if key == "temperature":
        factor = call(arrhenius if "activation_energy" in stated else wlf, where, stated)
    else:
        refuse_unknown(where, stated, (key,))
        factor = number(stated[key], "1", f"{where}.{key}")
    if not 1 / LARGEST_SHIFT <= factor <= LARGEST_SHIFT:
        expected = f"a shift of times by a factor from {1 / LARGEST_SHIFT:g} to {LARGEST_SHIFT:g}, not {factor!r}"
        raise InputError(key=f"{where}.{key}", found=stated[key], expected=expected)
    return factor


def program_of(segments: Any, can_pull: bool = False) -> Program:
    """Return the program of the tables ``[[program]]``; `can_pull` is whether loads may be negative."""
    if not isinstance(segments, list) or not segments:
        raise InputError(key="program", found=segments, expected="a list of [[program]] tables, at least one")
    program = Program()
    for place, stated in enumerate(segments):
        where = f"program.{place}"
        table = a_table(where, stated)
        kind = one_key(where, table, (*SEGMENTS, *PROGRAMS))
        value = table.pop(kind)
        if kind in SEGMENTS:
            program = call(SEGMENTS[kind], where, table, program, value)
            check_loads(f"{where}.{kind}", value, program, can_pull)
            continue
        refuse_unknown(where, table, ("control",))
        control = one_of(f"{where}.control", table.get("control", "load"), UNITS)
        where = f"{where}.{kind}"
        arguments = a_table(where, value)
        if "control" in arguments:
            raise InputError(key=f"{where}.control", found=arguments["control"], expected=f"this key next to {kind}")
        program = call(PROGRAMS[kind], where, arguments | {"control": control}, program)
        key = "amplitude" if kind == "cycle" else "values"
        check_loads(f"{where}.{key}", arguments.get(key), program, can_pull)
    return program


def check_loads(where: str, stated: Any, program: Program, can_pull: bool) -> None:
    """Refuse a program whose last table, with a stated value, has a negative load or pressure without adhesion."""
    if program.lowest_load >= 0 or can_pull:
        return
    if isinstance(stated, list):
        row = next(row for row, value in enumerate(stated) if value < 0)
        where = f"{where}.{row}"
        stated = stated[row]
    raise InputError(key=where, found=stated, expected="a load or pressure of at least 0, or a table [adhesion]")


def settings_of(tables: Mapping[str, Any], experiment: Experiment, body: Body) -> Settings:
    """Return the settings of a case, with the boundary that ``auto`` resolves to."""
    stated = split(tables["surface"], "missing")[0]
    for table in _KEYS_OF:
        here = a_table(table, tables.get(table, {}))
        refuse_unknown(table, here, _KEYS_OF[table])
        stated |= here
    if stated.get("times") == "all":
        del stated["times"]
    if "adhesion" in tables:
        stated["adhesion"] = call(adhesion, "adhesion", a_table("adhesion", tables["adhesion"]))
    try:
        settings = call(Settings, "", stated)
    except InputError as error:
        raise located(error, TABLE_OF[re.split(r"[.\[]", error.key)[0]]) from error
    boundary = settings.boundary
    if boundary == "auto":
        made_for = "free" if settings.edge == "accept" else surface_boundary(tables["surface"])
        boundary = experiment.boundary or made_for
    if boundary is None:
        raise InputError(key="solve.boundary", found="auto", expected=OPEN_BOUNDARY)
    settings = replace(settings, boundary=boundary)
    if isinstance(experiment, Loading) and isinstance(settings.times, tuple):
        end = experiment.program.duration
        last = max(settings.times, default=0.0)
        if last > end * (1 + _ROUNDING):
            raise InputError(key="keep.times", found=last, expected=f"times up to the end of the program, {end:g} s")
    for name, value, expected in experiment.unsupported(settings, body):
        raise InputError(key=dotted(TABLE_OF.get(name, ""), name), found=value, expected=expected)
    return settings
