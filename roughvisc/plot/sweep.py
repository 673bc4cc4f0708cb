"""Figure of a quantity of all cases of a sweep, as small multiples over the swept keys."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from roughvisc.errors import InputError
from roughvisc.plot import style
from roughvisc.study.case_text import names_of, value_text
from roughvisc.study.realisations import statistics
from roughvisc.study.sweep_table import ITSELF, REALISATION
from roughvisc.units import in_si, unit_for
from roughvisc.variables import AXES, CONDUCTANCES, ROW, ROWS, VARIABLES, axis_of

#: Largest number of panels, and of values of a key in a legend.
_MOST_PANELS, _MOST_NAMED = 12, 8
#: Viridis without its light end, which is hard to see on a white page.
_SHADES = ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0, 0.88, 256)))
#: Entries of the legend for realisations.
_BAND = Patch(color="0.3", alpha=0.22, lw=0)
_ITSELF_LINE = {"ls": (0, (4, 1.5)), "lw": 1.1}


@dataclass(frozen=True)
class Key:
    """Swept key.

    Attributes
    ----------
    column, name, symbol : str
        Column in a table of cases, name in words, and symbol of the unit.
    levels : list of float or str
        Numbers in this unit, ascending, or texts in the order of the cases.
    """

    column: str
    name: str
    symbol: str
    levels: list[Any]

    @property
    def is_numeric(self) -> bool:
        """Whether the levels are numbers."""
        return isinstance(self.levels[0], float)

    @property
    def label(self) -> str:
        """Label of an axis or a legend."""
        return f"{self.name} [{self.symbol}]" if self.symbol else self.name

    @property
    def texts(self) -> list[str]:
        """The levels as texts without unit."""
        return [f"{level:.4g}" if self.is_numeric else level for level in self.levels]

    @property
    def norm(self) -> Normalize:
        """Scale of the colours of numbers: logarithmic if they span decades."""
        return (LogNorm if style.is_logarithmic(self.levels) else Normalize)(self.levels[0], self.levels[-1])

    def colour(self, level: Any) -> Any:
        """Return the colour of a level."""
        return _SHADES(self.norm(level)) if self.is_numeric else style.CYCLE[self.levels.index(level) % 8]


def swept_keys(results: xr.Dataset) -> tuple[xr.Dataset, list[Key]]:
    """Return results with the values of their swept keys as they are shown, and these keys.

    Keys with most numbers come first. A key that depends on another key is left out.
    """
    names = [name for name, one in results.coords.items() if one.dims == ("case",)]
    cases = pd.DataFrame({name: results[name].values for name in names if name not in ("case", "case_key", ROWS)})
    counts, varied = cases.nunique(dropna=False), []
    for name in cases:
        pairs = {other: len(cases[[name, other]].drop_duplicates()) for other in varied}
        if counts[name] > 1 and not any(counts[name] == counts[other] == both for other, both in pairs.items()):
            varied.append(name)
    dotted = {name: str(results[name].attrs.get("long_name", name)) for name in varied}
    words, keys = names_of(list(dotted.values())), []
    for name, key in dotted.items():
        values, symbol = cases[name], ""
        if values.dtype.kind in "iuf" and np.isfinite(values).all() and not key.endswith("seed"):
            middle = [np.sqrt(values.min() * values.max())] if style.is_logarithmic(values) else values
            unit = unit_for(middle, str(results[name].attrs.get("units", "")))
            shown, symbol = unit(values).tolist(), unit.symbol
            levels = sorted(set(shown))
        else:
            texts = (textwrap.shorten(value_text(key, value) or "none", 40, placeholder="…") for value in values)
            shown = [style.verbatim(text) for text in texts]
            levels = list(dict.fromkeys(shown))
        keys.append(Key(str(name), words[key], symbol, levels))
        results = results.assign_coords({name: ("case", shown)})
    return results, sorted(keys, key=lambda key: (not key.is_numeric, -len(key.levels)))


@style.apply
def sweep(results: xr.Dataset, quantity: str | None = None, *, along: str | None = None, times: Any = None) -> Figure:
    """Draw a quantity of all cases against a swept key, or over time, as small multiples over the other keys.

    The key with the next most numbers colours the lines, all others make panels, up to twelve. Realisations are drawn
    as their mean, with the 95 % prediction interval of a single one; for a scan, also the measured scan is drawn.

    Parameters
    ----------
    results : xarray.Dataset
        Result of :func:`roughvisc.sweep` or :func:`roughvisc.open_results`.
    quantity : str, optional
        A history of every case, such as ``"approach"``. Default: the contact area or, for friction, the friction
        coefficient.
    along : str, optional
        Dotted key on the horizontal axis, such as ``"program.0.load"``; or ``"time"``, ``"speed"``,
        ``"reduced_speed"`` for curves of all cases. Default: the key with most numbers, or the speed.
    times : float or str, or a list, optional
        The nearest kept times are drawn; negative whole numbers count from the end. Default: the last time at which the
        cases differ by at least half of their largest difference. [s]

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the results are not a sweep, nothing varies in them, or a name is unknown.
    """
    if not isinstance(results, xr.Dataset) or results.sizes.get("case", 1) * results.sizes.get(REALISATION, 1) < 2:
        raise InputError("expected the Dataset of rv.open_results or rv.sweep, with several cases")
    axis = axis_of(results.variables)
    quantity = quantity or ("friction_coefficient" if axis == "speed" else "contact_area")
    row = ROW if ROW in results.dims else axis
    curves = [str(name) for name, one in results.variables.items() if row in one.dims and not {"x", "y"} & {*one.dims}]
    if quantity not in curves:
        raise InputError(key="quantity", found=quantity, expected=f"a history: {', '.join(sorted(curves))}")
    dotted = {str(one.attrs.get("long_name", name)): str(name) for name, one in results.coords.items()}
    results, keys = swept_keys(results)
    along = along or ("speed" if axis == "speed" else keys[0].column if keys else "")
    if along in curves:
        table = _known(results[[quantity, along]].load().to_dataframe().reset_index(), quantity)
        return _draw(table, results[quantity], keys, over=results[along])
    chosen = [key for key in keys if key.column in (along, dotted.get(along))]
    if not chosen:
        known = ", ".join([*(key.column for key in keys), *curves])
        raise InputError(key="along", found=along or "nothing that varies between the cases", expected=known)
    table, others = _at_times(results, quantity, times), [key for key in keys if key is not chosen[0]]
    at = Key("at", "", "", table["at"].unique().tolist())
    return _draw(table, results[quantity], [*chosen, *others[:1], at, *others[1:]])


def _known(table: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """Return the lines of a table that can be drawn."""
    known = np.isfinite(table[quantity])
    if quantity == "leak_rate":  # a logarithmic axis has no zero
        known &= table[quantity] > 0
    if not known.any():
        raise InputError(f"{quantity} has no value to draw")
    return table[known]


def _at_times(results: xr.Dataset, quantity: str, times: Any = None) -> pd.DataFrame:
    """Return a table of a quantity of all cases at some times, with the text of the time as column ``at``."""
    values, axis = results[quantity].load(), axis_of(results.variables)
    rows, row = values[axis], ROW if ROW in values.dims else axis
    places = np.atleast_1d(in_si(-1 if times is None else times, VARIABLES[axis].units, "times"))
    if times is None and row == axis:
        others = [dim for dim in values.dims if dim != axis]
        spread = (values.max(others) - values.min(others)).fillna(0).values
        places = rows.values[spread >= 0.5 * spread.max()][-1:]
    if not 0 < len(places) <= _MOST_PANELS:
        raise InputError(key="times", found=f"{len(places)} of them", expected=f"1 to {_MOST_PANELS}")
    parts = []
    for place in places:
        if place < 0:
            number = int(place) + (results[ROWS].fillna(1).astype(int) if row == ROW else rows.size)
        else:
            number = np.abs(rows - place).fillna(np.inf).argmin(row)
        table = values.isel({row: number}).to_dataframe().reset_index()
        near = table[axis].dropna().unique()
        text = AXES[axis].place(near[0], 3)
        parts.append(table.assign(at=text if near.size == 1 else "at the end" if place == -1 else f"near {text}"))
    return _known(pd.concat(parts), quantity)


def _draw(table: pd.DataFrame, quantity: xr.DataArray, keys: list[Key], over: xr.DataArray | None = None) -> Figure:
    """Draw a table of cases: the first key, or `over`, across; the next key as colours; the others as panels."""
    label, units = style.described(quantity)
    values = table[str(quantity.name)].to_numpy()
    unit = unit_for([np.sqrt(values.min() * values.max())] if style.is_logarithmic(values) else values, units)
    table = table.assign(shown=unit(values))
    across, rest = (None, keys) if over is not None else (keys[0], keys[1:])
    second, rest = (rest[0], rest[1:]) if rest else (None, [])
    families = [second.column] if second else []  # columns that tell the lines of a panel apart
    while rest and table.groupby([key.column for key in rest]).ngroups > _MOST_PANELS:
        families.append(rest.pop().column)
    if over is not None:
        places = xr.DataArray(np.unique(table[str(over.name)]), name=over.name, attrs=over.attrs)
        table["across"] = style.row_unit(places)(table[str(over.name)])
    else:
        table["across"] = table[across.column] if across.is_numeric else table[across.column].map(across.levels.index)
    groups = {key.column: table[key.column].map(key.levels.index) for key in rest}
    panels = list(table.groupby(list(groups.values()))) if rest else [((), table)]
    titles = []
    for found, _ in panels:
        parts = (f"{key.name} {key.texts[i]} {key.symbol}".strip() for key, i in zip(rest, found, strict=True))
        titles.append(textwrap.fill(", ".join(parts), 26))
    columns = 1 if not rest else len(rest[-1].levels) if len(rest[-1].levels) <= 4 else 3
    width, height = (3.4, 2.0) if columns == 1 else (2.1, 1.7)
    is_text = across is not None and not across.is_numeric
    is_turned = is_text and style.LETTER * len(" ".join(across.texts)) > width
    bottom = 0.45 + style.LETTER * max(map(len, across.texts)) if is_turned else 0.5
    look: dict[str, Any] = {"shared": "xy", "bottom": bottom, "lines": max(len(one.splitlines()) for one in titles)}
    figure, axes = style.new_panels(len(panels), columns, width, height, **look)
    for ax, (_, panel) in zip(axes, panels, strict=True):
        for _, line in panel.groupby(families) if families else [((), panel)]:
            colour = second.colour(line[second.column].iloc[0]) if second else style.BLUE
            _draw_line(ax, line.sort_values("across"), colour, joined=not is_text)
        style.value_axis(ax, table["shown"])
    if over is not None:
        style.row_axis(axes, places)
    elif is_text:
        axes[0].set_xticks(range(len(across.texts)), across.texts)
        axes[0].set_xlim(-0.5, len(across.texts) - 0.5)
        for ax in axes:
            ax.tick_params(axis="x", labelrotation=90 if is_turned else 0)
    elif style.is_logarithmic(across.levels):
        style.log_axis(axes[0].xaxis, across.levels)
    style.label_panels(axes, axes[0].get_xlabel() if over is not None else across.label, unit.label(label))
    style.letter_panels(axes, titles)
    named: dict[str, Artist] = {}
    if second and second.is_numeric and len(second.levels) > _MOST_NAMED:
        style.colour_bar(ScalarMappable(second.norm, _SHADES), axes, second.label)
    elif second and len(second.levels) <= 2 * _MOST_NAMED:
        colours = (second.colour(level) for level in second.levels)
        named = {text: Line2D([], [], color=one, marker="o") for text, one in zip(second.texts, colours, strict=True)}
    if REALISATION in table:
        has_scan = (table[REALISATION] == ITSELF).any()
        count = table.loc[table[REALISATION] != ITSELF, REALISATION].nunique()
        kind = "Gaussian surrogates" if has_scan else "realisations"
        named |= {f"mean of {count} {kind}": Line2D([], [], color="0.3"), "95 % prediction interval": _BAND}
        named |= {"measured scan": Line2D([], [], color="0.3", **_ITSELF_LINE)} if has_scan else {}
    style.legend_above(figure, named, second.label if second else "")
    return figure


def _draw_line(ax: Axes, line: pd.DataFrame, colour: Any, *, joined: bool) -> None:
    """Draw one line of a panel; of realisations the mean, the prediction interval, and the measured scan."""
    look: dict[str, Any] = {"color": colour, "marker": "o" if len(line) <= 100 else "", "ls": "-" if joined else ""}
    if REALISATION not in line:
        ax.plot(line["across"], line["shown"], **look)
        return
    # realisations with times of their own are interpolated to common times
    wide = line.pivot_table("shown", "across", REALISATION).interpolate("index", limit_area="inside").dropna()
    itself = wide.pop(ITSELF) if ITSELF in wide and wide.shape[1] > 1 else None
    found = statistics(wide.to_numpy().T)
    ends = wide.index, found["patch_lower"], found["patch_upper"]
    if joined and len(wide) > 1:
        ax.fill_between(*ends, color=colour, alpha=0.22, lw=0)
    else:
        ax.vlines(*ends, color=colour, alpha=0.35, lw=5)
    if itself is not None:
        dashed = _ITSELF_LINE if joined else {"ls": ""}
        ax.plot(itself.index, itself, marker="D", mfc="w", ms=4, color=colour, **dashed)
    ax.plot(wide.index, found["mean"], **look)


def sweep_figures(results: xr.Dataset) -> Iterator[tuple[str, str, Figure]]:
    """Yield name, caption and figure of everything that the results of several cases allow.

    A quantity that is the same in all cases, or equal to a swept key, is left out.
    """
    axis = axis_of(results.variables)
    if axis == "speed":
        for name in ("friction_coefficient", "contact_fraction"):
            yield name, f"{VARIABLES[name].label} against speed, for each case.", sweep(results, name)
        if "reduced_speed" in results and not np.allclose(results["reduced_speed"], results["speed"], equal_nan=True):
            caption = "Master curve: friction coefficient against the speed times the shift factor of the temperature."
            yield "master", caption, sweep(results, along="reduced_speed")
        return
    keys = swept_keys(results)[1]
    for name in ("contact_area", "approach", "force", "leak_rate", *CONDUCTANCES):
        if name not in results or not results[name].any():
            continue
        table = _at_times(results, name)
        stated = [table[name].iloc[0], *(table[key.column] for key in keys if key.is_numeric)]
        small = 1e-6 * table[name].abs().max()
        if keys and not any(np.allclose(table[name], one, rtol=0, atol=small) for one in stated):
            yield name, f"{VARIABLES[name].label} against the swept settings.", sweep(results, name)
        if name in ("contact_area", "leak_rate", *CONDUCTANCES):
            caption = f"{VARIABLES[name].label} over {axis}, for each case."
            yield f"{name}-histories", caption, sweep(results, name, along=axis)
