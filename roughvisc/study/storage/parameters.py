"""What was varied: the parameters of cases, and the coordinates that label results with them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.study.si_tables import default_of, unit_of
from roughvisc.study.sweep_table import DRAWN, REALISATION, SURROGATE

#: Coordinate that holds the key of the case.
CASE_KEY = "case_key"
#: dimensions, values, attributes
Label = tuple[tuple[str, ...], NDArray[Any], dict[str, str]]

_NOT_A_PARAMETER = ("title", "origin", "varied", "written")


def identifier(key: str) -> str:
    """Name of a varied parameter that Python and pandas take: its dotted key with underscores.

    Examples
    --------
    >>> identifier("program.0.load")
    'program_0_load'
    """
    return key.replace(".", "_")


def labels_of(
    parameters: Mapping[str, NDArray[Any]], case: Mapping[str, Any], dims: tuple[str, ...] = ()
) -> dict[str, Label]:
    """Coordinates that hold what was varied; ``long_name`` is the dotted key.

    Parameters
    ----------
    parameters : mapping
        Dotted key -> values over `dims`: numbers in SI, or strings.
    case : mapping
        A case in JSON, which tells the units.
    dims : tuple of str
        None: the values are of one case.
    """
    labels: dict[str, Label] = {}
    for key, values in parameters.items():
        unit = unit_of(key, case) if values.dtype.kind in "if" else ""
        labels[identifier(key)] = (dims, values, {"long_name": key} | ({"units": unit} if unit else {}))
    return labels


def labels_of_case(case: Mapping[str, Any]) -> dict[str, Label]:
    """Scalar coordinates of one result: what was varied in it.

    Parameters
    ----------
    case : mapping
        The case in JSON.
    """
    return labels_of({key: _column([value])[0] for key, value in case.get("varied", {}).items()}, case)


def parameters_of(cases: Sequence[Mapping[str, Any]]) -> dict[str, NDArray[Any]]:
    """Varied parameters of cases in JSON: those that a sweep set, and any other in which the cases differ."""
    keys = dict.fromkeys(key for case in cases for key in case.get("varied", {}))
    said_already = {SURROGATE} if REALISATION in keys else set()
    leaves = [dict(_leaves({k: v for k, v in case.items() if k not in _NOT_A_PARAMETER})) for case in cases]
    for key in dict.fromkeys(key for leaf in leaves for key in leaf):
        below = any(key == varied or key.startswith(f"{varied}.") for varied in keys)
        if not below and key not in said_already and any(leaf.get(key) != leaves[0].get(key) for leaf in leaves):
            keys[key] = None
    stated = [leaf | case.get("varied", {}) for case, leaf in zip(cases, leaves, strict=True)]

    def value(key: str, number: int) -> Any:
        return stated[number][key] if key in stated[number] else default_of(key, cases[number])

    return {key: _column([value(key, number) for number in range(len(cases))]) for key in keys}


def _leaves(stated: Any, above: str = "") -> Iterable[tuple[str, Any]]:
    named = stated.items() if isinstance(stated, dict) else enumerate(stated)
    for key, value in named:
        if isinstance(value, dict) or (isinstance(value, list) and any(isinstance(v, dict) for v in value)):
            yield from _leaves(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def _column(values: Sequence[Any]) -> NDArray[Any]:
    numbers = [isinstance(v, int | float) and not isinstance(v, bool) for v in values]
    if all(numbers):
        return np.array(values)
    if all(number or v is None for number, v in zip(numbers, values, strict=True)):
        return np.array([np.nan if v is None else v for v in values], dtype=float)
    return np.array(["" if v is None else v if isinstance(v, str) else json.dumps(v) for v in values])


def combinations(columns: Iterable[Sequence[Any] | NDArray[Any]], count: int) -> list[tuple[Any, ...]]:
    """Values of each of some cases in all columns, by which cases can be grouped: a missing number equals another.

    Examples
    --------
    >>> combinations([np.array([1.0, np.nan]), ["a", "b"]], 2)
    [(1.0, 'a'), (None, 'b')]
    """
    lists = [np.asarray(column).tolist() for column in columns]
    return [tuple(None if column[i] != column[i] else column[i] for column in lists) for i in range(count)]


def case_numbers(parameters: Mapping[str, NDArray[Any]], count: int) -> list[int]:
    """Number of each of some cases, from 0 in their order; all realisations of one case have its number.

    Parameters
    ----------
    parameters : mapping
        Of all cases, see :func:`parameters_of`.
    count : int
        How many cases there are.

    Examples
    --------
    >>> loads, numbers = np.array([1.0, 1.0, 2.0, 2.0]), np.array([1, 2, 1, 2])
    >>> case_numbers({"program.0.load": loads}, 4), case_numbers({"program.0.load": loads, "realisation": numbers}, 4)
    ([0, 1, 2, 3], [0, 0, 1, 1])
    """
    drawn = parameters.get(REALISATION, np.full(count, np.nan))
    settings = combinations((parameters[key] for key in parameters if key not in (REALISATION, *DRAWN)), count)
    of_case = [one if drawn[place] == drawn[place] else place for place, one in enumerate(settings)]
    first = {one: number for number, one in enumerate(dict.fromkeys(of_case))}
    return [first[one] for one in of_case]
