"""Figures of histories: force, approach and area over time, hysteresis loops, area against load."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from roughvisc.errors import InputError
from roughvisc.variables import STATUS_MEANINGS, VARIABLES
from roughvisc.views.axes import (
    BLUE,
    CYCLE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    TimeAxis,
    letter_panels,
    new_figure,
    require,
    spans_decades,
    spread_axis,
    styled,
    unit_for,
)

_PANELS = (
    ("force", "Force", BLUE),
    ("approach", "Approach", VERMILION),
    ("contact_area", "Contact area", GREEN),
    ("mean_gap", "Mean gap", PURPLE),
    ("work", "Work", ORANGE),
)
_COSTS = (("convolutions", "convolutions", BLUE), ("iterations", "iterations", SKY))
#: Panels up to which they stand in one column.
_ONE_COLUMN = 3
_NOT_CONVERGED = STATUS_MEANINGS.index("not_converged")


def _marker(count: int) -> str:
    """Points are marked as long as they can be told apart."""
    return "o" if count <= 40 else ""


def _failed(dataset: xr.Dataset) -> np.ndarray:
    """Frames whose step did not converge."""
    if "status" not in dataset:
        return np.zeros(dataset.sizes["time"], dtype=bool)
    return dataset["status"].values == _NOT_CONVERGED


def _leave_room(ax: Axes, *values: np.ndarray) -> None:
    """Linear limits from zero to somewhat above the largest value; a constant history lies in the middle."""
    shown = np.concatenate([np.ravel(one) for one in values])
    shown = shown[np.isfinite(shown)]
    lowest, highest = (min(shown.min(), 0.0), max(shown.max(), 0.0)) if shown.size else (0.0, 1.0)
    span = (highest - lowest) or 1.0
    ax.set_ylim(lowest - 0.05 * span, highest + 0.15 * span)


def _draw_history(ax: Axes, dataset: xr.Dataset, name: str, label: str, colour: str) -> None:
    axis = TimeAxis.of(dataset["time"])
    times, values = axis.unit(dataset["time"]), dataset[name].values
    unit = unit_for(values, VARIABLES[name].units)
    marker = _marker(len(times))
    ax.plot(times, unit(values), color=colour, marker=marker, label="counted" if name == "contact_area" else "_")
    failed = _failed(dataset)
    if failed.any():
        note = "not converged" if name == "force" else "_"
        ax.plot(times[failed], unit(values[failed]), "x", color="k", ms=5, mew=1.2, zorder=5, label=note)
    if name == "contact_area" and "contact_area_corrected" in dataset:
        corrected = unit(dataset["contact_area_corrected"])
        ax.plot(times, corrected, color="k", ls=(0, (4, 2)), lw=0.9, label="corrected for the grid")
    _leave_room(ax, unit(values))
    ax.set_ylabel(unit.label(label))


def _fraction_axis(ax: Axes, dataset: xr.Dataset) -> None:
    """Contact fraction on the right of the panel of the area, where the two are proportional."""
    if "contact_fraction" not in dataset:
        return
    area = unit_for(dataset["contact_area"], "m2")(dataset["contact_area"])
    touching = area > 0
    if not touching.any():
        return
    ratio = float((100 * dataset["contact_fraction"].values[touching] / area[touching]).mean())
    if math.isfinite(ratio) and ratio > 0:
        right = ax.secondary_yaxis("right", functions=(lambda shown: shown * ratio, lambda shown: shown / ratio))
        right.set_ylabel("of nominal [%]")


def _draw_accuracy(ax: Axes, dataset: xr.Dataset) -> None:
    axis = TimeAxis.of(dataset["time"])
    times = axis.unit(dataset["time"])
    floor, ceiling = math.inf, 0.0
    shown = (
        ("residual", "solver (energy bound)", PURPLE),
        ("time_error", "time steps", ORANGE),
        ("grid_error", "grid", SKY),
    )
    for name, label, colour in shown:
        if name not in dataset:
            continue
        values = dataset[name].values.astype(float)
        known = np.isfinite(values) & (values > 0)
        if known.any():
            ax.plot(times[known], values[known], color=colour, marker=_marker(len(times)), ms=2.5, lw=1, label=label)
            floor, ceiling = min(floor, values[known].min()), max(ceiling, values[known].max())
    tolerance = dataset.attrs.get("tolerance")
    if tolerance:
        ax.axhline(tolerance, color="0.3", lw=0.8, ls=(0, (1, 1.5)), label="tolerance")
        floor, ceiling = min(floor, tolerance), max(ceiling, tolerance)
    if ceiling > 0:
        ax.set_yscale("log")
        ax.set_ylim(floor / 3, ceiling * 3)
        decades = math.log10(ceiling / floor) + 1
        ax.yaxis.set_major_locator(LogLocator(numticks=5))
        ax.yaxis.set_minor_locator(LogLocator(subs=range(2, 10) if decades < 5 else (1.0,), numticks=99))
        ax.yaxis.set_minor_formatter(NullFormatter())
    else:
        ax.set_yticks([])
        ax.text(0.5, 0.5, "no accuracy recorded", transform=ax.transAxes, ha="center", va="center", color="0.4")
    ax.set_ylabel("Rel. error")


def _draw_cost(ax: Axes, dataset: xr.Dataset) -> None:
    """What every kept time has cost since the one before it."""
    times = TimeAxis.of(dataset["time"]).unit(dataset["time"])
    found = [(dataset[name].values.astype(float), label, colour) for name, label, colour in _COSTS if name in dataset]
    for values, label, colour in found:
        ax.plot(times, values, color=colour, marker=_marker(len(times)), ms=2.5, lw=1, label=label)
    shown = np.concatenate([values for values, _, _ in found])
    if shown.min() > 0 and shown.max() > 100 * shown.min():
        ax.set_yscale("log")
    else:
        _leave_room(ax, shown)
        ax.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    ax.set_ylabel("Per kept time")


@styled
def history(dataset: xr.Dataset) -> Figure:
    """Force, approach, contact area, mean gap and work over time; cost and accuracy of every kept time below.

    What the result does not hold is left out. The time axis is linear or logarithmic as the kept times suit. Steps
    that did not converge are crossed out. Work is that of the force so far, which is dissipated where a loop closes.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or holds none of the histories.
    """
    require(dataset, "time")
    panels = [panel for panel in _PANELS if panel[0] in dataset]
    if not panels:
        names = ", ".join(name for name, _, _ in _PANELS)
        raise InputError(f"the result holds none of {names}: nothing to draw over time")
    costs = any(name in dataset for name, _, _ in _COSTS)
    figure, axes = _history_panels(len(panels) + costs)
    for ax, (name, label, colour) in zip(axes, panels, strict=False):
        _draw_history(ax, dataset, name, label, colour)
        if name == "contact_area":
            _fraction_axis(ax, dataset)
    if costs:
        _draw_cost(axes[-2], dataset)
    _draw_accuracy(axes[-1], dataset)
    axis = TimeAxis.of(dataset["time"])
    for ax in axes:
        axis.apply(ax, dataset["time"])
        lowest = ax.get_subplotspec().is_last_row() or _nothing_below(ax, axes)
        ax.tick_params(labelbottom=lowest)
        ax.set_xlabel(ax.get_xlabel() if lowest else "")
        ax.grid(axis="both", color="0.9", lw=0.5)
        if ax.get_legend_handles_labels()[1]:
            ax.legend(loc="lower left", bbox_to_anchor=(0.1, 1.0), ncols=4, borderaxespad=0.15, handlelength=1.6)
    letter_panels(axes)
    figure.align_ylabels(axes)
    return figure


def _history_panels(count: int) -> tuple[Figure, list[Axes]]:
    """So many panels in one or two columns, and one below them across the whole width."""
    columns = 1 if count <= _ONE_COLUMN else 2
    rows = -(-count // columns)
    figure = new_figure(4.6 if columns == 1 else 7.4, 1.25 * rows + 1.3 + 0.25 * (columns - 1))
    grid = figure.add_gridspec(rows + 1, columns, height_ratios=[1.0] * rows + [0.75])
    cells = [grid[number // columns, number % columns] for number in range(count)]
    return figure, [figure.add_subplot(cell) for cell in (*cells, grid[rows, :])]


def _nothing_below(ax: Axes, axes: Sequence[Axes]) -> bool:
    """Whether no panel of the same column has its time axis right below."""
    place = ax.get_subplotspec()
    below = [other.get_subplotspec() for other in axes]
    return not any(one.rowspan.start == place.rowspan.stop and one.colspan == place.colspan for one in below)


@styled
def hysteresis(dataset: xr.Dataset) -> Figure:
    """Force against approach, the direction of time marked, and the work that the loop encloses.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.

    Returns
    -------
    matplotlib.figure.Figure
    """
    require(dataset, "time", "force", "approach")
    force, approach = dataset["force"].values, dataset["approach"].values
    across, up = unit_for(approach, "m"), unit_for(force, "N")
    x, y = across(approach), up(force)
    work = np.concatenate([[0.0], np.cumsum(np.diff(approach) * (force[1:] + force[:-1]) / 2)])
    energy = unit_for(work, "J")
    figure = new_figure(3.6, 3.0)
    ax = figure.add_subplot()
    ax.plot(x, y, color=BLUE, marker=_marker(len(x)), ms=2)
    _draw_arrows(ax, x, y)
    ax.plot(x[:1], y[:1], "o", color="k", ms=4, label="first kept time")
    if len(x) > 1:
        ax.plot(x[-1:], y[-1:], "s", color="k", mfc="w", ms=4.5, label=f"last: {energy.text(work[-1])} of work done")
    failed = _failed(dataset)
    if failed.any():
        ax.plot(x[failed], y[failed], "x", color=VERMILION, ms=6, mew=1.2, label="not converged")
    ax.set_xlabel(across.label("Approach"))
    ax.set_ylabel(up.label("Force"))
    _leave_room(ax, y)
    ax.grid(color="0.9", lw=0.5)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=2, handlelength=1.2)
    return figure


def _draw_arrows(ax: Axes, x: np.ndarray, y: np.ndarray, count: int = 5) -> None:
    """Arrows in the direction of time, at even distances along a path."""
    width, height = (np.ptp(x) or 1.0), (np.ptp(y) or 1.0)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x) / width, np.diff(y) / height))])
    if length[-1] == 0:
        return
    for place in (np.arange(count) + 0.5) / count * length[-1]:
        k = min(max(int(np.searchsorted(length, place)), 1), len(x) - 1)
        share = (place - length[k - 1]) / (length[k] - length[k - 1])
        start = np.array([x[k - 1], y[k - 1]])
        tip = start + share * (np.array([x[k], y[k]]) - start)
        style = {"arrowstyle": "-|>", "color": BLUE, "mutation_scale": 13, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", tip, start, arrowprops=style)


def _as_cases(results) -> dict[str, xr.Dataset]:
    """Results by the label each has in the legend."""
    if isinstance(results, xr.Dataset):
        if "case" in results.dims:
            return {str(one.values): results.sel(case=one) for one in results["case"]}
        results = [results]
    if isinstance(results, Mapping):
        return {str(label): dataset for label, dataset in results.items()}
    if not isinstance(results, Iterable):
        raise InputError(f"expected one result, a list or a mapping of them, found {type(results).__name__}")
    cases: dict[str, xr.Dataset] = {}
    for number, dataset in enumerate(results, 1):
        label = str(getattr(dataset, "attrs", {}).get("title") or f"case {number}")
        cases[label if label not in cases else f"{label} ({number})"] = dataset
    if not cases:
        raise InputError("no result given: nothing to draw")
    return cases


def _root_mean_square_slope(height: xr.DataArray) -> float:
    """Slope of the surface by differences between neighbouring present cells."""
    total = 0.0
    for name in ("x", "y"):
        if height.sizes[name] > 1:
            step = float(height[name][1] - height[name][0])
            total += float(((height.diff(name) / step) ** 2).mean())
    return math.sqrt(total)


@styled
def area_against_load(results, *, contact_modulus=None) -> Figure:
    r"""Contact area against force, one line a case.

    Parameters
    ----------
    results : xarray.Dataset, list or mapping of them
        Results; the keys of a mapping, or else their titles, name the lines.
    contact_modulus : float or mapping, optional
        Contact modulus, or several by name such as ``{"glassy": 4e6, "rubbery": 1e6}``, for which to draw the line
        of low loads. [Pa]

    Returns
    -------
    matplotlib.figure.Figure

    Notes
    -----
    The line of low loads is :math:`A = \sqrt{2 \pi} F / (E^* h'_\mathrm{rms})` [1]_, with the root-mean-square
    slope of the first case's surface.

    References
    ----------
    .. [1] A. W. Bush, R. D. Gibson, T. R. Thomas, *Wear* 35 (1975) 87-111.
    """
    cases = _as_cases(results)
    for dataset in cases.values():
        require(dataset, "time", "force", "contact_area")
    across = unit_for(np.concatenate([one["force"].values for one in cases.values()]), "N")
    up = unit_for(np.concatenate([one["contact_area"].values for one in cases.values()]), "m2")
    figure = new_figure(3.8, 3.0 + 0.13 * min(len(cases), 12))
    ax = figure.add_subplot()
    for number, (label, dataset) in enumerate(cases.items()):
        colour = CYCLE[number % len(CYCLE)] if len(cases) <= len(CYCLE) else "0.5"
        x, y = across(dataset["force"]), up(dataset["contact_area"])
        style = {"color": colour, "marker": _marker(len(x)), "ms": 2.5}
        ax.plot(x, y, label=label if len(cases) <= 12 else "_", **style)
    _draw_low_load_lines(ax, next(iter(cases.values())), contact_modulus, across, up)
    loads = np.sort(np.concatenate([one["force"].values for one in cases.values()]))
    if spans_decades(loads):
        spread_axis(ax.xaxis, across(loads))
        spread_axis(ax.yaxis, up(np.concatenate([one["contact_area"].values for one in cases.values()])))
    else:
        _leave_room(ax, *(up(one["contact_area"]) for one in cases.values()))
        ax.set_xlim(left=min(0.0, ax.get_xlim()[0]))
    ax.set_xlabel(across.label("Force"))
    ax.set_ylabel(up.label("Contact area"))
    ax.grid(color="0.9", lw=0.5)
    if len(ax.get_legend_handles_labels()[1]) > 1:
        figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=1 if len(cases) < 6 else 2)
    return figure


def _draw_low_load_lines(ax: Axes, dataset: xr.Dataset, moduli, across, up) -> None:
    if moduli is None:
        return
    require(dataset, "height")
    slope = _root_mean_square_slope(dataset["height"])
    named = moduli if isinstance(moduli, Mapping) else {"": moduli}
    top = float(dataset["force"].max())
    for (name, modulus), dash in zip(named.items(), ((4, 2), (1, 1.5), (6, 1, 1, 1)) * len(named), strict=False):
        loads = np.geomspace(1e-3 * top, top, 50)
        label = f"low loads, {name}" if name else "low loads"
        area = math.sqrt(2 * math.pi) * loads / (modulus * slope)
        ax.plot(across(loads), up(area), color="k", lw=0.9, ls=(0, dash), label=label)
