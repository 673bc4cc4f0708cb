"""Look of all figures: fonts, colours, panels of fixed size, legends, linear and logarithmic axes."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from string import ascii_lowercase
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from roughvisc.errors import printable
from roughvisc.units import Unit, unit_for
from roughvisc.variables import AXES, VARIABLES

#: Print-ready: text at the size of a caption, thin lines, embedded fonts.
STYLE = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titley": 1.0,  # a fixed place saves the measurement of all labels
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
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
#: Mean width of a letter of 8 points, height of a line of text, and width of a colour bar with its labels. [inch]
LETTER, _LINE, _BAR = 0.066, 0.16, 0.9
#: Ratio of the largest to the smallest value from which an axis is logarithmic.
_DECADES = 30.0


def apply(draw):
    """Decorate a function to draw its figure in the package's style, independent of the user's settings."""
    return matplotlib.rc_context(STYLE)(draw)


def new_panels(
    count: int,
    columns: int,
    width: float,
    height: float,
    *,
    shared: str = "",
    left: float = 0.75,
    bottom: float = 0.5,
    between: float | None = None,
    lines: int = 1,
) -> tuple[Figure, list[Axes]]:
    """Return a figure, independent of windows and of matplotlib's global state, and its panels in rows of some columns.

    Sizes of panels and margins are fixed, because a layout that measures every text takes longer than the drawing.

    Parameters
    ----------
    count, columns : int
        Numbers of panels and of columns.
    width, height : float
        Size of a panel without labels. [inch]
    shared : str
        Axes that all panels share: ``"x"``, ``"y"`` or ``"xy"``; only the outer panels have their labels.
    left, bottom : float
        Room for the labels of an axis. [inch]
    between : float, optional
        Distance of the columns. Default: room for the labels of the axis, if it has any. [inch]
    lines : int
        Number of lines of the titles of the panels.
    """
    rows, title, right = -(-count // columns), 0.15 + _LINE * lines, 0.2
    across = (0.2 if "y" in shared else left) if between is None else between
    up = title + (0.0 if "x" in shared else bottom)
    whole = left + columns * width + (columns - 1) * across + right, title + rows * height + (rows - 1) * up + bottom
    figure, axes = Figure(figsize=whole), []
    for number in range(count):
        row, column = divmod(number, columns)
        x, y = left + column * (width + across), bottom + (rows - 1 - row) * (height + up)
        place = (x / whole[0], y / whole[1], width / whole[0], height / whole[1])
        first = axes[0] if axes else None
        sharing = {f"share{axis}": first for axis in shared}
        axes.append(figure.add_axes(place, **sharing))
        axes[-1].tick_params(labelbottom="x" not in shared or number + columns >= count)
        axes[-1].tick_params(labelleft="y" not in shared or not column)
    return figure, axes


def label_panels(axes: Sequence[Axes], x: str, y: str = "") -> None:
    """Label the horizontal axes, and with a text the vertical axes, of the panels that show their numbers."""
    for ax in axes:
        if ax.xaxis.get_tick_params()["labelbottom"]:
            ax.set_xlabel(x)
        if y and ax.yaxis.get_tick_params()["labelleft"]:
            ax.set_ylabel(y)


def align(axes: Sequence[Axes], distance: float = 0.45) -> None:
    """Place the labels of the vertical axes at one distance [inch] from the panels."""
    for ax in axes:
        ax.yaxis.set_label_coords(-distance / (ax.get_position().width * ax.figure.get_figwidth()), 0.5)


def grow(figure: Figure, *, top: float = 0.0, right: float = 0.0) -> None:
    """Add room [inch] at the edges of a figure, whose panels keep their sizes."""
    width, height = figure.get_size_inches()
    for ax in figure.axes:
        x, y, side, up = ax.get_position(original=True).bounds
        wide, high = width / (width + right), height / (height + top)
        ax.set_position((x * wide, y * high, side * wide, up * high))
    figure.set_size_inches(width + right, height + top)


def colour_bar(mappable: ScalarMappable, axes: Sequence[Axes], label: str, **options: Any) -> None:
    """Draw a colour bar at the right of some panels; the figure grows if it has no room there."""
    figure = axes[0].figure
    right = max(ax.get_position().x1 for ax in axes) * figure.get_figwidth()
    grow(figure, right=max(right + _BAR - figure.get_figwidth(), 0.0))
    boxes, inch = [ax.get_position() for ax in axes], 1 / figure.get_figwidth()
    low, high = min(box.y0 for box in boxes), max(box.y1 for box in boxes)
    bar = figure.add_axes(((right + 0.1) * inch, low, 0.1 * inch, high - low))
    figure.colorbar(mappable, cax=bar, **options).set_label(label)


def text_above(figure: Figure, text: str) -> None:
    """Write a text above everything else in a figure."""
    lines = textwrap.wrap(text, int(figure.get_figwidth() / (1.2 * LETTER)))
    grow(figure, top=0.05 + _LINE * len(lines))
    figure.text(0.5, 1 - 0.05 / figure.get_figheight(), verbatim("\n".join(lines)), ha="center", va="top")


def legend_above(figure: Figure, named: Mapping[str, Artist], title: str = "") -> None:
    """Draw a legend above all panels, in as many columns as fit into the figure."""
    if not named:
        return
    width, height = figure.get_size_inches()
    columns = max(1, min(len(named), int(width / (0.5 + LETTER * max(map(len, named))))))
    grow(figure, top=0.08 + 0.19 * (-(-len(named) // columns) + bool(title)))
    look: dict[str, Any] = {"ncols": columns, "handlelength": 1.5, "columnspacing": 1.2, "title": title or None}
    place = {"loc": "lower center", "bbox_to_anchor": (width / 2, height), "bbox_transform": figure.dpi_scale_trans}
    figure.legend(list(named.values()), list(named), borderaxespad=0.2, **place, **look)


def verbatim(text: str) -> str:
    """Return a user's text with its dollar signs escaped, since they would start a formula."""
    return printable(text).replace("$", r"\$")


def letter_panels(axes: Sequence[Axes], titles: Sequence[str] = ()) -> None:
    """Write (a), (b), ... and a title at the top left of the panels; a single panel has a title only."""
    for number, ax in enumerate(axes):
        letter = f"({ascii_lowercase[number]})  " if 1 < len(axes) <= 26 else ""
        ax.set_title(letter + (titles[number] if number < len(titles) else ""), loc="left")


def named_in(*axes: Axes) -> dict[str, Artist]:
    """Return label -> artist of everything with a label in some panels."""
    return {label: one for ax in axes for one, label in zip(*ax.get_legend_handles_labels(), strict=True)}


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
        set_limits = axis.axes.set_xlim if axis.axis_name == "x" else axis.axes.set_ylim
        set_limits(-0.3 * low, 1.3 * high)
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


def row_axis(axes: Sequence[Axes], rows: xr.DataArray) -> None:
    """Scale and label the shared horizontal axis of times, speeds or distances; a logarithmic axis can show zero."""
    if _spreads(rows.values) or str(rows.name).endswith("speed"):
        log_axis(axes[0].xaxis, row_unit(rows)(rows))
    label_panels(axes, row_unit(rows).label(described(rows)[0]))


def _spreads(places: np.ndarray) -> bool:
    """Return whether most of some non-negative places lie in the first thirtieth of their axis."""
    known = places[np.isfinite(places)]
    return bool(known.size > 3 and known.min() >= 0 and 0 < np.median(known) < known.max() / _DECADES)


def row_text(rows: xr.DataArray, number: int) -> str:
    """Return the time, speed or distance of a row as a title, such as ``t = 50 ms``."""
    return AXES[str(rows.name)].place(float(rows[number]), 3)
