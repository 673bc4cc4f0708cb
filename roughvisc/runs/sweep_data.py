"""Results of a folder: their index, and the last sweep as one lazy Dataset and as a table.

The index, a cache of all histories, is one small file, so that results need not be opened. It is made again from the
results if it is absent, damaged or older than the results.
"""

from __future__ import annotations

import gzip
import json
import logging
import os
import sys
from base64 import b64decode, b64encode
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.labels import ATTRIBUTES, CARRIED, label
from roughvisc.paths import path_of
from roughvisc.runs.folder import (
    DAMAGED,
    KEY,
    atomic_write,
    case_path,
    no_results,
    read_json,
    write_json,
)
from roughvisc.runs.netcdf import lazy, open_without_steps, read_steps, read_variable
from roughvisc.study.case import Case, cases_given, identifier, labels_of, parameters_of
from roughvisc.study.sweep_table import DRAWN, REALISATION
from roughvisc.variables import AXES, ROW, ROWS, VARIABLES, axis_of
from roughvisc.version import program_version

log = logging.getLogger("roughvisc")

#: File with the index.
INDEX = ".index.json.gz"
#: Name of the file that lists the cases of the last sweep.
SWEEP = ".cases.json.gz"
#: Coordinate with the key of the case.
CASE_KEY = "case_key"
#: Size of a block, which is read in one call: several frames of a small grid, one frame of a large grid. [byte]
_BLOCK = 16 << 20
#: Number of results from which a client reads them, and number for a task; reading one takes about 10 ms.
_MANY = 200
_TOGETHER = 50


@dataclass(frozen=True)
class Entry:
    """Content of one result without its fields.

    Attributes
    ----------
    file : str
        Name of the file in the folder.
    stamp : list of int
        Size of the file [bytes] and time of its last change [ns].
    attributes, of_height : dict
        Attributes of the file and of its heights that are text or numbers.
    fields : dict
        dtype of each variable over x and y.
    arrays : dict
        Each variable over the rows, with ``time`` or ``speed``; and the positions ``x`` and ``y`` of the cells.
    """

    file: str
    stamp: list[int]
    attributes: dict[str, Any]
    of_height: dict[str, Any]
    fields: dict[str, str]
    arrays: dict[str, NDArray[Any]] = field(repr=False)

    @property
    def key(self) -> str:
        """Key of the case."""
        return str(self.attributes.get("case_key", ""))

    @property
    def along(self) -> str:
        """Axis of the rows."""
        return axis_of(self.arrays)

    @cached_property
    def case(self) -> dict[str, Any]:
        """The case as a dictionary, from its JSON."""
        return json.loads(self.attributes["case"])


def read_entry(path: Path) -> Entry:
    """Read the entry of one result.

    Raises
    ------
    InputError
        If the file cannot be read, is not a result, or is damaged.
    """
    with open_without_steps(path) as result:
        return entry_of(path, result)


def entry_of(path: Path, result: xr.Dataset) -> Entry:
    """Return the entry of a result that was opened, or that was just written (:func:`as_stored`).

    Parameters
    ----------
    path : Path
        Its file.
    result : xarray.Dataset
        Its content.
    """
    stamp = _stamp(path)
    lines = (axis_of(result.variables),), ("x",), ("y",)
    arrays = {}
    fields = {}
    for name, variable in result.variables.items():
        if variable.dims in lines:
            arrays[str(name)] = variable.values
        elif variable.dims[-2:] == ("x", "y"):
            fields[str(name)] = variable.dtype.str
    of_height = _plain(result["height"].attrs) if "height" in result else {}
    return Entry(path.name, stamp, _plain(result.attrs), of_height, fields, arrays)


def _plain(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Return the attributes that are texts or numbers."""
    items = {str(name): one.item() if isinstance(one, np.generic) else one for name, one in attributes.items()}
    return {name: one for name, one in items.items() if isinstance(one, str | int | float)}


def _stamp(path: Path) -> list[int]:
    status = path.stat()
    return [status.st_size, status.st_mtime_ns]


def index_of(folder: Path, known: Iterable[Entry] = ()) -> dict[str, Entry]:
    """Return the entry of every result in a folder by its key, and update the cache.

    The log names files that are not results.

    Parameters
    ----------
    folder : Path
        Results folder.
    known : iterable of Entry
        Entries of results that need not be opened.

    """
    cached = _read_cache(folder)
    before = cached | {entry.file: entry for entry in known}
    entries = {}
    paths = sorted(folder.glob(f"{KEY}.nc"))
    before |= _read_on_workers([path for path in paths if path.name not in before])
    for path in paths:
        try:
            entry = before.get(path.name)
            if entry is None or entry.stamp != _stamp(path):
                entry = read_entry(path)
            if entry.key != path.stem:
                raise InputError(f"{path}: holds the result of case {entry.key}: expected the case of its name")
            entries[entry.key] = entry
        except (InputError, FileNotFoundError) as error:  # damaged, or removed in the meantime
            log.warning("%s", error)
    if {entry.file: entry.stamp for entry in entries.values()} != {name: one.stamp for name, one in cached.items()}:
        results = [
            [one.file, one.stamp, one.attributes, one.of_height, one.fields, one.arrays] for one in entries.values()
        ]
        write_json(folder / INDEX, {"version": program_version(), "results": results}, _packed)
    return entries


def _read_on_workers(paths: Sequence[Path]) -> dict[str, Entry]:
    """Return the entries of many results by file name, read on the workers of the default client; none without one.

    A result that a worker cannot read is left out.
    """
    distributed = sys.modules.get("distributed")
    if len(paths) < _MANY or distributed is None:
        return {}
    try:
        client = distributed.default_client()
        parts = [paths[first : first + _TOGETHER] for first in range(0, len(paths), _TOGETHER)]
        entries = client.gather(client.map(_readable_entries, parts, pure=False))
    except (ValueError, OSError, RuntimeError):  # no client, or its cluster is lost
        return {}
    return {entry.file: entry for part in entries for entry in part}


def _readable_entries(paths: Sequence[Path]) -> list[Entry]:
    entries = []
    for path in paths:
        with suppress(InputError, FileNotFoundError):
            entries.append(read_entry(path))
    return entries


def _packed(array: NDArray[Any]) -> tuple[str, str]:
    return array.dtype.str, b64encode(array).decode()


def _read_cache(folder: Path) -> dict[str, Entry]:
    """Return the entries of the cache by file name; none if it is absent, damaged or of another version."""
    entries = {}
    with suppress(*DAMAGED):
        stated = read_json(folder / INDEX)
        for *plain, arrays in stated["results"] if stated["version"] == program_version() else ():
            unpacked = {name: np.frombuffer(b64decode(text), dtype) for name, (dtype, text) in arrays.items()}
            entries[plain[0]] = Entry(*plain, unpacked)
    return entries


def sweep_cases(cases: Sequence[Case], folder: Path | None = None) -> dict[str, dict[str, Any]]:
    """Return key -> JSON of each distinct case, in the order of the study, with paths relative to a folder."""
    return {key: json.loads(case.to_json(folder)) for key, case in {case.key: case for case in cases}.items()}


def write_sweep(cases: Sequence[Case], folder: Path) -> None:
    """Write the list of the cases of a sweep into its folder, one by one, because a hundred thousand may fill memory.

    If writing fails, an existing list is not changed.
    """
    distinct = {case.key: case for case in cases}
    with (
        suppress(OSError, InputError),
        atomic_write(folder / SWEEP) as temporary,
        temporary.open("wb") as stored,
        gzip.GzipFile("", "wb", compresslevel=1, fileobj=stored, mtime=0) as file,
    ):
        for number, (key, case) in enumerate(distinct.items()):
            file.write(f"{', ' if number else '{'}{json.dumps(key)}: {case.to_json(folder)}".encode())
        file.write(b"}")


def read_sweep(folder: Path) -> dict[str, dict[str, Any]]:
    """Return key -> JSON of each case of the last sweep in a folder; empty without a sweep.

    Raises
    ------
    InputError
        If the list of cases is not a regular file, cannot be read, or is damaged.
    """
    path = folder / SWEEP
    if not os.path.lexists(path):
        return {}
    try:
        return dict(read_json(path))
    except InputError:
        raise
    except DAMAGED as error:
        flaw = f"is damaged ({error})"
        raise InputError(f"{path}: {flaw}: expected the cases of a sweep; run it again", key=SWEEP) from error


def require_own_folder(cases: Sequence[Case], folder: Path) -> None:
    """Refuse a folder with the sweep of another study, whose list and table of cases the results would replace.

    A study that has changed has the same title or the same name of its file. Results of single cases do not count,
    because each has its own name.

    Raises
    ------
    InputError
        If the last sweep in the folder is one of another study.
    """
    listed: dict[str, dict[str, Any]] = {}
    with suppress(InputError):  # a damaged list belongs to no study
        listed = read_sweep(folder)
    if not listed or any(case.key in listed for case in cases):
        return
    own = set().union(*(_names(case.title, case.origin) for case in cases))
    other = set().union(*(_names(stated.get("title"), stated.get("origin")) for stated in listed.values()))
    if own & other:
        return
    holds, expected = f"holds the sweep of {', '.join(sorted(other))}", "a folder of this study, or a new one"
    raise InputError(f"out: {folder}: {holds}: expected {expected}", key="out", found=str(folder), expected=expected)


def _names(title: str | None, origin: str | Path | None) -> set[str]:
    """Return the title and the name of the file of a study, by which it is recognised after a change."""
    names = {title or "untitled", Path(origin).name if origin else ""} - {""}
    return names - {"untitled"} or names


def numbers_of(cases: Mapping[str, Mapping[str, Any]]) -> dict[str, int]:
    """Return the number of each case, from 0 in their order; the realisations of one case share its number."""
    numbers: dict[str, int] = {}
    number_of = {}
    for key, case in cases.items():
        varied = case.get("varied", {})
        settings = json.dumps({name: one for name, one in varied.items() if name not in (REALISATION, *DRAWN)})
        number_of[key] = numbers.setdefault(settings if REALISATION in varied else key, len(numbers))
    return number_of


def open_results(out: str | Path, *, cases: Sequence[Case] | str | Path | None = None) -> xr.Dataset:
    """Open all results of a sweep together; fields are read when they are needed.

    Parameters
    ----------
    out : path
        Folder of the results.
    cases : sequence of Case, or path, optional
        Cases whose results to open, in this order, or their study file. Default: the cases of the last sweep in this
        folder, or all results if no sweep ran in it.

    Returns
    -------
    xarray.Dataset
        Variables as in a single result, with ``case`` as first dimension; ``height`` has this dimension only if heights
        differ. ``case`` is the number of the case, from 0, as in :func:`to_table`; cases without a result are left out.

        - Cases with common times or speeds: variables over ``(case, time, x, y)`` or ``(case, speed, x, y)``.
        - Cases with different times or speeds: variables over ``(case, row, x, y)``, with the coordinates
          ``time(case, row)`` or ``speed(case, row)``, and ``rows(case)``, the number of rows of each case. Later rows
          are NaN. Whole numbers, such as ``status``, become floats.
        - Cases on different grids: histories only, without fields, and a warning in the log names the grids.

        The coordinate ``attributes`` contains the attributes in which the files differ, as JSON. If one case is
        selected, as in ``results.isel(case=0)``, observables, figures and the audit use its attributes, and read the
        history of its steps from its file.

        Varied parameters are coordinates over ``case``, numbers in SI or strings. The name of each is its dotted key
        with underscores, ``program_0_load``. A sweep with ``realisations`` has ``realisation`` as second dimension, in
        which 0 is the measured surface itself. Values of a realisation without a result are missing, and its key is
        empty.

    Raises
    ------
    InputError
        If the folder contains no result, or some results lie over time and others over speed.

    See Also
    --------
    roughvisc.sweep, roughvisc.to_table, roughvisc.open_result

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> cases = rv.vary(case, {"tolerance": [1e-1, 1e-2]})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     first = rv.run(cases[0], folder, progress=False)
    ...     results = rv.open_results(folder, cases=cases).load()
    >>> results.case.values.tolist()  # the second case is not finished
    [0]
    """
    folder = path_of(out, "out", "a folder of results").absolute()
    index = index_of(folder)
    listed = read_sweep(folder) if cases is None else sweep_cases(cases_given(cases), folder)
    listed = listed or {key: entry.case for key, entry in index.items()}
    here = [place for place, key in enumerate(listed) if key in index]
    if not here:
        raise no_results(folder)
    entries = [index[key] for key in listed if key in index]
    if len(axes := {entry.along: entry.file for entry in entries}) > 1:
        listing = ", ".join(f"{file} over {along}" for along, file in axes.items())
        raise InputError(f"{folder}: found {listing}: expected results over one axis; give cases", key="cases")
    numbers = numbers_of(listed)
    keys = [entry.key for entry in entries]
    parameters = {name: values[here] for name, values in parameters_of([*listed.values()]).items()}
    labels = labels_of(parameters, listed[keys[0]], ("case",)) | {
        "case": (("case",), np.array([numbers[key] for key in keys]), {"long_name": "number of the case"}),
        CASE_KEY: (("case",), np.array(keys), VARIABLES[CASE_KEY].attributes),
    }
    results = _by_realisation(_stacked(folder, entries).assign_coords(labels), parameters)
    results.encoding[CARRIED] = _Steps(folder)
    return results


@dataclass
class _Steps:
    """Histories of the steps of the cases in a folder, each read from its file at its first use."""

    folder: Path
    read: dict[str, xr.Dataset | None] = field(default_factory=dict, repr=False)

    def __call__(self, key: str) -> xr.Dataset | None:
        """Return the history of the steps of a case."""
        if key not in self.read:
            self.read[key] = read_steps(case_path(self.folder, key, "result"))
        return self.read[key]


def _stacked(folder: Path, entries: Sequence[Entry]) -> xr.Dataset:
    """Return results stacked over ``case``."""
    first = entries[0]
    along = first.along
    places = [entry.arrays[along] for entry in entries]
    common = all(np.array_equal(one, places[0]) for one in places)
    shared = [name for name in first.arrays if all(name in entry.arrays for entry in entries)]
    variables: dict[str, Any] = {
        name: (("case", *VARIABLES[name].over(along)), _side_by_side([entry.arrays[name] for entry in entries]))
        for name in shared
        if name not in (along, "x", "y")
    }
    coords = {along: places[0]} if common else {}
    grids = {(entry.arrays["x"].tobytes(), entry.arrays["y"].tobytes()): entry.arrays for entry in entries}
    if len(grids) == 1:
        coords |= {"x": first.arrays["x"], "y": first.arrays["y"]}
        one_surface = all(entry.case.get("surface") == first.case.get("surface") for entry in entries)
        for name in first.fields:
            if name in VARIABLES and all(name in entry.fields for entry in entries):
                of_all = one_surface and VARIABLES[name].dims == ("x", "y")
                field = _field(folder, entries[:1] if of_all else entries, name)
                variables[name] = field[0] if of_all else field
    else:
        cells = ", ".join(sorted({f"{len(one['x'])} x {len(one['y'])} cells" for one in grids.values()}))
        log.warning("%s: found %s: opened without fields; open_result gives the fields of each result", folder, cells)
    alike, apart = _common([entry.attributes for entry in entries])
    of_height, others = _common([entry.of_height for entry in entries])
    stated = [
        json.dumps(own | ({"height": heights} if heights else {})) for own, heights in zip(apart, others, strict=True)
    ]
    coords[ATTRIBUTES] = "case", np.array(stated, object), VARIABLES[ATTRIBUTES].attributes
    dataset = label(xr.Dataset(variables, coords, {"title": first.case.get("title", ""), **alike}))
    if "height" in dataset:
        dataset["height"].attrs |= of_height
    if common:
        return dataset
    counts = np.array([len(one) for one in places])
    rows = ("case", counts, {"long_name": f"number of {AXES[along].rows}", "units": "1"})
    place = (("case", ROW), _side_by_side(places), VARIABLES[along].attributes)
    return dataset.rename_dims({along: ROW}).assign_coords({along: place, ROWS: rows})


def _common(attributes: Sequence[Mapping[str, Any]]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the attributes that are equal in all cases, and the others of each case without the date of its run."""
    alike = {name: one for name, one in attributes[0].items() if all(other.get(name) == one for other in attributes)}
    return alike, [{name: one for name, one in own.items() if name not in (*alike, "history")} for own in attributes]


def _side_by_side(histories: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Return histories over (case, row); NaN after the last row of a case."""
    return np.array([*zip_longest(*histories, fillvalue=np.nan)]).T


def _field(folder: Path, entries: Sequence[Entry], name: str) -> xr.Variable:
    """Return a variable over (case, ...) in blocks of one case and some rows, which Dask reads."""
    dims = ("case", *VARIABLES[name].over(entries[0].along))
    counts = [len(entry.arrays[entry.along]) for entry in entries]
    dtype = np.result_type(*(entry.fields[name] for entry in entries))
    shape = (len(entries), *[max(counts)] * (len(dims) - 3), *(len(entries[0].arrays[axis]) for axis in ("x", "y")))
    paths = [str(folder / entry.file) for entry in entries]
    array = lazy(partial(_read_frames, name, paths, counts, shape, dtype), shape, dtype)
    rows = max(1, _BLOCK // (shape[-2] * shape[-1] * dtype.itemsize))
    return xr.Variable(dims, array).chunk({"case": 1} | ({dims[1]: rows} if len(dims) > 3 else {}))


def _read_frames(
    name: str, paths: Sequence[str], counts: Sequence[int], shape: tuple[int, ...], dtype: Any, key: tuple[Any, ...]
) -> NDArray[Any]:
    """Read a part of a variable over (case, x, y) or (case, row, x, y); rows after the last row of a case are NaN."""
    cases = np.arange(shape[0])[key[0]]
    if cases.ndim:
        parts = [_read_frames(name, paths, counts, shape, dtype, (case, *key[1:])) for case in cases]
        return np.stack(parts)
    rows = np.arange(shape[1])[key[1]]
    known = np.atleast_1d(rows < counts[cases])
    if len(shape) == 3 or known.all():
        return read_variable(paths[cases], name, key[1:])
    read = np.full((known.size, *shape[2:]), np.nan, dtype)[(slice(None), *key[2:])]
    if known.any():
        read[known] = read_variable(paths[cases], name, (rows[known], *key[2:]))
    return read.reshape(rows.shape + read.shape[1:])


def _by_realisation(flat: xr.Dataset, parameters: Mapping[str, NDArray[Any]]) -> xr.Dataset:
    """Return cases over (case, realisation); unchanged if some cases are not realisations, or one occurs twice.

    Numbers of a realisation without a result are NaN, and its texts empty.
    """
    drawn = parameters.get(REALISATION)
    if drawn is None or drawn.dtype.kind != "i":
        return flat
    pairs = pd.MultiIndex.from_arrays([flat["case"].values, drawn], names=["case", REALISATION])
    if pairs.has_duplicates:
        return flat
    settings = [identifier(key) for key in parameters if key not in (REALISATION, *DRAWN)]
    of_cases = flat[["case", *settings]].isel(case=np.unique(flat["case"].values, return_index=True)[1]).reset_coords()
    texts = {name: "" for name, one in flat.variables.items() if one.dtype.kind in "UO"}
    runs = flat.drop_vars(["case", REALISATION, *settings]).rename_dims(case="run")
    runs = runs.assign_coords(xr.Coordinates.from_pandas_multiindex(pairs, "run"))
    unstacked = runs.unstack("run", fill_value=texts).transpose("case", REALISATION, ...)
    unstacked = unstacked.assign_coords({name: of_cases.variables[name] for name in settings})
    unstacked[REALISATION].attrs["comment"] = "another patch of the same roughness; 0: the measured surface itself"
    return unstacked
