"""Statistics of realisations as rows of text, for the command line and the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roughvisc.units import unit_for

if TYPE_CHECKING:
    import pandas as pd

#: Quantities that follow from other quantities of the table.
_FOLLOW = ("contact_fraction", "friction_force", "friction_force_across", "transmissivity", "hydraulic_aperture")


def realisation_rows(table: pd.DataFrame) -> tuple[list[str], list[list[str]], list[str]]:
    """Return headings, rows and notes on the scatter of the realisations of each case.

    Parameters
    ----------
    table : pandas.DataFrame
        Result of :func:`roughvisc.study.storage.results_table.realisations_table`.
    """
    table = table if table.empty else table[~table["quantity"].isin(_FOLLOW)]
    if table.empty:
        return [], [], []
    varied = [str(name) for name in table.columns[1 : list(table.columns).index("quantity")]]
    short = [name.rpartition(".")[2] for name in varied]
    headings = [
        one.replace("_", " ") if short.count(one) == 1 else name for one, name in zip(short, varied, strict=True)
    ]
    headings += ["quantity", "mean", "95 % of the mean", "95 % prediction interval"]
    headings += ["scan", "ratio"] if "itself" in table else []
    rows = []
    for one in table.to_dict("records"):
        unit = unit_for([one["mean"]], one["unit"])
        settings = (one[name] for name in varied)
        row = [f"{value:.6g}" if isinstance(value, float) else str(value) for value in settings]
        row += [one["quantity"].replace("_", " "), unit.text(one["mean"], 3)]
        for ends in (("lower", "upper"), ("patch_lower", "patch_upper")):
            low, high = (unit.text(one[end], 3).removesuffix(unit.symbol).strip() for end in ends)
            row.append(f"{low} to {high}" if np.isfinite(one[ends[0]]) else "none")
        if "itself" in table:
            known = np.isfinite(one["itself"])
            row += [unit.text(one["itself"], 3), f"{one['ratio']:.3g}"] if known else ["", ""]
        rows.append(row)
    counts, places = sorted(set(table["count"])), (where.replace("_", " ") for where in dict.fromkeys(table["where"]))
    number = " to ".join(dict.fromkeys(f"{count}" for count in (counts[0], counts[-1])))
    drawn = "Gaussian surrogates of the scan" if "itself" in table else "realisations"
    return headings, rows, [f"Over {number} {drawn}, values at the {' or the '.join(places)}."]
