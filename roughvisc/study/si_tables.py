"""Tables of a case in SI, and the units of their keys."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from inspect import Parameter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from roughvisc.arguments import a_table, arguments, call, located, one_of, refuse_unknown, units_of
from roughvisc.errors import InputError
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.materials.models import MODELS
from roughvisc.mechanics.materials.temperature import arrhenius, wlf
from roughvisc.mechanics.program import UNITS, Program
from roughvisc.mechanics.sheet import sheet
from roughvisc.observables import OBSERVABLES
from roughvisc.settings import Settings
from roughvisc.study.audit.given import BOUNDS
from roughvisc.study.machine_history import read_history
from roughvisc.tables import FREQUENCY_UNITS, Wanted, read_table
from roughvisc.topography.conditioning import STEPS
from roughvisc.topography.framing import combine
from roughvisc.topography.scans import open_scan
from roughvisc.topography.synthesis import RECIPES
from roughvisc.units import number, quantity

#: Tables of a study, without its sweep.
TABLES = ("title", "surface", "material", "program", "friction", "solve", "keep", "observe", "audit")
#: Largest number of speeds between two ends.
_MOST_SPEEDS = 1000


class Column(NamedTuple):
    """Column of a CSV file that states an argument of a material.

    Attributes
    ----------
    heading, unit : str
        Name in the heading, and unit in SI; without one, `unit_key` states the unit of the argument, too.
    unit_key : str
        Key of the unit of the column, if the heading does not state it.
    """

    heading: str
    unit: str
    unit_key: str


#: Columns of each model that a CSV file may state.
COLUMNS: dict[str, dict[str, Column]] = {
    "creep_table": {
        "times": Column("time", "s", "time_unit"),
        "compliances": Column("compliance", "1/Pa", "compliance_unit"),
    },
    "relaxation_table": {
        "times": Column("time", "s", "time_unit"),
        "moduli": Column("modulus", "Pa", "modulus_unit"),
    },
    "dynamic_table": {
        "frequencies": Column("frequency", "", "frequency_unit"),
        "storage": Column("storage", "Pa", "modulus_unit"),
        "loss": Column("loss", "Pa", "modulus_unit"),
        "shift_factors": Column("shift_factor", "1", ""),
    },
}


def si_tables(data: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """Return the tables of a case in SI, independent of the files of its material and program.

    Parameters
    ----------
    data : mapping
        Tables of the TOML file.
    folder : Path or None
        Folder of relative paths. Without one, paths are kept and not checked.

    Returns
    -------
    dict
        The tables with absolute paths of scans, the content of CSV files, and numbers for texts with a unit. Any other
        value is unchanged; the function that takes it refuses it.
    """
    refuse_unknown("", data, TABLES)
    for name in ("surface", "material"):
        if name not in data:
            raise InputError(f"{name}: missing: expected a table [{name}]", key=name, expected=f"a table [{name}]")
    tables = dict(data)
    tables["surface"] = _with_paths("surface", data["surface"], folder)
    tables["material"] = _with_columns("material", data["material"], folder)
    if isinstance(data.get("program"), list):
        tables["program"] = [
            _with_rows(f"program.{number}", segment, folder) for number, segment in enumerate(data["program"])
        ]
    tables = {name: in_si(value, name, tables) for name, value in tables.items()}
    if isinstance(tables.get("friction"), dict) and "speeds" in tables["friction"]:
        tables["friction"]["speeds"] = _speeds("friction.speeds", tables["friction"]["speeds"])
    return tables


def in_si(value: Any, key: str, tables: Mapping[str, Any]) -> Any:
    """Return a value of a study in SI.

    Parameters
    ----------
    value : object
        A value, or a list or a table of values.
    key : str
        Its dotted key.
    tables : mapping
        Tables of the case, for units that depend on another key.

    Returns
    -------
    object
        The value with numbers for texts with a unit. Any other text is unchanged.

    Raises
    ------
    InputError
        If an integer is larger than any number of double precision.
    """
    if isinstance(value, Mapping):
        return {name: in_si(one, f"{key}.{name}", tables) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [in_si(one, f"{key}.{number}", tables) for number, one in enumerate(value)]
    unit = _unit(key, tables)
    if unit and isinstance(value, str):
        with suppress(InputError):
            return quantity(value, unit, difference=key.endswith("wlf_c2"))
    if isinstance(value, int) and abs(value) > sys.float_info.max:
        raise InputError(key=key, found=value, expected="a number with fewer digits")
    is_number = isinstance(value, int) and not isinstance(value, bool)
    return float(value) if is_number and unit not in ("", "1") else value


def unit_of(key: str, case: Mapping[str, Any] | None = None) -> str:
    """Return the unit of the value at a dotted key of a study; empty if it has none.

    Parameters
    ----------
    key : str
        Such as ``"program.0.load"``.
    case : mapping, optional
        The case as JSON, for units that depend on another key.

    Examples
    --------
    >>> unit_of("program.0.load"), unit_of("surface.seed"), unit_of("program.1.cycle.mean")
    ('N', '', '')
    >>> unit_of("program.0.cycle.amplitude", {"program": [{"cycle": {}, "control": "approach"}]})
    'm'
    """
    unit = _unit(key, case or {})
    return "" if unit == "1" else unit


def _unit(key: str, tables: Mapping[str, Any]) -> str:
    """Return the unit of the value at a dotted key, ``"1"`` of a pure number."""
    table, *path = key.split(".")
    names = [part for part in path if not part.isdecimal()]
    if not names or key == "keep.times":  # a number there is a count
        return ""
    if table == "program" and not path[0].isdecimal():
        return ""
    if table == "program" and names[-1] in ("mean", "amplitude", "values"):
        segments = tables.get("program") or []
        here = segments[int(path[0])] if int(path[0]) < len(segments) else None
        return UNITS.get(str(here.get("control", "load")), "") if isinstance(here, Mapping) else ""
    return _units().get(table, {}).get(names[-1], "")


@cache
def _units() -> dict[str, dict[str, str]]:
    """Return the unit of each key, by table, from the functions that take the arguments."""

    def units(*functions: Callable[..., Any]) -> dict[str, str]:
        return {name: unit for function in functions for name, unit in units_of(function).items()}

    steps = {name: units_of(step.function).get(step.argument, "") for name, step in STEPS.items()}
    factors = {"wlf_c1": "1", "wlf_c2": "K", "shift_factor": "1", "modulus_factor": "1"}
    segments = {"over": "s", "hold": "s", "period": "s", "times": "s", "slide": "m", "speed": "m/s", "cycles": "1"}
    return {
        "surface": units(open_scan, combine, *RECIPES.values(), *(step.function for step in STEPS.values())) | steps,
        "material": units(*MODELS.values(), wlf, arrhenius, sheet) | factors,
        "program": UNITS | segments,
        "friction": units(SteadySliding) | {"from": "m/s", "to": "m/s"},
        "solve": units(Settings) | {"time_step": "s"},
        "keep": {"times": "s", "precision": "1"},
        "observe": units(*OBSERVABLES.values()),
        "audit": {name: unit for name, (unit, _) in BOUNDS.items()},
    }


def default_of(key: str, case: Mapping[str, Any]) -> Any:
    """Return the default of a key that a case does not state; None if there is none.

    Parameters
    ----------
    key : str
        Dotted key.
    case : mapping
        The case as JSON.
    """
    table, _, name = key.partition(".")
    if table == "surface" and name in STEPS:
        return False
    functions = {
        "surface": RECIPES.get(case["surface"].get("generate")),
        "material": MODELS.get(case["material"]["model"]),
        "friction": SteadySliding,
    }
    function = Settings if name in arguments(Settings) else functions.get(table)
    default = arguments(function)[name][1] if function and name in arguments(function) else None
    return None if default is Parameter.empty else default


def existing_file(where: str, file: Any, folder: Path | None) -> str:
    """Return the absolute path of a file that a study names relative to its folder."""
    if not isinstance(file, str | Path) or not str(file):
        raise InputError(key=where, found=file, expected="the path of a file")
    if folder is None:  # a stored case, whose file may have been moved
        return str(file)
    path = (folder / Path(file).expanduser()).resolve()
    if not path.is_file():
        problem = "is a folder" if path.is_dir() else "does not exist"
        expected = f"a file ({path})"
        message = f"{where}: found {str(file)!r}, which {problem}: expected {expected}"
        raise InputError(message, key=where, found=file, expected=expected)
    return str(path)


def _with_paths(where: str, stated: Any, folder: Path | None) -> dict[str, Any]:
    """Return a table of a surface with absolute paths."""
    table = a_table(where, stated)
    if "file" in table:
        table["file"] = existing_file(f"{where}.file", table["file"], folder)
    if "second" in table:
        table["second"] = _with_paths(f"{where}.second", table["second"], folder)
    return table


def _with_columns(where: str, stated: Any, folder: Path | None) -> dict[str, Any]:
    """Return a table of a material with the columns of its CSV file, without the name of the file."""
    table = a_table(where, stated)
    for key in ("a", "b", "on"):
        if key in table:
            table[key] = _with_columns(f"{where}.{key}", table[key], folder)
    columns = COLUMNS.get(str(table.get("model")), {})
    units = {one.unit_key for one in columns.values()} - {"", "frequency_unit"}
    stated_units = {key: table[key] for key in units if key in table}
    if not columns or "file" not in table:
        for key, unit in stated_units.items():
            raise InputError(key=f"{where}.{key}", found=unit, expected="no unit of a column without a file")
        return table
    for key in columns:
        if key in table:
            raise InputError(key=f"{where}.file", found=table["file"], expected=f"either a file or {key}")
    for key, unit in stated_units.items():
        if not isinstance(unit, str):
            raise InputError(key=f"{where}.{key}", found=unit, expected="a unit")
    if "frequencies" in columns:
        one_of(f"{where}.frequency_unit", table.get("frequency_unit"), FREQUENCY_UNITS)
    wanted = {
        key: Wanted(one.heading, one.unit or table["frequency_unit"], stated_units.get(one.unit_key), not one.unit_key)
        for key, one in columns.items()
    }
    path = existing_file(f"{where}.file", table["file"], folder)
    with _in_file(f"{where}.file", table["file"]):
        found, _ = read_table(path, wanted)
    rest = {key: value for key, value in table.items() if key != "file" and key not in units}
    return rest | {key: values.tolist() for key, values in found.items()}


def _with_rows(where: str, stated: Any, folder: Path | None) -> Any:
    """Return a segment of a program with the rows of its file, without the name of the file."""
    table = stated.get("table") if isinstance(stated, Mapping) else None
    if not isinstance(table, str) and not (isinstance(table, Mapping) and "file" in table):
        return stated
    columns = {"file": table, "thin": 0} if isinstance(table, str) else dict(table)
    control = one_of(f"{where}.control", stated.get("control", "load"), UNITS)
    where, file = f"{where}.table", columns.pop("file")
    path = existing_file(where if isinstance(table, str) else f"{where}.file", file, folder)
    if "control" in stated or not columns.keys() & UNITS:
        columns.setdefault(control, control)
    with _in_file(where, file):
        history = call(read_history, "", columns, path)
        Program.table(history.times, history.values, history.control)
    rows = {"times": history.times, "values": history.values, "note": history.note}
    return {**stated, "table": rows, "control": history.control}


@contextmanager
def _in_file(key: str, file: Any) -> Iterator[None]:
    """Attribute errors in a file to the key that names the file."""
    try:
        yield
    except InputError as error:
        problem = str(error) if str(file) in str(error) else f"{file}: {error}"
        if error.key.isidentifier():  # of an argument
            raise located(error, key) from error
        raise located(InputError(problem, found=file, expected=error.expected), key) from error


def _speeds(where: str, stated: Any) -> Any:
    """Return speeds in increasing order: one, a list, or a number of speeds between two ends. [m/s]"""
    if isinstance(stated, list):
        return sorted(set(stated)) if all(isinstance(one, float) for one in stated) else stated
    if not isinstance(stated, Mapping):
        return [stated] if isinstance(stated, float) else stated
    refuse_unknown(where, stated, ("from", "to", "count"))
    for key in ("from", "to", "count"):
        if key not in stated:
            raise InputError(f"{where}.{key}: missing: expected from, to and count", key=f"{where}.{key}")
    first, last = (number(stated[key], "m/s", f"{where}.{key}", above=0) for key in ("from", "to"))
    count = stated["count"]
    if not isinstance(count, int) or isinstance(count, bool) or not 2 <= count <= _MOST_SPEEDS:
        raise InputError(key=f"{where}.count", found=count, expected=f"a whole number from 2 to {_MOST_SPEEDS}")
    if not first < last:
        raise InputError(key=f"{where}.from", found=first, expected=f"a speed below {last:g} m/s")
    return [float(f"{speed:.12g}") for speed in np.geomspace(first, last, count)]
