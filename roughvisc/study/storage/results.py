"""Many results seen as one: a lazy Dataset over case, time or speed, x and y; or a tree where grids differ."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, overload

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.labels import annotate
from roughvisc.study.statement.case import Case
from roughvisc.study.statement.variation import DRAWN, REALISATION
from roughvisc.study.storage.index import LATEST, Entry, index_of, save_index
from roughvisc.study.storage.parameters import (
    CASE_KEY,
    as_realisation,
    combinations,
    identifier,
    labels_of,
    parameters_of,
)
from roughvisc.study.storage.store import no_results, read_variable
from roughvisc.variables import VARIABLES
from roughvisc.variables.axes import AXES

#: A block that is read in one go: several frames of a small grid, one of a large. [bytes]
_BLOCK = 16 << 20
#: Attributes that all results of a sweep share.
_SHARED = (
    "Conventions",
    "result_format",
    "source",
    "references",
    "comment",
    "boundary",
    "tolerance",
    "method",
    "direction",
    "thickness",
    "base",
    "kernel",
)


@overload
def open_results(
    out: str | Path, *, cases: Sequence[Case] | Literal["last", "all"] = "last", ragged: Literal[False] = False
) -> xr.Dataset: ...


@overload
def open_results(
    out: str | Path, *, cases: Sequence[Case] | Literal["last", "all"] = "last", ragged: Literal[True]
) -> xr.DataTree: ...


def open_results(out, *, cases="last", ragged=False):
    """Open all results of a sweep together; fields are read when they are needed.

    Parameters
    ----------
    out : path
        Folder of the results.
    cases : "last", "all", or sequence of Case
        "last": the finished cases of the last sweep in this folder, or all results if there was no sweep. "all": all
        results in the folder. A sequence: the results of these cases, in this order.
    ragged : bool
        Return a tree with one result per node. The results may have different times or speeds, and different grids.

    Returns
    -------
    xarray.Dataset or xarray.DataTree
        Variables as in a single result, over ``time`` or ``speed``, with ``case`` as first dimension; ``height`` has it
        only if heights differ. A sweep with ``realisations`` has ``realisation`` as second dimension, in which 0 is a
        measured surface itself; what has not been computed is missing there, with an empty key. Varied parameters are
        coordinates on ``case``, numbers in SI or strings, each under two names: its dotted key, and its identifier in
        the files, ``program_0_load``. In a tree the parameters are scalar coordinates of each node, whose name is
        the key of the case.

    Raises
    ------
    InputError
        If there is nothing to open, or the results differ in times or grid and `ragged` is not set.

    Examples
    --------
    >>> results = rv.open_results("results/load_sweep")  # doctest: +SKIP
    >>> results.set_index(case=["program_0_load", "surface_seed"]).unstack().contact_area  # doctest: +SKIP
    """
    folder = Path(out).absolute()
    index = index_of(folder)
    save_index(folder, index)
    if index.sweep is None and cases == "last":
        raise InputError(
            f"{folder / LATEST}: is damaged: expected the cases of the sweep that ran last; run it again, which "
            "computes nothing that is finished, or ask for cases='all'"
        )
    entries = _chosen(index.entries, index.sweep or (), cases)
    if not entries:
        raise no_results(folder)
    drawn = dict(index.realisations)
    if not isinstance(cases, str):
        drawn = {case.key: case.varied[REALISATION] for case in cases if REALISATION in case.varied}
    parameters = parameters_of([as_realisation(entry.case, drawn.get(entry.key)) for entry in entries])
    if ragged:
        return _tree(folder, entries, parameters)
    _check_common(folder, entries)
    return _stacked(folder, entries, parameters)


def _chosen(entries: Mapping[str, Entry], last: Sequence[str], cases: Any) -> list[Entry]:
    if isinstance(cases, str):
        if cases not in ("last", "all"):
            raise InputError(f"cases is {cases!r}: expected 'last', 'all', or a list of cases")
        wanted: Iterable[str] = last if cases == "last" and any(key in entries for key in last) else entries
    else:
        wanted = dict.fromkeys(case.key for case in cases)
    return [entries[key] for key in wanted if key in entries]


def _check_common(folder: Path, entries: Sequence[Entry]) -> None:
    first = entries[0]
    for entry in entries[1:]:
        if entry.along != first.along:
            raise InputError(
                f"{folder}: {first.file} lies over {first.along}, {entry.file} over {entry.along}: open them with "
                "ragged=True, which gives a tree"
            )
        for what, one, other in (
            (f"{first.along}s", first.histories[first.along], entry.histories[first.along]),
            ("grid", first.x, entry.x),
            ("grid", first.y, entry.y),
        ):
            if not np.array_equal(one, other):
                sizes = f"{len(one)} and {len(other)}" if len(one) != len(other) else f"{len(one)} each, not the same"
                raise InputError(
                    f"{folder}: {first.file} and {entry.file} have no common {what} ({sizes}): open them with "
                    f"ragged=True, which gives a tree{', or keep a list of times' if what == 'times' else ''}"
                )


def _stacked(folder: Path, entries: Sequence[Entry], parameters: Mapping[str, NDArray[Any]]) -> xr.Dataset:
    first = entries[0]
    known = AXES[first.along].variables
    variables: dict[str, Any] = {
        name: (("case", *known[name].dims), _side_by_side([entry.histories[name] for entry in entries]))
        for name in first.histories
        if name != first.along and all(name in entry.histories for entry in entries)
    }
    one_surface = all(entry.case.get("surface") == first.case.get("surface") for entry in entries)
    for name, dtype in first.fields.items():
        if name in known and all(name in entry.fields for entry in entries):
            dims = known[name].dims
            if dims[0] == first.along or not one_surface:
                dtype = np.result_type(*(entry.fields[name] for entry in entries)).str
                variables[name] = (("case", *dims), _lazy(folder, entries, name, dtype))
            else:
                variables[name] = (dims, _lazy(folder, entries[:1], name, dtype)[0])
    coords = {first.along: first.histories[first.along], "x": first.x, "y": first.y}
    dataset = xr.Dataset(variables, coords=coords, attrs=_attributes(entries))
    dataset = annotate(dataset)
    keys = {CASE_KEY: (("case",), np.array([entry.key for entry in entries]), VARIABLES[CASE_KEY].attributes())}
    labels = labels_of(parameters, first.case, ("case",))
    return _by_realisation(dataset.assign_coords(keys | labels), parameters)


def _by_realisation(flat: xr.Dataset, parameters: Mapping[str, NDArray[Any]]) -> xr.Dataset:
    """Cases side by side over (case, realisation); as they are where some are no realisation, or one is there twice."""
    drawn = parameters.get(REALISATION)
    if drawn is None or drawn.dtype.kind != "i":
        return flat
    of_case = [key for key in parameters if key not in (REALISATION, *DRAWN)]
    settings = combinations((parameters[key] for key in of_case), len(drawn))
    rows, columns = list(dict.fromkeys(settings)), np.unique(drawn)
    place = np.full((len(rows), len(columns)), -1)
    place[[rows.index(one) for one in settings], np.searchsorted(columns, drawn)] = np.arange(len(drawn))
    if np.count_nonzero(place >= 0) < len(drawn):
        return flat
    spread = {name: _spread(one, place) for name, one in flat.variables.items() if "case" in one.dims}
    for key in of_case:
        spread[identifier(key)] = flat.variables[identifier(key)][place.max(axis=1)]
    for key in DRAWN:
        one = spread.get(identifier(key))
        if one is not None and (one.values == one.values[:1]).all():  # each case has the same seeds
            spread[identifier(key)] = one[0]
    attributes = {
        "long_name": "realisation",
        "comment": "number of another patch of the same roughness; 0: the measured surface itself",
    }
    spread[REALISATION] = xr.Variable(REALISATION, columns, attributes)
    known = flat.drop_vars([name for name in flat.variables if name in spread])
    coords = {name: one for name, one in spread.items() if name in flat.coords or name == REALISATION}
    return known.assign({name: one for name, one in spread.items() if name not in coords}).assign_coords(coords)


def _spread(variable: xr.Variable, place: NDArray[np.intp]) -> xr.Variable:
    """A variable over (case, realisation, ...) from one over (case, ...); missing where there is no case."""
    rows = [variable[np.maximum(row, 0)].data for row in place]
    data = np.stack(rows)  # of Dask arrays: a Dask array
    if (place < 0).any():
        missing = {"f": np.nan, "U": "", "S": b"", "O": ""}.get(variable.dtype.kind, -1)
        known = (place >= 0).reshape(*place.shape, *(1,) * (data.ndim - 2))
        data = (np if isinstance(data, np.ndarray) else import_module("dask.array")).where(known, data, missing)
        data = data.astype(variable.dtype)
    return xr.Variable(("case", REALISATION, *variable.dims[1:]), data, variable.attrs)


def _side_by_side(histories: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Histories over (case, time); NaN where a case has fewer rows than others, -1 for its status."""
    if len({len(one) for one in histories}) == 1:
        return np.stack(histories)
    missing = np.nan if histories[0].dtype.kind == "f" else -1
    table = np.full((len(histories), max(map(len, histories))), missing, histories[0].dtype)
    for row, one in zip(table, histories, strict=True):
        row[: len(one)] = one
    return table


def _attributes(entries: Sequence[Entry]) -> dict[str, Any]:
    first = entries[0]
    alike = {
        name: first.attributes[name]
        for name in _SHARED
        if name in first.attributes and all(e.attributes.get(name) == first.attributes[name] for e in entries)
    }
    return {"title": first.case.get("title", ""), **alike}


def _lazy(folder: Path, entries: Sequence[Entry], name: str, dtype: str) -> Any:
    """Dask array over (case, ...) of one variable; a block is one case's, some rows of it."""
    import dask.array as da

    first = entries[0]
    grid = (len(first.x), len(first.y))
    in_rows = AXES[first.along].variables[name].dims[0] == first.along
    frames = max(1, _BLOCK // (grid[0] * grid[1] * np.dtype(dtype).itemsize))
    starts = range(0, first.rows, frames) if in_rows else range(1)
    counts = (tuple(min(frames, first.rows - start) for start in starts),) if in_rows else ()
    paths = np.array([str(folder / entry.file) for entry in entries])
    blocks = paths.reshape(-1, *(1,) * (2 + in_rows))
    if in_rows:
        blocks = np.repeat(blocks, len(starts), axis=1)
    return da.map_blocks(
        _read,
        da.from_array(blocks, chunks=1),
        variable=name,
        frames=frames if in_rows else 0,
        dtype=np.dtype(dtype),
        chunks=((1,) * len(entries), *counts, (grid[0],), (grid[1],)),
        meta=np.empty((0,) * (3 + in_rows), dtype),
    )


def _read(path: NDArray[Any], variable: str, frames: int, block_id: tuple[int, ...] = ()) -> NDArray[Any]:
    """One block, from its file."""
    start = block_id[1] * frames if frames else 0
    key = slice(start, start + frames) if frames else slice(None)
    return read_variable(path.item(), variable, key)[np.newaxis]


def _tree(folder: Path, entries: Sequence[Entry], parameters: Mapping[str, NDArray[Any]]) -> xr.DataTree:
    nodes = {}
    for number, entry in enumerate(entries):
        node = _stacked(folder, [entry], {key: values[number : number + 1] for key, values in parameters.items()})
        nodes[entry.key] = node.isel(case=0)
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=_attributes(entries)), **nodes})
