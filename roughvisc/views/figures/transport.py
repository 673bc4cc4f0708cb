"""Figures of transport: the leak rate and where the fluid flows, and the conductance of the contact spots."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from roughvisc.errors import InputError
from roughvisc.observables import asked
from roughvisc.observables import leakage as derived
from roughvisc.observables.leakage import closing_times
from roughvisc.units import Quantity, Unit, quantities, unit_for
from roughvisc.variables import VARIABLES
from roughvisc.variables.axes import AXES, axis_of
from roughvisc.variables.spots import CONDUCTANCES
from roughvisc.views.figures import style
from roughvisc.views.figures.fields import Scale, colour_bar, draw_map, label_plane, plane_ratio, plane_unit
from roughvisc.views.figures.rows import RowAxis, at_rows, frame_at, require, rows_of

#: Decades of the flux below its largest that a map shows.
_DECADES = 3
#: Largest over smallest leak rate from which its axis is logarithmic.
_SPANS = 30.0


@style.apply
@quantities(time="s")
def leakage(dataset: xr.Dataset, time: Quantity | None = None) -> Figure:
    """Leak rate over time, with the time at which the contact closes, and a map of the flow at one time.

    The flux is drawn on a logarithmic scale of three decades; fluid that stands still lies below it.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``gap``. What of the leakage it does not hold is derived here, as the study's
        ``[observe]`` asks for it, or with the defaults of :func:`roughvisc.observables.leakage`.
    time : float or str, optional
        The nearest kept time is mapped; a negative whole number counts frames from the end. Default: the last at
        which the fluid flows. [s]

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or holds no gap.
    """
    require(dataset, "x", "y", "gap")
    dataset = with_leak_rate(dataset)
    flowing = np.flatnonzero(dataset["leak_rate"].values > 0)
    frame = frame_at(rows_of(dataset), time) if time is not None else int(flowing[-1]) if flowing.size else -1
    frame %= rows_of(dataset).size
    ratio = float(np.clip(plane_ratio(dataset), 0.4, 1.4))
    figure = style.new_figure(7.2, 1.1 + 2.4 * max(ratio, 0.8))
    on_time, on_map = figure.subplots(1, 2, width_ratios=[1.25, 1])
    _draw_rate(on_time, dataset, frame)
    image = _draw_flow(figure, on_map, dataset, frame)
    rows = rows_of(dataset)
    named: dict[str, Artist] = {}
    if marker := style.marker_of(rows.size):
        named[AXES[str(rows.name)].rows] = Line2D([], [], color=style.BLUE, ls="", marker=marker)
    named["mapped"] = Line2D([], [], color="k", ls="", marker="o", ms=6, mfc="none", mew=1.2)
    style.legend_above(figure, named | flow_legend(image))
    closed = "" if flowing.size else ", closed"
    style.letter_panels((on_time, on_map), ("", RowAxis.of(rows).text(rows[frame]) + closed))
    return figure


def with_leak_rate(dataset: xr.Dataset) -> xr.Dataset:
    """A result that holds its leak rate."""
    if "leak_rate" in dataset:
        return dataset
    found = asked(dataset)
    found = found if "leak_rate" in found else derived(dataset)
    return dataset.merge(found.compute(), compat="equals", join="exact")


def rate_unit(history: xr.DataArray) -> tuple[Unit, bool]:
    """Unit of a history, and whether it is a leak rate that spans so much that its axis is logarithmic."""
    si, positive = VARIABLES[str(history.name)].units, history.values[history.values > 0]
    if history.name != "leak_rate" or not positive.size or positive.max() <= _SPANS * positive.min():
        return unit_for(history.values, si), False
    return unit_for(np.sqrt([positive.min()]) * np.sqrt(positive.max()), si), True


def flux_of(dataset: xr.Dataset) -> xr.DataArray:
    """Size of the flux over (time, x, y), missing in contact, lazily; asked as the leak rate in the result was."""
    asked_with: dict[str, Any] = {
        name: dataset["leak_rate"].attrs[name] for name in ("along", "sides", "viscosity", "pressure_drop")
    }
    lazily = dataset[["gap"]].chunk({axis_of(dataset.variables): 1, "x": -1, "y": -1})
    lazily.attrs = dataset.attrs
    found = derived(lazily, flow=True, **asked_with)
    size = np.hypot(found["flux_x"], found["flux_y"]).where(lazily["gap"] > 0)
    return size.rename("flux").assign_attrs(VARIABLES["flux"].attributes())


def draw_flux(ax: Axes, flux: xr.DataArray, unit: Unit, plane: Unit, highest: float) -> AxesImage:
    """Map of the flux of one frame, up to the highest [m2/s] of all that are drawn."""
    lowest = highest * 10.0**-_DECADES
    image = draw_map(ax, visible(flux, highest * unit.factor), unit, plane, norm=LogNorm(lowest, highest))
    image.set_cmap(image.get_cmap().with_extremes(bad=style.CONTACT, under=style.NO_CONTACT))
    return image


def flow_legend(image: AxesImage) -> dict[str, Artist]:
    """What a map of the flow shows besides its scale: contact, and fluid that stands still."""
    values = np.ma.asarray(image.get_array())
    named: dict[str, Artist] = {"contact": Patch(color=style.CONTACT, lw=0)} if np.ma.getmaskarray(values).any() else {}
    if (values.filled(np.inf) < (image.norm.vmin or 0.0)).any():
        named["no flow"] = Patch(facecolor=style.NO_CONTACT, edgecolor="0.5", lw=0.4)
    return named


def flux_scale(highest: float) -> Scale:
    """Colour scale of the flux up to the highest: what is below stands still."""
    return Scale("flux", highest * 10.0**-_DECADES, highest, 0.0, highest, marked=True)


def visible(flux: xr.DataArray, highest: float) -> xr.DataArray:
    """Flux whose zeros a logarithmic scale takes for too low, and not for missing."""
    return flux.clip(min=0.1 * highest * 10.0**-_DECADES)


def _draw_rate(ax: Axes, dataset: xr.Dataset, frame: int) -> None:
    """Leak rate over time, the frame that is mapped, and when the contact closes."""
    axis, rate = RowAxis.of(rows_of(dataset)), dataset["leak_rate"].values
    unit, spans = rate_unit(dataset["leak_rate"])
    times = axis.unit(rows_of(dataset))
    shown = np.where(rate > 0, unit(rate), np.nan) if spans else unit(rate)
    ax.plot(times, shown, color=style.BLUE, marker=style.marker_of(len(times)))
    ax.plot(times[[frame]], shown[[frame]], "o", color="k", ms=6, mfc="none", mew=1.2)
    if spans:
        style.spread_axis(ax.yaxis, shown)
    else:
        style.leave_room(ax, shown)
    if closes := closing_times(dataset):
        before, after = axis.unit(closes)
        ax.axvspan(before, after, color="0.9", lw=0)
        whole = unit_for(closes, "s")
        ax.set_title(f"closes between {whole(closes[0]):.3g} and {whole.text(closes[1])}", loc="right")
    elif not rate.any():
        ax.set_title("closed at every kept time", loc="right")
    axis.apply(ax, rows_of(dataset), most=5)
    ax.set_ylabel(unit.label(VARIABLES["leak_rate"].label))
    ax.grid(color="0.9", lw=0.5)


def _draw_flow(figure: Figure, ax: Axes, dataset: xr.Dataset, frame: int) -> AxesImage:
    """Map of the flux at one time."""
    flux = at_rows(flux_of(at_rows(dataset, [frame])), 0).load()
    highest = float(np.nan_to_num(flux.values).max())
    unit, plane = unit_for([highest], VARIABLES["flux"].units), plane_unit(dataset)
    if highest > 0:
        image = draw_flux(ax, flux, unit, plane, float(unit(highest)))
        colour_bar(figure, [image], flux_scale(highest), unit, location="right")
    else:
        image = draw_flux(ax, flux, unit, plane, 1.0)
    label_plane(ax, dataset, plane)
    return image


#: Estimates with their labels and dashes.
_ESTIMATES = (("holm", "Holm", (0, (4, 2))), ("greenwood", "Greenwood", (0, (1, 1.5))))


@style.apply
def conductance(dataset: xr.Dataset) -> Figure:
    """Conductance of the contact spots over time, with its stated error as a band and the estimates as lines.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result, merged with what :func:`roughvisc.observables.conductance` gives of it, or of a study that
        asks for it in ``[observe]``.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or neither holds a conductance nor asks for one.
    """
    require(dataset)
    held = dataset if any(kind in dataset for kind in CONDUCTANCES) else asked(dataset).compute()
    found = [kind for kind in CONDUCTANCES if kind in held]
    if not found:
        raise InputError("the result holds no conductance: merge it with rv.observables.conductance(ds, resistivity)")
    figure = style.new_figure(4.2, 0.6 + 2.5 * len(found))
    axis = RowAxis.of(rows_of(dataset))
    axes = figure.subplots(len(found), 1, sharex=True, squeeze=False)[:, 0]
    for ax, kind in zip(axes, found, strict=True):
        _draw(ax, axis, held, kind)
        axis.apply(ax, rows_of(dataset))
    for ax in axes[:-1]:
        ax.set_xlabel("")
    style.letter_panels(axes)
    style.legend_above(figure, style.named_in(axes[0]))
    return figure


def _draw(ax: Axes, axis: RowAxis, dataset: xr.Dataset, kind: str) -> None:
    """Values in full contact are infinite, and left out."""

    def finite(name: str) -> np.ndarray:
        return dataset[name].where(np.isfinite(dataset[name])).values

    unit, times = unit_for(finite(kind), VARIABLES[kind].units), axis.unit(rows_of(dataset))
    values, error = unit(finite(kind)), unit(finite(f"{kind}_error"))
    ax.fill_between(times, np.maximum(values - error, 0), values + error, color=style.BLUE, alpha=0.25, lw=0)
    marker = style.marker_of(len(times))
    ax.plot(times, values, color=style.BLUE, marker=marker, ms=2.5, label="computed, with its error")
    shown = [values + error]
    for suffix, label, dashes in _ESTIMATES:
        if (name := f"{kind}_{suffix}") in dataset:
            shown.append(unit(finite(name)))
            ax.plot(times, shown[-1], color="0.35", ls=dashes, lw=0.9, label=label)
    style.leave_room(ax, *shown)
    ax.set_ylabel(unit.label(VARIABLES[kind].label))
    ax.grid(color="0.9", lw=0.5)
