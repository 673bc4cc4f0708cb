"""Figure of a quantity of all cases of a sweep, as small multiples over the swept keys."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import PurePath
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
from roughvisc.study.case_text import names_of
from roughvisc.study.realisations import statistics
from roughvisc.study.si_tables import unit_of
from roughvisc.study.storage.sweep_cases import identifier
from roughvisc.study.sweep_table import DRAWN, ITSELF, REALISATION
from roughvisc.units import Unit, in_si, unit_for
from roughvisc.variables import CONDUCTANCES, ROW, ROWS, VARIABLES, axis_of

#: Coordinates over the cases that are not swept keys.
_NO_KEYS = ("case", "case_key", ROWS, REALISATION)
#: Largest number of panels, and of values of a key in a legend.
_MOST_PANELS, _MOST_NAMED = 12, 8
#: Viridis without its light end, which is hard to see on a white page.
_SHADES = ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0, 0.88, 256)))
_ITSELF_LINE = {"ls": (0, (4, 1.5)), "lw": 1.1}


class Key:
    """Swept key of a table of cases: its name, its values in order, and their unit."""

    def __init__(self, column: str, dotted: str, name: str, values: pd.Series, units: str) -> None:
        self.column, self.dotted, self.name = column, dotted, name
        numbers = values.dtype.kind in "iuf" and np.isfinite(values).all()
        self.is_numeric = bool(numbers and not dotted.endswith("seed"))
        self.levels = sorted(values.unique()) if self.is_numeric else list(dict.fromkeys(values))
        middle = [np.sqrt(self.levels[0] * self.levels[-1])] if self.is_log else self.levels
        self.unit = unit_for(middle, units) if self.is_numeric else Unit(1.0, "")
        self._units = units

    @property
    def is_log(self) -> bool:
        """Whether the values are positive and span decades."""
        return self.is_numeric and style.is_logarithmic(self.levels)

    @property
    def label(self) -> str:
        """Label of an axis or a legend."""
        return self.unit.label(self.name)

    def text(self, level: Any, *, named: bool = False) -> str:
        """Return a value as text; `named` with the name of the key before a number."""
        if isinstance(level, str):
            shown = PurePath(level).name if self.dotted.endswith("file") else level
            return style.verbatim(textwrap.shorten(shown or "none", 40, placeholder="…"))
        shown = "half-space" if level == np.inf else unit_for([level], self._units).text(level, 4)
        return f"{self.name.lower()} {shown}" if named else shown


def swept_keys(results: xr.Dataset) -> list[Key]:
    """Return the keys that vary between the cases, longest list of numbers first; a dependent key is left out."""
    drawn = {identifier(key) for key in DRAWN} if REALISATION in results.dims else set()
    columns = [
        str(name)
        for name, one in results.coords.items()
        if one.dims == ("case",) and name not in _NO_KEYS and name not in drawn and len(set(one.values.tolist())) > 1
    ]
    table = pd.DataFrame({name: results[name].values for name in columns})
    independent: list[str] = []
    for name in columns:
        pairs = ((table.groupby([name, other]).ngroups, other) for other in independent)
        if not any(count == table[name].nunique() == table[other].nunique() for count, other in pairs):
            independent.append(name)
    dotted = {}
    for name in independent:
        said = str(results[name].attrs.get("long_name", name))
        dotted[name] = said if identifier(said) == identifier(name) else name
    names = names_of(list(dotted.values()))
    keys = [
        Key(name, key, names[key], table[name], str(results[name].attrs.get("units") or unit_of(key)))
        for name, key in dotted.items()
    ]
    return sorted(keys, key=lambda key: (not key.is_numeric, -len(key.levels)))


def case_label(keys: Sequence[Key], values: Sequence[Any]) -> str:
    """Return the values of some keys in words, such as ``Load 2 mN, seed 1``."""
    text = ", ".join(key.text(value, named=True) for key, value in zip(keys, values, strict=True))
    return text if text.startswith("t =") else text[:1].upper() + text[1:]


def default_quantity(results: xr.Dataset) -> str:
    """Return the friction coefficient over speeds, else the contact area (a fraction if surfaces differ in size)."""
    if axis_of(results.variables) == "speed":
        return "friction_coefficient"
    if {"nominal_pressure", "contact_fraction", "force"} <= set(results):
        force, pressure = results["force"], results["nominal_pressure"]
        sizes = (force / pressure).where(pressure > 0).max([dim for dim in force.dims if dim != "case"])
        if float(sizes.max() - sizes.min()) > 1e-6 * float(sizes.max()):
            return "contact_fraction"
    return "contact_area"


@style.apply
def sweep(
    results: xr.Dataset,
    quantity: str | None = None,
    *,
    along: str | Sequence[str] | None = None,
    times: Any = None,
) -> Figure:
    """Draw a quantity of all cases against a swept key, or over time, as small multiples over the other keys.

    The key with the next most numbers colours the lines, all others make panels, up to twelve. Realisations are drawn
    as their mean, with the 95 % prediction interval of a single one; for a scan, also the measured scan is drawn.

    Parameters
    ----------
    results : xarray.Dataset
        Result of :func:`roughvisc.sweep` or :func:`roughvisc.open_results`.
    quantity : str, optional
        A history of every case, such as ``"approach"``. Default: the contact area, or the contact fraction if the
        surfaces differ in size; for friction, the friction coefficient.
    along : str, or a pair, optional
        Dotted key on the horizontal axis, such as ``"program.0.load"``; or ``"time"``, ``"speed"``,
        ``"reduced_speed"`` for curves of all cases; or two keys for maps. Default: the key with most numbers, or the
        speed.
    times : float or str, or a list, optional
        The nearest kept times are drawn; negative whole numbers count from the end. Default: the last time, or the time
        of the largest difference of the cases if the last difference is less than half as large; up to four times if
        one key is swept. [s]

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
    quantity = quantity or default_quantity(results)
    row = ROW if ROW in results.dims else axis
    curves = [str(name) for name, one in results.variables.items() if row in one.dims and not {"x", "y"} & {*one.dims}]
    if quantity not in curves:
        raise InputError(key="quantity", found=quantity, expected=f"a history: {', '.join(sorted(curves))}")
    keys = swept_keys(results)
    asked = [along] if isinstance(along, str) else list(along or ())
    asked = asked or (["speed"] if axis == "speed" else [])
    over = asked[0] if asked and (asked[0] in curves or asked[0] in VARIABLES) else None
    if over is not None and over not in curves:
        raise InputError(key="along", found=over, expected=f"one of {', '.join(sorted(curves))} in every case")
    if over is None:
        known = {name: key for key in keys for name in (key.column, key.dotted)}
        for name in asked:
            if name not in known:
                raise InputError(key="along", found=name, expected=f"one of {', '.join([*known, axis])}")
        chosen = [known[name] for name in asked] or keys[:1]
        if not chosen:
            raise InputError("nothing varies between the cases: nothing to draw against")
        keys = chosen + [key for key in keys if key not in chosen]
        table, note = _at_times(results, quantity, times, axis, row, one=len(keys) == 1)
    else:
        table, note = _table(results[[quantity, over]], quantity), ""
    return _draw(table, quantity, results[quantity].attrs, keys, over, len(asked) == 2 and over is None, note)


def _table(results: xr.Dataset, quantity: str) -> pd.DataFrame:
    """Return a table with a line for each case and row with a value of the quantity."""
    wanted = results.load()
    if "case_key" in wanted.coords and REALISATION in wanted.dims:
        wanted = wanted.where(wanted["case_key"] != "")
    table = wanted.to_dataframe().reset_index()
    table = table[np.isfinite(table[quantity])]
    return table[table[quantity] > 0] if quantity == "leak_rate" else table  # a logarithmic axis has no zero


def _at_times(
    results: xr.Dataset, quantity: str, times: Any, axis: str, row: str, *, one: bool
) -> tuple[pd.DataFrame, str]:
    """Return a table of a quantity at some times (column ``at``), and a note that states a single time."""
    found = results[[quantity]].load()
    rows = found[axis]
    if times is None and row == axis:
        others = [dim for dim in found[quantity].dims if dim != axis]
        spread = (found[quantity].max(others) - found[quantity].min(others)).fillna(0).values
        last = rows.size - 1
        if one:
            frames = np.flatnonzero(np.abs(found[quantity]).max(others) > 0)
            frames = frames[np.linspace(0, frames.size - 1, min(frames.size, 4)).astype(int)] if frames.size else [last]
        else:
            frames = [last if spread[-1] >= 0.5 * spread.max() else int(spread.argmax())]
        places = [float(rows[int(frame)]) for frame in frames]
    else:
        places = np.atleast_1d(in_si(-1 if times is None else times, VARIABLES[axis].units, "times")).tolist()
    if not 0 < len(places) <= _MOST_PANELS:
        raise InputError(key="times", found=f"{len(places)} of them", expected=f"1 to {_MOST_PANELS}")
    parts, texts = [], []
    for place in places:
        if place < 0:
            counts = found[ROWS].fillna(1).astype(int) if row == ROW else rows.size
            number: Any = counts + int(place)
        else:
            number = np.abs(rows - place).fillna(np.inf).argmin(row)
        at = found.isel({row: number})
        near = np.unique(at[axis].values[np.isfinite(at[axis].values)])
        text = style.row_text(xr.DataArray(near, name=axis), -1)
        texts.append(text if near.size == 1 else "the end" if place == -1 else text.replace("=", "≈"))
        parts.append(_table(at, quantity).assign(at=texts[-1]))
    return pd.concat(parts), f"At {texts[0]}." if len(texts) == 1 else ""


def _draw(
    table: pd.DataFrame,
    quantity: str,
    attributes: dict[str, Any],
    keys: list[Key],
    over: str | None,
    as_map: bool,
    note: str,
) -> Figure:
    """Draw a table of cases: one key across, one as colours, the others as panels."""
    declared = VARIABLES.get(quantity)
    label = declared.label if declared else str(attributes.get("long_name", quantity)).capitalize()
    values = table[quantity].to_numpy()
    if quantity == "contact_fraction":
        unit = Unit(0.01, "%")
    else:
        middle = [np.sqrt(values.min() * values.max())] if style.is_logarithmic(values) else values
        unit = unit_for(middle, declared.units if declared else str(attributes.get("units", "")))
    across, rest = (None, keys) if over else (keys[0], keys[1:])
    second, rest = (rest[0], rest[1:]) if rest else (None, [])
    several = "at" in table and table["at"].nunique() > 1
    if several and second is None:
        second = Key("at", "at", "Time", table["at"], "")
    elif several:
        rest = [Key("at", "at", "", table["at"], ""), *rest]
    while rest and table.groupby([key.column for key in rest]).ngroups > _MOST_PANELS:
        rest = rest[:-1]  # a key without panels makes more lines of one colour
    columns = [key.column for key in rest]
    panels = list(table.groupby(columns, sort=False)) if columns else [((), table)]
    if columns and columns != ["at"]:
        panels.sort(key=lambda one: [key.levels.index(level) for key, level in zip(rest, one[0], strict=True)])
    width = min(len(panels), 3 if len(panels) != 4 else 2)
    if len(rest) > 1 and 2 <= len(rest[-1].levels) <= 4 and len(panels) % len(rest[-1].levels) == 0:
        width = len(rest[-1].levels)  # a column for each of its values
    height = -(-len(panels) // width)
    figure = style.new_figure(4.6 if width == 1 else 1.2 + 2.3 * width, 1.2 + (2.4 if height == 1 else 1.8) * height)
    axes = figure.subplots(height, width, sharex=True, sharey=True, squeeze=False).ravel()
    norm = _norm(unit(values)) if as_map else None
    for ax, (_, panel) in zip(axes, panels, strict=False):
        if as_map:
            _draw_cells(ax, panel.assign(**{quantity: unit(panel[quantity])}), quantity, across, second, norm)
        else:
            lines = [key.column for key in keys if key not in rest and key is not across and key is not second]
            _draw_lines(ax, panel, quantity, unit, across, over, second, lines)
    _finish_axes(axes[0], unit(values), unit.label(label), table, across, over, as_map)
    for unused in axes[len(panels) :]:
        unused.remove()
    labels = axes[0].get_xlabel(), axes[0].get_ylabel()
    for number, ax in enumerate(axes[: len(panels)]):
        ax.set_xlabel(labels[0] if number + width >= len(panels) else "")
        ax.set_ylabel(labels[1] if number % width == 0 else "")
        ax.tick_params(labelbottom=number + width >= len(panels), labelleft=number % width == 0)
        ax.grid(visible=not as_map)
    titles = [case_label(rest, found) for found, _ in panels]
    style.letter_panels(axes[: len(panels)], [textwrap.fill(one, 28) for one in titles])
    if as_map:
        bar = ScalarMappable(norm, "viridis")
        figure.colorbar(bar, ax=list(axes[: len(panels)]), pad=0.02, aspect=22).set_label(unit.label(label))
    else:
        _name_lines(figure, list(axes[: len(panels)]), table, second)
    style.note_below(figure, note)
    return figure


def _norm(values: Any) -> Normalize:
    """Return the colour scale of some values: logarithmic if they span decades."""
    low, high = float(np.min(values)), float(np.max(values))
    return LogNorm(low, high) if style.is_logarithmic(values) else Normalize(low, high if high > low else low + 1)


def _colour(key: Key | None, level: Any) -> Any:
    """Return the colour of a value of the key that colours the lines."""
    if key is None:
        return style.BLUE
    if key.is_numeric:
        return _SHADES(_norm(key.levels)(level))
    number = key.levels.index(level)
    return _SHADES(number / max(1, len(key.levels) - 1)) if key.column == "at" else style.CYCLE[number % 8]


def _draw_lines(
    ax: Axes,
    panel: pd.DataFrame,
    quantity: str,
    unit: Unit,
    across: Key | None,
    over: str | None,
    second: Key | None,
    others: list[str],
) -> None:
    """Draw the lines of one panel: one for each value of the second key, and of keys without panels."""
    grouping = ([second.column] if second else []) + others
    for found, line in (
        panel.groupby(grouping, sort=second is None or second.is_numeric) if grouping else [((None,), panel)]
    ):
        look: dict[str, Any] = {"color": _colour(second, found[0])}
        numbers = line[REALISATION] if REALISATION in line else pd.Series(np.nan, line.index)
        if across is None:
            assert over is not None
            at = pd.Series(style.row_unit(_rows(panel, over))(line[over]), line.index)
            look["marker"] = "o" if at.nunique() <= 20 and panel["case"].nunique() <= _MOST_NAMED else ""
        elif across.is_numeric:
            at, look["marker"] = pd.Series(across.unit(line[across.column]), line.index), "o"
        else:
            at = line[across.column].map(across.levels.index)
            look |= {"marker": "o", "ls": "", "ms": 5}
        shown = pd.Series(unit(line[quantity]), line.index)
        if numbers.notna().any():  # realisations, interpolated to common abscissae
            wide = pd.DataFrame({"at": at, "number": numbers, "value": shown}).pivot_table("value", "at", "number")
            wide = wide.interpolate("index", limit_area="inside").dropna()
            itself = wide.pop(ITSELF) if ITSELF in wide and wide.shape[1] > 1 else pd.Series(dtype=float)
            found = statistics(wide.to_numpy().T)
            ends = (wide.index, found["patch_lower"], found["patch_upper"])
            joined = look.get("ls") != "" and len(wide) > 1
            if joined:
                ax.fill_between(*ends, color=look["color"], alpha=0.22, lw=0)
            else:
                ax.vlines(*ends, color=look["color"], alpha=0.35, lw=5)
            dashes = _ITSELF_LINE if joined else {"ls": ""}
            if itself.size:
                ax.plot(itself.index, itself, marker="D", mfc="w", ms=4, color=look["color"], **dashes)
            ax.plot(wide.index, found["mean"], **look)
        else:
            order = at.sort_values(kind="stable").index
            ax.plot(at[order], shown[order], **look)


def _rows(table: pd.DataFrame, over: str) -> xr.DataArray:
    """Return the distinct times, speeds or distances of a table."""
    units = VARIABLES[over].units if over in VARIABLES else ""
    return xr.DataArray(np.unique(table[over]), name=over, dims=over, attrs={"units": units})


def _draw_cells(ax: Axes, panel: pd.DataFrame, quantity: str, across: Key, up: Key, norm: Normalize) -> None:
    """Draw one cell for each pair of values of two keys, coloured by the mean of a quantity."""
    cells = panel.pivot_table(index=up.column, columns=across.column, values=quantity, aggfunc="mean")
    cells = cells.reindex(index=up.levels, columns=across.levels)
    ax.imshow(cells, origin="lower", aspect="auto", norm=norm, cmap="viridis", interpolation="nearest")
    ax.set_facecolor(style.MISSING)
    every = -(-len(up.levels) // 12)
    numbers = range(0, len(up.levels), every)
    shown = [f"{float(up.unit(up.levels[i])):.4g}" if up.is_numeric else up.text(up.levels[i]) for i in numbers]
    ax.set_yticks(list(numbers), shown)
    ax.set_ylabel(up.label)


def _finish_axes(
    ax: Axes, values: Any, label: str, table: pd.DataFrame, across: Key | None, over: str | None, as_map: bool
) -> None:
    """Set the scales, ticks and labels that all panels share."""
    if not as_map:
        style.value_axis(ax, values)
        ax.set_ylabel(label)
    if across is None:
        assert over is not None
        style.row_axis(ax, _rows(table, over))
        if over.endswith("speed"):
            ax.set_xscale("log")
        return
    if across.is_numeric and not as_map:
        if across.is_log:
            style.log_axis(ax.xaxis, across.unit(across.levels))
    else:
        every = -(-len(across.levels) // 12)
        numbers = list(range(0, len(across.levels), every))
        texts = [
            f"{float(across.unit(across.levels[i])):.4g}" if across.is_numeric else across.text(across.levels[i])
            for i in numbers
        ]
        ax.set_xticks(numbers, texts)
        if sum(map(len, texts)) > 30:
            ax.tick_params(axis="x", labelrotation=90)
        if not as_map:
            ax.set_xlim(-0.5, len(across.levels) - 0.5)
    ax.set_xlabel(across.label)


def _name_lines(figure: Figure, axes: list[Axes], table: pd.DataFrame, second: Key | None) -> None:
    """Draw the legend or colour bar of the key that colours the lines, and entries for lines and bands."""
    named: dict[str, Artist] = {}
    title = ""
    if second is not None and second.is_numeric and len(second.levels) > _MOST_NAMED:
        bar = ScalarMappable(_norm(second.unit(second.levels)), _SHADES)
        figure.colorbar(bar, ax=axes, pad=0.02, aspect=22).set_label(second.label)
    elif second is not None and len(second.levels) <= 2 * _MOST_NAMED:
        title = second.name
        named = {second.text(one): Line2D([], [], color=_colour(second, one), marker="o") for one in second.levels}
    if REALISATION in table:
        count, scan = (
            table.loc[table[REALISATION] != ITSELF, REALISATION].nunique(),
            (table[REALISATION] == ITSELF).any(),
        )
        kind = "Gaussian surrogates" if scan else "realisations"
        named |= {f"mean of {count} {kind}": Line2D([], [], color="0.3")}
        named |= {"95 % prediction interval": Patch(color="0.3", alpha=0.22, lw=0)}
        if scan:
            named["measured scan"] = Line2D([], [], color="0.3", **_ITSELF_LINE)
    style.legend_above(figure, named, title)


def sweep_figures(results: xr.Dataset) -> Iterator[tuple[str, str, Figure]]:
    """Yield name, caption and figure of everything that the results of several cases allow.

    A quantity that is the same in all cases, or equal to a swept key, is left out.
    """
    area, axis = default_quantity(results), axis_of(results.variables)
    if axis == "speed":
        for file, name in (("friction", "friction_coefficient"), ("area", "contact_fraction")):
            yield file, f"{VARIABLES[name].label} against speed, for each case.", sweep(results, name)
        if "reduced_speed" in results and not np.allclose(results["reduced_speed"], results["speed"], equal_nan=True):
            caption = "Master curve: friction coefficient against the speed times the shift factor of the temperature."
            yield "master", caption, sweep(results, along="reduced_speed")
        return
    loading = "nominal_pressure" if area == "contact_fraction" else "force"
    keys = swept_keys(results)
    for name in (area, "approach", loading, "leak_rate", *CONDUCTANCES):
        if name not in results:
            continue
        if keys and not _is_known(results, name, keys, axis):
            file = "area" if name == area else name
            yield file, f"{VARIABLES[name].label} against the swept settings.", sweep(results, name)
        if name in (area, "leak_rate", *CONDUCTANCES):
            caption = f"{VARIABLES[name].label} over {axis}, for each case."
            yield "histories" if name == area else f"{name}-histories", caption, sweep(results, name, along=axis)


def _is_known(results: xr.Dataset, name: str, keys: list[Key], axis: str) -> bool:
    """Return whether a quantity is the same in all cases, or equal to a swept key, at its drawn time."""
    row = ROW if ROW in results.dims else axis
    table, _ = _at_times(results, name, None, axis, row, one=False)
    values = table[name].to_numpy()
    scale = 1e-6 * float(np.max(np.abs(values), initial=0.0))
    stated = [values[0]] if values.size else [values]
    stated += [table[key.column].to_numpy() for key in keys if key.is_numeric]
    return any(np.allclose(values, one, rtol=0, atol=scale) for one in stated)
