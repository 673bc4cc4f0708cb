"""Axes of all figures: units and prefixes, fonts, colours, choice of time axis and frames.

The package computes in SI; figures show readable prefixes (µm, MPa, ms). A :class:`Unit` is chosen from the data of
one axis and then used for every artist on it.
"""

from __future__ import annotations

import math
import string
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike

from roughvisc.errors import InputError, printable
from roughvisc.labels import expect_declared_units, expect_history
from roughvisc.units import Unit, unit_for
from roughvisc.variables import OTHER_DIMS
from roughvisc.variables.axes import AXES, axis_of

#: Print-ready: sans serif at the size of a caption, thin lines, ticks inwards, embedded fonts.
STYLE = {
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "legend.fontsize": 8,
    "legend.title_fontsize": 8,
    "figure.labelsize": 9,
    "legend.frameon": False,
    "lines.linewidth": 1.3,
    "lines.markersize": 3.5,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "savefig.dpi": 200,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
}

#: Okabe and Ito's colours: told apart by all common kinds of colour vision, and in grey.
BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY = "#0072b2", "#d55e00", "#009e73", "#e69f00", "#cc79a7", "#56b4e9"
CYCLE = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, "#000000")
#: Contact in all figures, as lines and as areas; cells out of contact on a map of what is in contact alone; cells where
#: the profile is missing.
CONTACT, NO_CONTACT, ABSENT = VERMILION, "#dceaf5", "0.72"
#: Size of notes in a figure. [point]
SMALL = 8.0
#: Mean width of a letter of a legend [inch], and what an entry takes beside its text.
_LETTER, _ENTRY = 0.062, 0.46
#: Mean width of a letter of an axis' label. [inch]
_LABEL_LETTER = 0.073


def styled(draw):
    """Decorator: draw a figure in the package's style, whatever the reader's own settings are."""
    return matplotlib.rc_context(STYLE)(draw)


def new_figure(width: float, height: float, layout: str = "constrained") -> Figure:
    """Figure of a size [inch] that belongs to no window and to no global state."""
    return Figure(figsize=(width, height), layout=layout)


def letter_panels(axes: Sequence[Axes], titles: Sequence[str] = ()) -> None:
    """Write (a), (b), ... at the top left of the panels, and a title behind the letter; one panel needs no letter."""
    for number, ax in enumerate(axes):
        title = titles[number] if number < len(titles) else ""
        letter = rf"$\mathbf{{({string.ascii_lowercase[number]})}}$" if 1 < len(axes) <= 26 else ""
        ax.set_title("  ".join(filter(None, (letter, title))), loc="left")


def _columns(labels: Sequence[str], width: float) -> int:
    """As many columns of a legend as a width [inch] has room for: it is filled column by column."""
    sizes = [_ENTRY + _LETTER * max(map(len, label.split("\n"))) for label in labels]
    for count in range(len(sizes), 1, -1):
        if sum(float(max(part)) for part in np.array_split(sizes, count)) <= width:
            return count
    return 1


def legend_above(figure: Figure, named: Mapping[str, Artist], title: str = "") -> None:
    """Legend above all panels, in as many columns as the figure has room for; long entries are broken."""
    if not named:
        return
    width = figure.get_figwidth() - 0.3
    labels = [textwrap.fill(label, max(16, int((width - _ENTRY) / _LETTER))) for label in named]
    look: dict[str, Any] = {"ncols": _columns(labels, width), "handlelength": 1.5, "columnspacing": 1.2}
    legend = figure.legend(list(named.values()), labels, loc="outside upper center", **look)
    legend.set_title(title or None)


def legend_over(ax: Axes, width: float) -> None:
    """Legend of a panel of about that width [inch], above it and beside its letter; none where nothing is named."""
    handles, labels = ax.get_legend_handles_labels()
    if not labels:
        return
    look: dict[str, Any] = {"borderaxespad": 0.1, "handlelength": 1.4, "columnspacing": 1.0, "handletextpad": 0.5}
    look["ncols"] = _columns(labels, width - 0.2)
    ax.legend(handles, labels, loc="lower right", bbox_to_anchor=(1.0, 1.0), **look)


def broken(label: str, room: float) -> str:
    """Label of an axis of about that length [inch]: its unit, or last word, in a second line where it is longer."""
    return "\n".join(label.rsplit(" ", 1)) if len(label) * _LABEL_LETTER > room else label


def note_below(figure: Figure, *notes: str) -> None:
    """What a reader has to know besides, below all panels, in lines that are no longer than the figure is wide."""
    width = int((figure.get_figwidth() - 0.2) / _LETTER)
    if lines := [line for note in notes if note for line in textwrap.wrap(note, width)]:
        figure.supxlabel("\n".join(lines), fontsize=SMALL)


def say_inside(ax: Axes, text: str) -> None:
    """Text in the middle of a panel that has nothing to show."""
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color="0.4")


# --------------------------------------------------------------------------------------------------------- time


def spans_decades(values) -> bool:
    """Whether increasing values lie more evenly on a logarithmic than on a linear axis, over two decades or more."""
    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values) & (values > 0)]
    if len(values) < 4 or values[-1] < 100 * values[0]:
        return False

    def unevenness(shown):
        return np.max(np.abs((shown - shown[0]) / (shown[-1] - shown[0]) - np.linspace(0, 1, len(shown))))

    return bool(unevenness(np.log(values)) < 0.7 * unevenness(values))


def rows_of(dataset: xr.Dataset | xr.DataArray) -> xr.DataArray:
    """The coordinate that the rows of a result, or of a history, lie over."""
    return dataset[axis_of(dataset.variables if isinstance(dataset, xr.Dataset) else dataset.dims)]


def at_rows(dataset: xr.Dataset | xr.DataArray, numbers) -> Any:
    """Some rows of a result, or of a field, or one of them."""
    known = dataset.variables if isinstance(dataset, xr.Dataset) else dataset.dims
    return dataset.isel({axis_of(known): numbers})


@dataclass(frozen=True)
class RowAxis:
    """How the places of rows are shown: their unit, and a linear or a logarithmic scale chosen by the data."""

    unit: Unit
    logarithmic: bool
    first: float
    label: str = "Time"
    symbol: str = "t"

    @classmethod
    def of(cls, rows: xr.DataArray | ArrayLike, name: str = "") -> RowAxis:
        """Axis for increasing places on the axis of a name; by default that of the coordinate given, or times [s]."""
        name = name or getattr(rows, "name", "time")
        name = name if name in AXES else "time"
        known = AXES[name].variables[name]
        places = np.sort(np.asarray(rows, dtype=float).ravel())
        positive = places[places > 0]
        label = "Time" if name == "time" else known.label
        symbol = AXES[name].symbol
        if spans_decades(places):
            return cls(Unit(1.0, known.units), True, float(positive[0]), label, symbol)
        return cls(unit_for(places, known.units), False, float(positive[0]) if len(positive) else 1.0, label, symbol)

    def text(self, place: float) -> str:
        """A place as read in running text, in the unit of the axis, such as ``"t = 50 ms"``."""
        return f"{self.symbol} = {self.unit.text(float(place), 3)}"

    def apply(self, ax: Axes, times, most: int = 7) -> None:
        """Set scale, limits, label and at most so many decades of the axis; zero keeps its place on a log one."""
        times = self.unit(times)
        if self.logarithmic:
            zero = times[0] <= 0
            if zero:
                decades = math.log10(times[-1] / self.first)
                ax.set_xscale("symlog", linthresh=self.first, linscale=max(0.8, 0.09 * decades))
                ax.set_xlim(-0.15 * self.first, 1.2 * times[-1])
            else:
                ax.set_xscale("log")
                ax.set_xlim(times[0] / 1.2, 1.2 * times[-1])
            low, high = math.ceil(math.log10(self.first) - 1e-9), math.floor(math.log10(times[-1]) + 1e-9)
            labelled = 10.0 ** np.arange(low, high + 1, -(-(high - low + 1) // most))
            fine = np.outer(10.0 ** np.arange(low - 1, high + 1), np.arange(1, 10)).ravel()
            ax.xaxis.set_major_locator(FixedLocator([0.0, *labelled] if zero else labelled))
            ax.xaxis.set_minor_locator(FixedLocator(fine[(fine >= self.first) & (fine <= times[-1])]))
        elif len(times) > 1:
            margin = 0.02 * (times[-1] - times[0])
            ax.set_xlim(times[0] - margin, times[-1] + margin)
            ax.xaxis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
        else:
            ax.set_xticks(times, [f"{times[0]:.4g}"])
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set_xlabel(self.unit.label(self.label))


def spread_axis(axis: Axis, shown, always: bool = False) -> None:
    """Make one axis logarithmic where the values on it span a decade or more, or always, with readable ticks."""
    shown = np.asarray(shown, dtype=float)
    shown = shown[np.isfinite(shown) & (shown > 0)]
    if not shown.size or (shown.max() < 10 * shown.min() and not always):
        return
    (axis.axes.set_xscale if axis.axis_name == "x" else axis.axes.set_yscale)("log")
    if shown.max() < (30 if axis.axis_name == "x" else 300) * shown.min():
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=99))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def row_text(place: xr.DataArray | float) -> str:
    """Place of a row, or a time [s], as read in running text, such as ``"t = 50 ms"``."""
    return AXES[str(getattr(place, "name", "time"))].place(float(place), 3)


def spread_frames(times, count: int) -> np.ndarray:
    """Indices of at most ``count`` kept times [s], even on the axis that suits them, first and last included."""
    times = np.asarray(times, dtype=float)
    if len(times) <= count:
        return np.arange(len(times))
    if count == 1:
        return np.array([len(times) - 1])
    place = times
    if spans_decades(times):
        first = times[times > 0][0]
        place = np.log(np.maximum(times, first / 2))
    wanted = np.linspace(place[0], place[-1], count)
    nearest = np.abs(place[:, None] - wanted).argmin(axis=0)
    return np.unique(nearest)


def telling_frames(dataset: xr.Dataset, count: int) -> list[int]:
    """Indices of at most ``count`` frames: even in time while there is contact, that of the largest area among them.

    Frames whose contact is below a thousandth of the largest show nothing; they are drawn only if there are no others.
    """
    rows = rows_of(dataset)
    frames = np.arange(rows.size)
    if "contact_area" in dataset:
        area = np.nan_to_num(dataset["contact_area"].values)
        if area.max() > 0:
            frames = frames[area > 1e-3 * area.max()]
    chosen = frames[spread_frames(rows.values[frames], count)]
    if "contact_area" in dataset and len(chosen) > 2 and len(chosen) < len(frames):
        largest = frames[area[frames].argmax()]
        if area[chosen].max() < 0.999 * area[largest]:
            inner = np.abs(chosen[1:-1] - largest).argmin() + 1
            chosen = np.sort(np.append(np.delete(chosen, inner), largest))
    return [int(frame) for frame in np.unique(chosen)]


def fullest_frame(dataset: xr.Dataset) -> int:
    """Index of the last frame whose contact area is the largest, or of the last frame where areas are unknown."""
    if "contact_area" not in dataset:
        return rows_of(dataset).size - 1
    area = np.nan_to_num(dataset["contact_area"].values)
    return int(np.flatnonzero(area >= 0.999 * area.max())[-1])


def frame_at(times, time: float) -> int:
    """Index of the kept time nearest to ``time`` [s]; a negative whole number counts frames from the end."""
    times = np.asarray(times, dtype=float)
    if not np.isfinite(time):
        raise InputError(f"time is {time!r}: expected a number [s], or -1 for the last kept one")
    if time < 0:
        if time != int(time) or -int(time) > len(times):
            raise InputError(f"time is {time!r}: expected a time [s], or -1 to -{len(times)} to count from the end")
        return len(times) + int(time)
    return int(np.abs(times - time).argmin())


# --------------------------------------------------------------------------------------------------------- data


def verbatim(text: str) -> str:
    """A text of the user as a figure shows it, letter by letter: dollars begin no formula."""
    return printable(text).replace("$", r"\$")


def require(dataset: xr.Dataset, *names: str) -> None:
    """Refuse a Dataset that is not one case's result, or lacks variables; say how to get them."""
    if not isinstance(dataset, xr.Dataset):
        raise InputError(f"expected a result (xarray.Dataset), found {type(dataset).__name__}")
    if "time" in names and "case" not in dataset.dims:
        expect_history(dataset)
    axis = axis_of(names) if axis_of(names) in names else axis_of(dataset.variables)
    if axis not in dataset.variables:
        names = (axis, *names)
    extra = [dim for dim in dataset.dims if dim not in (axis, *OTHER_DIMS)]
    if extra:
        raise InputError(f"the result has dimension {extra[0]!r}: choose one case, as in ds.isel({extra[0]}=0)")
    for name in names:
        if name not in dataset.variables:
            stored = ", ".join(str(known) for known in dataset.data_vars)
            raise InputError(f"the result holds no {name!r} (it holds {stored}): run again with it among the fields")
    if dataset.sizes.get(axis, 1) == 0:
        raise InputError(f"the result holds no {axis} at all: nothing to draw")
    expect_declared_units(dataset)
