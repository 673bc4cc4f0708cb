"""A case as text: the study file that states it, what it says in words, and what it is called in titles and files."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

from roughvisc.study.si_tables import unit_of
from roughvisc.units import Unit, unit_for

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
        if key != "model" and (key, value) != ("modulus_factor", 1.0) and not isinstance(value, list | dict)
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


#: The longest name of a file, without what stands before and after it.
_LONGEST = 80
#: Letters of a key that tell cases apart whose names are alike.
_KEY = 8


def names_of(keys: Sequence[str]) -> dict[str, str]:
    """What dotted keys are called: their last word; what stands before it too where two would be called alike.

    Examples
    --------
    >>> names_of(["program.0.load", "material.kelvin_viscosity"])["material.kelvin_viscosity"]
    'Kelvin viscosity'
    >>> names_of(["program.0.load", "program.2.load"])["program.2.load"]
    'Load (program.2)'
    """
    last = {key: _last_word(key) for key in keys}
    counts = Counter(last.values())
    names = {key: f"{name} ({key.rpartition('.')[0]})" if counts[name] > 1 else name for key, name in last.items()}
    return {key: (name[:1].upper() + name[1:]).replace("_", " ") for key, name in names.items()}


def _last_word(key: str) -> str:
    """Last part of a dotted key; a number with what it counts."""
    parts = key.split(".")
    return " ".join(parts[-2:]) if parts[-1].isdecimal() and len(parts) > 1 else parts[-1]


def varied_texts(case: Mapping[str, Any]) -> dict[str, str]:
    """What was varied in a case in JSON: dotted key -> value as the study writes it, or in a unit that suits it."""
    written = case.get("written", {})
    return {key: written.get(key) or _text(key, value) for key, value in case.get("varied", {}).items()}


def _text(key: str, value: Any) -> str:
    text = readable_setting(key, value)
    return PurePath(text).name if key.rpartition(".")[2] == "file" else text


def case_words(case: Mapping[str, Any]) -> str:
    """What was varied in a case in JSON, in words; empty if nothing.

    Examples
    --------
    >>> case_words({"varied": {"program.0.load": 2.0, "program.1.hold": 5.0}, "written": {"program.0.load": "2000 mN"}})
    'Load 2000 mN, hold 5 s'
    """
    texts = varied_texts(case)
    words = ", ".join(f"{name[:1].lower()}{name[1:]} {texts[key]}" for key, name in names_of(list(texts)).items())
    return words[:1].upper() + words[1:]


def file_stems(cases: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Names for the files of some cases: of what was varied, in letters that every system takes; else of their keys.

    A name depends on its case alone, but where two are alike, as in capitals only, both carry their keys.

    Parameters
    ----------
    cases : mapping
        Key -> case in JSON.

    Examples
    --------
    >>> file_stems({"0123456789abcdef": {"varied": {"program.0.load": 2.0, "program.1.hold": 5.0}}})
    {'0123456789abcdef': 'load_2N-hold_5s'}
    """
    stems = {key: _stem(key, case) for key, case in cases.items()}
    counts = Counter(stem.casefold() for stem in stems.values())
    return {key: stem if counts[stem.casefold()] == 1 else f"{stem}-{key[:_KEY]}" for key, stem in stems.items()}


def _stem(key: str, case: Mapping[str, Any]) -> str:
    texts = varied_texts(case)
    counts = Counter(map(_last_word, texts))
    parts = []
    for dotted, text in texts.items():
        name = _last_word(dotted) if counts[_last_word(dotted)] == 1 else dotted
        value = PurePath(text).stem if dotted.rpartition(".")[2] == "file" else text
        parts.append(f"{_safe(name)}_{_safe(value)}")
    stem = "-".join(parts)
    return (stem if len(stem) <= _LONGEST else f"{stem[: _LONGEST - _KEY - 1]}-{key[:_KEY]}") or key


def _safe(text: str) -> str:
    """Letters, digits, points and dashes alone; a number stands next to its unit."""
    text = text.replace("µ", "u").replace("μ", "u").replace("%", "percent").replace("/", "_per_", 1) if text else ""
    return re.sub(r"_?[^A-Za-z0-9.+-]+", "_", re.sub(r"(?<=\d) (?=[^\W\d])", "", text)).strip("_.") or "none"
