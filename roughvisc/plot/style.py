"""Look of all figures: fonts and colours, letters, legends and notes, linear and logarithmic axes."""

from __future__ import annotations

import string
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from roughvisc.errors import printable
from roughvisc.units import Unit, unit_for
from roughvisc.variables import AXES, VARIABLES

#: Print-ready: text at the size of a caption, thin lines, embedded fonts.
STYLE = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "figure.labelsize": 9,
    "figure.titlesize": 9,
    "grid.color": "0.9",
    "grid.linewidth": 0.5,
    "legend.fontsize": 8,
    "legend.title_fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.3,
    "lines.markersize": 3.5,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
}

#: Okabe and Ito's colours, distinguishable with all common kinds of colour vision.
BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY = "#0072b2", "#d55e00", "#009e73", "#e69f00", "#cc79a7", "#56b4e9"
CYCLE = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, "#000000", "0.5")
#: Contact in all figures; cells without contact on a map of the pressure; missing cells.
CONTACT, NO_CONTACT, MISSING = VERMILION, "#dceaf5", "0.72"
#: Mean width of a letter in a legend, and width of an entry without its text. [inch]
_LETTER, _ENTRY = 0.065, 0.5
#: Ratio of the largest to the smallest value from which an axis is logarithmic.
_DECADES = 30.0


def apply(draw):
    """Decorate a function to draw its figure in the package's style, independent of the user's settings."""
    return matplotlib.rc_context(STYLE)(draw)


def new_figure(width: float, height: float) -> Figure:
    """Return a figure of a size [inch], independent of windows and of matplotlib's global state."""
    return Figure(figsize=(width, height), layout="constrained")


def new_panels(count: int, columns: int, width: float, height: float, **options: Any) -> tuple[Figure, list[Axes]]:
    """Return a figure of a size [inch] and its panels, in rows of some columns; `options` as in ``Figure.subplots``."""
    figure = new_figure(width, height)
    axes = figure.subplots(-(-count // columns), columns, squeeze=False, **options).ravel()
    for unused in axes[count:]:
        unused.remove()
    return figure, list(axes[:count])


def label_outer(axes: Sequence[Axes], columns: int, *, along_y: bool = True) -> None:
    """Keep labels of the horizontal axis at the lowest panels, and `along_y` of the vertical axis at the left ones."""
    for number, ax in enumerate(axes):
        is_lowest = number + columns >= len(axes)
        ax.tick_params(labelbottom=is_lowest)
        ax.set_xlabel(ax.get_xlabel() if is_lowest else "")
        if along_y and number % columns:
            ax.tick_params(labelleft=False)
            ax.set_ylabel("")


def verbatim(text: str) -> str:
    """Return a user's text with its dollar signs escaped, since they would start a formula."""
    return printable(text).replace("$", r"\$")


def letter_panels(axes: Sequence[Axes], titles: Sequence[str] = ()) -> None:
    """Write (a), (b), ... and a title at the top left of the panels; a single panel has a title only."""
    for number, ax in enumerate(axes):
        letter = rf"$\mathbf{{({string.ascii_lowercase[number]})}}$  " if 1 < len(axes) <= 26 else ""
        ax.set_title(letter + (titles[number] if number < len(titles) else ""), loc="left")


def legend_above(figure: Figure, named: Mapping[str, Artist], title: str = "") -> None:
    """Draw a legend above all panels, in as many columns as fit into the figure."""
    if named:
        width = figure.get_figwidth() - 0.2
        longest = max(len(line) for label in named for line in label.split("\n"))
        columns = max(1, min(len(named), int(width / (_ENTRY + _LETTER * longest))))
        look: dict[str, Any] = {"ncols": columns, "handlelength": 1.5, "columnspacing": 1.2, "title": title or None}
        figure.legend(list(named.values()), list(named), loc="outside upper center", **look)


def named_in(*axes: Axes) -> dict[str, Artist]:
    """Return label -> artist of everything with a label in some panels."""
    return {label: one for ax in axes for one, label in zip(*ax.get_legend_handles_labels(), strict=True)}


def note_below(figure: Figure, note: str) -> None:
    """Write a note below all panels, in lines no longer than the figure is wide."""
    if note:
        figure.supxlabel("\n" + textwrap.fill(note, int(figure.get_figwidth() / _LETTER)), fontsize=8)


def is_logarithmic(values: Any) -> bool:
    """Return whether all values are positive and the largest is at least thirty times the smallest."""
    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values)]
    return bool(values.size and values.min() > 0 and values.max() >= _DECADES * values.min())


def log_axis(axis: Axis, values: Any) -> None:
    """Make one axis logarithmic; zeros have a place of their own at its lower end.

    Ticks have plain numbers if the positive values cover less than three decades.
    """
    values = np.asarray(values, dtype=float)
    positive = values[np.isfinite(values) & (values > 0)]
    set_scale = axis.axes.set_xscale if axis.axis_name == "x" else axis.axes.set_yscale
    low, high = (positive.min(), positive.max()) if positive.size else (1.0, 1.0)
    fine = (1.0, 2.0, 5.0) if high < 100 * low else (1.0,)
    if (values == 0).any():
        set_scale("symlog", linthresh=low, linscale=0.5)
        decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
        ticks = [one for one in np.outer(decades, fine).ravel() if 0.999 * low <= one <= 1.001 * high]
        axis.set_ticks([0.0, *ticks[:: -(-len(ticks) // 5) or 1]])
        axis.set_view_interval(-0.3 * low, 1.3 * high, ignore=True)
        axis.axes.autoscale(axis=axis.axis_name, enable=False)
    else:
        set_scale("log")
        if high < 1000 * low:
            axis.set_major_locator(LogLocator(subs=fine, numticks=20))
    if high < 1000 * low:
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def value_axis(ax: Axes, *values: Any) -> None:
    """Scale the vertical axis for some values: logarithmic if they span decades, else linear and with zero."""
    shown = np.concatenate([np.ravel(np.asarray(one, dtype=float)) for one in values])
    shown = shown[np.isfinite(shown)]
    if is_logarithmic(shown):
        log_axis(ax.yaxis, shown)
    elif shown.size:
        low, high = min(shown.min(), 0.0), max(shown.max(), 0.0)
        span = (high - low) or 1.0
        ax.set_ylim(low - 0.04 * span, high + 0.12 * span)
    ax.grid()


def described(variable: xr.DataArray) -> tuple[str, str]:
    """Return the label and the SI unit of a variable, as declared or from its attributes."""
    if declared := VARIABLES.get(str(variable.name)):
        return declared.label, declared.units
    name = str(variable.attrs.get("long_name", str(variable.name).replace("_", " ")))
    return name[:1].upper() + name[1:], str(variable.attrs.get("units", ""))


def row_unit(rows: xr.DataArray) -> Unit:
    """Return the unit of the times, speeds or distances of some rows, without prefix on a logarithmic axis."""
    _, unit = described(rows)
    return Unit(1.0, unit) if _spreads(rows.values) else unit_for(rows.values, unit)


def row_axis(ax: Axes, rows: xr.DataArray) -> None:
    """Scale and label the horizontal axis of times, speeds or distances; a logarithmic axis can show zero."""
    if _spreads(rows.values) or str(rows.name).endswith("speed"):
        log_axis(ax.xaxis, row_unit(rows)(rows))
    ax.set_xlabel(row_unit(rows).label(described(rows)[0]))


def _spreads(places: np.ndarray) -> bool:
    """Return whether most of some non-negative places lie in the first thirtieth of their axis."""
    known = places[np.isfinite(places)]
    return bool(known.size > 3 and known.min() >= 0 and 0 < np.median(known) < known.max() / _DECADES)


def row_text(rows: xr.DataArray, number: int) -> str:
    """Return the time, speed or distance of a row as a title, such as ``t = 50 ms``."""
    return AXES[str(rows.name)].place(float(rows[number]), 3)
