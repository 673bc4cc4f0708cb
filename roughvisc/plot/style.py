"""Look of all figures: fonts, colours, panels of fixed size, legends, linear and logarithmic axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator
from matplotlib.transforms import Bbox

from roughvisc.errors import printable
from roughvisc.units import Unit, unit_for
from roughvisc.variables import VARIABLES

#: Style sheet of all figures.
STYLE = matplotlib.rc_params_from_file(Path(__file__).with_name("roughvisc.mplstyle"), use_default_template=False)
#: Main colours of its cycle: distinguishable with all common kinds of colour vision.
BLUE = "#0072b2"
VERMILION = "#d55e00"
GREEN = "#009e73"
#: Contact in all figures; cells without contact on a map of the pressure; missing cells.
CONTACT = VERMILION
NO_CONTACT = "#dceaf5"
MISSING = "0.72"
#: Line around the contact on maps.
OUTLINE = "#1d2328"
#: Mean width of a letter of 8 points, and height of a line of text. [inch]
LETTER = 0.066
_LINE = 0.16
#: Markers and dashes that distinguish lines without colours.
_MARKERS = "os^DvPX*"
_DASHES = ("-", (0, (5, 1.5)), (0, (6, 1.5, 1, 1.5)), (0, (1.5, 1.2)))
#: Width of a colour bar with its labels. [inch]
BAR = 1.0
#: Ratio of the largest to the smallest value from which an axis is logarithmic.
_DECADES = 30.0


#: Decorator of a function that draws a figure, in the package's style and independent of the user's settings.
apply = matplotlib.rc_context(STYLE)


def new_panels(
    count: int,
    columns: int,
    size: tuple[float, float],
    *,
    shared: str = "",
    lines: int = 1,
    projection: str | None = None,
    **room: float,
) -> tuple[Figure, list[Axes]]:
    """Return a figure, independent of windows and of matplotlib's global state, and its panels in rows of some columns.

    Sizes of panels and margins are fixed, because a layout that measures every text takes longer than the drawing.

    Parameters
    ----------
    count, columns : int
        Numbers of panels and of columns.
    size : tuple of float
        Width and height of a panel without labels. [inch]
    shared : str
        Axes that all panels share: ``"x"``, ``"y"`` or ``"xy"``; only the outer panels have their labels.
    lines : int
        Number of lines of the titles of the panels.
    projection : str, optional
        Kind of axes of matplotlib, such as ``"polar"``. Default: rectangular.
    **room : float
        Margins ``left``, ``right`` and ``bottom`` of the panels, and ``between`` two columns. [inch]
    """
    width, height = size
    rows = -(-count // columns)
    title = 0.15 + _LINE * lines
    left = room.get("left", 0.75)
    right = room.get("right", 0.2)
    bottom = room.get("bottom", 0.5)
    across = room.get("between", 0.2 if "y" in shared else left)
    up = title + (0.0 if "x" in shared else bottom)
    wide = left + columns * width + (columns - 1) * across + right
    high = bottom + rows * height + (rows - 1) * up + title
    figure = Figure(figsize=(wide, high))
    grid = figure.subplots(
        rows, columns, sharex="x" in shared, sharey="y" in shared, squeeze=False, subplot_kw={"projection": projection}
    )
    figure.subplots_adjust(left / wide, bottom / high, 1 - right / wide, 1 - title / high, across / width, up / height)
    for unused in grid.flat[count:]:
        unused.remove()
    axes = list(grid.flat[:count])
    for ax in axes[-columns:]:  # also above an empty place
        ax.tick_params(labelbottom=True)
    return figure, axes


def distinct(count: int) -> list[dict[str, Any]]:
    """Return looks of some lines that differ in marker, dash and width, besides their colour.

    Later lines are thinner, so that lines with equal values stay visible. Many lines differ in colour alone.
    """
    if not 1 < count <= len(_MARKERS):
        return [{"marker": "o" if count == 1 else "", "ls": "-"} for _ in range(count)]
    looks = []
    for i, marker in enumerate(_MARKERS[:count]):
        left = 1 - i / (count - 1)
        width = 1.2 + 0.9 * left
        size = 3.2 + 2.0 * left
        face = {} if i % 2 == 0 else {"mfc": "w"}
        looks.append({"marker": marker, "ls": _DASHES[i % len(_DASHES)], "lw": width, "ms": size, **face})
    return looks


def letter(axes: Sequence[Axes]) -> None:
    """Name several panels by letters at their upper right corners."""
    for name, ax in zip("abcdefghijklmnop", axes if len(axes) > 1 else (), strict=False):
        ax.set_title(name, loc="right", fontweight="bold")


def label_panels(axes: Sequence[Axes], x: str = "", y: str = "") -> None:
    """Label the horizontal axes, the vertical axes, or both, of the panels that show their numbers."""
    for ax in axes:
        if x and ax.xaxis.get_tick_params()["labelbottom"]:
            ax.set_xlabel(x)
        if y and ax.yaxis.get_tick_params()["labelleft"]:
            ax.set_ylabel(y)


def colour_bar(mappable: Any, axes: Sequence[Axes], label: str, **options: Any) -> None:
    """Draw a colour bar at the right of some panels, in the margin of the figure."""
    figure = axes[0].figure
    box = Bbox.union([ax.get_position() for ax in axes])
    inch = 1 / figure.get_figwidth()
    bar = figure.add_axes((box.x1 + 0.14 * inch, box.y0, 0.1 * inch, box.height))
    figure.colorbar(mappable, cax=bar, **options).set_label(label)


def legend_above(figure: Figure, named: Mapping[str, Artist], title: str = "") -> None:
    """Draw a legend above all panels, in as many columns as fit; the figure grows, and the panels keep their sizes."""
    if not named:
        return
    width, height = figure.get_size_inches()
    columns = max(1, min(len(named), int(width / (0.5 + LETTER * max(map(len, named))))))
    whole = height + 0.08 + 0.19 * (-(-len(named) // columns) + bool(title))
    for ax in figure.axes:
        x, y, side, up = ax.get_position(original=True).bounds
        ax.set_position((x, y * height / whole, side, up * height / whole))
    figure.set_size_inches(width, whole)
    look: dict[str, Any] = {"ncols": columns, "title": title or None, "borderaxespad": 0.2}
    figure.legend(named.values(), named.keys(), loc="upper center", bbox_to_anchor=(0.5, 1.0), **look)


def verbatim(text: str) -> str:
    """Return a user's text with its dollar signs escaped, since they would start a formula."""
    return printable(text).replace("$", r"\$")


def named_in(*axes: Axes) -> dict[str, Artist]:
    """Return label -> artist of everything with a label in some panels."""
    return {label: one for ax in axes for one, label in zip(*ax.get_legend_handles_labels(), strict=True)}


def is_logarithmic(values: Any) -> bool:
    """Return whether all values are positive and the largest is at least thirty times the smallest."""
    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values)]
    return bool(values.size and values.min() > 0 and values.max() >= _DECADES * values.min())


def is_uneven(values: Any) -> bool:
    """Return whether most values lie in the first thirtieth of their range, which begins at zero or above."""
    known = np.asarray(values, dtype=float)
    known = known[np.isfinite(known)]
    return bool(known.size > 3 and known.min() >= 0 and 0 < np.median(known) < known.max() / _DECADES)


def log_axis(axis: Axis, values: Any) -> None:
    """Make one axis logarithmic; zeros have a place of their own at its lower end.

    Ticks have plain numbers if the positive values cover less than three decades.
    """
    values = np.asarray(values, dtype=float)
    positive = values[np.isfinite(values) & (values > 0)]
    low, high = (positive.min(), positive.max()) if positive.size else (1.0, 1.0)
    set_scale = getattr(axis.axes, f"set_{axis.axis_name}scale")
    if (values == 0).any():
        set_scale("symlog", linthresh=10.0 ** np.floor(np.log10(low)))
        axis.get_major_locator().set_params(numticks=6 if axis.axis_name == "x" else 4)
    else:
        set_scale("log")
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 100 * low else (1,), numticks=8))
    if high < 1000 * low:
        axis.set_major_formatter("{x:g}")
    decades = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    between = np.arange(1, 10) if decades.size <= 6 else np.ones(1)
    axis.set_minor_locator(FixedLocator((10.0 ** decades[:, None] * between).ravel()))
    axis.set_minor_formatter("")


def value_axis(ax: Axes, values: Any, unit: Unit, *, may_vanish: bool = False) -> None:
    """Scale the vertical axis for some values: logarithmic if they have a unit and span decades, else with zero.

    Values that may vanish, such as a leak rate, have a place for zero on a logarithmic axis.
    """
    values = np.asarray(values, dtype=float)
    if unit.symbol and is_logarithmic(values[values > 0] if may_vanish else values):
        log_axis(ax.yaxis, values)
        if may_vanish and (values == 0).any():
            ax.text(0.02, 0.0, "0: no leak", transform=ax.get_yaxis_transform(), va="bottom", fontsize=7)
    else:
        ax.update_datalim([(0.0, 0.0)], updatex=False)
        ax.autoscale_view(scalex=False)


def title_of(dataset: xr.Dataset, case: Mapping[str, Any], number: int) -> str:
    """Return the title of a result: the one of its study, or else its program, or else its number."""
    program = str(dataset.attrs.get("program", ""))
    title = case.get("title") or dataset.attrs.get("title") or program[:1].upper() + program[1:]
    return str(title or f"case {number}")


def described(variable: xr.DataArray) -> tuple[str, str]:
    """Return the label and the SI unit of a variable, as declared or from its attributes."""
    if declared := VARIABLES.get(str(variable.name)):
        return declared.label, declared.units
    return str(variable.attrs.get("long_name", variable.name)), str(variable.attrs.get("units", ""))


def middle_unit(values: Any, si: str) -> Unit:
    """Return the unit that suits the middle of some values: the geometric one, if they span decades."""
    return unit_for(np.sqrt(np.min(values) * np.max(values)) if is_logarithmic(values) else values, si)


def row_axis(axes: Sequence[Axes], rows: xr.DataArray) -> Unit:
    """Scale and label the horizontal axis of times, speeds or distances, and return its unit.

    The axis is logarithmic, without prefix of the unit, if most rows lie in its first thirtieth; it can show zero.
    """
    label, si = described(rows)
    known = rows.values[np.isfinite(rows.values)]
    unit = Unit(1.0, si) if is_uneven(known) else unit_for(known, si)
    if is_uneven(known) or str(rows.name).endswith("speed"):
        log_axis(axes[0].xaxis, unit(known))
    label_panels(axes, unit.label(label))
    return unit
