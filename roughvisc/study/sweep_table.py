"""Sweeps: changes of a study for each of its cases, the realisations of its surface, and statistics over them."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import stdtrit

from roughvisc.arguments import a_table, dotted, suits
from roughvisc.errors import InputError, short_repr

Array = NDArray[np.float64]

#: Keys of the number of realisations in a sweep, and of the number of a realisation in a case.
REALISATIONS = "realisations"
REALISATION = "realisation"
#: Number of the measured surface, which comes before its surrogates.
ITSELF = 0
#: Keys that a realisation changes.
SURROGATE, _SEED = DRAWN = ("surface.realisation", "surface.seed")
#: Largest numbers of realisations and of cases.
MOST = 10_000
MOST_CASES = 100_000


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
    cases: list[tuple[dict[str, Any], dict[str, int]]] = []
    for change in expand(sweep, folder):
        for key in change:
            if key.partition(".")[0] in ("observe", "audit"):
                expected = "a value in its own table, since it changes no result"
                raise InputError(key=key, found=change[key], expected=expected)
        count = change.pop(REALISATIONS, None)
        cases += [(change, {})] if count is None else _realisations(change, count, data)
        if len(cases) > MOST_CASES:
            raise InputError(key="sweep", found=f"{len(cases)} cases", expected=f"at most {MOST_CASES}")
    return cases


def expand(sweep: Any, folder: Path = Path()) -> list[dict[str, Any]]:
    """Return the changes of each case: dotted key -> value.

    The lists of ``[sweep]`` are multiplied, the last key varying fastest. The lists of ``[[sweep]]`` have equal length
    and are combined entry by entry. A single value in ``[[sweep]]`` applies to its whole table.

    Examples
    --------
    >>> expand({"a": [1, 2], "b": [3, 4]})
    [{'a': 1, 'b': 3}, {'a': 1, 'b': 4}, {'a': 2, 'b': 3}, {'a': 2, 'b': 4}]
    >>> expand([{"a": [1, 2], "b": [3, 4]}, {"a": 5}])
    [{'a': 1, 'b': 3}, {'a': 2, 'b': 4}, {'a': 5}]
    """
    tables = sweep if isinstance(sweep, list) else [sweep]
    if not tables or not all(isinstance(table, Mapping) for table in tables):
        raise InputError(key="sweep", found=sweep, expected="a table of lists, or [[sweep]] tables")
    changes: list[dict[str, Any]] = []
    for number, table in enumerate(tables):
        lists = {key: _matching(key, value, folder) for key, value in _flat(table)}
        if tables is sweep:
            lengths = {key: len(values) for key, values in lists.items() if isinstance(values, list)}
            if not table or len(set(lengths.values())) > 1 or 0 in lengths.values():
                raise InputError(key=f"sweep.{number}", found=lengths, expected="lists of one length, at least 1")
            count = max(lengths.values(), default=1)
            columns = [values if key in lengths else [values] * count for key, values in lists.items()]
            chosen: Iterable[Any] = zip(*columns, strict=True)
        else:
            lists |= {key: [value] for key, value in lists.items() if key == REALISATIONS}
            for key, values in lists.items():
                if not isinstance(values, list) or not values:
                    raise InputError(key=f"sweep.{key}", found=values, expected="a list of values")
            if (count := math.prod(map(len, lists.values()))) > MOST_CASES:
                raise InputError(key="sweep", found=f"{count} cases", expected=f"at most {MOST_CASES}")
            chosen = itertools.product(*lists.values())
        changes += [dict(zip(lists, values, strict=True)) for values in chosen]
    return changes


def _flat(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values of a table, written with quotes (``"a.b" = ...``) or without (``a.b = ...``)."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def _matching(key: str, value: Any, folder: Path) -> Any:
    """Return a value of a sweep with the names of files, sorted, for each pattern such as ``"scans/*.sur"``.

    The name of an existing file is not a pattern.
    """
    if key.rpartition(".")[2] != "file":
        return value
    values: list[Any] = []
    for pattern in value if isinstance(value, list) else [value]:
        if not isinstance(pattern, str) or not set("*?[") & set(pattern) or (folder / pattern).exists():
            values.append(pattern)
            continue
        names = glob(os.path.expanduser(pattern), root_dir=folder, recursive=True)
        matches = sorted(name for name in names if (folder / name).is_file())
        if not matches:
            expected = f"a pattern that matches a file in {folder.absolute()}"
            raise InputError(key=f"sweep.{key}", found=pattern, expected=expected)
        values += matches
    return value if values == [value] else values


def _realisations(
    change: dict[str, Any], count: Any, data: Mapping[str, Any]
) -> list[tuple[dict[str, Any], dict[str, int]]]:
    """Return the changes of a case for each of its realisations, and the number of each.

    Realisation 0 of a scan is the scan itself; the others are its surrogates. A generated surface has consecutive
    seeds, beginning with the stated seed.
    """
    where = f"sweep.{REALISATIONS}"
    if not suits(count, int) or not 2 <= count <= MOST:
        raise InputError(key=where, found=count, expected=f"a whole number from 2 to {MOST}")
    for key, value in change.items():
        data = place(data, key, value) if key.startswith("surface") else data
    surface = a_table("surface", data.get("surface"))
    if stated := [key for key in DRAWN if key in change] + [SURROGATE] * ("realisation" in surface):
        raise InputError(key=where, found=count, expected=f"either realisations or {stated[0]}")
    if "file" in surface or "file" in a_table("surface.second", surface.get("second", {})):
        surrogates = [{SURROGATE: number} for number in range(ITSELF + 1, count + 1)]
        return [
            (change | surrogate, {REALISATION: number}) for number, surrogate in enumerate([{}, *surrogates], ITSELF)
        ]
    made = surface.get("generate")
    seed = surface.get("seed")
    if made not in ("self_affine", "spectrum") or "second" in surface:
        expected = "a scan, or one face of 'self_affine' or 'spectrum'"
        raise InputError(key=where, found=f"generate = {made!r}", expected=expected)
    if not isinstance(seed, int) or "amplitudes" not in surface:
        kinds = "'gaussian' for patches of a surface, or 'fixed' for surfaces of one rms height"
        raise InputError(key=where, found=count, expected=f"a whole number as seed, and amplitudes: {kinds}")
    return [(change | {_SEED: seed + number}, {REALISATION: number + 1}) for number in range(count)]


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
        return {name: entry for name, entry in entries.items() if entry is not None}
    if isinstance(tables, list) and part.isdecimal() and int(part) < len(tables):
        index = int(part)
        return [*tables[:index], changed(tables[index]), *tables[index + 1 :]]
    whole = dotted(above, key)
    expected = f"an entry or a key of {above}"
    message = f"{whole}: {above} is {short_repr(tables)}, which has no {part!r}: expected {expected}"
    raise InputError(message, key=whole, found=value, expected=expected)


def value_at(tables: Any, key: str, default: Any) -> Any:
    """Return the value at a dotted key of nested tables."""
    for name in key.split("."):
        if isinstance(tables, list) and name.isdecimal() and int(name) < len(tables):
            tables = tables[int(name)]
        elif isinstance(tables, Mapping) and name in tables:
            tables = tables[name]
        else:
            return default
    return tables


def over_realisations(values: xr.DataArray) -> xr.Dataset:
    r"""Return mean, scatter and 95 % intervals of a quantity over the realisations of a surface.

    Parameters
    ----------
    values : xarray.DataArray
        A quantity with a dimension ``realisation``, such as ``results.contact_area`` of a sweep with ``realisations``,
        in any unit. Realisation 0, the measured surface itself, does not count as one of its surrogates.

    Returns
    -------
    xarray.Dataset
        Over the other dimensions, in the unit of the quantity:

        - ``mean`` and ``standard_deviation`` (of the sample, with :math:`n - 1`);
        - ``lower`` and ``upper``, the interval of the mean;
        - ``patch_lower`` and ``patch_upper``, the interval of the value of one more patch, for a single measurement;
        - ``count``, the number of known values;
        - with realisation 0 its value ``itself``, and its ``ratio`` to the mean [-].

    Raises
    ------
    InputError
        If the quantity has no dimension ``realisation``.

    See Also
    --------
    roughvisc.sweep, roughvisc.surrogates

    Notes
    -----
    Values that are not finite count as missing. If all other values are positive, both intervals are intervals of the
    logarithm. Let :math:`m` and :math:`s` be the mean and the standard deviation of the :math:`n` logarithms, and
    :math:`t` Student's quantile with :math:`n - 1` degrees of freedom. The interval of the mean is
    :math:`m + s^2/2 \pm t \sqrt{s^2/n + s^4/(2(n-1))}` [1]_. It contains the mean of log-normal values in 92 to 95 of
    100 samples of 4 or more values with :math:`s \le 1.2`. The interval of a patch is
    :math:`m \pm t s \sqrt{1 + 1/n}`. For values of both signs Student's intervals of the values themselves are
    returned. Intervals are missing for fewer than two values, and for a quantity that is never negative and is zero in
    some realisations, such as the leak rate of a closed gap.

    References
    ----------
    .. [1] U. Olsson, Confidence intervals for the mean of a log-normal distribution, J. Stat. Educ. 13 (2005) 1.

    Examples
    --------
    >>> import numpy as np, roughvisc as rv, xarray as xr
    >>> area = xr.DataArray(np.exp([0.1, -0.1, 0.2, -0.2]), dims="realisation", attrs={"units": "m^2"})
    >>> found = rv.over_realisations(area)
    >>> [round(float(found[name]), 3) for name in ("lower", "mean", "upper")]
    [0.758, 1.013, 1.364]
    """
    if not isinstance(values, xr.DataArray):
        raise InputError(key="values", found=values, expected="a quantity of a sweep, such as results.contact_area")
    if REALISATION not in values.dims:
        expected = f"a dimension {REALISATION!r}, as a sweep with realisations = 24 has it"
        raise InputError(key=str(values.name or "values"), found=list(values.dims), expected=expected)
    values = values.transpose(REALISATION, ...)
    numbers = values[REALISATION].values if REALISATION in values.coords else np.ones(len(values))
    columns = statistics(values.values[numbers != ITSELF])
    if ITSELF in numbers:
        itself = columns["itself"] = values.values[numbers == ITSELF][0]
        mean = columns["mean"]
        columns["ratio"] = np.divide(itself, mean, out=np.full_like(mean, np.nan), where=mean != 0)
    units = values.attrs.get("units", "1")
    name = str(values.attrs.get("long_name", values.name or "values"))
    variables = {}
    for statistic, array in columns.items():
        unit = "1" if statistic in ("count", "ratio") else units
        attributes = {"long_name": f"{statistic.replace('_', ' ')}: {name}", "units": unit}
        variables[statistic] = (values.dims[1:], array, attributes)
    coords = {key: coordinate for key, coordinate in values.coords.items() if REALISATION not in coordinate.dims}
    return xr.Dataset(variables, coords, {"quantity": str(values.name or "")})


def statistics(values: Array) -> dict[str, Array]:
    """Return the statistics of :func:`over_realisations` for values over (realisation, ...), without realisation 0."""
    values = np.where(np.isfinite(values), values, np.nan)
    count = np.isfinite(values).sum(axis=0)
    with np.errstate(all="ignore"):  # missing values or too few values give NaN
        freedom = np.where(count > 1, count - 1, np.nan)
        student = stdtrit(freedom, 0.975)
        mean = np.nansum(values, axis=0) / count
        deviation = np.sqrt(np.nansum((values - mean) ** 2, axis=0) / freedom)
        logarithms = np.log(values)
        middle = np.nansum(logarithms, axis=0) / count
        spread = np.sqrt(np.nansum((logarithms - middle) ** 2, axis=0) / freedom)
        of_mean = student * np.sqrt(spread**2 / count + spread**4 / (2 * freedom))
        of_patch = student * np.sqrt(1 + 1 / count)
        centre = middle + spread**2 / 2
        least = np.fmin.reduce(values, axis=0, initial=np.inf)
        # in logarithms if all values are positive; no interval if some are zero and none is negative
        positive = least > 0
        zero = least == 0
        ends = {
            "lower": (np.exp(centre - of_mean), mean - student / np.sqrt(count) * deviation),
            "upper": (np.exp(centre + of_mean), mean + student / np.sqrt(count) * deviation),
            "patch_lower": (np.exp(middle - of_patch * spread), mean - of_patch * deviation),
            "patch_upper": (np.exp(middle + of_patch * spread), mean + of_patch * deviation),
        }
    columns = {"mean": mean, "standard_deviation": deviation}
    columns |= {name: np.where(zero, np.nan, np.where(positive, *pair)) for name, pair in ends.items()}
    return columns | {"count": count}
