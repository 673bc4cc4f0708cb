"""Statistics of realisations as rows of text, for the command line and the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from roughvisc.units import unit_for

if TYPE_CHECKING:
    import pandas as pd

#: Quantities that follow from others of the table.
_FOLLOW = ("contact_fraction", "friction_force", "friction_force_across", "transmissivity", "hydraulic_aperture")


def realisation_rows(table: pd.DataFrame) -> tuple[list[str], list[list[str]], list[str]]:
    """Headings, rows and notes that say what the realisations of each case scatter.

    Parameters
    ----------
    table : pandas.DataFrame
        Of :func:`roughvisc.study.storage.table.realisations_table`.
    """
    if table.empty:
        return [], [], []
    varied = [str(name) for name in table.columns[1 : list(table.columns).index("quantity")]]
    scan = "itself" in table
    last = [name.rpartition(".")[2] for name in varied]
    pairs = zip(last, varied, strict=True)
    headings = [short.replace("_", " ") if last.count(short) == 1 else name for short, name in pairs]
    headings += ["quantity", "mean", "95 % of the mean", "95 % prediction interval"] + ["scan", "ratio"] * scan
    rows = []
    told = table[~table["quantity"].isin(_FOLLOW)]
    for one in told.to_dict("records"):
        unit = unit_for([one["mean"]], one["unit"])
        row = [_plain(one[name]) for name in varied] + [one["quantity"].replace("_", " "), unit.text(one["mean"], 3)]
        row += [_interval(one, *ends, unit) for ends in (("lower", "upper"), ("patch_lower", "patch_upper"))]
        if scan:
            known = np.isfinite(one["itself"])
            mark = " !" if one["standing"] in ("below", "above") else ""
            row += [unit.text(one["itself"], 3) if known else "", f"{one['ratio']:.3g}{mark}" if known else ""]
        rows.append(row)
    return headings, rows, _notes(told, scan)


def _notes(told: pd.DataFrame, scan: bool) -> list[str]:
    counts = sorted(set(told["count"]))
    number = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    places = ", ".join(f"at the {one.replace('_', ' ')}" for one in dict.fromkeys(told["where"]))
    notes = [f"Over {number} {'Gaussian surrogates of the scan' if scan else 'realisations'}, values {places}."]
    if (told["zeros"] > 0).any():
        notes.append("A quantity that is zero in some of them has no interval.")
    if scan:
        apart = told[told["standing"].isin(["below", "above"])]
        names = ", ".join(dict.fromkeys(name.replace("_", " ") for name in apart["quantity"]))
        if names:
            notes.append(
                f"! Not a random-phase surface: the scan lies outside the 99 % of its surrogates in {names}. The "
                "spectrum alone does not give this number; that of the scan stays as it is."
            )
    return notes


def _interval(one: Mapping[str, Any], lower: str, upper: str, unit: Any) -> str:
    ends = (one[lower], one[upper])
    if not np.isfinite(ends).all():
        return "none"
    low, high = (unit.text(end, 3).removesuffix(unit.symbol).strip() for end in ends)
    return f"{low} to {high}"


def _plain(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else "" if value is None else str(value)
