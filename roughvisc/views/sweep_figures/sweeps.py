"""Figures of sweeps: a quantity against what was varied, as lines or as a map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import Any, Literal

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from roughvisc.errors import InputError
from roughvisc.units import Quantity, quantities
from roughvisc.variables import NOT_CONVERGED
from roughvisc.views.figures import style
from roughvisc.views.figures.rows import RowAxis, frame_at, rows_of, spread_frames
from roughvisc.views.sweep_figures.cases import (
    Cases,
    Parameter,
    cases_of,
    combined,
    label_of,
    quantity_unit,
    without_zeros,
)
from roughvisc.views.sweep_figures.colouring import Colouring, readable_ticks
from roughvisc.views.sweep_figures.ensembles import ITSELF_STYLE, Band, band_handles, draw_band
from roughvisc.views.sweep_figures.maps import draw_maps, positions, set_parameter_axis

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
    """A quantity against what was varied in a sweep: lines, or a map of two parameters.

    Numbers lie on linear axes, or on logarithmic ones where they span decades; anything else, such as materials,
    files and seeds, makes categories. Points that did not converge are crossed out. Of realisations the mean is drawn,
    the band in which 95 % of patches lie and, of a scan, the scan itself; a map has the mean.

    Parameters
    ----------
    results : xarray.Dataset or xarray.DataTree
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
    values = _at_frames(cases.members, quantity, frames)
    bands = [_at_frames([None if b is None else end(b) for b in cases.bands], quantity, frames) for end in _ENDS]
    titles = _titles(cases, frames)
    if times is None and len(frames) == 1 and not _all_last(cases, frames[0]):
        titles = [f"{titles[0]}, where the cases differ most"]
    if as_map:
        return draw_maps(cases, across[:2], quantity, values, titles)
    if len(cases.parameters) == 1:
        return _lines_by_time(cases, across[0], quantity, values, bands, titles, frames)
    return _families(cases, across[0], quantity, values, bands, titles, frames)


# ------------------------------------------------------------------------------------------------ what is drawn

#: Both ends of a band, and the measured surface itself.
_ENDS: tuple[Callable[[Band], xr.Dataset | None], ...] = (
    attrgetter("lower"),
    attrgetter("upper"),
    attrgetter("itself"),
)


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
        asked = np.atleast_1d(np.asarray(times, dtype=float)).ravel()
        if not 0 < asked.size <= _MOST_PANELS:
            raise InputError(f"{asked.size} times to draw: choose 1 to {_MOST_PANELS}")
        return [[frame_at(clock, float(time)) for clock in clocks] for time in asked]
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


def _failed(cases: Cases, frames: list[int]) -> np.ndarray:
    pairs = zip(cases.members, frames, strict=True)
    return np.array(["status" in m and int(m["status"][f]) == NOT_CONVERGED for m, f in pairs])


# ------------------------------------------------------------------------------------------------------- lines


def _lines_by_time(
    cases: Cases,
    across: Parameter,
    quantity: str,
    values: np.ndarray,
    bands: list[np.ndarray],
    titles: list[str],
    frames: list[list[int]],
) -> Figure:
    """One parameter: a line for each time."""
    figure = style.new_figure(4.2, 3.2)
    ax = figure.add_subplot()
    unit = quantity_unit(cases, quantity, values)
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.8, len(values)))
    for number, (row, colour, title, frame) in enumerate(zip(values, shades, titles, frames, strict=True)):
        members = np.arange(len(row))
        ends = [unit(one[number]) for one in bands]
        _draw_line(ax, across, members, unit(row), _failed(cases, frame), ends, color=colour, label=title)
    _finish(ax, cases, across, quantity, np.array([values, *bands]))
    named = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    style.legend_above(figure, named | {str(one.get_label()): one for one in band_handles(cases.bands)})
    return figure


def _families(
    cases: Cases,
    across: Parameter,
    quantity: str,
    values: np.ndarray,
    bands: list[np.ndarray],
    titles: list[str],
    frames: list[list[int]],
) -> Figure:
    """Several parameters: a panel for each time, in it a line for each combination of the others."""
    family = combined([one for one in cases.parameters if one.key != across.key])
    colouring = Colouring(family)
    figure = style.new_figure(1.2 + 3.0 * len(values), 3.2 + 0.14 * len(colouring.handles()) / (1 + len(values)))
    axes = figure.subplots(1, len(values), sharey=True, squeeze=False)[0]
    unit = quantity_unit(cases, quantity, values)
    crossed = False
    for number, (ax, row, frame) in enumerate(zip(axes, values, frames, strict=True)):
        failed = _failed(cases, frame)
        crossed |= bool(failed.any())
        for level in range(len(family.levels)):
            members = np.flatnonzero(family.places == level)
            nested = 1 - 0.55 * level / max(1, len(family.levels) - 1)  # so that none hides another that it lies on
            look = {"color": colouring.colour(level), "lw": 2.3 * nested, "ms": 7.0 * nested}
            ends = [unit(one[number][members]) for one in bands]
            _draw_line(ax, across, members, unit(row[members]), failed[members], ends, **look)
        _finish(ax, cases, across, quantity, np.array([values, *bands]))
        ax.label_outer(remove_inner_ticks=False)
        ax.set_xlabel(across.label)
    handles = [*colouring.handles(), *band_handles(cases.bands), *([_CROSS] if crossed else [])]
    style.legend_above(
        figure, {str(one.get_label()): one for one in handles}, family.name if colouring.handles() else ""
    )
    colouring.draw_bar(figure, list(axes))
    style.letter_panels(axes, titles)
    return figure


_CROSS = Line2D([], [], color="k", marker="x", ls="", ms=5, label="not converged")


def _draw_line(
    ax: Axes,
    across: Parameter,
    members: np.ndarray,
    shown: np.ndarray,
    failed: np.ndarray,
    ends: list[np.ndarray],
    **look,
) -> None:
    """A line over the parameter, and its band; points of categories are not joined, nor that of an infinite value."""
    place = positions(across)[across.places[members]]
    order = np.argsort(place, kind="stable")
    few = len(members) <= 40
    look |= {"marker": "o" if few else "", "ls": "-" if across.numeric else ""}
    columns = [place[order], *(one[order] for one in (shown, *ends))]
    if across.endless:
        last = int(np.isfinite(across.values[members]).sum())
        columns = [np.insert(one, last, np.nan) for one in columns]
    x, y, lower, upper, itself = columns
    ax.plot(x, y, **{"ms": 3.5 if across.numeric else 5} | look)
    if known := int(np.isfinite(lower).sum()):
        draw_band(ax, x, lower, upper, look["color"], across.numeric and known > 1)
    if np.isfinite(itself).any():
        look = ITSELF_STYLE if across.numeric else {"ls": ""}
        ax.plot(x, itself, marker="D", mfc="w", ms=4, color=look["color"], **look)
    if failed.any():
        ax.plot(place[failed], shown[failed], "x", color="k", ms=5, mew=1.2, zorder=5, label=_CROSS.get_label())


def _finish(ax: Axes, cases: Cases, across: Parameter, quantity: str, values: np.ndarray) -> None:
    """Scales, ticks and labels of a panel of lines."""
    unit = quantity_unit(cases, quantity, values)
    shown = unit(values)
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
    ax.set_ylabel(label_of(cases, quantity, unit))
    ax.grid(color="0.9", lw=0.5)
