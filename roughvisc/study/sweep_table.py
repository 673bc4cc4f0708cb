"""Sweeps: the changes that make each case of a study, and the realisations of its surface."""

from __future__ import annotations

import copy
import itertools
import math
import os
from collections.abc import Iterator, Mapping
from glob import glob
from pathlib import Path
from typing import Any

from roughvisc.arguments import a_table
from roughvisc.errors import InputError, short_repr
from roughvisc.topography.scans import is_card, read_toml

#: Key of a sweep, and the key of the number of a realisation in a case.
REALISATIONS, REALISATION = "realisations", "realisation"
#: Number of the measured surface, which comes before its surrogates.
ITSELF = 0
#: Keys that a realisation changes.
SURROGATE, _SEED, _SECOND_SEED = DRAWN = ("surface.realisation", "surface.seed", "surface.second.seed")
#: Largest numbers of realisations and of cases.
MOST, MOST_CASES = 10_000, 100_000


def sweep_changes(sweep: Any, data: Mapping[str, Any], folder: Path) -> list[tuple[dict[str, Any], int | None]]:
    """Return the changes of a study that make each of its cases.

    Parameters
    ----------
    sweep : dict or list of dict
        ``[sweep]`` or ``[[sweep]]``; empty for a study of one case.
    data : mapping
        Other tables of the study.
    folder : Path
        Folder of the study, for patterns of files.

    Returns
    -------
    list of (dict, int or None)
        Dotted key -> value, and the number of the realisation of a case that is one.

    Raises
    ------
    InputError
        If the tables are not lists of values, a pattern matches no file, there are too many cases, or the surface has
        no realisations.
    """
    tables = [_with_files(table, folder) for table in sweep] if isinstance(sweep, list) else _with_files(sweep, folder)
    found: list[tuple[dict[str, Any], int | None]] = []
    for change in expand(tables):
        drawn = _realisations(change, data, folder) if REALISATIONS in change else [(change, None)]
        found += drawn
        if len(found) > MOST_CASES:
            raise InputError(key="sweep", found=f"{len(found)} cases", expected=f"at most {MOST_CASES}")
    return found


def expand(sweep: Any) -> list[dict[str, Any]]:
    """Return the changes of each case of a sweep, without realisations: dotted key -> value.

    Parameters
    ----------
    sweep : dict or list of dict
        ``[sweep]``: every combination of the lists; ``[[sweep]]``: the lists of a table entry by entry, table after
        table. A single value of ``[[sweep]]`` holds for its whole table.

    Examples
    --------
    >>> expand({"a": [1, 2], "b": [3, 4]})
    [{'a': 1, 'b': 3}, {'a': 1, 'b': 4}, {'a': 2, 'b': 3}, {'a': 2, 'b': 4}]
    >>> expand([{"a": [1, 2], "b": [3, 4]}, {"a": 5}])
    [{'a': 1, 'b': 3}, {'a': 2, 'b': 4}, {'a': 5}]
    """
    if isinstance(sweep, list) and all(isinstance(table, Mapping) and table for table in sweep):
        return [change for number, table in enumerate(sweep) for change in _entry_by_entry(number, dict(_flat(table)))]
    if not isinstance(sweep, Mapping):
        raise InputError(key="sweep", found=sweep, expected="a table of lists, or [[sweep]] tables")
    lists = {key: [value] if key == REALISATIONS else value for key, value in _flat(sweep)}
    for key, values in lists.items():
        if not isinstance(values, list) or not values:
            raise InputError(key=f"sweep.{key}", found=values, expected="a list of values")
    if (count := math.prod(map(len, lists.values()))) > MOST_CASES:
        raise InputError(key="sweep", found=f"{count} cases", expected=f"at most {MOST_CASES}")
    return [dict(zip(lists, chosen, strict=True)) for chosen in itertools.product(*lists.values())]


def _entry_by_entry(number: int, table: Mapping[str, Any]) -> list[dict[str, Any]]:
    lengths = {key: len(values) for key, values in table.items() if isinstance(values, list)}
    if len(set(lengths.values())) > 1 or 0 in lengths.values():
        raise InputError(key=f"sweep.{number}", found=lengths, expected="lists of one length, at least 1")
    count = next(iter(lengths.values()), 1)
    if count > MOST_CASES:
        raise InputError(key=f"sweep.{number}", found=f"{count} cases", expected=f"at most {MOST_CASES}")
    return [{key: v[entry] if isinstance(v, list) else v for key, v in table.items()} for entry in range(count)]


def _flat(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values of a table, written with quotes (``"a.b" = ...``) or without (``a.b = ...``)."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def _with_files(table: Any, folder: Path) -> Any:
    """Return a table of a sweep with the names of files for patterns such as ``"scans/*.sur"``."""
    if not isinstance(table, Mapping):
        return table
    return {
        key: _matching(key, value, folder) if key.rpartition(".")[2] == "file" else value for key, value in _flat(table)
    }


def _matching(key: str, value: Any, folder: Path) -> Any:
    """Return names of files, sorted, for each pattern; the name of an existing file is kept."""
    stated = value if isinstance(value, list) else [value]
    found: list[Any] = []
    for one in stated:
        if not isinstance(one, str) or not set("*?[") & set(one) or (folder / one).exists():
            found.append(one)
            continue
        pattern = os.path.expanduser(one)
        matches = sorted(name for name in glob(pattern, root_dir=folder, recursive=True) if (folder / name).is_file())
        if not matches:
            where = "" if os.path.isabs(pattern) else f" in {folder.absolute()}"
            raise InputError(key=f"sweep.{key}", found=one, expected=f"a pattern that matches a file{where}")
        found += matches
    return value if found == stated else found


def _realisations(change: Mapping[str, Any], data: Mapping[str, Any], folder: Path) -> list[tuple[dict[str, Any], int]]:
    """Return the changes that make each realisation of a case, and its number."""
    where, count = f"sweep.{REALISATIONS}", change[REALISATIONS]
    rest = {key: value for key, value in change.items() if key != REALISATIONS}
    if not isinstance(count, int) or isinstance(count, bool) or not 2 <= count <= MOST:
        raise InputError(key=where, found=count, expected=f"a whole number from 2 to {MOST}")
    for key, value in rest.items():
        data = place(data, key, value) if key.partition(".")[0] == "surface" else data
    surface = a_table("surface", data.get("surface"))
    second = a_table("surface.second", surface.get("second", {}))
    if stated := [key for key in DRAWN if key in rest] + [SURROGATE] * ("realisation" in surface):
        raise InputError(key=where, found=count, expected=f"either realisations or {stated[0]}")
    if "file" in surface or "file" in second:
        made = _card_recipe(surface.get("file"), folder)
        if made not in (None, "self_affine"):
            raise InputError(key=where, found=f"a card of generate = {made!r}", expected="a scan, or roughness")
        return [(rest | ({SURROGATE: number} if number != ITSELF else {}), number) for number in range(count + 1)]
    seeds = _seeds({_SEED: surface, _SECOND_SEED: second}, count)
    numbers = range(1, count + 1)
    return [(rest | {key: seed + number - 1 for key, seed in seeds.items()}, number) for number in numbers]


def _seeds(faces: Mapping[str, Mapping[str, Any]], count: int) -> dict[str, int]:
    """Return the first seed of each generated rough face, by its key."""
    where = f"sweep.{REALISATIONS}"
    rough = {key: face for key, face in faces.items() if face.get("generate") == "self_affine"}
    if not rough:
        made = faces[_SEED].get("generate")
        raise InputError(key=where, found=f"generate = {made!r}", expected="a scan, or generate = 'self_affine'")
    seeds: dict[str, Any] = {key: face.get("seed") for key, face in rough.items()}
    for key, face in rough.items():
        if not isinstance(seeds[key], int):
            raise InputError(key=where, found=seeds[key], expected=f"a whole number as {key}")
        if "amplitudes" not in face:
            kinds = "'gaussian' for patches of a surface, or 'fixed' for surfaces of one rms height"
            raise InputError(key=where, found=count, expected=f"{key.removesuffix('seed')}amplitudes, {kinds}")
    if 0 < max(seeds.values()) - min(seeds.values()) < count:  # one face would come again as the other one
        expected = f"seeds of the two faces that are equal, or at least {count} apart"
        raise InputError(key=where, found=list(seeds.values()), expected=expected)
    return seeds


def _card_recipe(file: Any, folder: Path) -> Any:
    """Return the recipe that a surface card contains; None if the file is no card."""
    path = Path(folder, Path(str(file)).expanduser())
    return read_toml(path, "a surface card in TOML").get("generate") if is_card(path, None) and path.is_file() else None


def place(data: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Return a copy of nested tables with another value at a dotted key; None removes the key.

    Raises
    ------
    InputError
        If the key leads through a plain value, or beyond the end of a list.

    Examples
    --------
    >>> place({"program": [{"load": 1}]}, "program.0.load", 2)
    {'program': [{'load': 2}]}
    """
    changed = copy.deepcopy(dict(data))
    here: Any = changed
    *above, last = key.split(".")
    for depth, part in enumerate([*above, last]):
        named = ".".join(above[:depth])
        if isinstance(here, list):
            if not part.isdecimal() or int(part) >= len(here):
                message = f"{key}: found {part!r}: {named} has entries 0 to {len(here) - 1}"
                raise InputError(message, key=key, found=value, expected=f"an entry of {named}")
        elif not isinstance(here, dict):
            message = f"{key}: {named} is {short_repr(here)}, which has no keys"
            raise InputError(message, key=key, found=value, expected=f"a table {named}")
        if depth < len(above):
            here = here[int(part)] if isinstance(here, list) else here.setdefault(part, {})
    if isinstance(here, list):
        here[int(last)] = value
    elif value is None:
        here.pop(last, None)
    else:
        here[last] = value
    return changed


def value_at(tables: Any, key: str, default: Any) -> Any:
    """Return the value at a dotted key of nested tables."""
    for part in key.split("."):
        if isinstance(tables, list) and part.isdecimal() and int(part) < len(tables):
            tables = tables[int(part)]
        elif isinstance(tables, Mapping) and part in tables:
            tables = tables[part]
        else:
            return default
    return tables
