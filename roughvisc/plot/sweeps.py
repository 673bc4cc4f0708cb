"""Figures of a sweep: a quantity against what was varied, and the curves of all cases, as small multiples."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from roughvisc.errors import InputError
from roughvisc.plot import style
from roughvisc.plot.case_text import names_of, readable_setting, setting_unit
from roughvisc.plot.rows import RowAxis, frame_at, spread_frames
from roughvisc.study.realisations import statistics
from roughvisc.study.si_tables import unit_of
from roughvisc.study.storage.parameters import identifier
from roughvisc.study.sweep_table import DRAWN, ITSELF, REALISATION
from roughvisc.units import Unit, unit_for
from roughvisc.variables import AXES, VARIABLES, axis_of

#: Lines up to which a legend names each, panels up to which values are told apart, and levels of both axes of a map.
_NAMED, _PANELS, _MAP_FROM = 8, 9, 4
#: Quantities that span decades, and of which zero means that there is none.
_SPANNING = ("leak_rate", "transmissivity", "hydraulic_aperture")
_NO_PARAMETERS = ("case", "case_key", "rows", REALISATION, *AXES)
#: How a measured surface is drawn among its surrogates.
_ITSELF = {"ls": (0, (4, 1.5)), "lw": 1.1}


@dataclass(frozen=True)
class Parameter:
    """What was varied.

    Attributes
    ----------
    key, name : str
        Dotted key of the study, and name on an axis.
    values : ndarray, shape (cases,)
        Numbers in SI, or texts.
    si : str
        Unit of numbers.
    """

    key: str
    name: str
    values: np.ndarray
    si: str = ""

    @property
    def numeric(self) -> bool:
        """Whether it has an axis of numbers: all are finite, and no seeds."""
        return self.values.dtype.kind in "iuf" and bool(np.isfinite(self.values).all()) and "seed" not in self.key

    @property
    def levels(self) -> list[Any]:
        """Different values: numbers by size, others in the order of the cases."""
        return sorted(set(self.values.tolist())) if self.numeric else list(dict.fromkeys(self.values.tolist()))

    @property
    def places(self) -> np.ndarray:
        """Number of the level of each case."""
        texts = list(map(repr, self.levels))  # one missing number equals another
        return np.array([texts.index(repr(value)) for value in self.values.tolist()])

    @property
    def unit(self) -> Unit:
        """Unit of the axis: of numbers over decades, the one that suits their middle."""
        return setting_unit(middle_of_decades(self.values), self.si) if self.numeric else Unit(1.0, "")

    @property
    def positions(self) -> np.ndarray:
        """Positions of the levels on an axis."""
        return self.unit(self.levels) if self.numeric else np.arange(len(self.levels), dtype=float)

    @property
    def is_logarithmic(self) -> bool:
        """Whether the levels lie at least as evenly on a logarithmic axis as on a linear one, over a decade."""
        at = self.positions
        if not self.numeric or len(at) < 2 or not at[0] > 0 or at[-1] < 10 * at[0]:
            return False
        return _unevenness(np.log(at)) <= _unevenness(at)

    def texts(self) -> list[str]:
        """Levels as texts: numbers with their unit, files without their folders."""
        if self.numeric:
            return [self.unit.text(value, 4) for value in self.levels]
        texts = [readable_setting(self.key, one) if isinstance(one, int | float) else str(one) for one in self.levels]
        files = [PurePath(text).name for text in texts]
        texts = files if len(set(files)) == len(texts) else texts
        shown = [textwrap.shorten(text, 60, placeholder="…") for text in texts]
        return [style.verbatim(text if text not in ("", "nan") else "none") for text in shown]


def _unevenness(values: np.ndarray) -> float:
    """Largest deviation of increasing values from even distances, over their range."""
    return float(np.abs((values - values[0]) / (values[-1] - values[0]) - np.linspace(0, 1, len(values))).max())


def middle_of_decades(values: Any) -> np.ndarray:
    """Return values that tell a unit: of positive ones over two decades or more their geometric mean."""
    known = np.ravel(np.asarray(values, dtype=float))
    known = known[np.isfinite(known)]
    if known.size and known.min() > 0 and known.max() >= 100 * known.min():
        return np.array([np.exp(np.log(known).mean())])
    return known


@dataclass(frozen=True)
class Curves:
    """A quantity of all cases over the rows.

    Attributes
    ----------
    quantity, over : str
        Names of the quantity and of the axis.
    frames : list of pandas.DataFrame
        Of each case over the axis: ``value``; of realisations their mean, ``lower`` and ``upper``, the 95 % prediction
        interval of a single one, and with a measured surface ``itself``. [SI]
    parameters : list of Parameter
        What was varied, without what follows from another parameter.
    counts : list of int
        Numbers of realisations; none of cases without any.
    """

    quantity: str
    over: str
    frames: list[pd.DataFrame]
    parameters: list[Parameter]
    counts: list[int]
    units: str

    @property
    def unit(self) -> Unit:
        """Unit to show the quantity in."""
        if self.quantity == "contact_fraction":
            return Unit(0.01, "%")
        return unit_for(middle_of_decades(np.concatenate([one["value"] for one in self.frames])), self.units)

    @property
    def label(self) -> str:
        """Label of an axis of the quantity."""
        return self.unit.label(label_of(self.quantity))

    @property
    def has_itself(self) -> bool:
        """Whether a measured surface is drawn among its surrogates."""
        return any("itself" in one for one in self.frames)

    def parameter(self, key: str) -> Parameter:
        """Return the parameter of a dotted key, or of its identifier."""
        for one in self.parameters:
            if key in (one.key, identifier(one.key)):
                return one
        raise InputError(f"{key!r} was not varied: expected one of {', '.join(one.key for one in self.parameters)}")


def label_of(quantity: str) -> str:
    """Return the name of a quantity on an axis."""
    return VARIABLES[quantity].label if quantity in VARIABLES else quantity.replace("_", " ").capitalize()


def curves_of(results: Any, quantity: str | None = None, over: str = "") -> Curves:
    """Read a quantity of all cases of a sweep.

    Parameters
    ----------
    results : xarray.Dataset
        Of :func:`roughvisc.sweep` or :func:`roughvisc.open_results`.
    quantity : str, optional
        A history of every case. Default: the contact area, or the contact fraction of surfaces of several sizes.
    over : str, optional
        Name of the axis. Default: time or speed.

    Raises
    ------
    InputError
        If the results are no sweep of several cases, or a case has no such history.
    """
    if not isinstance(results, xr.Dataset) or "case" not in results.dims or results.sizes["case"] < 2:
        raise InputError("expected the Dataset of rv.open_results or rv.sweep, with several cases")
    axis = axis_of(results.variables)
    over, quantity = over or axis, quantity or area_of(results)
    known = {name for name, one in results.variables.items() if {axis, "row"} & {*one.dims} and "x" not in one.dims}
    if over not in known:
        raise InputError(f"the results hold no {over!r} in every case: expected a temperature in the material")
    if quantity not in known:
        names = ", ".join(sorted(str(name) for name in known & {*results.data_vars}))
        raise InputError(f"quantity is {quantity!r}: expected a history of every case: {names}")
    varied = {str(name): one for name, one in results.coords.items() if _is_parameter(results, str(name))}
    columns = results[[quantity, over, *varied]].reset_coords()
    if quantity in _SPANNING:
        columns[quantity] = columns[quantity].where(columns[quantity] > 0)
    table = columns.to_dataframe().reset_index()
    table = table[np.isfinite(table[over]) & np.isfinite(table[quantity])]
    drawn = REALISATION in table and bool(table[REALISATION].notna().any())
    names = {_key(one): name for name, one in varied.items() if not drawn or _key(one) not in DRAWN}
    by = [name for name in names.values() if name != REALISATION] if drawn else ["case"]
    groups = [one for _, one in table.groupby(by or np.zeros(len(table)), sort=False, dropna=False)]
    if not groups or (len(groups) < 2 and not drawn):
        raise InputError("found one case with rows: expected several, as a sweep gives them")
    frames, counts = [], []
    for group in groups:
        frame, count = _frame(group, quantity, over)
        frames.append(frame)
        counts += [count] if count else []
    values = {key: np.array([group[name].iloc[0] for group in groups]) for key, name in names.items() if name in table}
    parameters = [
        Parameter(key, "", _numbers(one), str(varied[names[key]].attrs.get("units") or unit_of(key)))
        for key, one in values.items()
        if key != REALISATION
    ]
    units = str(results[quantity].attrs.get("units", VARIABLES[quantity].units if quantity in VARIABLES else ""))
    return Curves(quantity, over, frames, _independent(parameters), counts, units)


def area_of(results: xr.Dataset) -> str:
    """Return the name of the contact area to compare: the fraction of surfaces of several sizes."""
    if {"contact_fraction", "nominal_pressure", "force"} <= set(results.data_vars):
        sizes = (results["force"] / results["nominal_pressure"]).values
        sizes = sizes[np.isfinite(sizes)]
        if sizes.size and np.ptp(sizes) > 1e-6 * sizes.max():
            return "contact_fraction"
    return "contact_area"


def _is_parameter(results: xr.Dataset, name: str) -> bool:
    return name not in _NO_PARAMETERS[:3] and name not in AXES and set(results[name].dims) <= {"case", REALISATION}


def _key(coordinate: xr.DataArray) -> str:
    """Return the dotted key of a parameter, which its identifier does not tell."""
    stated = str(coordinate.attrs.get("long_name", ""))
    return stated if identifier(stated) == identifier(str(coordinate.name)) else str(coordinate.name)


def _frame(group: pd.DataFrame, quantity: str, over: str) -> tuple[pd.DataFrame, int]:
    """Return a case over the axis, and the number of its realisations; these are interpolated to common places."""
    if REALISATION not in group or group[REALISATION].isna().all():
        return group.set_index(over)[[quantity]].set_axis(["value"], axis=1).sort_index(), 0
    wide = group.pivot_table(index=over, columns=REALISATION, values=quantity)
    wide = wide.interpolate("index", limit_area="inside").dropna()
    itself = wide.pop(ITSELF) if ITSELF in wide and wide.shape[1] > 1 else None
    found = statistics(wide.to_numpy().T)
    frame = {"value": found["mean"], "lower": found["patch_lower"], "upper": found["patch_upper"]}
    return pd.DataFrame(frame | ({} if itself is None else {"itself": itself}), index=wide.index), wide.shape[1]


def _numbers(values: np.ndarray) -> np.ndarray:
    """Return numbers where every value is a list of one number, as of a material with one relaxation time."""
    try:
        read = [json.loads(value) for value in values.tolist()] if values.dtype.kind in "OU" else []
    except (TypeError, ValueError):
        return values
    alone = bool(read) and all(isinstance(one, list) and len(one) == 1 and type(one[0]) in (int, float) for one in read)
    return np.array([one[0] for one in read], dtype=float) if alone else values


def _independent(parameters: Sequence[Parameter]) -> list[Parameter]:
    """Return the parameters that vary, named, without those that follow one to one from another before them."""
    kept: list[Parameter] = []
    for one in parameters:
        pairs = [len(set(zip(one.places, other.places, strict=True))) for other in kept]
        follows = any(n == len(one.levels) == len(other.levels) for n, other in zip(pairs, kept, strict=True))
        if len(one.levels) > 1 and not follows:
            kept.append(one)
    kept.sort(key=lambda one: (not one.numeric, -len(one.levels)))
    names = names_of([one.key for one in kept])
    return [Parameter(one.key, names[one.key], one.values, one.si) for one in kept]


def combined(parameters: Sequence[Parameter], count: int) -> Parameter:
    """Return one parameter that stands for several, or for none: each combination is a level."""
    if len(parameters) == 1:
        return parameters[0]
    texts = [np.array(_named_texts(one))[one.places] for one in parameters]
    values = [", ".join(parts) for parts in zip(*texts, strict=True)] if texts else [""] * count
    return Parameter("", ", ".join(one.name for one in parameters), np.array(values))


def _named_texts(parameter: Parameter) -> list[str]:
    """Return levels as texts that say what they are: numbers with the name of the parameter."""
    named = parameter.values.dtype.kind not in "OU"
    return [f"{parameter.name} {text}" if named else text for text in parameter.texts()]


class Hue:
    """Colours of the levels of a parameter: a legend of a few, a colour bar of many numbers.

    Parameters
    ----------
    parameter : Parameter
        It colours lines.
    """

    def __init__(self, parameter: Parameter) -> None:
        self.parameter, count = parameter, len(parameter.levels)
        self.is_named = count <= _NAMED or not parameter.numeric
        at = parameter.positions
        norm = (LogNorm if parameter.is_logarithmic else Normalize)(at[0], at[-1]) if parameter.numeric else Normalize()
        shades = matplotlib.colormaps["viridis"].resampled(256)(np.linspace(0.0, 0.88, 256))
        self.mapped = ScalarMappable(norm, matplotlib.colors.ListedColormap(shades))
        if not parameter.numeric:
            palette = style.CYCLE if count <= len(style.CYCLE) else matplotlib.colormaps["tab20"].colors
            self.colours = [palette[level % len(palette)] for level in range(count)]
        else:
            even = np.linspace(0, 1, max(count, 2)) if count <= _NAMED else norm(at)
            self.colours = [self.mapped.cmap(float(one)) for one in np.atleast_1d(even)]

    def legend(self) -> dict[str, Artist]:
        """Return the entries of the legend."""
        if not self.is_named or len(self.parameter.levels) < 2:
            return {}
        texts = self.parameter.texts()
        return {text: Line2D([], [], color=colour) for text, colour in zip(texts, self.colours, strict=False)}

    def draw_bar(self, figure: Figure, axes: Sequence[Axes]) -> None:
        """Draw the colour bar of many numbers."""
        if not self.is_named:
            bar = figure.colorbar(self.mapped, ax=list(axes), pad=0.02, aspect=22)
            bar.set_label(self.parameter.unit.label(self.parameter.name))
            bar.outline.set_linewidth(0.6)
            bar.minorticks_off()
            style.readable_ticks(bar.ax.yaxis, *self.mapped.get_clim(), self.parameter.is_logarithmic)


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    columns = min(count, 2 if count in (2, 4) else 3)
    rows = -(-count // columns)
    size = (4.6, 3.3) if count == 1 else (min(1.0 + 2.4 * columns, 7.4), 3.3 if rows == 1 else 1.2 + 1.9 * rows)
    figure = style.new_figure(*size)
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for number, ax in enumerate(axes):
        ax.set_visible(number < count)
        ax.tick_params(labelbottom=number + columns >= count)
    return figure, list(axes[:count])


def _draw(ax: Axes, x: np.ndarray, frame: pd.DataFrame, unit: Unit, joined: bool = True, **look: Any) -> None:
    """Draw a line with its band and the measured surface; points of categories are not joined."""
    look |= {} if joined else {"ls": "", "marker": "o", "ms": 5}
    ax.plot(x, unit(frame["value"]), **look)
    if "lower" in frame and frame["lower"].notna().any():
        lower, upper = unit(frame["lower"]), unit(frame["upper"])
        if joined and len(frame) > 1:
            ax.fill_between(x, lower, upper, color=look["color"], alpha=0.22, lw=0, zorder=1)
        else:
            ax.vlines(x, lower, upper, color=look["color"], alpha=0.35, lw=5, zorder=1)
    if "itself" in frame:
        marks = {"marker": "D", "mfc": "w", "ms": 4} if not joined or len(frame) == 1 else {}
        ax.plot(x, unit(frame["itself"]), color=look["color"], **_ITSELF | marks)


def _finish(
    figure: Figure, axes: Sequence[Axes], curves: Curves, hue: Hue, across: str, titles: Sequence[str]
) -> Figure:
    """Set the scale of the quantity, the titles, the labels and the legend."""
    shown = np.concatenate(
        [np.ravel(line.get_ydata()) for ax in axes for line in ax.lines]
        + [path.vertices[:, 1] for ax in axes for one in ax.collections for path in one.get_paths()]
    )
    style.set_scale(axes[0].yaxis, shown[np.isfinite(shown)])
    for ax in axes:
        ax.grid(color="0.9", lw=0.5)
    style.letter_panels(axes, [textwrap.fill(title, 24) for title in titles])
    if len(axes) == 1:
        axes[0].set(xlabel=across, ylabel=curves.label)
    else:
        figure.supxlabel(across)
        figure.supylabel(curves.label)
    named = hue.legend()
    title = hue.parameter.name if named else ""
    if curves.counts:
        low, high = min(curves.counts), max(curves.counts)
        kind = "Gaussian surrogates" if curves.has_itself else "realisations"
        named[f"mean of {low if low == high else f'{low} to {high}'} {kind}"] = Line2D([], [], color="0.3", lw=1.6)
        named["95 % prediction interval"] = Patch(color="0.3", alpha=0.22, lw=0)
    if curves.has_itself:
        named["measured scan"] = Line2D([], [], color="0.3", **_ITSELF)
    style.legend_above(figure, named, title)
    hue.draw_bar(figure, axes)
    return figure


@style.apply
def histories(results: Any, quantity: str | None = None, *, by: str | None = None, over: str = "") -> Figure:
    """Draw a history of every case over time or speed, coloured by one parameter, with a panel for each other one.

    Parameters
    ----------
    results, quantity, over
        As of :func:`curves_of`.
    by : str, optional
        Dotted key of the parameter that colours the lines. Default: the one with the most numbers.

    Returns
    -------
    matplotlib.figure.Figure
    """
    curves = curves_of(results, quantity, over)
    first = curves.parameter(by) if by else next(iter(curves.parameters), None)
    count = len(curves.frames)
    first = first or Parameter("case", "Case", np.arange(1, count + 1))
    facets = combined([one for one in curves.parameters if one.key != first.key], count)
    if len(facets.levels) > _PANELS:
        facets = combined([], count)
    figure, axes = _panels(len(facets.levels))
    hue, axis = Hue(first), _axis_of(curves)
    for frame, colour, panel in zip(curves.frames, first.places, facets.places, strict=True):
        width = 2.3 - 1.3 * colour / max(1, len(first.levels) - 1)  # so that none hides another that it lies on
        marker = "o" if len(frame) * count <= 120 else ""
        look = {"color": hue.colours[colour], "lw": width, "marker": marker, "ms": 1.5 + width}
        _draw(axes[panel], axis.unit(frame.index), frame, curves.unit, **look)
    for ax in axes:
        axis.apply(ax, np.unique(np.concatenate([one.index for one in curves.frames])), most=7 if len(axes) == 1 else 4)
        ax.set_xlabel("")
        if curves.over != "time":
            ax.set_xscale("log")
    across = axis.unit.label("Reduced speed $a_T V$" if over == "reduced_speed" else axis.label)
    return _finish(figure, axes, curves, hue, across, _named_texts(facets) if len(axes) > 1 else [])


def _axis_of(curves: Curves) -> RowAxis:
    rows = np.unique(np.concatenate([one.index for one in curves.frames]))
    return RowAxis.of(rows, "speed" if curves.over == "reduced_speed" else curves.over)


@style.apply
def sweep(
    results: Any,
    quantity: str | None = None,
    *,
    along: str | Sequence[str] | None = None,
    times: float | Sequence[float] | None = None,
    kind: str = "auto",
) -> Figure:
    """Draw a quantity of every case against what was varied: as lines, or of two parameters as a map.

    The parameter with the most numbers lies along x. Another one colours the lines, further ones make panels; of a
    single parameter the times colour the lines. Of realisations the mean is drawn with the 95 % prediction interval of
    a single one and, of a scan, the measured scan.

    Parameters
    ----------
    results, quantity
        As of :func:`curves_of`.
    along : str or sequence of str, optional
        Dotted key of the parameter along x; of a map also of that along y.
    times : float or sequence of float, optional
        Times, or speeds, of which the nearest kept ones are drawn; negative whole numbers count from the end. Default:
        the last; of a single parameter up to four.
    kind : {"auto", "lines", "map"}
        A map is the default of two parameters of four or more values each.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the results are no sweep, nothing varies in them, or a name is unknown.
    """
    if kind not in ("auto", "lines", "map"):
        raise InputError(key="kind", found=kind, expected="'auto', 'lines' or 'map'")
    curves = curves_of(results, quantity)
    if not curves.parameters:
        raise InputError("nothing varies between the cases: nothing to draw against")
    first = [curves.parameter(key) for key in ([along] if isinstance(along, str) else along or ())]
    ordered = first + [one for one in curves.parameters if one not in first]
    across, rest = ordered[0], ordered[1:]
    table, titles = _at_times(curves, times, len(ordered) == 1)
    fewest = min((len(one.levels) for one in ordered), default=0)
    suits = len(ordered) == 2 and fewest >= _MAP_FROM and not isinstance(along, str)
    if kind == "map" or (kind == "auto" and (suits or len(first) == 2)):
        if not rest:
            raise InputError(f"a map needs two parameters that vary: found {across.key}")
        return _map(curves, table, titles, across, rest[0])
    frame_numbers = range(len(titles))
    count = len(curves.frames)
    if rest:
        hue_of, facets = rest[0], combined(rest[1:], count)
        if len(facets.levels) * len(titles) > _PANELS:
            hue_of, facets = combined(rest, count), combined([], count)
        names = _named_texts(facets) if len(facets.levels) > 1 else [""]
        panels = [(number, level) for level in range(len(names)) for number in frame_numbers]
        several = len(titles) > 1 or len(names) == 1
        heads = [", ".join(filter(None, (names[level], titles[number] if several else ""))) for number, level in panels]
    else:
        hue_of, facets = Parameter("", "", np.array(titles)), combined([], count)
        panels, heads = [(0, 0)], []
    figure, axes = _panels(len(panels))
    hue = Hue(hue_of)
    if not rest:
        shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.8, len(titles)))
        hue.colours = list(shades)
        for number, (colour, title) in enumerate(zip(shades, titles, strict=True)):
            _draw_across(axes[0], curves, table[number], across, np.arange(count), color=colour, label=title)
    for (number, level), ax in zip(panels if rest else [], axes, strict=False):
        for place in range(len(hue_of.levels)):
            chosen = np.flatnonzero((facets.places == level) & (hue_of.places == place))
            nested = 1 - 0.55 * place / max(1, len(hue_of.levels) - 1)  # so that none hides another that it lies on
            look = {"color": hue.colours[place], "lw": 2.3 * nested, "ms": 7 * nested}
            _draw_across(ax, curves, table[number], across, chosen, **look)
    for ax in axes:
        _set_parameter_axis(ax.xaxis, across, len(axes))
    return _finish(figure, axes, curves, hue, across.unit.label(across.name), heads)


def _at_times(curves: Curves, times: Any, alone: bool) -> tuple[list[pd.DataFrame], list[str]]:
    """Return, for each time that is drawn, the rows of all cases, and its title."""
    places = [one.index.to_numpy() for one in curves.frames]
    axis = _axis_of(curves)
    if times is not None:
        asked = np.atleast_1d(np.asarray(times, dtype=float)).ravel()
        if not 0 < asked.size <= _NAMED:
            raise InputError(key="times", found=asked.size, expected=f"1 to {_NAMED} times")
        chosen = [[frame_at(one, float(time)) for one in places] for time in asked]
    elif alone and all(np.array_equal(one, places[0]) for one in places):
        held = np.flatnonzero(
            [any(abs(one["value"].iloc[row]) > 0 for one in curves.frames) for row in range(len(places[0]))]
        )
        held = held if held.size else np.array([len(places[0]) - 1])
        chosen = [[int(held[row])] * len(places) for row in spread_frames(places[0][held], 4)]
    else:
        chosen = [[len(one) - 1 for one in places]]
    tables, titles = [], []
    for rows in chosen:
        tables.append(pd.concat([one.iloc[[row]] for one, row in zip(curves.frames, rows, strict=True)]))
        at = np.unique(tables[-1].index)
        ends = all(row == len(one) - 1 for row, one in zip(rows, places, strict=True))
        text = axis.text(float(np.median(at)))
        titles.append(text if at.size == 1 else "at the end" if ends else text.replace("=", "≈"))
    return tables, titles


def _draw_across(
    ax: Axes, curves: Curves, table: pd.DataFrame, across: Parameter, chosen: np.ndarray, **look: Any
) -> None:
    """Draw some cases against a parameter."""
    if chosen.size:
        at = across.positions[across.places[chosen]]
        order = np.argsort(at, kind="stable")
        look = {"marker": "o" if chosen.size <= 40 else "", "ms": 3.5} | look
        _draw(ax, at[order], table.iloc[chosen[order]], curves.unit, across.numeric, **look)


def _set_parameter_axis(axis: Axis, parameter: Parameter, panels: int = 1) -> None:
    """Set scale, limits and ticks of an axis of a parameter."""
    at, horizontal = parameter.positions, axis.axis_name == "x"
    if parameter.is_logarithmic:
        (axis.axes.set_xscale if horizontal else axis.axes.set_yscale)("log")
    borders = _borders(parameter)
    (axis.axes.set_xlim if horizontal else axis.axes.set_ylim)(borders[0], borders[-1])
    if parameter.numeric:
        style.readable_ticks(axis, at[0], at[-1], parameter.is_logarithmic)
        return
    step = -(-len(at) // 25)
    texts = parameter.texts()[::step]
    axis.set_ticks(at[::step], labels=texts)
    if horizontal and sum(map(len, texts)) * panels > 34:
        for label in axis.get_ticklabels():
            label.set(rotation=30 if len(texts) <= 6 else 90, ha="right", rotation_mode="anchor")
    axis.axes.tick_params(axis=axis.axis_name, length=0)


def _borders(parameter: Parameter) -> np.ndarray:
    """Return the borders between the levels, half way on the scale of the axis."""
    at = np.log(parameter.positions) if parameter.is_logarithmic else parameter.positions
    middle = (at[1:] + at[:-1]) / 2
    borders = np.concatenate([[2 * at[0] - middle[0]], middle, [2 * at[-1] - middle[-1]]])
    return np.exp(borders) if parameter.is_logarithmic else borders


def _map(curves: Curves, table: list[pd.DataFrame], titles: Sequence[str], across: Parameter, up: Parameter) -> Figure:
    """Draw a panel for each time, with a cell for each combination of two parameters."""
    if len(set(zip(across.places, up.places, strict=True))) < len(curves.frames):
        more = ", ".join(one.key for one in curves.parameters if one not in (across, up))
        raise InputError(f"several cases lie in one cell of the map: choose among {more} first, or use kind='lines'")
    shown = curves.unit([one["value"].to_numpy() for one in table])
    known = shown[np.isfinite(shown)]
    low, high = (known.min(), known.max()) if known.size else (0.0, 1.0)
    logarithmic = bool(low > 0 and high >= 30 * low)
    norm = LogNorm(low, high) if logarithmic else Normalize(low, high if high > low else low + 1)
    figure = style.new_figure(1.4 + 2.6 * len(shown), 2.9)
    axes = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    colours = matplotlib.colormaps["viridis"].with_extremes(bad=style.ABSENT)
    for ax, row in zip(axes, shown, strict=True):
        cells = np.full((len(up.levels), len(across.levels)), np.nan)
        cells[up.places, across.places] = row
        mesh = ax.pcolormesh(_borders(across), _borders(up), np.ma.masked_invalid(cells), cmap=colours, norm=norm)
        _set_parameter_axis(ax.xaxis, across, len(axes))
        _set_parameter_axis(ax.yaxis, up)
        ax.tick_params(direction="out", which="both")
        ax.label_outer(remove_inner_ticks=False)
        ax.set_xlabel(across.unit.label(across.name))
    axes[0].set_ylabel(up.unit.label(up.name))
    bar = figure.colorbar(mesh, ax=list(axes), pad=0.02, aspect=22)
    bar.set_label(curves.label)
    bar.outline.set_linewidth(0.6)
    bar.minorticks_off()
    style.readable_ticks(bar.ax.yaxis, *mesh.get_clim(), logarithmic)
    style.letter_panels(axes, titles)
    return figure
