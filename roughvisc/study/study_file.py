"""Parts of a case from the tables of a study file: surface, body, experiment and settings.

A table contains the arguments of one function, which checks them; see :mod:`roughvisc.arguments`. All tables here are
in SI, as :func:`roughvisc.study.si_tables.si_tables` returns them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any

from roughvisc.arguments import a_table, call, check, located, one_key, one_of, refuse_unknown, split
from roughvisc.errors import InputError
from roughvisc.experiment.base import Experiment
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.layer import layer
from roughvisc.mechanics.materials.creep import LARGEST_SHIFT, Material, shift, stiffened
from roughvisc.mechanics.materials.models import MODELS
from roughvisc.mechanics.materials.temperature import arrhenius, wlf
from roughvisc.mechanics.program import UNITS, Program
from roughvisc.mechanics.sheet import sheet
from roughvisc.observables import OBSERVABLES
from roughvisc.settings import OPEN_BOUNDARY, Settings, known_boundary
from roughvisc.study.audit.given import AuditInputs
from roughvisc.topography.scans import surface_boundary
from roughvisc.units import number

#: Keys of a temperature, which every model has.
TEMPERATURE = ("temperature", "reference_temperature", "wlf_c1", "wlf_c2", "activation_energy", "shift_factor")
#: Keys of a body that is not a half-space.
GEOMETRY = ("thickness", "base", "on")
#: Method of each segment of a program, by the key of its first argument.
SEGMENTS: dict[str, Callable[..., Program]] = {
    "load": Program.load,
    "pressure": Program.pressure,
    "approach": Program.approach,
    "hold": Program.hold,
    "slide": Program.slide,
}
#: Functions that make a part of a program from a table.
PROGRAMS: dict[str, Callable[..., Program]] = {"cycle": Program.cycle, "table": Program.table}
#: Settings in the table ``[keep]``. ``missing`` is in ``[surface]``, any other one in ``[solve]``.
KEPT = ("fields", "times")
#: Fields of which an observable needs one.
_NEEDS = {"leakage": ("gap",), "conductance": ("pressure", "gap")}
#: Part of its duration by which a kept time may exceed a program.
_ROUNDING = 1e-12


def cells(shape: Any) -> tuple[int, int]:
    """Return the numbers of cells along x and y, of which a table may state one for both."""
    both: Any = shape.get("shape") if isinstance(shape, Mapping) else shape
    return (int(both[0]), int(both[1])) if isinstance(both, list | tuple) else (int(both), int(both))


# ----------------------------------------------------------------------------------------------------------------
# body


def material_of(table: Mapping[str, Any], where: str = "material") -> Material:
    """Return the material of a table, at its temperature."""
    model = one_of(f"{where}.model", table.get("model"), MODELS)
    thermal, arguments = split(table, *TEMPERATURE)
    scaling, arguments = split(arguments, "model", "modulus_factor")
    if model == "pair":
        parts = split(arguments, "a", "b")[0]
        arguments |= {key: material_of(a_table(f"{where}.{key}", one), f"{where}.{key}") for key, one in parts.items()}
    material = call(MODELS[model], where, arguments)
    factor = shift_factor(thermal, where)
    material = material if factor == 1 else shift(material, factor)
    if scaling.get("modulus_factor", 1.0) == 1:
        return material
    try:
        return stiffened(material, scaling["modulus_factor"])
    except InputError as error:
        raise located(error, where) from error


def shift_factor(table: Mapping[str, Any], where: str = "material") -> float:
    """Return the factor of all times of a material at its temperature; one if none is stated."""
    stated, _ = split(table, *TEMPERATURE)
    if not stated:
        return 1.0
    if "shift_factor" in stated:
        key, factor = "shift_factor", stated["shift_factor"]
        if other := next((one for one in stated if one != key), ""):
            raise InputError(key=f"{where}.{key}", found=factor, expected=f"either this or {other}")
    else:
        key = "temperature"
        if "activation_energy" in stated and not {"wlf_c1", "wlf_c2"} & stated.keys():
            factor = call(arrhenius, where, stated)
        else:
            factor = call(_wlf, where, stated)
    if not (isinstance(factor, int | float) and 1 / LARGEST_SHIFT <= factor <= LARGEST_SHIFT):
        expected = f"a shift of times by a factor from {1 / LARGEST_SHIFT:g} to {LARGEST_SHIFT:g}, not {factor!r}"
        raise InputError(key=f"{where}.{key}", found=stated[key], expected=expected)
    return float(factor)


def _wlf(temperature: float, reference_temperature: float, wlf_c1: float, wlf_c2: float) -> float:
    """Return :func:`roughvisc.wlf` with the constants under the names that they have in a study."""
    try:
        return wlf(temperature, reference_temperature, wlf_c1, wlf_c2)
    except InputError as error:
        key = f"wlf_{error.key}" if error.key in ("c1", "c2") else error.key
        raise InputError(key=key, found=error.found, expected=error.expected) from error


def body_of(table: Mapping[str, Any], where: str = "material") -> Body:
    """Return a half-space of the material of a table, a sheet, or a layer on the body of its table ``on``."""
    geometry, rest = split(table, *GEOMETRY)
    material = material_of(rest, where)
    if "on" in geometry:
        below = body_of(a_table(f"{where}.on", geometry["on"]), f"{where}.on")
        return call(layer, where, geometry | {"on": below}, material)
    return call(sheet, where, geometry, material) if geometry else Body(material)


# ----------------------------------------------------------------------------------------------------------------
# experiment


def program_of(segments: Any) -> Program:
    """Return the program of the tables ``[[program]]``."""
    if not isinstance(segments, list) or not segments:
        raise InputError(key="program", found=segments, expected="a list of [[program]] tables, at least one")
    program = Program()
    for place, stated in enumerate(segments):
        program = _extended(program, f"program.{place}", a_table(f"program.{place}", stated))
    return program


def _extended(program: Program, where: str, table: dict[str, Any]) -> Program:
    """Return a program with one more segment, cycle or table."""
    kind = one_key(where, table, (*SEGMENTS, *PROGRAMS))
    value = table.pop(kind)
    if kind in SEGMENTS:
        return call(SEGMENTS[kind], where, table, program, value)
    refuse_unknown(where, table, ("control",))
    control = one_of(f"{where}.control", table.get("control", "load"), UNITS)
    where = f"{where}.{kind}"
    arguments = a_table(where, value)
    if "control" in arguments:
        raise InputError(key=f"{where}.control", found=arguments["control"], expected=f"this key next to {kind}")
    added = call(PROGRAMS[kind], where, arguments | {"control": control})
    before = program.segments[-1] if program.segments else None
    if kind == "table" and before and arguments["values"][0] == 0 and (before.control, before.end) != (control, 0.0):
        # a table that begins at zero after something else begins with a jump to zero
        added = getattr(Program(), control)(0.0, over=0.0) + added
    return program + added


def experiment_of(tables: Mapping[str, Any]) -> Experiment:
    """Return the experiment of the tables ``[[program]]`` or the table ``[friction]``."""
    if "friction" not in tables and "program" not in tables:
        expected = "a list of [[program]] tables, or a table [friction]"
        raise InputError(f"program: missing: expected {expected}", key="program", expected=expected)
    if "friction" not in tables:
        return Loading(program_of(tables["program"]))
    if "program" in tables:
        raise InputError(key="program", found=tables["program"], expected="either [[program]] or [friction]")
    return call(SteadySliding, "friction", a_table("friction", tables["friction"]))


# ----------------------------------------------------------------------------------------------------------------
# settings, observables, audit


def table_of(setting: str) -> str:
    """Return the table of a study that a setting is in."""
    return "keep" if setting in KEPT else "surface" if setting == "missing" else "solve"


def stated_settings(tables: Mapping[str, Any]) -> Settings:
    """Return the settings that the tables ``[solve]``, ``[keep]`` and ``[surface]`` state."""
    names: dict[str, list[str]] = {"solve": [], "keep": ["precision"], "surface": []}
    for one in fields(Settings):
        names[table_of(one.name)].append(one.name)
    stated = split(tables["surface"], *names["surface"])[0]
    for table in ("solve", "keep"):
        here = a_table(table, tables.get(table, {}))
        refuse_unknown(table, here, names[table])
        stated |= split(here, *names[table])[0]
    stated.pop("precision", None)
    if stated.get("times") == "all":
        del stated["times"]
    try:
        return call(Settings, "", stated)
    except InputError as error:
        raise located(error, table_of(error.key.partition(".")[0])) from error


def settings_of(tables: Mapping[str, Any], experiment: Experiment) -> Settings:
    """Return the settings of a case, with the boundary that ``auto`` resolves to and the times of the program."""
    settings = stated_settings(tables)
    boundary = known_boundary(settings, experiment.boundary, lambda: surface_boundary(tables["surface"]))
    if boundary is None:
        raise InputError(f"solve.boundary: {OPEN_BOUNDARY}", key="solve.boundary", found="auto", expected="a boundary")
    settings = replace(settings, boundary=boundary)
    if late := late_times(settings, experiment):
        times: Any = settings.times
        if late == times:
            raise InputError(key="keep.times", found=list(late), expected="a time up to the end of the program")
        settings = replace(settings, times=times[: -len(late)])
    for name, value, why in experiment.unsupported(settings):
        key = f"{table_of(name)}.{name}"
        raise InputError(f"{key}: found {value!r}: {why}", key=key, found=value, expected=why)
    return settings


def late_times(settings: Settings, experiment: Experiment) -> tuple[float, ...]:
    """Return the listed times after the end of the program, which are not kept. [s]"""
    if not isinstance(experiment, Loading) or not isinstance(settings.times, tuple):
        return ()
    end = experiment.program.duration * (1 + _ROUNDING)
    return tuple(time for time in settings.times if time > end)


def precision_of(tables: Mapping[str, Any]) -> float | None:
    """Return the relative precision of the fields in a file; None if they are exact."""
    if "precision" not in tables.get("keep", {}):
        return None
    return number(tables["keep"]["precision"], "1", "keep.precision", above=0, below=1)


def observed(tables: Mapping[str, Any], settings: Settings) -> dict[str, dict[str, Any]]:
    """Return the arguments of each observable of the table ``[observe]``.

    Raises
    ------
    InputError
        If an observable or an argument is wrong, or the settings keep no field that it needs.
    """
    asked = a_table("observe", tables.get("observe", {}))
    refuse_unknown("observe", asked, OBSERVABLES)
    for name, stated in asked.items():
        where, arguments = f"observe.{name}", a_table(f"observe.{name}", stated)
        check(OBSERVABLES[name], where, arguments)
        if not set(_NEEDS[name]) & set(settings.fields):
            expected = f"{' or '.join(map(repr, _NEEDS[name]))} in keep.fields"
            raise InputError(key=where, found=arguments, expected=expected)
        if arguments.get("sides") == "periodic" and settings.boundary != "periodic":
            expected = f"'closed', since the boundary is {settings.boundary!r}"
            raise InputError(key=f"{where}.sides", found="periodic", expected=expected)
    return asked


def audit_inputs(tables: Mapping[str, Any]) -> AuditInputs:
    """Return the quantities of the table ``[audit]``."""
    stated = call(AuditInputs, "audit", a_table("audit", tables.get("audit", {})))
    if stated.base is not None and stated.thickness is None:
        raise InputError(key="audit.base", found=stated.base, expected="a thickness, too")
    return stated
