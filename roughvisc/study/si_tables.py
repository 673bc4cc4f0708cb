"""Quantities of a study in SI, and the units and defaults of its keys."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from inspect import Parameter
from typing import Any

from roughvisc.arguments import arguments, units_of
from roughvisc.errors import InputError
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.materials.models import MODELS
from roughvisc.mechanics.materials.temperature import arrhenius, wlf
from roughvisc.mechanics.program import UNITS
from roughvisc.mechanics.sheet import sheet
from roughvisc.observables import OBSERVABLES
from roughvisc.settings import Settings
from roughvisc.study.audit import audit
from roughvisc.topography.conditioning import STEPS
from roughvisc.topography.framing import combine
from roughvisc.topography.scans import open_scan
from roughvisc.topography.synthesis import RECIPES
from roughvisc.units import number


def in_si(value: Any, key: str, tables: Mapping[str, Any]) -> Any:
    """Return a value of a study in SI.

    Parameters
    ----------
    value : object
        A value, or a list or a table of values.
    key : str
        Dotted key of the value.
    tables : mapping
        Tables of the case, for units that depend on another key.

    Returns
    -------
    object
        The value, in which numbers replace texts with a unit. Other texts are unchanged.

    Raises
    ------
    InputError
        If an integer exceeds the largest number of double precision.
    """
    if isinstance(value, Mapping):
        return {name: in_si(one, f"{key}.{name}" if key else name, tables) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [in_si(one, f"{key}.{number}", tables) for number, one in enumerate(value)]
    if isinstance(value, float | bool) or value is None:
        return value
    unit = _unit(key, tables)
    if unit and isinstance(value, str):
        with suppress(InputError):
            return number(value, unit, difference=key.endswith("wlf_c2"))
    if isinstance(value, int):
        if abs(value) > sys.float_info.max:
            raise InputError(key=key, found=value, expected="a number with fewer digits")
        return float(value) if unit not in ("", "1") else value
    return value


def unit_of(key: str, case: Mapping[str, Any] | None = None) -> str:
    """Return the unit of the value at a dotted key of a study; empty if it has none.

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
    unit = _unit(key, case or {})
    return "" if unit == "1" else unit


def _unit(key: str, tables: Mapping[str, Any]) -> str:
    """Return the unit of the value at a dotted key; ``"1"`` for a pure number."""
    table, *path = key.split(".")
    names = [part for part in path if not part.isdecimal()]
    if not names or key == "keep.times":  # a number in keep.times is a number of times
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
    factors = {"wlf_c2": "K", "shift_factor": "1", "modulus_factor": "1"}
    segments = {"over": "s", "hold": "s", "period": "s", "times": "s", "slide": "m", "speed": "m/s", "cycles": "1"}
    return {
        "surface": units(open_scan, combine, *RECIPES.values(), *(step.function for step in STEPS.values())) | steps,
        "material": units(*MODELS.values(), wlf, arrhenius, sheet) | factors,
        "program": UNITS | segments,
        "friction": units(SteadySliding) | {"from": "m/s", "to": "m/s"},
        "solve": units(Settings) | {"time_step": "s"},
        "keep": {"times": "s"},
        "observe": units(*OBSERVABLES.values()),
        "audit": units(audit),
    }


def default_of(key: str, case: Mapping[str, Any]) -> Any:
    """Return the default of a key that a case does not state; None for a key without a default.

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
    functions: dict[str, Callable[..., Any]] = {
        "surface": RECIPES.get(case["surface"].get("generate"), open_scan),
        "material": MODELS[case["material"]["model"]],
        "friction": SteadySliding,
    }
    function = Settings if name in arguments(Settings) else functions.get(table, Settings)
    _, default = arguments(function).get(name, (None, None))
    return None if default is Parameter.empty else default
