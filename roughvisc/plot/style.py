"""The look of all figures: colours and fonts, sizes, letters, legends, notes, limits and ticks."""

from __future__ import annotations

import string
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogFormatterSciNotation, LogLocator, MaxNLocator, NullFormatter

from roughvisc.errors import printable

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


def apply(draw):
    """Decorator: draw a figure in the package's style, whatever the reader's own settings are."""
    return matplotlib.rc_context(STYLE)(draw)


def new_figure(width: float, height: float, layout: str = "constrained") -> Figure:
    """Figure of a size [inch] that belongs to no window and to no global state."""
    return Figure(figsize=(width, height), layout=layout)


def named_in(*axes: Axes) -> dict[str, Any]:
    """Label -> artist of all that has a label in some panels."""
    return {label: one for ax in axes for one, label in zip(*ax.get_legend_handles_labels(), strict=True)}


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
    figure.legend(list(named.values()), labels, loc="outside upper center", title=title or None, **look)


def legend_over(ax: Axes, width: float) -> None:
    """Legend of a panel of about that width [inch], above it and beside its letter; none where nothing is named."""
    handles, labels = ax.get_legend_handles_labels()
    if labels:
        look = {"borderaxespad": 0.1, "handlelength": 1.4, "columnspacing": 1.0, "handletextpad": 0.5}
        columns = _columns(labels, width - 0.2)
        ax.legend(handles, labels, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, **look)


def broken(label: str, room: float) -> str:
    """Label of an axis of about that length [inch]: its unit, or last word, in a second line where it is longer."""
    return "\n".join(label.rsplit(" ", 1)) if len(label) * _LABEL_LETTER > room else label


def note_below(figure: Figure, *notes: str) -> None:
    """What a reader has to know besides, below all panels, in lines that are no longer than the figure is wide."""
    width = int((figure.get_figwidth() - 0.2) / _LETTER)
    if lines := [line for note in notes if note for line in textwrap.wrap(note, width)]:
        figure.supxlabel("\n".join(["", *lines]), fontsize=SMALL)  # clear of the labels of the panels


def marker_of(count: int) -> str:
    """Points are marked as long as they can be told apart."""
    return "o" if count <= 40 else ""


def leave_room(ax: Axes, *values: np.ndarray) -> None:
    """Linear limits from zero to somewhat above the largest value; a constant history lies in the middle."""
    shown = np.concatenate([np.ravel(one) for one in values])
    shown = shown[np.isfinite(shown)]
    lowest, highest = (min(shown.min(), 0.0), max(shown.max(), 0.0)) if shown.size else (0.0, 1.0)
    span = (highest - lowest) or 1.0
    ax.set_ylim(lowest - 0.04 * span, highest + 0.15 * span)


def say_inside(ax: Axes, text: str) -> None:
    """Text in the middle of a panel that has nothing to show."""
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color="0.4")


def spread_axis(axis: Axis, shown, always: bool = False) -> None:
    """Make one axis logarithmic where the values on it span a decade or more, or always, with readable ticks."""
    shown = np.asarray(shown, dtype=float)
    shown = shown[np.isfinite(shown) & (shown > 0)]
    if not shown.size or (shown.max() < 10 * shown.min() and not always):
        return
    (axis.axes.set_xscale if axis.axis_name == "x" else axis.axes.set_yscale)("log")
    if shown.max() < (30 if axis.axis_name == "x" else 300) * shown.min():
        plain_log_ticks(axis, fine=True)
    axis.set_minor_formatter(NullFormatter())


def plain_log_ticks(axis: Axis, *, fine: bool, most: int = 99) -> None:
    """Ticks of a logarithmic axis as plain numbers: at 1, 2 and 5 of each decade, or at the decades alone."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if fine else (1.0,), numticks=most))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def readable_ticks(axis: Axis, low: float, high: float, logarithmic: bool) -> None:
    """Ticks at round values; on a logarithmic axis plain numbers, or powers of ten where some would not read well."""
    if not logarithmic:
        axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
        return
    plain_log_ticks(axis, fine=high < 300 * low, most=12)
    if low < 0.9e-3 or high >= 1e5:
        axis.set_major_formatter(LogFormatterSciNotation())


def set_scale(axis: Axis, shown: np.ndarray) -> None:
    """Scale of the y axis of some values: logarithmic for positive ones over two decades, else linear from zero."""
    low, high = (float(shown.min()), float(shown.max())) if shown.size else (0.0, 1.0)
    logarithmic = low > 0 and high >= 100 * low
    if logarithmic:
        axis.axes.set_yscale("log")
        axis.axes.set_ylim(low / 1.4, high * 1.4)
    else:
        leave_room(axis.axes, shown)
    readable_ticks(axis, *axis.axes.get_ylim(), logarithmic)


def verbatim(text: str) -> str:
    """A text of the user as a figure shows it, letter by letter: dollars begin no formula."""
    return printable(text).replace("$", r"\$")
