"""A case as text: the study file that states it, and what it says in words."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from roughvisc.study.statement.schema.units import unit_of
from roughvisc.views.figures.axes import Unit, unit_for

#: What an infinite number stands for; the thickness alone may be one.
ENDLESS = "half-space"


def study_text(case: Mapping[str, Any]) -> str:
    """Study file (TOML, SI units) that states a case.

    Parameters
    ----------
    case : mapping
        The case, as the attribute ``case`` of a result has it in JSON.

    Examples
    --------
    >>> print(study_text({"title": "Ball", "material": {"model": "elastic", "shear_modulus": 1e6}}))
    title = "Ball"
    <BLANKLINE>
    [material]
    model = "elastic"
    shear_modulus = 1000000.0
    <BLANKLINE>
    """
    tables = {key: value for key, value in case.items() if key not in ("origin", "varied", "written")}
    text = "".join(f"{key} = {_value(value)}\n" for key, value in tables.items() if not _is_table(value))
    for name, value in tables.items():
        for entry in value if isinstance(value, list) else [value]:
            if isinstance(entry, dict):
                heading = f"[[{name}]]" if isinstance(value, list) else f"[{name}]"
                said = {key: inner for key, inner in entry.items() if inner is not False}  # steps left out
                lines = "".join(f"{key} = {_value(inner)}\n" for key, inner in said.items())
                text += f"\n{heading}\n{lines}"
    return text


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and any(isinstance(one, dict) for one in value))


def _value(value: Any) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    return repr(value)


def setting_unit(values: Any, si: str) -> Unit:
    """Unit with a prefix that suits some values of a setting. [SI]"""
    if si == "Pa s":
        unit = unit_for(values, "Pa")
        return Unit(unit.factor, f"{unit.symbol} s")
    if si.startswith("1/"):
        return Unit(1.0, si)  # no prefix: 3e-07 1/Pa
    return unit_for(values, si)


def readable_setting(key: str, value: Any) -> str:
    """Value of a dotted key of a study, with its unit if its name tells one.

    Examples
    --------
    >>> readable_setting("program.0.load", 0.02), readable_setting("solve.tolerance", 0.001)
    ('20 mN', '0.001')
    >>> readable_setting("material.thickness", 5e-4), readable_setting("material.thickness", math.inf)
    ('500 µm', 'half-space')
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value if isinstance(value, str) else json.dumps(value)
    return ENDLESS if value == math.inf else setting_unit([value], unit_of(key)).text(value, 4)


def material_words(material: Mapping[str, Any]) -> str:
    """Material of a case in one line."""
    rest = [
        f"{key.replace('_', ' ')} {readable_setting(f'material.{key}', value)}"
        for key, value in material.items()
        if key != "model" and not isinstance(value, list | dict)
    ]
    tables = [f"{len(value)} {key}" for key, value in material.items() if isinstance(value, list)]
    return ", ".join([str(material.get("model", "?")).replace("_", " "), *rest, *tables])


def friction_words(friction: Mapping[str, Any]) -> str:
    """What a case asks of steady sliding, in one line."""
    speeds = friction.get("speeds", [])
    ends = [unit_for([one], "m/s").text(one, 4) for one in (speeds[0], speeds[-1])] if speeds else []
    said = [f"{len(speeds)} speeds, {' to '.join(dict.fromkeys(ends))}"]
    for key in ("load", "pressure"):
        said += [f"{key} {readable_setting(f'friction.{key}', friction[key])}"] if key in friction else []
    return ", ".join([*said, f"along {friction.get('direction', 'x')}"])


def program_words(segments: list[Mapping[str, Any]]) -> list[str]:
    """Loading program of a case, a line a segment."""
    return [table_words(f"program.{number}", segment) for number, segment in enumerate(segments)]


def table_words(name: str, table: Mapping[str, Any]) -> str:
    """A table of a study in one line; its dotted name tells the units."""
    told = {
        key: _value(value) if isinstance(value, dict | list) else readable_setting(f"{name}.{key}", value)
        for key, value in table.items()
    }
    return ", ".join(f"{key} {words}" for key, words in told.items())
