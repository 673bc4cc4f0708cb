"""Results as tables: a row for each case of a sweep, or for each kept time of a case; CSV files of both."""

from __future__ import annotations

import logging
from itertools import chain
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import heading
from roughvisc.observables.history import expect_result
from roughvisc.paths import path_of
from roughvisc.runs.folder import atomic_write, no_results, recorded_failure
from roughvisc.runs.sweep_data import index_of, numbers_of, read_sweep
from roughvisc.study.case import parameters_of
from roughvisc.study.study_file import unit_of
from roughvisc.variables import AXES, VARIABLES, axis_of, in_table

log = logging.getLogger("roughvisc")

#: Name of the file with the table of the last sweep.
CASES = "cases.csv"


def to_table(out: str | Path) -> pd.DataFrame:
    """Return the table of the last sweep in a folder, with one row per case, including failed cases.

    Parameters
    ----------
    out : path
        Results folder. If no sweep ran in it, the table contains all its results.

    Returns
    -------
    pandas.DataFrame
        The index is the number of the case, from 0 in the order of the study, as in :func:`open_results`; the
        realisations of one case share its number. Columns: title; varied parameters under their dotted keys, in the
        units of the study; force, approach, contact area, contact fraction, mean gap, friction if the profile slides,
        and observables, each followed by its error if there is one; the largest stated error; status,
        message and file. The values are for the last kept time, or for a friction curve at the speed of largest
        friction, which is also a column. Units are in brackets.

    Raises
    ------
    InputError
        If the folder contains no result, or `out` is not a path.

    See Also
    --------
    roughvisc.open_results, roughvisc.to_csv

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ds = rv.run(case, folder, progress=False).load()
    ...     table = rv.to_table(folder)
    >>> table["status"].tolist()
    ['converged']
    """
    folder = path_of(out, "out", "a folder of results; rv.to_csv takes a Dataset").absolute()
    index = index_of(folder)
    cases = read_sweep(folder)
    if not index and not cases:
        raise no_results(folder)
    cases = cases or {key: entry.case for key, entry in index.items()}
    stated = [*cases.values()]
    numbers = []
    ends = []
    for key in cases:
        values: dict[str, float] = {}
        status = "not computed"
        message = ""
        entry = index.get(key)
        if entry is not None:
            status = "converged"
            row = AXES[entry.along].telling_row(entry.arrays)
            for name in chain.from_iterable((name, variable.error) for name, variable in in_table("value").items()):
                if len(entry.arrays.get(name, ())):
                    values[heading(name, VARIABLES[name].units)] = float(entry.arrays[name][row])
            for name, variable in in_table("largest").items():
                known = filter(np.isfinite, entry.arrays.get(name, ()))
                values[f"largest {heading(name, variable.units)}"] = max(known, default=np.nan)
        elif record := recorded_failure(folder, key):
            status = "failed"
            message = str(record.get("message", ""))
        numbers.append(values)
        ends.append({"status": status, "message": " ".join(message.split()), "file": entry.file if entry else ""})
    table = pd.DataFrame({"title": [str(case.get("title", "")) for case in stated]})
    for key, values in parameters_of(stated).items():
        table[heading(key, unit_of(key, stated[0]) if values.dtype.kind in "if" else "")] = values
    table = table.join(pd.DataFrame(numbers, table.index)).dropna(axis="columns", how="all").join(pd.DataFrame(ends))
    return table.set_index(pd.Index(numbers_of(cases).values(), name="case"))


def write_table(folder: Path, path: Path | None = None) -> Path:
    """Write the table of the last sweep in a folder as CSV, by default into the folder, and return its path."""
    path = path or folder / CASES
    table = to_table(folder)
    with atomic_write(path) as temporary:
        # spreadsheets need the byte-order mark of UTF-8; errors exceed the seventh digit
        table.to_csv(temporary, encoding="utf-8-sig", errors="surrogateescape", float_format="%.7g")
    return path


def update_table(folder: Path) -> None:
    """Write the table of the last sweep in a folder; if writing fails, log a warning."""
    try:
        write_table(folder)
    except (OSError, InputError) as error:
        log.warning("%s cannot be written: %s", folder / CASES, error)


def to_csv(dataset: xr.Dataset, path: str | Path) -> Path:
    """Write the histories of a result to a CSV file, with one row per kept time, or per speed of a friction curve.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.
    path : path
        File to write; an existing one is replaced.

    Returns
    -------
    pathlib.Path
        The file. Its first row names each column with its unit, as in ``force [N]``; a status is a word; unknown
        values are empty. Numbers are written with all digits.

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or the folder cannot be written to.

    See Also
    --------
    roughvisc.to_table, roughvisc.save_result

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=33)
    >>> press = rv.Program().load(1e-4, over=0)
    >>> ds = rv.simulate(ball, rv.elastic(1e6), press, times=[0.0], progress=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     text = rv.to_csv(ds, f"{folder}/ball.csv").read_text()
    >>> text.startswith("time [s],")
    True
    """
    dataset = expect_result(dataset)
    rows = axis_of(dataset)
    names = [name for name, variable in dataset.data_vars.items() if variable.dims == (rows,)]
    table = dataset[names].reset_coords(drop=True).to_dataframe()
    for name in table:
        if meanings := VARIABLES[name].meanings if name in VARIABLES else ():
            table[name] = [meanings[value] for value in table[name]]
    headings = [heading(str(name), dataset[name].attrs.get("units", "")) for name in (rows, *names)]
    with atomic_write(path) as temporary:
        table.to_csv(temporary, header=headings[1:], index_label=headings[0], errors="surrogateescape")
    return Path(path)
