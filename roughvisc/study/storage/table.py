"""The table of a sweep: what was varied in each case, how it ended, and its numbers at the end or at its peak."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import heading
from roughvisc.study.realisations import over_realisations
from roughvisc.study.si_tables import unit_of
from roughvisc.study.storage.failures import stated_failure
from roughvisc.study.storage.files import atomic_write
from roughvisc.study.storage.index import Entry, Index, index_of
from roughvisc.study.storage.parameters import parameters_of
from roughvisc.study.storage.store import no_results
from roughvisc.study.storage.sweep_cases import SweepCase, numbers_of, read_sweep
from roughvisc.study.sweep_table import DRAWN, REALISATION
from roughvisc.units import number_and_unit, quantity
from roughvisc.variables import AXES, NOT_CONVERGED, VARIABLES, variables_in_table

if TYPE_CHECKING:
    import pandas as pd

log = logging.getLogger("roughvisc")

CASES, REALISATIONS = "cases.csv", "realisations.csv"
#: Values that differ by less than this, relative, are prescribed.
_ALIKE = 1e-9


def to_table(out: str | Path) -> pd.DataFrame:
    """Table of the cases of the last sweep in a folder, one row per case, including failed ones.

    Parameters
    ----------
    out : path
        Results folder. If no sweep ran in it, all its results are included.

    Returns
    -------
    pandas.DataFrame
        The index is the number of the case, from 0 in the order of the study, as in :func:`open_results`; the
        realisations of one case have its number. Columns: title; varied parameters under their dotted keys, in the
        units of the study; at the last kept time force, approach, contact area with its bounds, contact fraction, mean
        gap, friction if the profile slides, and observables; for a friction curve the same at the speed of largest
        friction, and this speed; the largest stated error and its parts; status, message and file. Units are in
        brackets.

    Raises
    ------
    InputError
        If the folder contains no result.

    Examples
    --------
    >>> rv.to_table("results/load_sweep").to_excel("load_sweep.xlsx")  # doctest: +SKIP
    """
    folder = Path(out).absolute()
    index = index_of(folder)
    cases = read_sweep(folder)
    if not index.entries and not cases:
        raise no_results(folder)
    return _table(folder, index, cases, {})


def write_table(folder: Path, index: Index, cases: Sequence[SweepCase], held: Mapping[str, str] | None = None) -> None:
    """Write the table of a sweep as CSV; if that is impossible, the log says so and the sweep goes on.

    Parameters
    ----------
    folder : Path
        Of the results.
    index : Index
        Of the folder.
    cases : sequence of SweepCase
        Cases of the sweep.
    held : mapping, optional
        Key -> message, of the cases that another run was at work on.
    """
    tables = {CASES: _table(folder, index, cases, held or {})}
    (folder / REALISATIONS).unlink(missing_ok=True)  # of a sweep before
    found = realisations_table(index, cases)
    if len(found):
        tables[REALISATIONS] = found.set_index("case")
    for name, table in tables.items():
        try:
            with atomic_write(folder / name) as temporary:
                # spreadsheets go by the mark of UTF-8; seven digits are more than the errors leave
                table.map(_no_formula).to_csv(
                    temporary, encoding="utf-8-sig", float_format="%.7g", lineterminator="\r\n"
                )
        except (OSError, InputError) as error:
            log.warning("%s cannot be written: %s", folder / name, error)


def _no_formula(value: Any) -> Any:
    """A value of a table; text that a spreadsheet would take for a formula gets an apostrophe in front."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")) else value


def realisations_table(index: Index, cases: Sequence[SweepCase]) -> pd.DataFrame:
    """Mean, scatter and intervals over the realisations of each case of the last sweep, one row per quantity.

    Parameters
    ----------
    index : Index
        Of the folder.
    cases : sequence of SweepCase
        Cases of the sweep.

    Returns
    -------
    pandas.DataFrame
        Number of the case and varied parameters as in :func:`to_table`; the quantity, its unit and its row; then the
        variables of :func:`roughvisc.over_realisations`. Prescribed quantities are left out.
    """
    import pandas as pd

    stated = [one.case for one in cases]
    numbers = numbers_of(cases)
    varied = {key: values for key, values in _parameters(stated).items() if key not in (REALISATION, *DRAWN)}
    groups: dict[int, list[int]] = {}
    for place, (number, one) in enumerate(zip(numbers, cases, strict=True)):
        if one.key in index.entries and REALISATION in one.case.get("varied", {}):
            groups.setdefault(number, []).append(place)
    rows = []
    for number, places in groups.items():
        settings = [values[places[0]] for values in varied.values()]
        entries = [index.entries[cases[place].key] for place in places]
        drawn = [cases[place].case["varied"][REALISATION] for place in places]
        axis = AXES[entries[0].along]
        for name in variables_in_table("last"):
            variable = VARIABLES[name]
            values = np.array(
                [_summary_row(one, name) if len(one.histories.get(name, ())) else np.nan for one in entries]
            )
            known = values[np.isfinite(values)]
            if name in AXES or not known.size or np.ptp(known) <= _ALIKE * abs(known).max():
                continue
            found = over_realisations(xr.DataArray(values, {REALISATION: drawn}, name=name))
            told = {str(key): one.item() for key, one in found.data_vars.items()}
            rows.append(
                {"case": number, **dict(zip(varied, settings, strict=True)), "quantity": name, "unit": variable.units}
                | {"where": f"largest {axis.telling}" if axis.telling else "end"}
                | told
            )
    return pd.DataFrame(rows)


def _table(folder: Path, index: Index, cases: Sequence[SweepCase], held: Mapping[str, str]) -> pd.DataFrame:
    import pandas as pd

    cases = cases or [SweepCase(key, entry.case) for key, entry in index.entries.items()]
    keys, stated = [one.key for one in cases], [one.case for one in cases]
    entries = [index.entries.get(key) for key in keys]
    failures = {key: stated_failure(folder, key) for key, entry in zip(keys, entries, strict=True) if entry is None}
    columns: dict[str, Any] = {"title": [str(case.get("title", "")) for case in stated], **_parameters(stated)}
    headings = {name: heading(name, one.units) for name, one in VARIABLES.items()}
    for rows in dict.fromkeys(entry.along for entry in entries if entry):
        mine = [entry if entry and entry.along == rows else None for entry in entries]
        for which, before, take in (("last", "", _summary_row), ("largest", "largest ", _largest)):
            for name in variables_in_table(which):
                column = columns.setdefault(f"{before}{headings[name]}", [np.nan] * len(keys))
                for place, entry in enumerate(mine):
                    if entry and len(entry.histories.get(name, ())):
                        column[place] = take(entry, name)
    table = pd.DataFrame(columns, pd.Index(numbers_of(cases), name="case")).dropna(axis="columns", how="all")
    records = [failures.get(key) or {} for key in keys]
    messages = [held.get(key, "") if entry is None else "" for key, entry in zip(keys, entries, strict=True)]
    return table.assign(
        status=[
            "held by another run" if message else _status(entry, bool(record))
            for entry, record, message in zip(entries, records, messages, strict=True)
        ],
        message=[
            " ".join(str(message or record.get("message", "")).split())
            for record, message in zip(records, messages, strict=True)
        ],
        file=[entry.file if entry else "" for entry in entries],
    )


def _parameters(stated: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Values of what was varied, under its key and unit."""
    columns = {}
    for key, values in parameters_of(stated).items():
        si = unit_of(key, stated[0]) if values.dtype.kind in "if" else ""
        unit, numbers = _as_written(key, values.tolist(), si, stated) if si else ("", values)
        columns[heading(key, unit)] = numbers
    return columns


def _as_written(key: str, values: list[float], si: str, stated: Sequence[Mapping[str, Any]]) -> tuple[str, list[float]]:
    """Unit that the study states first, and the values in it."""
    texts = [case.get("written", {}).get(key, f"{value!r} {si}") for case, value in zip(stated, values, strict=True)]
    unit = next((number_and_unit(case["written"][key])[1] for case in stated if key in case.get("written", {})), si)
    numbers = [
        value
        if not math.isfinite(value)
        else number_and_unit(text)[0]
        if text.endswith(f" {unit}")
        else quantity(text, unit)
        for text, value in zip(texts, values, strict=True)
    ]
    return unit, numbers


def _summary_row(entry: Entry, name: str) -> float:
    """The value at the end; of a curve of friction where that is largest."""
    return float(entry.histories[name][AXES[entry.along].telling_row(entry.histories)])


def _largest(entry: Entry, name: str) -> float:
    values = entry.histories[name]
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else np.nan


def _status(entry: Entry | None, failed: bool) -> str:
    if entry is None:
        return "failed" if failed else "not computed"
    bad = int((entry.histories["status"] == NOT_CONVERGED).sum())
    return f"{bad} of {entry.rows} {AXES[entry.along].rows} not converged" if bad else "converged"
