"""Sweeps: the values of each case of a parametric study, and the realisations of a surface."""

from __future__ import annotations

import copy
import itertools
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from glob import glob
from pathlib import Path
from typing import Any

from roughvisc.errors import InputError
from roughvisc.topography.cards import is_card, read_toml
from roughvisc.units import shown

#: Key of ``[sweep]``, and name under which a case carries its number.
REALISATIONS, REALISATION = "realisations", "realisation"
#: Number of the measured surface itself.
ITSELF = 0
#: What a realisation changes in a study.
SURROGATE, _SEED, _SECOND_SEED = DRAWN = ("surface.realisation", "surface.seed", "surface.second.seed")
#: More realisations than this are taken for a slip.
MOST = 10_000


def realisation(surface: Any, number: int) -> dict[str, Any]:
    """Changes of a study that make one realisation of its surface: dotted key -> value.

    Parameters
    ----------
    surface : mapping
        The table ``[surface]``, as a study writes it.
    number : int
        Number of the realisation, from 1; :data:`ITSELF` is the measured surface itself.

    Returns
    -------
    dict
        Of a measured surface the number of a surrogate (see :func:`roughvisc.surrogates`), nothing for the surface
        itself. Of roughness that is generated the seed: the stated one is number 1, and each next number the next seed.

    Raises
    ------
    InputError
        If the surface is no sample of a roughness.

    Examples
    --------
    >>> realisation({"generate": "self_affine", "seed": 7, "amplitudes": "gaussian"}, 3)
    {'surface.seed': 9}
    >>> realisation({"file": "scan.sur"}, 3), realisation({"file": "scan.sur"}, 0)
    ({'surface.realisation': 3}, {})
    """
    faces = {_SEED: surface, _SECOND_SEED: surface.get("second") or {}}
    if is_measured(surface):
        return {SURROGATE: number} if number != ITSELF else {}
    rough = {key: face for key, face in faces.items() if face.get("generate") == "self_affine"}
    if not rough:
        made = shown(surface.get("generate"))
        raise InputError(f"found together with generate = {made}: expected a scan, or generate = 'self_affine'")
    seeds = {key: face.get("seed") for key, face in rough.items()}
    for key, seed in seeds.items():
        if not isinstance(seed, int) or isinstance(seed, bool):
            raise InputError(f"found with {key} = {shown(seed)}: expected a seed to begin with, a whole number")
    return {key: seed + number - 1 for key, seed in seeds.items()}


def is_measured(surface: Mapping[str, Any]) -> bool:
    """Whether a surface comes from a file, so that its realisations are surrogates of it."""
    return "file" in surface or "file" in (surface.get("second") or {})


def numbers(surface: Any, count: Any, folder: Path | None) -> range:
    """Numbers of so many realisations of a surface; of a measured one the surface itself comes first, in addition.

    Parameters
    ----------
    surface : mapping
        The table ``[surface]``, as a study writes it.
    count : object
        What the study states.
    folder : Path or None
        That the file of the surface is relative to.

    Raises
    ------
    InputError
        If the count is no whole number of at least two, or the surface does not tell how its realisations scatter.
    """
    if not isinstance(count, int) or isinstance(count, bool) or not 2 <= count <= MOST:
        raise InputError(f"found {shown(count)}: expected a whole number from 2 to {MOST}")
    if surface.get("realisation") is not None:
        raise InputError("found together with surface.realisation: expected one of them")
    if is_measured(surface):
        made = _recipe_of_card(surface.get("file"), folder)
        if made not in (None, "self_affine"):
            raise InputError(f"found together with a surface card of generate = {shown(made)}: expected a roughness")
        return range(ITSELF, count + 1)
    drawn = realisation(surface, 1)
    for key in drawn:
        face = surface if key == _SEED else surface["second"]
        if face.get("amplitudes") is None:
            where = key.removesuffix(".seed")
            raise InputError(
                f"found without {where}.amplitudes: expected 'gaussian', which scatters as patches of a surface do, or "
                "'fixed', with which all realisations have one rms height"
            )
    seeds = list(drawn.values())
    if len(seeds) == 2 and 0 < abs(seeds[0] - seeds[1]) < count:  # a face would come again as the other one
        raise InputError(
            f"found {count} with the seeds {seeds[0]} and {seeds[1]} of the two faces: expected seeds that are at "
            f"least {count} apart, or equal"
        )
    return range(1, count + 1)


def _recipe_of_card(file: Any, folder: Path | None) -> Any:
    """The recipe that a surface card names; None of any other file."""
    path = Path(folder or ".", Path(str(file)).expanduser())
    return read_toml(path, "a surface card in TOML").get("generate") if is_card(path, None) and path.is_file() else None


#: More cases are taken for a slip: a sweep of them would not end.
MOST_CASES = 100_000


def expand(sweep: Any) -> list[dict[str, Any]]:
    """Changes that make each case of a sweep: dotted key -> value.

    Parameters
    ----------
    sweep : dict or list of dict
        ``[sweep]``: every combination of the lists; ``[[sweep]]``: the lists of a table entry by entry, table after
        table. A value that is no list holds for its whole table; ``realisations`` is a number, see
        :func:`with_realisations`.

    Returns
    -------
    list of dict
        One empty dict without a sweep.

    Examples
    --------
    >>> expand({"a": [1, 2], "b": [3, 4]})
    [{'a': 1, 'b': 3}, {'a': 1, 'b': 4}, {'a': 2, 'b': 3}, {'a': 2, 'b': 4}]
    >>> expand([{"a": [1, 2], "b": [3, 4]}, {"a": 5}])
    [{'a': 1, 'b': 3}, {'a': 2, 'b': 4}, {'a': 5}]
    """
    if isinstance(sweep, Mapping):
        keys = dict(_flat(sweep))
        if REALISATIONS in keys:
            keys[REALISATIONS] = [keys[REALISATIONS]]
        for key, values in keys.items():
            if not isinstance(values, list) or not values:
                raise InputError(f"sweep.{key}: found {shown(values)}: expected a list of values")
        count = math.prod(len(values) for values in keys.values())
        if count > MOST_CASES:
            lengths = " x ".join(str(len(values)) for values in keys.values())
            raise InputError(f"sweep: found {lengths} = {count} cases: expected at most {MOST_CASES}")
        return [dict(zip(keys, chosen, strict=True)) for chosen in itertools.product(*keys.values())]
    if not isinstance(sweep, list) or not all(isinstance(table, Mapping) and table for table in sweep):
        raise InputError(f"sweep: found {shown(sweep)}: expected a table of lists, or [[sweep]] tables")
    return [change for number, table in enumerate(sweep) for change in _zipped(number, dict(_flat(table)))]


def with_realisations(
    changes: list[dict[str, Any]], data: Mapping[str, Any], folder: Path
) -> list[tuple[dict[str, Any], int | None]]:
    """Changes that make each case of a sweep, those with a number of realisations once for each of them.

    Parameters
    ----------
    changes : list of dict
        As :func:`expand` gives them.
    data : mapping
        The study without its sweep.
    folder : Path
        That files are relative to.

    Returns
    -------
    list of (dict, int or None)
        Changes, and the number of the realisation; None of a case that is no realisation.
    """
    found: list[tuple[dict[str, Any], int | None]] = []
    for change in changes:
        if REALISATIONS not in change:
            found.append((change, None))
            continue
        rest = {key: value for key, value in change.items() if key != REALISATIONS}
        surface = _surface(data, rest)
        try:
            twice = [key for key in rest if key in DRAWN]
            if twice:
                raise InputError(f"found together with sweep.{twice[0]}: expected one of them")
            for number in numbers(surface, change[REALISATIONS], folder):
                found.append((rest | realisation(surface, number), number))
        except InputError as error:
            raise InputError(f"sweep.{REALISATIONS}: {error}") from error
        if len(found) > MOST_CASES:
            told = f"found {len(found)} cases or more with realisations"
            raise InputError(f"sweep: {told}: expected at most {MOST_CASES}")
    return found


def _surface(data: Mapping[str, Any], change: Mapping[str, Any]) -> Mapping[str, Any]:
    """The table ``[surface]`` of a case; empty where it is none, which is refused with the case."""
    for key, value in change.items():
        if key.partition(".")[0] == "surface":
            with suppress(InputError):
                data = place(data, key, value)
    surface = data.get("surface")
    return surface if isinstance(surface, Mapping) and isinstance(surface.get("second"), Mapping | None) else {}


def _zipped(number: int, table: Mapping[str, Any]) -> list[dict[str, Any]]:
    lengths = {key: len(values) for key, values in table.items() if isinstance(values, list)}
    if len(set(lengths.values())) > 1 or 0 in lengths.values():
        found = ", ".join(f"{length} for {key}" for key, length in lengths.items())
        raise InputError(f"sweep.{number}: found {found}: expected lists of one length, at least 1")
    runs = next(iter(lengths.values()), 1)
    if runs > MOST_CASES:
        raise InputError(f"sweep.{number}: found {runs} cases: expected at most {MOST_CASES}")
    return [{key: v[run] if isinstance(v, list) else v for key, v in table.items()} for run in range(runs)]


def _flat(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys of a table, whether it was written with quotes (``"a.b" = ...``) or without (``a.b = ...``)."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def with_files(sweep: Any, folder: Path) -> Any:
    """A sweep in which patterns of files stand for the files that match them, sorted by name.

    Parameters
    ----------
    sweep : dict or list of dict
        As :func:`expand` takes it. A key ``file``, such as ``surface.file``, may hold patterns such as
        ``"scans/*.sur"``, alone or in its list.
    folder : Path
        That the patterns are relative to.
    """
    if isinstance(sweep, list):
        return [with_files(table, folder) for table in sweep]
    if not isinstance(sweep, Mapping):
        return sweep
    return {
        key: _matching(key, value, folder) if key.rpartition(".")[2] == "file" else value for key, value in _flat(sweep)
    }


def _matching(key: str, value: Any, folder: Path) -> Any:
    """The value, with the files in place of each pattern; a file that is there by that very name is no pattern."""
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
            raise InputError(f"sweep.{key}: found {one!r}, which matches no file{where}: expected one at least")
        found += matches
    return value if found == stated else found


def place(data: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """A copy of nested tables with the value at a dotted key set.

    Raises
    ------
    InputError
        If the key leads through something that is no table, or to a segment that is not there.

    Examples
    --------
    >>> place({"program": [{"load": 1}]}, "program.0.load", 2)
    {'program': [{'load': 2}]}
    """
    changed = copy.deepcopy(dict(data))
    here: Any = changed
    parts: list[Any] = key.split(".")
    for depth, part in enumerate(parts):
        last = depth == len(parts) - 1
        if isinstance(here, list):
            if not part.isdecimal() or int(part) >= len(here):
                above = ".".join(parts[:depth])
                raise InputError(f"found {part!r}: {above} has entries 0 to {len(here) - 1}")
            part = int(part)
        elif not isinstance(here, dict):
            raise InputError(f"{'.'.join(parts[:depth])} is {here!r}, which has no keys")
        if last:
            here[part] = value
        else:
            here = here.setdefault(part, {}) if isinstance(here, dict) else here[part]
    return changed
