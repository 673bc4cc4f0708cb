"""The table of a sweep: what was varied in each case, how it ended, and its numbers at the end."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from roughvisc.errors import InputError
from roughvisc.labels import heading
from roughvisc.study.statement.schema.units import unit_of
from roughvisc.study.storage.failures import stated_failure
from roughvisc.study.storage.index import Entry, Index, index_of
from roughvisc.study.storage.parameters import parameters_of
from roughvisc.study.storage.store import no_results, whole_file
from roughvisc.units import number_and_unit, quantity
from roughvisc.variables import NOT_CONVERGED, VARIABLES

if TYPE_CHECKING:
    import pandas as pd

log = logging.getLogger("roughvisc")

CASES = "cases.csv"
#: Histories of which the table has the value at the end.
_AT_THE_END = (
    "time",
    "force",
    "nominal_pressure",
    "approach",
    "contact_area_corrected",
    "contact_area_lower",
    "contact_area_upper",
    "contact_fraction",
    "mean_gap",
)
#: Histories of which the table has the largest value.
_LARGEST = ("stated_error", "time_error", "residual", "grid_error")


def to_table(out: str | Path) -> pd.DataFrame:
    """Cases of the sweep that ran last in a folder as a table: a row a case, those too that failed.

    Parameters
    ----------
    out : path
        Folder of the results. A folder that no sweep ran in gives all results in it. Cases that have not been computed
        yet are left out.

    Returns
    -------
    pandas.DataFrame
        Indexed by the number of the case. Columns: title; what was varied, under its dotted key, in the unit that the
        study states; at the last kept time force, approach, contact area corrected for the grid with its bounds,
        fraction, mean gap; the largest stated error and its parts; status, message and file. Units stand in brackets.

    Raises
    ------
    InputError
        If the folder holds no result.

    Examples
    --------
    >>> rv.to_table("results/load_sweep").to_excel("load_sweep.xlsx")  # doctest: +SKIP
    """
    folder = Path(out).absolute()
    index = index_of(folder)
    if not index.entries and not index.sweep:
        raise no_results(folder)
    return _table(folder, index, {})


def write_table(folder: Path, index: Index, cases: Mapping[str, Mapping[str, Any]]) -> None:
    """Write the table of a sweep as CSV; where that cannot be done, the log says so and the sweep goes on.

    Parameters
    ----------
    folder : Path
        Of the results.
    index : Index
        Of the folder.
    cases : mapping
        Key -> case in JSON of the sweep.
    """
    try:
        with whole_file(folder / CASES) as temporary:
            # spreadsheets go by the mark of UTF-8; seven digits are more than the errors leave
            settings = {"encoding": "utf-8-sig", "float_format": "%.7g", "lineterminator": "\r\n"}
            _table(folder, index, cases).to_csv(temporary, **settings)
    except (OSError, InputError) as error:
        log.warning("%s cannot be written: %s", folder / CASES, error)


def _table(folder: Path, index: Index, cases: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    known = {key: entry.case for key, entry in index.entries.items()}
    failures = {key: stated_failure(folder, key) for key in index.sweep if key not in known}
    known |= {key: record["case"] for key, record in failures.items() if record}
    known |= cases
    keys = [key for key in index.sweep if key in known] or list(index.entries)
    stated = [known[key] for key in keys]
    entries = [index.entries.get(key) for key in keys]
    columns: dict[str, Any] = {"title": [str(case.get("title", "")) for case in stated], **_parameters(stated)}
    for name in _AT_THE_END:
        columns[heading(name, VARIABLES[name].units)] = _from_each(entries, name, lambda values: values[-1])
    for name in _LARGEST:
        columns[f"largest {heading(name, VARIABLES[name].units)}"] = _from_each(entries, name, _largest)
    table = pd.DataFrame(columns, pd.RangeIndex(1, len(keys) + 1, name="case")).dropna(axis="columns", how="all")
    records = [failures.get(key) or {} for key in keys]
    return table.assign(
        status=[_status(entry, bool(record)) for entry, record in zip(entries, records, strict=True)],
        message=[" ".join(str(record.get("message", "")).split()) for record in records],
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
        value if value != value else number_and_unit(text)[0] if text.endswith(f" {unit}") else quantity(text, unit)
        for text, value in zip(texts, values, strict=True)
    ]
    return unit, numbers


def _from_each(entries: Sequence[Entry | None], name: str, take: Callable[[np.ndarray], float]) -> list[float]:
    """A number from a history of each case; NaN where there is none."""
    histories = [entry.histories.get(name, ()) if entry else () for entry in entries]
    return [float(take(np.asarray(one))) if len(one) else np.nan for one in histories]


def _largest(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return known.max() if known.size else np.nan


def _status(entry: Entry | None, failed: bool) -> str:
    if entry is None:
        return "failed" if failed else "not computed"
    bad = int((entry.histories["status"] == NOT_CONVERGED).sum())
    return f"{bad} of {entry.rows} times not converged" if bad else "converged"
