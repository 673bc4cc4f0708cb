"""Figure of a trade: error against wall time."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from roughvisc.errors import InputError
from roughvisc.study.trade.ladder import format_tolerance, step_text
from roughvisc.study.trade.recommend import WORDS, main_quantities, pareto_front, uncertainty
from roughvisc.variables import VARIABLES
from roughvisc.views.figures import style

#: family of settings -> marker and colour, told apart by either
_FAMILIES = {
    "tolerance": ("o", style.BLUE),
    "coarser grid": ("v", style.VERMILION),
    "finer grid": ("^", style.VERMILION),
    "fixed steps": ("s", style.GREEN),
    "direct history": ("D", style.PURPLE),
    "rounded fields": ("P", style.SKY),
    "seed paper's algorithm": ("X", style.ORANGE),
}
#: What the line is called below which nobody need pay.
_FLOOR = "no setting is better"
#: Where a label may stand: offset from its point [point], and how it is aligned there; the first that is free is taken.
_PLACES = (
    ((6, 0), "left", "center"),
    ((0, 5), "center", "bottom"),
    ((0, -5), "center", "top"),
    ((-6, 0), "right", "center"),
    ((4, 4), "left", "bottom"),
    ((4, -4), "left", "top"),
    ((-4, 4), "right", "bottom"),
    ((-4, -4), "right", "top"),
    ((5, 11), "left", "bottom"),
    ((5, -11), "left", "top"),
    ((-5, 11), "right", "bottom"),
    ((-5, -11), "right", "top"),
)


@style.apply
def trade(dataset: xr.Dataset, quantities: Sequence[str] | None = None) -> Figure:
    """Wall time against error of every setting, with the Pareto front: what no other setting beats in both.

    Errors that the reference cannot tell from zero lie in the grey band below; a setting whose error is exactly zero
    is drawn at the bottom. The front does not go through either: where such points lie was not measured. A dashed line
    is the error that no setting lessens, where the trade holds it: below it nobody need pay.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.trade`.
    quantities : sequence of str, optional
        One panel for each: ``friction_coefficient``, ``pressure``, ``approach``, ``contact_area``,
        ``contact_area_counted``, ``mean_gap``, and what the trade holds beside these. Default: contact area and
        pressure, where something slides friction coefficient and contact area.

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
    known = main_quantities(dataset)
    quantities = known[:2] if quantities is None else list(quantities)
    for name in quantities:
        if name not in known:
            raise InputError(f"quantities holds {name!r}: expected some of {', '.join(known)}")
    shown = [name for name in quantities if np.isfinite(dataset["error"].sel(quantity=name)).any()]
    if not shown:
        raise InputError("the trade holds no measured setting: nothing to draw")
    figure = style.new_figure(0.6 + 3.3 * len(shown), 3.7)
    axes = figure.subplots(1, len(shown), squeeze=False)[0]
    points = [_draw(ax, dataset, name) for ax, name in zip(axes, shown, strict=True)]
    named, columns = style.named_in(*axes), 4 if len(shown) > 1 else 2
    figure.legend(named.values(), named, loc="outside upper center", ncols=columns, handlelength=1.4)
    style.letter_panels(axes)
    figure.draw_without_rendering()  # the layout must stand before labels can be kept apart
    for ax, rows in zip(axes, points, strict=True):
        _place(ax, dataset, *rows)
    return figure


def _draw(ax: Axes, dataset: xr.Dataset, quantity: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw a panel; the settings in it, where each stands, and the corners of the front."""
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
    families = dataset["family"].values
    for family, (marker, colour) in _FAMILIES.items():
        chosen = known & (families == family)
        if chosen.any():
            ax.plot(spent[chosen], height[chosen], marker, color=colour, ms=5, mew=0, label=family, zorder=3)
    ax.plot(spent[best], height[best], "o", mfc="none", mec="0.2", mew=0.7, ms=8.5, ls="", zorder=2)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(spent[known].min() / 1.6, spent[known].max() * 3)
    ax.set_ylim(bottom, height[known].max() * 2)
    if nothing:
        ax.axhline(floor * 1.7, color="0.6", lw=0.6, ls=(0, (1, 2)), zorder=0)
        ax.text(0.02, floor, "none seen", transform=ax.get_yaxis_transform(), fontsize=6, style="italic", va="center")
    if "floor" in dataset and (kept := 100 * float(dataset["floor"].sel(quantity=quantity))) > 0:
        _draw_floor(ax, kept, str(dataset["floor_open"].sel(quantity=quantity).values))
        ax.set_ylim(min(bottom, kept / 2), max(ax.get_ylim()[1], kept * 2))
    if unsure > bottom:
        ax.axhspan(bottom, min(unsure, height[known].max()), color="0.93", zorder=0, label="reference not known")
    for axis, most in ((ax.xaxis, 30), (ax.yaxis, 300)):
        low, high = axis.get_view_interval()
        style.plain_log_ticks(axis, fine=high < most * low, most=20)
    ax.set_xlabel(f"{VARIABLES['wall_time'].label} [s]")
    ax.set_ylabel(f"Error of {WORDS[quantity]} [%]")
    ax.grid(color="0.9", lw=0.5)
    where = np.flatnonzero(known)
    return where, np.column_stack([spent, height])[where], np.column_stack([spent, height])[best]


def _draw_floor(ax: Axes, floor: float, still_open: str) -> None:
    """The error that no setting lessens [%], and what is not in it."""
    ax.axhline(floor, color="k", lw=1.0, ls=(0, (5, 2)), zorder=1, label=_FLOOR)
    said = f"no setting better than {floor:.2g} %" + (f"; still open: {still_open}" if still_open else "")
    ax.set_title(textwrap.fill(said, 50), fontsize=6, loc="right")


def _brief(row: xr.Dataset) -> str:
    """What tells a setting from the others of its family."""
    step = float(row["time_step"])
    text = step_text(step) if np.isfinite(step) else format_tolerance(float(row["tolerance"]))
    if float(row["coarsening"]) != 1:
        text += f", {int(row['cells_x'])}×{int(row['cells_y'])}"
    return text


def _place(ax: Axes, dataset: xr.Dataset, settings: np.ndarray, points: np.ndarray, line: np.ndarray) -> None:
    """Write a label beside every point, where it covers neither another one nor a point nor the front."""
    point = ax.figure.dpi / 72
    share = np.linspace(0, 1, 40)[:, None]
    corners = ax.transData.transform(line)
    along = [a + share * (b - a) for a, b in pairwise(corners)]
    taken = [_around(at, 3.5 * point) for at in ax.transData.transform(points)]
    taken += [_around(at, 0.6 * point) for part in along for at in part]
    frame = ax.get_window_extent()
    for floor in [one for one in ax.lines if one.get_label() == _FLOOR]:
        height = ax.transData.transform((ax.get_xlim()[0], floor.get_ydata()[0]))[1]
        taken.append(Bbox.from_extents(frame.x0, height - point, frame.x1, height + point))
    for i, at in zip(settings, points, strict=True):
        row = dataset.isel(setting=i)
        colour = 0.65 * np.array(to_rgb(_FAMILIES[str(row["family"].values)][1]))
        label = ax.annotate(_brief(row), at, (0, 0), textcoords="offset points", fontsize=6, color=colour, zorder=4)
        boxes, covered = [], []
        for offset, across, up in _PLACES:
            label.set(position=offset, ha=across, va=up)
            box = label.get_window_extent()
            boxes.append(box)
            covered.append(sum(_common(box, other) for other in taken) + box.width * box.height - _common(box, frame))
            if covered[-1] <= 1e-9:
                break
        least = int(np.argmin(np.array(covered) > min(covered) + 1e-9))  # the first of those that cover least
        offset, across, up = _PLACES[least]
        label.set(position=offset, ha=across, va=up)
        taken.append(boxes[least])


def _around(at: np.ndarray, reach: float) -> Bbox:
    return Bbox.from_extents(at[0] - reach, at[1] - reach, at[0] + reach, at[1] + reach)


def _common(a: Bbox, b: Bbox) -> float:
    """Area that two boxes share."""
    shared = Bbox.intersection(a, b)
    return float(shared.width * shared.height) if shared is not None else 0.0
