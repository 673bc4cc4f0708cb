"""Figure of a quantity of all cases of a sweep, as small multiples over the swept keys."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.labels import ATTRIBUTES, steps_of
from roughvisc.plot import style
from roughvisc.plot.fields import rows_at
from roughvisc.study.case_text import names_of, value_text
from roughvisc.study.sweep_table import ITSELF, REALISATION, statistics
from roughvisc.variables import AXES, CONDUCTANCES, ROW, ROWS, STEPPED, VARIABLES, axis_of

#: Largest number of panels, and of values of a key in a legend.
_MOST_PANELS = 12
_MOST_NAMED = 12


def swept_keys(results: xr.Dataset) -> dict[str, pd.Series]:
    """Return coordinate -> values of each swept key for all cases, under its label.

    Categories are ascending numbers in the unit of the label, or texts in the order of the cases. Keys with most
    numbers come first. Of keys that vary together only the first one is kept.
    """
    names = [str(name) for name, one in results.coords.items() if one.dims == ("case",)]
    others = ("case", "case_key", ATTRIBUTES, ROWS)
    cases = pd.DataFrame({name: results[name].values for name in names if name not in others})
    first: dict[tuple[int, ...], str] = {}
    for name in cases:
        first.setdefault(tuple(pd.factorize(cases[name], use_na_sentinel=False)[0]), name)
    dotted = {name: str(results[name].attrs.get("long_name", name)) for codes, name in first.items() if any(codes)}
    words = names_of(list(dotted.values()))
    keys = {}
    for name, key in dotted.items():
        values = cases[name]
        label = words[key]
        if values.dtype.kind in "iuf" and np.isfinite(values).all() and not key.endswith("seed"):
            unit = style.middle_unit(values, str(results[name].attrs.get("units", "")))
            shown = pd.Categorical(unit(values))
            label = unit.label(label)
        else:
            texts = [style.verbatim(value_text(key, value) or "none") for value in values]
            texts = [text if len(text) <= 40 else f"{text[:20]}…{text[-19:]}" for text in texts]
            shown = pd.Categorical(texts, dict.fromkeys(texts))
        keys[name] = pd.Series(shown, results["case"].values, name=label)
    return dict(sorted(keys.items(), key=lambda item: (_is_text(item[1]), -len(item[1].cat.categories))))


def _is_text(column: pd.Series) -> bool:
    """Return whether the categories of a column are texts."""
    return isinstance(column.cat.categories[0], str)


@style.apply
def sweep(results: xr.Dataset, quantity: str | None = None, *, along: str | None = None, times: Any = -1) -> Figure:
    """Draw a quantity of all cases against a swept key, or over time, as small multiples over the other keys.

    The key with the next most numbers gives the lines colours, dashes and markers, all others make panels, up to
    twelve. Of equal lines the earlier ones are wider. Realisations are drawn
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
        ``"reduced_speed"`` for curves of all cases. Lines over the time pass through every step, if known, and markers
        are the kept times; other lines join the rows. Default: the key with most numbers, or the speed; if only
        realisations vary, the time.
    times : list of float or str, str or int, default -1
        Times, as a list or one text with a unit; the nearest kept times are drawn. Negative whole numbers, also a
        single one, count from the end. [s]

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the results are not a sweep, or a name is unknown.

    See Also
    --------
    roughvisc.sweep, roughvisc.plot.history

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> cases = rv.vary(case, {"tolerance": [0.1, 0.01]})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     results = rv.sweep(cases, folder, workers=0, progress=False).load()
    >>> figure = rv.plot.sweep(results, "approach", along="tolerance")
    """
    if not isinstance(results, xr.Dataset) or results.sizes.get("case", 1) * results.sizes.get(REALISATION, 1) < 2:
        raise InputError("expected the Dataset of rv.open_results or rv.sweep, with several cases")
    axis = axis_of(results.variables)
    quantity = quantity or ("friction_coefficient" if axis == "speed" else "contact_area")
    row = ROW if ROW in results.dims else axis
    curves = [str(name) for name, one in results.variables.items() if row in one.dims and not {"x", "y"} & {*one.dims}]
    one_of("quantity", quantity, curves)
    keys = swept_keys(results)
    along = (along or ("speed" if axis == "speed" else next(iter(keys), axis))).replace(".", "_")
    one_of("along", along, [*keys, *curves])
    cases = pd.DataFrame({one.name: one for one in keys.values()})
    if along in keys:
        across = keys.pop(along).name
        others = [name for name in cases if name != across]
        table = _at_times(results[quantity], times)
        columns = [across, *others[:1], "", *others[1:]]
    else:
        table = _curves(results, quantity, along)
        columns = [along, *cases]
    table = table.join(cases, on="case") if len(cases) else table
    return _draw(table, results[quantity], columns, results[along] if along in curves else None)


def _curves(results: xr.Dataset, quantity: str, along: str) -> pd.DataFrame:
    """Return a table of a quantity of all cases along an axis: at every step over time if known, else at the rows.

    The column ``is_kept`` marks the rows of the results.
    """
    rows = results[[quantity, along]].load().to_dataframe().reset_index()
    if along != "time" or quantity not in STEPPED or REALISATION in results.dims or "case" not in results.dims:
        return rows.assign(is_kept=True)
    parts = []
    for case, number in enumerate(results["case"].values.tolist() if "case" in results.coords else []):
        steps = steps_of(results.isel(case=case))
        if steps is None or quantity not in steps:
            return rows.assign(is_kept=True)
        part = pd.DataFrame({"case": number, along: steps[along].values, quantity: steps[quantity].values})
        kept = rows.loc[rows["case"] == number, along].dropna()
        parts.append(part.assign(is_kept=part[along].isin(kept) & ~part[along].duplicated(keep="last")))
    return pd.concat(parts, ignore_index=True) if parts else rows.assign(is_kept=True)


def _at_times(values: xr.DataArray, times: Any = -1) -> pd.DataFrame:
    """Return a table of a quantity of all cases at some times, with the time as text in a column without a name."""
    axis = axis_of(values.coords)
    table = values.load().to_dataframe().reset_index().dropna(subset=axis)
    rows = table.groupby([dim for dim in ("case", REALISATION) if dim in values.dims])[axis]
    parts = []
    for place, is_from_end in zip(*rows_at(times, axis, "times", rows.size().max(), _MOST_PANELS), strict=True):
        off = rows.cumcount(ascending=False) + 1 + place if is_from_end else table[axis] - place
        part = table.loc[off.abs().groupby(rows.ngroup()).idxmin()]
        text = AXES[axis].place(part[axis].iloc[0], 3)
        if part[axis].nunique() > 1:
            text = "at the end" if place == -1 else f"near {text}"
        parts.append(part.assign(**{"": text}))
    table = pd.concat(parts)
    return table.assign(**{"": pd.Categorical(table[""], table[""].unique())}, is_kept=True)


def _draw(table: pd.DataFrame, quantity: xr.DataArray, columns: list[str], over: xr.DataArray | None = None) -> Figure:
    """Draw a table of cases: the first column, or `over`, across; the next one as colours; the others as panels."""
    name = str(quantity.name)
    label, si = style.described(quantity)
    table = table[np.isfinite(table[name])]
    if table.empty:
        raise InputError(f"{name} has no value to draw")
    unit = style.middle_unit(table[name][table[name] > 0] if name == "leak_rate" else table[name], si)
    table = table.assign(shown=unit(table[name]))
    # each line of a panel is one family
    across = columns[0]
    families = columns[1:2]
    rest = columns[2:]
    while len(panels := _grouped(table, rest)) > _MOST_PANELS:
        families.append(rest.pop())
    titles = [_title(rest, levels) for levels, _ in panels]
    count = len(table[rest[-1]].cat.categories) if rest else 1
    size = (2.1, 1.7) if count > 1 else (3.4, 2.0)
    room = {}
    texts = list(table[across].cat.categories) if over is None and _is_text(table[across]) else []
    is_turned = style.LETTER * len(" ".join(texts)) > size[0]
    if is_turned:
        room["bottom"] = 0.45 + style.LETTER * max(map(len, texts))
    lines = max(len(title.splitlines()) for title in titles)
    figure, axes = style.new_panels(len(panels), count if count <= 4 else 3, size, shared="xy", lines=lines, **room)
    table = _placed(axes, table, across, over)
    looks = _looks(table[families[0]]) if families else {None: {"color": style.BLUE, "marker": "o"}}
    for ax, (_, panel), title in zip(axes, _grouped(table, rest), titles, strict=True):
        for (level, *_), line in _grouped(panel, families):
            _draw_line(ax, line.sort_values("across"), looks[level], joined=not texts)
        style.value_axis(ax, table["shown"], unit, may_vanish=name == "leak_rate")
        ax.set_title(title)
        ax.tick_params(axis="x", labelrotation=90 if is_turned else 0)
    style.label_panels(axes, y=unit.label(label))
    style.letter(axes)
    named = style.named_in(*axes)
    in_order = {look["label"]: named.pop(look["label"]) for look in looks.values() if look.get("label") in named}
    style.legend_above(figure, in_order | named, families[0] if families else "")
    return figure


def _grouped(table: pd.DataFrame, columns: list[str]) -> list[tuple[tuple[Any, ...], pd.DataFrame]]:
    """Return the values of some columns and the lines with them; the whole table without columns."""
    return list(table.groupby(columns, observed=True)) if columns else [((None,), table)]


def _title(columns: list[str], levels: tuple[Any, ...]) -> str:
    """Return the title of a panel, with one line or more for each column."""
    lines = []
    for column, level in zip(columns, levels, strict=False):
        name, _, symbol = column.rstrip("]").partition(" [")
        lines.append(textwrap.fill(f"{name} {_text(level)} {symbol}".strip(), 26))
    return "\n".join(lines)


def _text(level: Any) -> str:
    """Return a level as text without unit."""
    return level if isinstance(level, str) else f"{level:.4g}"


def _looks(column: pd.Series) -> dict[Any, dict[str, Any]]:
    """Return level of a column -> colour, marker, dash and label of its lines; of many only some have a label."""
    levels = column.cat.categories
    shades = matplotlib.colormaps["viridis"](np.linspace(0, 0.8, len(levels)))  # without the light end
    named = {*levels[:: -(-len(levels) // _MOST_NAMED)]}
    texts = [_text(level) if level in named else None for level in levels]
    others = style.distinct(len(levels))
    return {
        level: {"color": shade, "label": text} | other
        for level, shade, text, other in zip(levels, shades, texts, others, strict=True)
    }


def _placed(axes: Sequence[Axes], table: pd.DataFrame, column: str, over: xr.DataArray | None) -> pd.DataFrame:
    """Scale and label the horizontal axis; return a table with the places on it as column ``across``."""
    if over is not None:
        return table.assign(across=style.row_axis(axes, over)(table[column]))
    style.label_panels(axes, column)
    levels = table[column].cat.categories
    if _is_text(table[column]):
        axes[0].set_xticks(range(len(levels)), levels)
        axes[0].set_xlim(-0.5, len(levels) - 0.5)
        return table.assign(across=table[column].cat.codes)
    if style.is_logarithmic(levels):
        style.log_axis(axes[0].xaxis, levels)
    return table.assign(across=table[column].astype(float))


def _draw_line(ax: Axes, line: pd.DataFrame, look: dict[str, Any], *, joined: bool) -> None:
    """Draw one line of a panel; of realisations the mean, the prediction interval, and the measured scan."""
    look = dict(look)
    if line["is_kept"].sum() > 100:
        look["marker"] = ""
    elif not joined:
        look["marker"] = look.get("marker") or "o"
    if not joined:
        look["ls"] = ""
    if REALISATION not in line:
        ax.plot(line["across"], line["shown"], markevery=np.flatnonzero(line["is_kept"]).tolist(), **look)
        return
    # realisations with times of their own are interpolated to common times
    wide = line.pivot_table("shown", "across", REALISATION).interpolate("index", limit_area="inside").dropna()
    itself = wide.pop(ITSELF) if ITSELF in wide and wide.shape[1] > 1 else None
    summary = statistics(wide.to_numpy().T)
    ends = wide.index, summary["patch_lower"], summary["patch_upper"]
    band = {"color": look["color"], "label": f"mean and 95 % prediction interval, {wide.shape[1]} realisations"}
    if joined and len(wide) > 1:
        ax.fill_between(*ends, alpha=0.22, lw=0, **band)
    else:
        ax.vlines(*ends, alpha=0.35, lw=5, **band)
    ax.plot(wide.index, summary["mean"], **look)
    if itself is not None:
        dashed = {"marker": "D", "mfc": "w", "ms": 4, "lw": 1.1, "ls": "--" if joined else "", "label": "measured scan"}
        ax.plot(itself.index, itself, **(look | dashed))


def sweep_figures(results: xr.Dataset) -> Iterator[tuple[str, str, Figure]]:
    """Yield name, caption and figure of everything that the results of several cases allow.

    A quantity that is the same in all cases, or equal to a swept key, is left out.
    """
    axis = axis_of(results.variables)
    in_time = ("contact_area", "leak_rate", *CONDUCTANCES)
    in_speed = ("friction_coefficient", "contact_fraction")
    for name in in_speed if axis == "speed" else in_time:
        if name in results and results[name].any():
            caption = f"{VARIABLES[name].label} over {axis}, for each case."
            yield f"{name}-{axis}", caption, sweep(results, name, along=axis)
    if "reduced_speed" in results and not np.allclose(results["reduced_speed"], results["speed"], equal_nan=True):
        caption = "Master curve: friction coefficient against the speed times the shift factor of the temperature."
        yield "master", caption, sweep(results, along="reduced_speed")
    keys = swept_keys(results)
    for name in (*in_time, "approach", "force") if keys and axis == "time" else ():
        if name in results:
            table = _at_times(results[name])
            stated = [table[name].iloc[0], *(table[key] for key in keys if results[key].dtype.kind in "iuf")]
            small = 1e-6 * table[name].abs().max()
            if not any(np.allclose(table[name], one, rtol=0, atol=small) for one in stated):
                yield name, f"{VARIABLES[name].label} against the swept settings.", sweep(results, name)
