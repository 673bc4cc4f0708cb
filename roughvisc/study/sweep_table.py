"""Sweeps: changes of a study for each of its cases, and the realisations of its surface."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Iterator, Mapping
from glob import glob
from pathlib import Path
from typing import Any

from roughvisc.arguments import a_table, dotted
from roughvisc.errors import InputError, short_repr

#: Keys of the number of realisations in a sweep, and of the number of a realisation in a case.
REALISATIONS, REALISATION = "realisations", "realisation"
#: Number of the measured surface, which comes before its surrogates.
ITSELF = 0
#: Keys that a realisation changes.
SURROGATE, _SEED, _SECOND_SEED = DRAWN = ("surface.realisation", "surface.seed", "surface.second.seed")
#: Largest numbers of realisations and of cases.
MOST, MOST_CASES = 10_000, 100_000


def sweep_changes(sweep: Any, data: Mapping[str, Any], folder: Path) -> list[tuple[dict[str, Any], dict[str, int]]]:
    """Return the changes of a study for each of its cases.

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
    list of (dict, dict)
        Dotted key -> value; and the number of the realisation, if the case is a realisation.

    Raises
    ------
    InputError
        If the tables are not lists of values, a pattern matches no file, there are too many cases, a key does not
        influence results, or the surface has no realisations.
    """
    found: list[tuple[dict[str, Any], dict[str, int]]] = []
    named = [_with_files(one, folder) for one in sweep] if isinstance(sweep, list) else _with_files(sweep, folder)
    for change in expand(named):
        for key in change:
            if key.partition(".")[0] in ("observe", "audit"):
                expected = "a value in its own table, since it changes no result"
                raise InputError(key=key, found=change[key], expected=expected)
        count = change.pop(REALISATIONS, None)
        found += [(change, {})] if count is None else _realisations(change, count, data)
        if len(found) > MOST_CASES:
            raise InputError(key="sweep", found=f"{len(found)} cases", expected=f"at most {MOST_CASES}")
    return found


def expand(sweep: Any) -> list[dict[str, Any]]:
    """Return the changes of each case of a sweep, without realisations: dotted key -> value.

    Parameters
    ----------
    sweep : dict or list of dict
        ``[sweep]``: every combination of the lists; ``[[sweep]]``: the lists of a table entry by entry, table after
        table. A single value in ``[[sweep]]`` applies to its whole table.

    Examples
    --------
    >>> expand({"a": [1, 2], "b": [3, 4]})
    [{'a': 1, 'b': 3}, {'a': 1, 'b': 4}, {'a': 2, 'b': 3}, {'a': 2, 'b': 4}]
    >>> expand([{"a": [1, 2], "b": [3, 4]}, {"a": 5}])
    [{'a': 1, 'b': 3}, {'a': 2, 'b': 4}, {'a': 5}]
    """
    if isinstance(sweep, list) and all(isinstance(table, Mapping) and table for table in sweep):
        found = []
        for number, table in enumerate(sweep):
            stated = dict(_flat(table))
            lengths = {key: len(values) for key, values in stated.items() if isinstance(values, list)}
            if len(set(lengths.values())) > 1 or 0 in lengths.values():
                raise InputError(key=f"sweep.{number}", found=lengths, expected="lists of one length, at least 1")
            for entry in range(max(lengths.values(), default=1)):
                found.append({key: one[entry] if isinstance(one, list) else one for key, one in stated.items()})
        return found
    if not isinstance(sweep, Mapping):
        raise InputError(key="sweep", found=sweep, expected="a table of lists, or [[sweep]] tables")
    lists = {key: [value] if key == REALISATIONS else value for key, value in _flat(sweep)}
    for key, values in lists.items():
        if not isinstance(values, list) or not values:
            raise InputError(key=f"sweep.{key}", found=values, expected="a list of values")
    if (count := math.prod(map(len, lists.values()))) > MOST_CASES:
        raise InputError(key="sweep", found=f"{count} cases", expected=f"at most {MOST_CASES}")
    return [dict(zip(lists, chosen, strict=True)) for chosen in itertools.product(*lists.values())]


def _flat(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values of a table, written with quotes (``"a.b" = ...``) or without (``a.b = ...``)."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def _with_files(table: Any, folder: Path) -> Any:
    """Return a table of a sweep with the names of files, sorted, for each pattern such as ``"scans/*.sur"``.

    The name of an existing file is not a pattern.
    """
    if not isinstance(table, Mapping):
        return table
    named = dict(_flat(table))
    for key, value in named.items():
        found: list[Any] = []
        for one in value if isinstance(value, list) else [value]:
            is_pattern = isinstance(one, str) and set("*?[") & set(one) and not (folder / one).exists()
            if key.rpartition(".")[2] != "file" or not is_pattern:
                found.append(one)
                continue
            pattern = os.path.expanduser(one)
            matches = [name for name in glob(pattern, root_dir=folder, recursive=True) if (folder / name).is_file()]
            if not matches:
                where = "" if os.path.isabs(pattern) else f" in {folder.absolute()}"
                raise InputError(key=f"sweep.{key}", found=one, expected=f"a pattern that matches a file{where}")
            found += sorted(matches)
        named[key] = value if found == [value] else found
    return named


def _realisations(
    change: Mapping[str, Any], count: Any, data: Mapping[str, Any]
) -> list[tuple[dict[str, Any], dict[str, int]]]:
    """Return the changes of a case for each of its realisations, and the number of each.

    Realisation 0 of a scan is the scan itself; the others are its surrogates. Generated faces have consecutive seeds,
    beginning with the stated seeds; the stated seeds of two faces decide whether any faces are equal.
    """
    where = f"sweep.{REALISATIONS}"
    if not isinstance(count, int) or isinstance(count, bool) or not 2 <= count <= MOST:
        raise InputError(key=where, found=count, expected=f"a whole number from 2 to {MOST}")
    for key, value in change.items():
        data = place(data, key, value) if key.partition(".")[0] == "surface" else data
    surface = a_table("surface", data.get("surface"))
    faces = {_SEED: surface, _SECOND_SEED: a_table("surface.second", surface.get("second", {}))}
    if stated := [key for key in DRAWN if key in change] + [SURROGATE] * ("realisation" in surface):
        raise InputError(key=where, found=count, expected=f"either realisations or {stated[0]}")
    if any("file" in face for face in faces.values()):
        surrogates = [{SURROGATE: number} for number in range(1, count + 1)]
        return [({**change, **one}, {REALISATION: number}) for number, one in enumerate([{}, *surrogates], ITSELF)]
    seeds = {key: face.get("seed") for key, face in faces.items() if face.get("generate") == "self_affine"}
    if not seeds:
        made = f"generate = {surface.get('generate')!r}"
        raise InputError(key=where, found=made, expected="a scan, or generate = 'self_affine'")
    for key, seed in seeds.items():
        if not isinstance(seed, int) or "amplitudes" not in faces[key]:
            kinds = "'gaussian' for patches of a surface, or 'fixed' for surfaces of one rms height"
            expected = f"a whole number as {key}, and {key.removesuffix('seed')}amplitudes: {kinds}"
            raise InputError(key=where, found=count, expected=expected)
    return [
        ({**change, **{key: seed + number - 1 for key, seed in seeds.items()}}, {REALISATION: number})
        for number in range(1, count + 1)
    ]


def place(tables: Any, key: str, value: Any, above: str = "") -> Any:
    """Return a copy of nested tables with another value at a dotted key; None removes the key.

    Parameters
    ----------
    tables : dict or list
        The tables.
    key : str
        Dotted key in these tables.
    value : object
        The new value.
    above : str
        Dotted key of the tables, for messages.

    Raises
    ------
    InputError
        If the key leads through a plain value, or beyond the end of a list.

    Examples
    --------
    >>> place({"program": [{"load": 1}]}, "program.0.load", 2)
    {'program': [{'load': 2}]}
    """
    part, _, below = key.partition(".")

    def changed(inner: Any) -> Any:
        return place(inner, below, value, dotted(above, part)) if below else value

    if isinstance(tables, Mapping):
        entries = {**tables, part: changed(tables.get(part, {}))}
        return {name: one for name, one in entries.items() if one is not None}
    if isinstance(tables, list) and part.isdecimal() and int(part) < len(tables):
        at = int(part)
        return [*tables[:at], changed(tables[at]), *tables[at + 1 :]]
    whole, expected = dotted(above, key), f"an entry or a key of {above}"
    message = f"{whole}: {above} is {short_repr(tables)}, which has no {part!r}: expected {expected}"
    raise InputError(message, key=whole, found=value, expected=expected)


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
