"""All results of a sweep as one lazy Dataset over case, time or speed or row, x and y."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.study.case import Case
from roughvisc.study.storage.files import warn_once
from roughvisc.study.storage.index import Entry, Index, index_of, save_index
from roughvisc.study.storage.parameters import CASE_KEY, case_numbers, identifier, labels_of, parameters_of
from roughvisc.study.storage.store import no_results, read_variable
from roughvisc.study.storage.sweep_cases import SweepCase, read_sweep, sweep_cases
from roughvisc.study.sweep_table import DRAWN, REALISATION
from roughvisc.units import unit_for
from roughvisc.variables import AXES, ROW, ROWS, VARIABLES

#: A block that is read in one go: several frames of a small grid, one of a large. [bytes]
_BLOCK = 16 << 20
#: Attributes that all results of a sweep share.
_SHARED = (
    "Conventions",
    "result_format",
    "source",
    "boundary",
    "tolerance",
    "direction",
    "thickness",
    "base",
    "kernel",
)


def open_results(out: str | Path, *, cases: Sequence[Case] | Literal["last", "all"] = "last") -> xr.Dataset:
    """Open all results of a sweep together; fields are read when they are needed.

    Parameters
    ----------
    out : path
        Folder of the results.
    cases : "last", "all", or sequence of Case
        "last": the finished cases of the last sweep in this folder, or all results if there was no sweep. "all": all
        results in the folder. A sequence: the results of these cases, in this order.

    Returns
    -------
    xarray.Dataset
        Variables as in a single result, with ``case`` as first dimension; ``height`` has it only if heights differ.
        ``case`` is the number of the case, from 0, as in :func:`to_table`; a case without a result is left out.

        - Cases with common times or speeds: variables over ``(case, time, x, y)`` or ``(case, speed, x, y)``.
        - Others: variables over ``(case, row, x, y)``, with the coordinates ``time(case, row)`` or
          ``speed(case, row)``, and ``rows(case)``, the number of rows of each case. Later rows are NaN. Whole numbers,
          such as ``status``, become floats.
        - Cases on different grids: histories only, without fields, and a warning in the log names the grids.

        Varied parameters are coordinates over ``case``, numbers in SI or strings. The name of each is its dotted key
        with underscores, ``program_0_load``. A sweep with ``realisations`` has ``realisation`` as second dimension, in
        which 0 is a measured surface itself; a realisation without a result is missing there, with an empty key.

    Raises
    ------
    InputError
        If there is nothing to open, or some results lie over time and others over speed.

    Examples
    --------
    >>> results = rv.open_results("results/load_sweep")  # doctest: +SKIP
    >>> results.set_index(case=["program_0_load", "surface_seed"]).unstack("case").contact_area  # doctest: +SKIP
    """
    folder = Path(out).absolute()
    index = index_of(folder)
    save_index(folder, index)
    listed = _listed(folder, index, cases)
    here = [place for place, one in enumerate(listed) if one.key in index.entries]
    if not here:
        raise no_results(folder)
    entries = [index.entries[listed[place].key] for place in here]
    if len(axes := {entry.along: entry.file for entry in entries}) > 1:
        found = ", ".join(f"{file} over {along}" for along, file in axes.items())
        raise InputError(f"{folder}: found {found}: expected results over one of them; give cases", key="cases")
    parameters = parameters_of([one.case for one in listed])
    numbers = np.array(case_numbers(parameters, len(listed)))[here]
    parameters = {key: values[here] for key, values in parameters.items()}
    flat = _stacked(folder, entries)
    keys = {CASE_KEY: (("case",), np.array([entry.key for entry in entries]), VARIABLES[CASE_KEY].attributes)}
    labels = labels_of(parameters, listed[here[0]].case, ("case",))
    number = {"case": ("case", numbers, {"long_name": "number of the case"})}
    return _by_realisation(flat.assign_coords(number | keys | labels), parameters)


def _listed(folder: Path, index: Index, cases: Any) -> list[SweepCase]:
    """The cases to open, those without a result too."""
    if not isinstance(cases, str):
        return sweep_cases(cases)
    if cases not in ("last", "all"):
        raise InputError(key="cases", found=cases, expected="'last', 'all', or a list of cases")
    last = read_sweep(folder) if cases == "last" else []
    return last or [SweepCase(key, entry.case) for key, entry in index.entries.items()]


def _stacked(folder: Path, entries: Sequence[Entry]) -> xr.Dataset:
    """Results one after another over ``case``."""
    first = entries[0]
    along = first.along
    places = [entry.histories[along] for entry in entries]
    common = all(np.array_equal(one, places[0]) for one in places)
    variables: dict[str, Any] = {
        name: (("case", *VARIABLES[name].over(along)), _side_by_side([entry.histories[name] for entry in entries]))
        for name in first.histories
        if name != along and all(name in entry.histories for entry in entries)
    }
    one_grid = all(np.array_equal(e.x, first.x) and np.array_equal(e.y, first.y) for e in entries)
    one_surface = all(entry.case.get("surface") == first.case.get("surface") for entry in entries)
    if not one_grid:
        grids = ", ".join(dict.fromkeys(map(_grid, entries)))
        warn_once(
            folder / first.file,
            f"{folder}: the results lie on different grids ({grids}): their histories are opened together, without "
            "fields; open each with open_result for its fields",
        )
    for name in first.fields if one_grid else ():
        if name in VARIABLES and all(name in entry.fields for entry in entries):
            dims = VARIABLES[name].over(along)
            if dims[0] == along or not one_surface:
                variables[name] = (("case", *dims), _lazy(folder, entries, name))
            else:
                variables[name] = (dims, _lazy(folder, entries[:1], name)[0])
    coords = ({along: places[0]} if common else {}) | ({"x": first.x, "y": first.y} if one_grid else {})
    dataset = label(xr.Dataset(variables, coords=coords, attrs=_attributes(entries)))
    if common:
        return dataset
    dataset = dataset.rename_dims({along: ROW})
    counts = np.array([len(one) for one in places])
    rows = ("case", counts, {"long_name": f"number of {AXES[along].rows}", "units": "1"})
    return dataset.assign_coords(
        {along: (("case", ROW), _side_by_side(places), VARIABLES[along].attributes), ROWS: rows}
    )


def _grid(entry: Entry) -> str:
    """Cells of a result and their size, as one reads them."""
    sides = [one[1] - one[0] if len(one) > 1 else 0.0 for one in (entry.x, entry.y)]
    unit = unit_for(sides, "m")
    return f"{len(entry.x)} x {len(entry.y)} cells of {unit.text(sides[0], 4)} by {unit.text(sides[1], 4)}"


def _by_realisation(flat: xr.Dataset, parameters: Mapping[str, NDArray[Any]]) -> xr.Dataset:
    """Cases side by side over (case, realisation); unchanged if some are no realisation, or one is there twice."""
    drawn = parameters.get(REALISATION)
    if drawn is None or drawn.dtype.kind != "i":
        return flat
    (rows, row), (columns, column) = (np.unique(one, return_inverse=True) for one in (flat["case"].values, drawn))
    place = np.full((len(rows), len(columns)), -1)
    place[row, column] = np.arange(len(drawn))
    if np.count_nonzero(place >= 0) < len(drawn):
        return flat
    flat = flat.drop_vars("case")
    spread = {name: _spread(one, place) for name, one in flat.variables.items() if "case" in one.dims}
    for key in parameters:
        if key not in (REALISATION, *DRAWN):
            spread[identifier(key)] = flat.variables[identifier(key)][place.max(axis=1)]
    for key in DRAWN:
        one = spread.get(identifier(key))
        if one is not None and (one.values == one.values[:1]).all():  # each case has the same seeds
            spread[identifier(key)] = one[0]
    attributes = {
        "long_name": "realisation",
        "comment": "number of another patch of the same roughness; 0: the measured surface itself",
    }
    spread |= {REALISATION: xr.Variable(REALISATION, columns, attributes), "case": xr.Variable("case", rows)}
    known = flat.drop_vars([name for name in flat.variables if name in spread])
    coords = {name: one for name, one in spread.items() if name in flat.coords or name in (REALISATION, "case")}
    return known.assign({name: one for name, one in spread.items() if name not in coords}).assign_coords(coords)


def _spread(variable: xr.Variable, place: NDArray[np.intp]) -> xr.Variable:
    """A variable over (case, realisation, ...) from one over (case, ...); missing where there is no case."""
    data = np.stack([variable[np.maximum(row, 0)].data for row in place])  # of Dask arrays: a Dask array
    if (place < 0).any():
        missing = {"U": "", "S": b"", "O": ""}.get(variable.dtype.kind, np.nan)
        known = (place >= 0).reshape(*place.shape, *(1,) * (data.ndim - 2))
        data = (np if isinstance(data, np.ndarray) else import_module("dask.array")).where(known, data, missing)
    return xr.Variable(("case", REALISATION, *variable.dims[1:]), data, variable.attrs)


def _side_by_side(histories: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Histories over (case, row); NaN after the last row of a case."""
    if len({len(one) for one in histories}) == 1:
        return np.stack(histories)
    table = np.full((len(histories), max(map(len, histories))), np.nan)
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


def _lazy(folder: Path, entries: Sequence[Entry], name: str) -> Any:
    """Dask array over (case, ...) of one variable; a block is one case's, some rows of it, NaN after its last."""
    import dask.array as da

    first = entries[0]
    grid = (len(first.x), len(first.y))
    dtype = np.result_type(*(entry.fields[name] for entry in entries))
    in_rows = VARIABLES[name].over(first.along)[0] == first.along
    rows = np.array([entry.rows for entry in entries])
    if in_rows and np.ptp(rows):
        dtype = np.result_type(dtype, np.float16)
    frames = max(1, _BLOCK // (grid[0] * grid[1] * dtype.itemsize))
    starts = range(0, rows.max(), frames) if in_rows else range(1)
    counts = (tuple(min(frames, int(rows.max()) - start) for start in starts),) if in_rows else ()
    each = np.array([str(folder / entry.file) for entry in entries]), rows
    blocks = [one.reshape(-1, *(1,) * (2 + in_rows)) for one in each]
    if in_rows:
        blocks = [np.repeat(one, len(starts), axis=1) for one in blocks]
    return da.map_blocks(
        _read,
        *(da.from_array(one, chunks=1) for one in blocks),
        variable=name,
        counts=counts[0] if in_rows else (),
        grid=grid,
        as_type=dtype,
        dtype=dtype,
        chunks=((1,) * len(entries), *counts, (grid[0],), (grid[1],)),
        meta=np.empty((0,) * (3 + in_rows), dtype),
    )


def _read(
    path: NDArray[Any],
    rows: NDArray[Any],
    variable: str,
    counts: tuple[int, ...],
    grid: tuple[int, int],
    as_type: np.dtype[Any],
    block_id: tuple[int, ...] = (),
) -> NDArray[Any]:
    """One block, from its file."""
    if not counts:
        return read_variable(path.item(), variable, slice(None))[np.newaxis]
    start, count = sum(counts[: block_id[1]]), counts[block_id[1]]
    known = min(max(rows.item() - start, 0), count)
    if known == count:
        return read_variable(path.item(), variable, slice(start, start + count)).astype(as_type, copy=False)[np.newaxis]
    block = np.full((1, count, *grid), np.nan, as_type)
    if known:
        block[0, :known] = read_variable(path.item(), variable, slice(start, start + known))
    return block
