"""What a case of a sweep is called: in words for titles and pickers, and in safe letters for files."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

from roughvisc.views.sweep_figures.case_text import readable_setting

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
