"""Figures of distributions over the contact: pressure and gap, number and size of contact clusters."""

from __future__ import annotations

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from roughvisc.observables import cluster_areas, clusters, gap_distribution, pressure_distribution
from roughvisc.units import quantities, unit_for
from roughvisc.variables import VARIABLES
from roughvisc.views.figures import style
from roughvisc.views.figures.coarsened import row_parts
from roughvisc.views.figures.rows import RowAxis, at_rows, frames_at, require, rows_of, spread_frames, telling_frames

_DISTRIBUTIONS = {"pressure": pressure_distribution, "gap": gap_distribution}
_MOST_LINES = 24
#: Contact clusters below which their number and their areas are no distribution.
_FEWEST_CLUSTERS = 3


def _frames(dataset: xr.Dataset, times, count: int) -> list[int]:
    return telling_frames(dataset, count) if times is None else frames_at(rows_of(dataset), times, _MOST_LINES)


def _colours(count: int) -> np.ndarray:
    """From early to late: the order of lightness of the viridis map, its faintest end left out."""
    return matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, count) if count > 1 else [0.0])


@style.apply
@quantities(times="s")
def distributions(dataset: xr.Dataset, times=None, bins: int | None = None) -> Figure:
    """Probability densities of the contact pressure and of the gap at chosen times.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``pressure`` or ``gap``.
    times : float or str, or list of them, optional
        The nearest kept times are drawn; negative whole numbers count frames from the end. By default up to five over
        the time in contact. [s]
    bins : int, optional
        Number of bins from zero to the largest value drawn; by default as the number of cells suits.

    Returns
    -------
    matplotlib.figure.Figure

    Notes
    -----
    The density of pressure is over the cells in contact, that of the gap over the present cells out of contact: each
    has the integral 1.
    """
    require(dataset)
    panels = [(name, find) for name, find in _DISTRIBUTIONS.items() if name in dataset]
    if not panels:
        require(dataset, "pressure", "gap")
    frames = _frames(dataset, times, 5)
    chosen, texts = at_rows(dataset, frames), RowAxis.of(rows_of(dataset))
    figure = style.new_figure(3.4 * len(panels) + 0.2, 3.0)
    axes = figure.subplots(1, len(panels), squeeze=False)[0]
    for ax, (name, find) in zip(axes, panels, strict=True):
        count = bins or _bin_count(chosen[name])
        _draw_density(ax, chosen, find(chosen, count)[f"{name}_density"], name, texts)
    named = style.named_in(*axes)
    style.legend_above(figure, {label: named[label] for label in map(texts.text, rows_of(chosen)) if label in named})
    style.letter_panels(axes)
    return figure


def _bin_count(field: xr.DataArray) -> int:
    """As many bins as the fullest frame has values to fill."""
    counts = [sum(np.count_nonzero(part > 0) for _, part in row_parts(frame)) for frame in field]
    return int(np.clip(np.sqrt(float(max(counts))) / 2, 6, 50))


def _no_contact(ax: Axes, text: str = "no contact") -> None:
    style.say_inside(ax, text)
    ax.set_yticks([])


def _draw_density(ax: Axes, dataset: xr.Dataset, density: xr.DataArray, name: str, texts: RowAxis) -> None:
    centres = density[f"{name}_bin"].values
    width = 2 * centres[0]
    limits = width * np.arange(len(centres) + 1)
    unit = unit_for(limits, VARIABLES[name].units)
    for number, colour in enumerate(_colours(rows_of(dataset).size)):
        values = at_rows(density, number).values * unit.factor
        if not np.isfinite(values).all():
            continue
        text = texts.text(rows_of(dataset)[number])
        ax.stairs(values, unit(limits), color=colour, lw=1.2, label=text, baseline=None)
    ax.set_xlim(0, float(unit(limits[-1])))
    ax.set_ylim(bottom=0)
    ax.set_xlabel(unit.label(VARIABLES[name].label))
    ax.set_ylabel(f"Density [1/{unit.symbol}]")
    if not density.notnull().any():
        _no_contact(ax, "no contact" if name == "pressure" else "full contact")
    ax.grid(color="0.9", lw=0.5)


def has_clusters(dataset: xr.Dataset) -> bool:
    """Whether the contact has several spots at one of a few times: of a single one there is nothing to count."""
    shown = at_rows(dataset, telling_frames(dataset, 4))
    return bool((clusters(shown)["cluster_count"] >= _FEWEST_CLUSTERS).any())


@style.apply
@quantities(times="s")
def contact_clusters(dataset: xr.Dataset, times=None) -> Figure:
    """Number of contact clusters and their largest and mean area over time, and the distribution of their areas.

    Where the contact never has more than two clusters the figure says so in place of the distribution.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``pressure`` or ``gap``.
    times : float or str, or list of them, optional
        Where the distribution is drawn; negative whole numbers count frames from the end. By default up to four over
        the time in contact. [s]

    Returns
    -------
    matplotlib.figure.Figure
    """
    require(dataset, "x", "y")
    followed = at_rows(dataset, spread_frames(rows_of(dataset), 100))
    found = clusters(followed).compute()
    figure = style.new_figure(7.2, 3.0)
    count, area, sizes = figure.subplots(1, 3)
    axis = RowAxis.of(rows_of(dataset))
    times_shown = axis.unit(rows_of(followed))
    marker = style.marker_of(len(times_shown))
    count.plot(times_shown, found["cluster_count"], color=style.BLUE, marker=marker)
    count.set_ylabel("Contact clusters")
    most = max(int(found["cluster_count"].max()), 1)
    count.set_ylim(-0.05 * most, 1.1 * most)
    count.yaxis.set_major_locator(MaxNLocator(5, integer=True, min_n_ticks=1))
    unit = unit_for(found["cluster_area_largest"], "m^2")
    area.plot(times_shown, unit(found["cluster_area_largest"]), color=style.CONTACT, marker=marker, label="largest")
    area.plot(times_shown, unit(found["cluster_area_mean"]), color=style.BLUE, marker=marker, ls="--", label="mean")
    area.set_ylabel(unit.label("Cluster area"))
    if found["cluster_count"].any():
        style.spread_axis(area.yaxis, unit([found["cluster_area_largest"], found["cluster_area_mean"]]))
        style.legend_over(area, 1.9)
    else:
        _no_contact(area)
    for ax in (count, area):
        axis.apply(ax, rows_of(dataset), most=4)
    _draw_sizes(sizes, dataset, _frames(dataset, times, 4))
    for ax in (count, area, sizes):
        ax.grid(color="0.9", lw=0.5)
    style.letter_panels((count, area, sizes))
    return figure


def _draw_sizes(ax: Axes, dataset: xr.Dataset, frames: list[int]) -> None:
    """How many clusters are at least that large: no bins to choose."""
    chosen = at_rows(dataset, frames)
    areas = cluster_areas(chosen)["cluster_area"].values
    most, unit = int(np.isfinite(areas).sum(axis=1).max()), unit_for(areas, "m^2")
    if most < _FEWEST_CLUSTERS:
        _no_contact(ax, ("no contact", "one cluster at most", "two clusters at most")[most])
        ax.set_xticks([])
    else:
        texts = RowAxis.of(rows_of(dataset))
        for row, time, colour in zip(areas, rows_of(chosen), _colours(len(frames)), strict=True):
            row = unit(row[np.isfinite(row)])
            if len(row):
                look = {"drawstyle": "steps-post", "label": texts.text(time)}
                ax.plot(row, np.arange(1, len(row) + 1), color=colour, **look)
                ax.plot(row[:1], [1], "o", color=colour, ms=3.5 if len(row) == 1 else 2)
        ax.locator_params(axis="x", nbins=4)
        style.spread_axis(ax.xaxis, unit(areas))
        style.spread_axis(ax.yaxis, [1, most])
        if ax.get_yscale() == "log":
            ax.set_ylim(bottom=0.8)
        else:
            ax.set_ylim(0, 1.4 * ax.get_ylim()[1])
            ax.yaxis.set_major_locator(MaxNLocator(5, integer=True))
        style.legend_over(ax, 1.9)
    ax.set_xlabel(unit.label("Cluster area"))
    ax.set_ylabel("Clusters at least as large")
