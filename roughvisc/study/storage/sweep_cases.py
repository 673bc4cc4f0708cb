"""Cases of a sweep: their varied parameters, their numbers, and the list of the last sweep in a folder."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.study.case import Case
from roughvisc.study.si_tables import default_of, unit_of
from roughvisc.study.storage.folder import DAMAGED, read_json, write_json
from roughvisc.study.sweep_table import DRAWN, REALISATION, SURROGATE

#: File with the cases of the last sweep.
SWEEP = ".cases.json.gz"
#: Coordinate with the key of the case.
CASE_KEY = "case_key"
#: Dimensions, values and attributes of a coordinate.
Label = tuple[tuple[str, ...], NDArray[Any], dict[str, str]]

_NOT_A_PARAMETER = ("title", "origin", "varied", "written")


@dataclass(frozen=True)
class SweepCase:
    """One case of a sweep.

    Two cases share a key and a result if they differ only in labels, for example scans with equal bytes.

    Attributes
    ----------
    key : str
        Key of the case, the name of its result.
    case : dict
        The case as JSON, including its varied parameters.
    """

    key: str
    case: Mapping[str, Any]


def sweep_cases(cases: Sequence[Case]) -> list[SweepCase]:
    """Return keys and JSON of some cases, in their order, without duplicates of key and labels."""
    distinct: dict[Any, Case] = {}
    for case in cases:
        distinct.setdefault((case.key, json.dumps(dict(case.varied))), case)
    return [SweepCase(case.key, json.loads(case.to_json())) for case in distinct.values()]


def write_sweep(folder: Path, cases: Sequence[SweepCase]) -> None:
    """Write the list of cases of a sweep to its folder; if writing fails, the folder has no list."""
    write_json(folder / SWEEP, [{"key": one.key, "case": one.case} for one in cases])


def read_sweep(folder: Path) -> list[SweepCase]:
    """Return the cases of the last sweep in a folder; an empty list without a sweep.

    Raises
    ------
    InputError
        If the list of cases is damaged.
    """
    path = folder / SWEEP
    try:
        return [SweepCase(str(one["key"]), dict(one["case"])) for one in read_json(path)]
    except FileNotFoundError:
        return []
    except DAMAGED as error:
        raise InputError(
            f"{path}: cannot be read, or is damaged ({error}): expected the cases of the last sweep; run it again, "
            "which computes nothing that is finished",
            key=SWEEP,
        ) from error


def numbers_of(cases: Sequence[SweepCase]) -> list[int]:
    """Return the number of each case, from 0 in their order; the realisations of one case share its number."""
    numbers: dict[Any, int] = {}
    found = []
    for place, one in enumerate(cases):
        varied = one.case.get("varied", {})
        settings = json.dumps({key: value for key, value in varied.items() if key not in (REALISATION, *DRAWN)})
        found.append(numbers.setdefault(settings if REALISATION in varied else place, len(numbers)))
    return found


def number_by_key(cases: Sequence[SweepCase]) -> dict[str, int]:
    """Return key -> number of the first case with this key."""
    return dict(reversed([(one.key, number) for one, number in zip(cases, numbers_of(cases), strict=True)]))


def parameters_of(cases: Sequence[Mapping[str, Any]]) -> dict[str, NDArray[Any]]:
    """Return varied parameters of cases in JSON: parameters of the sweep, and others in which the cases differ."""
    keys = dict.fromkeys(key for case in cases for key in case.get("varied", {}))
    leaves = [dict(_leaves({k: v for k, v in case.items() if k not in _NOT_A_PARAMETER})) for case in cases]
    known = (*keys, SURROGATE) if REALISATION in keys else tuple(keys)
    for key in dict.fromkeys(key for leaf in leaves for key in leaf):
        stated = any(key == one or key.startswith(f"{one}.") for one in known)
        if not stated and any(leaf.get(key) != leaves[0].get(key) for leaf in leaves):
            keys[key] = None
    values = [leaf | case.get("varied", {}) for case, leaf in zip(cases, leaves, strict=True)]
    return {
        key: _column(
            [one[key] if key in one else default_of(key, case) for one, case in zip(values, cases, strict=True)]
        )
        for key in keys
    }


def _leaves(stated: Any, above: str = "") -> Iterable[tuple[str, Any]]:
    for key, value in stated.items() if isinstance(stated, dict) else enumerate(stated):
        if isinstance(value, dict) or (isinstance(value, list) and any(isinstance(v, dict) for v in value)):
            yield from _leaves(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def _column(values: Sequence[Any]) -> NDArray[Any]:
    """Return values as numbers, with NaN for None, or as strings."""
    if all(value is None or (isinstance(value, int | float) and not isinstance(value, bool)) for value in values):
        return np.array([np.nan if value is None else value for value in values])
    return np.array(["" if v is None else v if isinstance(v, str) else json.dumps(v) for v in values])


def labels_of(
    parameters: Mapping[str, NDArray[Any]], case: Mapping[str, Any], dims: tuple[str, ...] = ()
) -> dict[str, Label]:
    """Return varied parameters as coordinates; ``long_name`` is the dotted key.

    Parameters
    ----------
    parameters : mapping
        Dotted key -> values over `dims`: numbers in SI, or strings.
    case : mapping
        A case in JSON, which determines the units.
    dims : tuple of str
        Dimensions of the values; empty for one case.
    """
    labels: dict[str, Label] = {}
    for key, values in parameters.items():
        unit = unit_of(key, case) if values.dtype.kind in "if" else ""
        labels[identifier(key)] = (dims, values, {"long_name": key} | ({"units": unit} if unit else {}))
    return labels


def labels_of_case(case: Mapping[str, Any]) -> dict[str, Label]:
    """Return the varied parameters of one case in JSON as scalar coordinates."""
    return labels_of({key: _column([value])[0] for key, value in case.get("varied", {}).items()}, case)


def identifier(key: str) -> str:
    """Return a name of a varied parameter that Python and pandas accept: its dotted key with underscores.

    Examples
    --------
    >>> identifier("program.0.load")
    'program_0_load'
    """
    return key.replace(".", "_")
