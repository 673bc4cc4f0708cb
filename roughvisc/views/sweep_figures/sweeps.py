"""A quantity against the swept parameters, as lines or as a map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullFormatter

from roughvisc.errors import InputError
from roughvisc.units import Quantity, Unit, quantities
from roughvisc.views.figures import style
from roughvisc.views.figures.rows import RowAxis, frame_at, frames_at, rows_of, spread_frames
from roughvisc.views.sweep_figures.case_text import ENDLESS
from roughvisc.views.sweep_figures.cases import (
    Cases,
    Parameter,
    cases_of,
    combined,
    label_of,
    quantity_unit,
    without_zeros,
)
from roughvisc.views.sweep_figures.colouring import Colouring, even_in_log, readable_ticks
from roughvisc.views.sweep_figures.ensembles import ITSELF_STYLE, band_legend, draw_band

#: Parameters with so many values or more make a map by default.
_MAP_FROM = 4
_MOST_PANELS = 6
#: Times at which cases are compared.
_MOST_TIMES = 200


@style.apply
@quantities(times="s")
def sweep(
    results: Any,
    quantity: str | None = None,
    *,
    times: Quantity | Sequence[Quantity] | None = None,
    along: str | Sequence[str] | None = None,
    kind: Literal["auto", "lines", "map"] = "auto",
) -> Figure:
    """Draw a quantity against the swept parameters: lines, or a map of two parameters.

    Numbers lie on linear axes, or on logarithmic ones where they span decades; anything else, such as materials,
    files and seeds, makes categories. Of realisations the mean is drawn
    with the 95 % prediction interval of a single one and, of a scan, the measured scan; a map has the mean.

    Parameters
    ----------
    results : xarray.Dataset
        What :func:`roughvisc.sweep` or :func:`roughvisc.open_results` gives.
    quantity : str, optional
        A history of every case, such as ``"approach"`` or ``"wall_time"``; by default the contact area, or the
        contact fraction where the surfaces differ in size.
    times : float or str, or sequence of them, optional
        The nearest kept times are drawn; negative whole numbers count from the end. Where one parameter was varied,
        by default up to four, a line each; else by default the last, or where the cases differ most if they differ
        by less than half of that at the end, which the title then says. Where several were varied, a panel each. [s]
    along : str, or two of them, optional
        Dotted key of the parameter across; of a map, those across and up. By default the parameter with the most
        numbers.
    kind : {"auto", "lines", "map"}
        ``"lines"``: one for every combination of the parameters that do not lie across. ``"map"``: colours over two
        parameters; the default where there are two of four values or more each.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the results are no sweep, nothing varies in them, or a name is unknown.
    """
    if kind not in ("auto", "lines", "map"):
        raise InputError(f"kind is {kind!r}: expected 'auto', 'lines' or 'map'")
    cases = cases_of(results)
    quantity = cases.history_named(quantity)
    across = _across(cases, along)
    as_map = kind == "map" or (kind == "auto" and _suits_map(cases, along))
    if as_map and len(across) < 2:
        raise InputError(f"a map needs two parameters that vary: found {', '.join(p.key for p in cases.parameters)}")
    frames = _frames(cases, quantity, times, one=len(cases.parameters) == 1)
    titles = _titles(cases, frames)
    if times is None and len(frames) == 1 and not _all_last(cases, frames[0]):
        titles = [f"{titles[0]}, where the cases differ most"]
    ends = [[None if band is None else getattr(band, end) for band in cases.bands] for end in _ENDS]
    drawn = _Drawn(
        cases,
        quantity,
        titles,
        _at_frames(cases.members, quantity, frames),
        [_at_frames(datasets, quantity, frames) for datasets in ends],
    )
    if as_map:
        return _draw_maps(drawn, *across[:2])
    return (_lines_by_time if len(cases.parameters) == 1 else _families)(drawn, across[0])


#: Both ends of a band, and the measured surface itself.
_ENDS = ("lower", "upper", "itself")


@dataclass(frozen=True)
class _Drawn:
    """What is drawn of a quantity.

    Attributes
    ----------
    cases : Cases
        What it is of.
    quantity : str
        Its name.
    titles : list of str
        What tells its times.
    values : ndarray, shape (times, cases)
        [SI]
    bands : list of ndarray
        The same of both ends of a band and of the measured surface itself; missing where there is none.
    """

    cases: Cases
    quantity: str
    titles: list[str]
    values: np.ndarray
    bands: list[np.ndarray]

    @property
    def unit(self) -> Unit:
        """Unit to show values in."""
        return quantity_unit(self.cases, self.quantity, self.values)

    @property
    def label(self) -> str:
        """Label of an axis of the values."""
        return label_of(self.cases, self.quantity, self.unit)


def _at_frames(members: Sequence[xr.Dataset | None], quantity: str, frames: list[list[int]]) -> np.ndarray:
    """Values over (time, case) as they are drawn; missing where there is no Dataset."""
    values = [
        [np.nan if m is None else float(m[quantity][f]) for m, f in zip(members, row, strict=True)] for row in frames
    ]
    return without_zeros(quantity, np.array(values))


def _across(cases: Cases, along: str | Sequence[str] | None) -> list[Parameter]:
    """Parameters in the order in which they take the axes."""
    if not cases.parameters:
        raise InputError("nothing varies between the cases: nothing to draw against")
    asked = [along] if isinstance(along, str) else list(along or ())
    first = [cases.parameter(key) for key in asked]
    rest = [one for one in cases.parameters if one not in first]
    return first + sorted(rest, key=lambda one: (not one.numeric, -len(one.levels)))


def _suits_map(cases: Cases, along: str | Sequence[str] | None) -> bool:
    if along is not None and not isinstance(along, str):
        return len(along) == 2
    if len(cases.parameters) != 2:
        return False
    one, other = (len(parameter.levels) for parameter in cases.parameters)
    return min(one, other) >= _MAP_FROM and len(cases.members) > one * other / 2


def _frames(cases: Cases, quantity: str, times: float | Sequence[float] | None, one: bool) -> list[list[int]]:
    """Frame of every case, for each time that is drawn."""
    clocks = [rows_of(member).values for member in cases.members]
    if times is not None:
        of_each = [frames_at(clock, times, _MOST_PANELS) for clock in clocks]
        return [list(row) for row in zip(*of_each, strict=True)]
    shared = all(np.array_equal(clock, clocks[0]) for clock in clocks)
    if not (one and shared):
        return [telling_frames_of(cases, quantity)]
    telling = [i for i in range(len(clocks[0])) if any(abs(float(m[quantity][i])) > 0 for m in cases.members)]
    telling = telling or [len(clocks[0]) - 1]
    return [[telling[i]] * len(clocks) for i in spread_frames(clocks[0][telling], 4)]


def _titles(cases: Cases, frames: list[list[int]]) -> list[str]:
    """The time of each row of frames, or about which time it is if it is not the same in all cases."""
    pairs = [zip(cases.members, row, strict=True) for row in frames]
    found = [{float(rows_of(member)[frame]) for member, frame in row} for row in pairs]
    axis = RowAxis.of(np.unique([place for places in found for place in places]), cases.axis)
    texts = [axis.text(float(np.median(list(places)))) for places in found]
    texts = [text if len(p) == 1 else text.replace("=", "≈") for text, p in zip(texts, found, strict=True)]
    ends = [len(p) > 1 and _all_last(cases, row) for p, row in zip(found, frames, strict=True)]
    return ["at the end" if end else text for end, text in zip(ends, texts, strict=True)]


def _all_last(cases: Cases, frames: list[int]) -> bool:
    return all(frame == rows_of(member).size - 1 for member, frame in zip(cases.members, frames, strict=True))


def telling_frames_of(cases: Cases, quantity: str) -> list[int]:
    """Frame of each case at the end; where the cases differ less than half as much there, where they differ most."""
    clocks = [rows_of(member).values for member in cases.members]
    last = [len(clock) - 1 for clock in clocks]
    common = np.unique(np.concatenate(clocks))
    common = common[(common >= max(c[0] for c in clocks)) & (common <= min(c[-1] for c in clocks))]
    if not common.size or len({clock[-1] for clock in clocks}) > 1:
        return last
    common = common[spread_frames(common, _MOST_TIMES)]
    values = [np.interp(common, clock, m[quantity]) for clock, m in zip(clocks, cases.members, strict=True)]
    spread = np.nan_to_num(np.ptp(values, axis=0))
    if spread[-1] >= 0.5 * spread.max():
        return last
    return [frame_at(clock, common[spread.argmax()]) for clock in clocks]


# ------------------------------------------------------------------------------------------------------- lines


def _lines_by_time(drawn: _Drawn, across: Parameter) -> Figure:
    """One parameter: a line for each time."""
    figure = style.new_figure(4.2, 3.2)
    ax = figure.add_subplot()
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.8, len(drawn.values)))
    for number, (colour, title) in enumerate(zip(shades, drawn.titles, strict=True)):
        _draw_line(ax, drawn, across, number, slice(None), color=colour, label=title)
    _finish(ax, drawn, across)
    style.legend_above(figure, style.named_in(ax) | band_legend(drawn.cases.bands))
    return figure


def _families(drawn: _Drawn, across: Parameter) -> Figure:
    """Several parameters: a panel for each time, in it a line for each combination of the others."""
    family = combined([one for one in drawn.cases.parameters if one.key != across.key])
    colouring, times = Colouring(family), len(drawn.values)
    named = colouring.legend()
    figure = style.new_figure(1.2 + 3.0 * times, 3.2 + 0.14 * len(named) / (1 + times))
    axes = figure.subplots(1, times, sharey=True, squeeze=False)[0]
    for number, ax in enumerate(axes):
        for level in range(len(family.levels)):
            nested = 1 - 0.55 * level / max(1, len(family.levels) - 1)  # so that none hides another that it lies on
            look = {"color": colouring.colour(level), "lw": 2.3 * nested, "ms": 7.0 * nested}
            _draw_line(ax, drawn, across, number, np.flatnonzero(family.places == level), **look)
        _finish(ax, drawn, across)
        ax.label_outer(remove_inner_ticks=False)
        ax.set_xlabel(across.label)
    title = family.name if named else ""
    named |= band_legend(drawn.cases.bands)
    style.legend_above(figure, named, title)
    colouring.draw_bar(figure, list(axes))
    style.letter_panels(axes, drawn.titles)
    return figure


def _draw_line(ax: Axes, drawn: _Drawn, across: Parameter, time: int, members: Any, **look) -> None:
    """A line over the parameter, and its band; points of categories are not joined, nor that of an infinite value."""
    place = positions(across)[across.places[members]]
    shown, *ends = (drawn.unit(one[time][members]) for one in (drawn.values, *drawn.bands))
    order = np.argsort(place, kind="stable")
    look |= {"marker": "o" if len(place) <= 40 else "", "ls": "-" if across.numeric else ""}
    columns = [one[order] for one in (place, shown, *ends)]
    if across.endless:
        last = int(np.isfinite(across.values[members]).sum())
        columns = [np.insert(one, last, np.nan) for one in columns]
    x, y, lower, upper, itself = columns
    ax.plot(x, y, **{"ms": 3.5 if across.numeric else 5} | look)
    if known := int(np.isfinite(lower).sum()):
        draw_band(ax, x, lower, upper, look["color"], across.numeric and known > 1)
    if np.isfinite(itself).any():
        of_itself = ITSELF_STYLE if across.numeric else {"ls": ""}
        ax.plot(x, itself, marker="D", mfc="w", ms=4, color=look["color"], **of_itself)


def _finish(ax: Axes, drawn: _Drawn, across: Parameter) -> None:
    """Scales, ticks and labels of a panel of lines."""
    shown = drawn.unit(np.array([drawn.values, *drawn.bands]))
    shown = shown[np.isfinite(shown)]
    set_parameter_axis(ax.xaxis, across)
    low, high = (shown.min(), shown.max()) if shown.size else (0.0, 1.0)
    logarithmic = low > 0 and high >= (10 if ax.get_xscale() == "log" else 100) * low
    if logarithmic:
        ax.set_yscale("log")
        ax.set_ylim(low / 1.4, high * 1.4)
    else:
        bottom, top = min(low, 0.0), max(high, 0.0)
        span = (top - bottom) or 1.0
        ax.set_ylim(bottom - (0.05 * span if bottom < 0 else 0.0), top + 0.1 * span)
    readable_ticks(ax.yaxis, *ax.get_ylim(), logarithmic)
    ax.set_ylabel(drawn.label)
    ax.grid(color="0.9", lw=0.5)


# -------------------------------------------------------------------------------------------------------- maps


def _draw_maps(drawn: _Drawn, across: Parameter, up: Parameter) -> Figure:
    """Two parameters: a panel for each time, in it a cell for each combination."""
    cases = drawn.cases
    if len(set(zip(across.places, up.places, strict=True))) < len(cases.members):
        more = ", ".join(one.key for one in cases.parameters if one not in (across, up))
        raise InputError(f"several cases lie in one cell of the map: choose among {more} first, or use kind='lines'")
    shown = drawn.unit(drawn.values)
    known = shown[np.isfinite(shown)]
    low, high = (known.min(), known.max()) if known.size else (0.0, 1.0)
    logarithmic = low > 0 and high >= 30 * low
    norm = LogNorm(low, high) if logarithmic else Normalize(low, high if high > low else low + 1)
    figure = style.new_figure(1.4 + 2.6 * len(shown), 2.9)
    panels = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    look: dict[str, Any] = {"cmap": matplotlib.colormaps["viridis"].with_extremes(bad=style.ABSENT), "norm": norm}
    for ax, row in zip(panels, shown, strict=True):
        cells = np.full((len(up.levels), len(across.levels)), np.nan)
        cells[up.places, across.places] = row
        mesh = ax.pcolormesh(_borders_between(across), _borders_between(up), np.ma.masked_invalid(cells), **look)
        set_parameter_axis(ax.xaxis, across)
        set_parameter_axis(ax.yaxis, up)
        ax.tick_params(direction="out", which="both")
        ax.label_outer(remove_inner_ticks=False)
        ax.set_xlabel(across.label)
    bar = figure.colorbar(mesh, ax=list(panels), pad=0.02, aspect=22)
    bar.set_label(drawn.label)
    bar.outline.set_linewidth(0.6)
    bar.minorticks_off()
    readable_ticks(bar.ax.yaxis, *mesh.get_clim(), logarithmic)
    style.letter_panels(panels, drawn.titles)
    return figure


def positions(parameter: Parameter) -> np.ndarray:
    """Where the levels of a parameter lie on its axis; an infinite one a step beyond the others."""
    if not parameter.numeric:
        return np.arange(len(parameter.levels), dtype=float)
    places = parameter.unit(parameter.levels)
    if parameter.endless:
        last, before = places[-2], places[-3] if len(places) > 2 else places[-2] / 2
        places[-1] = last * last / before if before > 0 else math.inf
        if not even_in_log(places):
            places[-1] = 2 * last - before
    return places


def _borders_between(parameter: Parameter) -> np.ndarray:
    """Borders between the cells of a map, half way between the levels on the scale of the axis."""
    places = positions(parameter)
    logarithmic = parameter.numeric and even_in_log(places)
    places = np.log(places) if logarithmic else places
    middle = (places[1:] + places[:-1]) / 2
    borders = np.concatenate([[2 * places[0] - middle[0]], middle, [2 * places[-1] - middle[-1]]])
    return np.exp(borders) if logarithmic else borders


def set_parameter_axis(axis: Axis, parameter: Parameter) -> None:
    """Scale, limits, ticks and label of an axis of a parameter."""
    places, count = positions(parameter), len(parameter.levels)
    horizontal = axis.axis_name == "x"
    logarithmic = parameter.numeric and even_in_log(places)
    set_limits = axis.axes.set_xlim if horizontal else axis.axes.set_ylim
    if logarithmic:
        (axis.axes.set_xscale if horizontal else axis.axes.set_yscale)("log")
    borders = _borders_between(parameter)
    set_limits(borders[0], borders[-1])
    if parameter.numeric:
        scaled = np.log(places) if logarithmic else places
        if parameter.endless or (count <= 6 and np.diff(scaled).min() > 0.11 * np.ptp(scaled)):
            beyond = places[-1] if parameter.endless else math.inf
            step = -(-count // 6)
            axis.set_major_locator(FixedLocator(places[(count - 1) % step :: step]))
            axis.set_major_formatter(lambda value, _: ENDLESS if value == beyond else f"{value:.4g}")
            axis.set_minor_locator(FixedLocator([]))
            axis.set_minor_formatter(NullFormatter())
        else:
            readable_ticks(axis, places[0], places[-1], logarithmic)
    else:
        step = -(-count // 25)
        texts = parameter.texts()[::step]
        axis.set_ticks(places[::step], labels=texts)
        if horizontal and sum(map(len, texts)) > 34:
            for label in axis.get_ticklabels():
                label.set(rotation=30 if len(texts) <= 6 else 90, ha="right", rotation_mode="anchor")
                label.set_va("top" if len(texts) <= 6 else "center")
        axis.axes.tick_params(axis=axis.axis_name, length=0)
    axis.set_label_text(parameter.label)
