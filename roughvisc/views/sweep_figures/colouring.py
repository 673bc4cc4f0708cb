"""Colours of many lines by a parameter: a legend of a few, a colour bar of many."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatterSciNotation, MaxNLocator

from roughvisc.views.figures import style
from roughvisc.views.figures.rows import unevenness
from roughvisc.views.sweep_figures.cases import Parameter

#: Lines up to which a legend names each.
NAMED = 8
#: Categories up to which a colour bar names each.
_BAR_NAMED = 24


def even_in_log(values) -> bool:
    """Whether positive values span a decade and lie at least as evenly on a logarithmic axis as on a linear one."""
    values = np.unique(np.asarray(values, dtype=float))
    if len(values) < 2 or not values[0] > 0 or values[-1] < 10 * values[0]:
        return False
    return unevenness(np.log(values)) <= unevenness(values)


def line_colours(count: int) -> Colormap:
    """Perceptually even colours for so many lines, without the palest, which white paper swallows."""
    return ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0.0, 0.88, max(count, 2))))


@dataclass(frozen=True)
class Colouring:
    """Colours of the levels of a parameter: by size for numbers, apart for categories."""

    parameter: Parameter

    @property
    def few(self) -> bool:
        """Whether every level has its own entry in a legend."""
        return len(self.parameter.levels) <= NAMED

    @property
    def _graded(self) -> bool:
        """Whether a colour bar has an axis of numbers."""
        return self.parameter.numeric and not self.parameter.endless

    def colour(self, level: int):
        """Colour of the level of this number."""
        count = len(self.parameter.levels)
        if not self.parameter.numeric and count <= len(style.CYCLE):
            return style.CYCLE[level]
        if self.few or not self._graded:
            return line_colours(count)(level)
        return line_colours(256)(self._norm()(self.parameter.unit(self.parameter.levels[level])))

    def _norm(self) -> Normalize:
        shown = self.parameter.unit(self.parameter.levels)
        return (LogNorm if even_in_log(shown) else Normalize)(shown[0], shown[-1])

    def legend(self) -> dict[str, Artist]:
        """Entries of a legend, a level each; none where there are too many."""
        if not self.few:
            return {}
        texts = self.parameter.texts()
        return {text: Line2D([], [], color=self.colour(i), lw=1.6) for i, text in enumerate(texts)}

    def draw_bar(self, figure: Figure, axes) -> None:
        """Colour bar, where there are too many levels for a legend."""
        if self.few:
            return
        count = len(self.parameter.levels)
        if self._graded:
            shades = ScalarMappable(self._norm(), line_colours(256))
        else:
            shades = ScalarMappable(BoundaryNorm(np.arange(count + 1) - 0.5, count), line_colours(count))
        bar = figure.colorbar(shades, ax=axes, pad=0.02, aspect=22)
        bar.set_label(self.parameter.label)
        bar.outline.set_linewidth(0.6)
        bar.minorticks_off()
        if not self._graded:
            step = -(-count // _BAR_NAMED)
            bar.set_ticks(np.arange(0, count, step), labels=self.parameter.texts()[::step])
        else:
            readable_ticks(bar.ax.yaxis, *bar.mappable.get_clim(), isinstance(self._norm(), LogNorm))


def readable_ticks(axis: Axis, low: float, high: float, logarithmic: bool) -> None:
    """Ticks at round values; on a logarithmic axis plain numbers, or powers of ten where some would not read well."""
    if not logarithmic:
        axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
        return
    style.plain_log_ticks(axis, fine=high < 300 * low, most=12)
    if low < 0.9e-3 or high >= 1e5:
        axis.set_major_formatter(LogFormatterSciNotation())
