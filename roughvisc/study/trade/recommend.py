"""Choice among the settings of a trade: the Pareto front, and the cheapest setting that is accurate enough."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.variables import VARIABLES

#: Wall times within this factor are taken as equal.
_EQUAL = 1.1
#: Names of the quantities in text, the most important first.
WORDS = {
    name: VARIABLES[name].label.lower()
    for name in (
        "friction_coefficient",
        "contact_area",
        "pressure",
        "approach",
        "contact_area_counted",
        "mean_gap",
        "force",
        "leak_rate",
        "thermal_conductance",
        "incremental_stiffness",
    )
}


def pareto_front(dataset: xr.Dataset, quantity: str) -> NDArray[np.bool_]:
    """Return the Pareto front: settings that no other one beats in wall time without being beaten in accuracy.

    Errors count to two digits.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.trade`.
    quantity : str
        Quantity whose error counts.
    """
    spent, wrong = dataset["run_time"].values, dataset["error"].sel(quantity=quantity).values
    known = np.isfinite(spent) & np.isfinite(wrong)
    wrong = np.array([float(f"{value:.1e}") for value in wrong])
    best = np.zeros(len(spent), dtype=bool)
    for i in np.flatnonzero(known):
        no_worse = known & (spent <= spent[i]) & (wrong <= wrong[i])
        better = no_worse & ((spent < spent[i]) | (wrong < wrong[i]))
        best[i] = not better.any()
    return best


def uncertainty(dataset: xr.Dataset, quantity: str) -> float:
    """Return how far the reference may be off; of a scan, on the grid of the scan. [-]"""
    parts = ("time",) if dataset.attrs.get("grid_is_data") else ("time", "grid")
    return float(sum(dataset[f"reference_{part}_uncertainty"].sel(quantity=quantity) for part in parts))


def reliable_errors(dataset: xr.Dataset, quantity: str) -> NDArray[np.float64]:
    """Return the error of each setting that can be relied on. [-]

    It is the largest error of the setting and of all sharper tolerances on the same grid, so that a chance agreement
    does not count, plus the uncertainty of the reference. It is NaN for a setting that was not measured, and for
    another grid than the scan's.
    """
    errors = dataset["error"].sel(quantity=quantity).values
    tolerance, coarsening = dataset["tolerance"].values, dataset["coarsening"].values
    found = np.full(errors.shape, np.nan)
    for i in np.flatnonzero(np.isfinite(errors)):
        sharper = (coarsening == coarsening[i]) & (tolerance <= tolerance[i])
        found[i] = np.nanmax(errors[sharper]) + uncertainty(dataset, quantity)
    if dataset.attrs.get("grid_is_data"):
        found[coarsening != 1] = np.nan
    return found


def cheapest(dataset: xr.Dataset, quantity: str, target: float) -> int | None:
    """Return the index of the fastest setting whose reliable error is at most ``target``; None if there is none.

    Among settings of nearly equal times, it is the first.
    """
    spent = np.where(reliable_errors(dataset, quantity) <= target, dataset["run_time"].values, np.inf)
    if not np.isfinite(spent).any():
        return None
    return int(np.flatnonzero(spent <= _EQUAL * np.min(spent))[0])


def main_quantities(dataset: xr.Dataset) -> list[str]:
    """Return the quantities of a trade, the most important first."""
    return [name for name in WORDS if name in dataset["quantity"]]


def choice(dataset: xr.Dataset, quantity: str, target: float) -> str:
    """Return a sentence on the cheapest setting with an error of at most ``target``, or on the best setting."""
    wanted = f"For {percent(target)} on {WORDS[quantity]}"
    index = cheapest(dataset, quantity, target)
    if index is not None:
        return f"{wanted}: {dataset['setting'].values[index]}, {duration(float(dataset['run_time'][index]))}"
    errors = reliable_errors(dataset, quantity)
    if not np.isfinite(errors).any():
        return f"{wanted}: not known, no setting could be compared with the reference"
    best = int(np.nanargmin(errors))
    unsure = percent(uncertainty(dataset, quantity))
    name, error = dataset["setting"].values[best], percent(errors[best], 3)
    return f"{wanted}: not reached; best is {name} with {error} (uncertainty of the reference: {unsure})"


def percent(part: float, digits: int = 2) -> str:
    """Return a part as a percentage.

    Examples
    --------
    >>> percent(0.01), percent(1.234e-3), percent(2e-6)
    ('1 %', '0.12 %', '0.0002 %')
    """
    return f"{100 * float(f'{part:.{digits}g}'):.6f}".rstrip("0").rstrip(".") + " %"


def duration(seconds: float) -> str:
    """Return a wall time in text.

    Examples
    --------
    >>> duration(0.0123), duration(14.2), duration(190), duration(9000)
    ('0.012 s', '14 s', '3 min', '2.5 h')
    """
    if seconds < 90:
        return f"{seconds:.2g} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
