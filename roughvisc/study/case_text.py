"""A case as text: its study file, and its name in titles and file names."""

from __future__ import annotations

import html
import json
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import PurePath
from typing import Any

from roughvisc.study.study_file import unit_of
from roughvisc.topography.scans import toml_text
from roughvisc.units import unit_for

#: Longest stem of a file name, and number of letters of a key that make it unique.
_LONGEST = 80
_KEY = 8
#: Largest number of values of a list that a table shows in full.
_LISTED = 6


def study_text(case: Mapping[str, Any]) -> str:
    """Return the study file of a case, in TOML and SI units.

    Parameters
    ----------
    case : mapping
        The case, from the JSON in the attribute ``case`` of a result.

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
    text = ""
    tables = ""
    for name, value in case.items():
        if name in ("origin", "varied"):
            continue
        several = isinstance(value, list) and any(isinstance(item, dict) for item in value)
        if not (several or isinstance(value, dict)):
            text += f"{name} = {toml_text(value)}\n"
            continue
        for entry in value if several else [value]:
            stated = {key: inner for key, inner in entry.items() if inner is not False}  # a step left out is false
            lines = [f"{key} = {toml_text(inner)}" for key, inner in stated.items()]
            tables += "\n".join(["", f"[[{name}]]" if several else f"[{name}]", *lines, ""])
    return text + tables


def names_of(keys: Sequence[str]) -> dict[str, str]:
    """Return short names of dotted keys: the last word, with the rest of the key if two names would be equal.

    Examples
    --------
    >>> names_of(["program.0.load", "material.kelvin_viscosity"])["material.kelvin_viscosity"]
    'Kelvin viscosity'
    >>> names_of(["program.0.load", "program.2.load"])["program.2.load"]
    'Load (program.2)'
    >>> names_of(["program.2.over"])["program.2.over"]
    'Duration'
    """
    last = {}
    for key in keys:
        above, _, word = key.rpartition(".")
        word = "duration" if word == "over" else word
        last[key] = f"{above.rpartition('.')[2]} {word}".strip() if word.isdecimal() else word
    counts = Counter(last.values())
    names = {key: f"{name} ({key.rpartition('.')[0]})" if counts[name] > 1 else name for key, name in last.items()}
    return {key: (name[:1].upper() + name[1:]).replace("_", " ") for key, name in names.items()}


def varied_texts(case: Mapping[str, Any]) -> dict[str, str]:
    """Return dotted key -> varied value of a case, in a suitable unit."""
    return {key: value_text(key, value) for key, value in case.get("varied", {}).items()}


def value_text(key: str, value: Any) -> str:
    """Return the value [SI] of a dotted key as text, in a suitable unit.

    Examples
    --------
    >>> value_text("program.0.load", 2e-3), value_text("surface.file", "scans/a.sur")
    ('2 mN', 'a.sur')
    >>> value_text("keep.times", [0.13, 0.5]), value_text("surface.shape", [16, 32])
    ('130, 500 ms', '16 x 32 cells')
    """
    if isinstance(value, str) and value.startswith("["):  # a list, as a coordinate of a sweep holds it
        with suppress(ValueError):
            value = json.loads(value)
    name = key.rpartition(".")[2]
    if isinstance(value, list | tuple) and value and all(map(_is_number, value)):
        if name in ("shape", "resample"):
            return " x ".join(map(str, value)) + " cells"
        unit = unit_for(value, "s" if key == "keep.times" else unit_of(key))
        return f"{', '.join(f'{one / unit.factor:.4g}' for one in value)} {unit.symbol}".rstrip()
    if not _is_number(value):
        text = value if isinstance(value, str) else json.dumps(value)
        return PurePath(text).name if name == "file" else text
    # only the thickness may be infinite
    return "half-space" if value == math.inf else unit_for([value], unit_of(key)).text(value, 4)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def short_words(varied: Mapping[str, Any]) -> str:
    """Return varied values [SI] in few words: a value with a unit without its name.

    Examples
    --------
    >>> short_words({"program.0.load": 2.0, "solve.tolerance": 1e-2, "surface.resample": [16, 16]})
    '2 N, tolerance 0.01, 16 x 16 cells'
    """
    names = names_of(list(varied))
    parts = []
    for key, value in varied.items():
        text = value_text(key, value)
        has_unit = unit_of(key) not in ("", "1") or text.endswith(" cells")
        parts.append(text if has_unit else f"{names[key][:1].lower()}{names[key][1:]} {text}")
    return ", ".join(parts)


def case_words(case: Mapping[str, Any]) -> str:
    """Return the varied values of a case in words; empty if there are none.

    Examples
    --------
    >>> case_words({"varied": {"program.0.load": 2.0, "program.1.hold": 5.0}})
    'Load 2 N, hold 5 s'
    """
    texts = varied_texts(case)
    words = ", ".join(f"{name[:1].lower()}{name[1:]} {texts[key]}" for key, name in names_of(list(texts)).items())
    return words[:1].upper() + words[1:]


def case_html(title: str, rows: Mapping[str, Any]) -> str:
    """Return a case as a table in HTML, for a notebook.

    Parameters
    ----------
    title : str
        Title of the case.
    rows : mapping
        Name of each row -> its text, or a table of the study in SI, whose values get suitable units.
    """
    lines = [f"<table><caption>{html.escape(title)}</caption>"]
    for name, content in rows.items():
        if isinstance(content, Mapping):
            parts = [f"{key.replace('_', ' ')} {_texts(f'{name}.{key}', value)}" for key, value in content.items()]
            content = "; ".join(parts)
        left = "style='text-align:left'"
        lines.append(f"<tr><th {left}>{html.escape(name)}</th><td {left}>{html.escape(content)}</td></tr>")
    return "\n".join([*lines, "</table>"])


def _texts(key: str, value: Any) -> str:
    """Return a value or a list of values of a dotted key, in suitable units."""
    if isinstance(value, list) and len(value) > _LISTED:
        return f"{_texts(key, value[0])} to {_texts(key, value[-1])} ({len(value)} values)"
    if isinstance(value, list):
        return ", ".join(_texts(key, inner) for inner in value)
    if isinstance(value, Mapping):
        return ", ".join(f"{name.replace('_', ' ')} {_texts(f'{key}.{name}', inner)}" for name, inner in value.items())
    return value_text(key, value)


def file_stems(cases: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Return stems of file names of cases in portable letters: the varied values, or the title, or the key.

    A stem depends only on its case. If two stems differ only in capitals, both get their keys added.

    Parameters
    ----------
    cases : mapping
        Key -> case in JSON.

    Examples
    --------
    >>> file_stems({"0123456789abcdef": {"varied": {"program.0.load": 2.0, "program.1.hold": 5.0}}})
    {'0123456789abcdef': 'load_2N-hold_5s'}
    """
    stems = {}
    for key, case in cases.items():
        texts = varied_texts(case)
        parts = []
        names = names_of(list(texts))
        for dotted, text in texts.items():
            value = PurePath(text).stem if dotted.rpartition(".")[2] == "file" else text
            parts.append(f"{_safe(names[dotted].lower())}_{_safe(value)}")
        title = str(case.get("title", ""))
        stem = "-".join(parts) or (_safe(title) if title else "")
        stems[key] = (stem if len(stem) <= _LONGEST else f"{stem[: _LONGEST - _KEY - 1]}-{key[:_KEY]}") or key
    counts = Counter(stem.casefold() for stem in stems.values())
    return {key: stem if counts[stem.casefold()] == 1 else f"{stem}-{key[:_KEY]}" for key, stem in stems.items()}


def _safe(text: str) -> str:
    """Return a text of letters, digits, points and dashes, with numbers next to their units."""
    text = text.replace("µ", "u").replace("μ", "u").replace("%", "percent").replace("/", "_per_", 1) if text else ""
    return re.sub(r"_?[^A-Za-z0-9.+-]+", "_", re.sub(r"(?<=\d) (?=[^\W\d])", "", text)).strip("_.") or "none"
