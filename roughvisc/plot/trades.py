"""Figure of a trade: error against wall time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.plot import style
from roughvisc.study.trade import format_tolerance, pareto_front, uncertainty
from roughvisc.variables import VARIABLES

#: kind of grid -> marker and colour
_GRIDS = {
    "grid of the study": ("o", style.BLUE),
    "coarser grid": ("v", style.VERMILION),
    "finer grid": ("^", style.VERMILION),
}


@style.apply
def trade(dataset: xr.Dataset, quantity: str | Sequence[str] | None = None) -> Figure:
    """Draw wall time against error of every setting, with the Pareto front.

    Errors that are smaller than the uncertainty of the reference lie in a grey band. A setting whose error is exactly
    zero is drawn at the bottom. The front leaves out both.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.trade`.
    quantity : str or sequence of str, optional
        One panel for each. Default: the first two of the trade.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is no trade, holds no such quantity, or no setting was measured.
    """
    if not isinstance(dataset, xr.Dataset) or "run_time" not in dataset:
        raise InputError("expected the Dataset of rv.trade")
    known = dataset["quantity"].values.tolist()
    wanted = known[:2] if quantity is None else [quantity] if isinstance(quantity, str) else list(quantity)
    for name in wanted:
        if name not in known:
            raise InputError(key="quantity", found=name, expected=f"some of {', '.join(known)}")
    shown = [name for name in wanted if np.isfinite(dataset["error"].sel(quantity=name)).any()]
    if not shown:
        raise InputError("the trade holds no measured setting: nothing to draw")
    figure = style.new_figure(0.6 + 3.3 * len(shown), 3.7)
    axes = figure.subplots(1, len(shown), squeeze=False)[0]
    for ax, name in zip(axes, shown, strict=True):
        _draw(ax, dataset, name)
    named, columns = style.named_in(*axes), 4 if len(shown) > 1 else 2
    figure.legend(named.values(), named, loc="outside upper center", ncols=columns, handlelength=1.4)
    style.letter_panels(axes)
    return figure


def _draw(ax: Axes, dataset: xr.Dataset, quantity: str) -> None:
    """Draw a panel."""
    spent, wrong = dataset["run_time"].values, 100 * dataset["error"].sel(quantity=quantity).values
    unsure = 100 * uncertainty(dataset, quantity)
    known = np.isfinite(spent) & np.isfinite(wrong)
    positive = wrong[known & (wrong > 0)]
    lowest = positive.min() if positive.size else 1e-3
    nothing = bool((wrong[known] == 0).any())
    floor = lowest / 3 if nothing else lowest
    bottom = floor / (3 if nothing else 1.8)
    height = np.maximum(wrong, floor)
    measured = wrong > np.nan_to_num(unsure)  # what the reference can tell from zero
    best = np.flatnonzero(pareto_front(dataset, quantity) & measured)
    best = best[np.argsort(spent[best], kind="stable")]
    ax.plot(spent[best], height[best], color="0.35", lw=1.0, zorder=1, label="Pareto front")
    coarsening = dataset["coarsening"].values
    for (name, (marker, colour)), kind in zip(_GRIDS.items(), (0, 1, -1), strict=True):
        chosen = known & (np.sign(coarsening - 1) == kind)
        if chosen.any():
            ax.plot(spent[chosen], height[chosen], marker, color=colour, ms=5, mew=0, label=name, zorder=3)
        for i in [i for i in np.flatnonzero(chosen) if i in best or kind]:
            look = {"textcoords": "offset points", "fontsize": 6, "color": 0.65 * np.array(to_rgb(colour))}
            ax.annotate(_brief(dataset.isel(setting=i)), (spent[i], height[i]), (6, (-7, 3)[i % 2]), **look)
    ax.plot(spent[best], height[best], "o", mfc="none", mec="0.2", mew=0.7, ms=8.5, ls="", zorder=2)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(spent[known].min() / 1.6, spent[known].max() * 3)
    ax.set_ylim(bottom, height[known].max() * 2)
    if nothing:
        ax.axhline(floor * 1.7, color="0.6", lw=0.6, ls=(0, (1, 2)), zorder=0)
        ax.text(0.02, floor, "none seen", transform=ax.get_yaxis_transform(), fontsize=6, style="italic", va="center")
    if unsure > bottom:
        ax.axhspan(
            bottom, min(unsure, height[known].max()), color="0.93", zorder=0, label="uncertainty of the reference"
        )
    for axis, most in ((ax.xaxis, 30), (ax.yaxis, 300)):
        low, high = axis.get_view_interval()
        style.plain_log_ticks(axis, fine=high < most * low, most=20)
    ax.set_xlabel(f"{VARIABLES['wall_time'].label} [s]")
    ax.set_ylabel(f"Error of {VARIABLES[quantity].label.lower()} [%]")
    ax.grid(color="0.9", lw=0.5)


def _brief(row: xr.Dataset) -> str:
    """Return the label of a setting in the figure."""
    grid = "" if float(row["coarsening"]) == 1 else f", {int(row['cells_x'])}×{int(row['cells_y'])}"
    return format_tolerance(float(row["tolerance"])) + grid
