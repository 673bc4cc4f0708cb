"""Line figures: histories, area against load, friction against speed, cost against error, and sources of an error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.arguments import listed_names, one_of
from roughvisc.errors import InputError
from roughvisc.judge.trade import format_tolerance, pareto_front, uncertainty
from roughvisc.labels import error_of, steps_of
from roughvisc.observables.history import expect_result
from roughvisc.observables.theory import asperity_fraction, persson_fraction
from roughvisc.plot import style
from roughvisc.topography.grid import nominal_area, rms_slope
from roughvisc.units import Unit, quantities, unit_for
from roughvisc.variables import AXES, VARIABLES, axis_of

#: Least error, over the largest value, that a figure shows.
_VISIBLE = 0.01
#: Largest number of rows for which dots are drawn.
_DOTS = 40
#: Offsets at which the label of a point may stand, and half of the width and height that a label needs. [pt]
_OFFSETS = ((0.0, 7.0), (0.0, -7.0), (14.0, 0.0), (-14.0, 0.0))
_LABEL = (16.0, 7.0)


@style.apply
def history(dataset: xr.Dataset, quantities: Sequence[str] | str | None = None, *, over: str | None = None) -> Figure:
    """Draw quantities over time, over the distance slid, over the speed, or over each other.

    Lines pass through every time step, and dots mark the kept times. Bands show the stated error, with the grid
    error if the result contains it. A band is omitted if the error is below 1 % of the largest value everywhere. A
    result without the history of its steps has only dots. The axis is logarithmic if the largest value exceeds thirty
    times the smallest.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result. If it is merged with :func:`roughvisc.observables.area_by_theory`, the theory is drawn as
        well. :func:`sweep` draws several cases.
    quantities : sequence of str, optional
        One panel for each quantity. Default: force, approach, contact area, mean gap, work, friction coefficient, leak
        rate and conductances, if in the result; over the sliding distance, friction coefficient and contact area.
    over : str, optional
        Quantity on the horizontal axis, such as ``"sliding_distance"``, or ``"approach"`` for a loop of hysteresis.
        Default: time or speed.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or lacks a quantity.

    See Also
    --------
    roughvisc.plot.sweep, roughvisc.observables.history

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy("1 um", "0.1 mm", "0.1 mm", 16)
    >>> press = rv.Program().pressure("20 kPa", over="1 s")
    >>> ds = rv.simulate(wave, rv.elastic(1e6), press, times=3, progress=False)
    >>> figure = rv.plot.history(ds, ["contact_area", "mean_gap"])
    >>> len(figure.axes)
    2
    """
    dataset = expect_result(dataset)
    axis = axis_of(dataset.variables)
    over = over or axis
    default = [name for name, variable in VARIABLES.items() if variable.is_panel]
    if over == "sliding_distance":
        default = ["friction_coefficient", "contact_area"]
    wanted = [name for name in default if name in dataset] if quantities is None else quantities
    names = listed_names(wanted)
    expect_result(dataset, over, *(names or default))
    kept = dataset.sortby(axis)
    steps = steps_of(kept) if axis == "time" else kept
    # an odd number of panels in two columns would leave a hole
    columns = 2 if len(names) > 3 and len(names) % 2 == 0 else 1
    height = 0.9 if len(names) > 2 else 1.7
    figure, axes = style.new_panels(len(names), columns, (4.1 - 0.6 * columns, height), shared="x", left=0.85)
    across = style.row_axis(axes, (kept if steps is None or over not in steps else steps)[over])
    for ax, name in zip(axes, names, strict=True):
        line = kept if steps is not None and not {name, over} <= steps.variables.keys() else steps
        _draw_history(ax, name, line, kept, over, across)
    figure.align_ylabels()
    style.letter(axes)
    style.legend_above(figure, style.named_in(*axes))
    return figure


def _draw_history(ax: Axes, name: str, steps: xr.Dataset | None, kept: xr.Dataset, over: str, across: Unit) -> None:
    """Draw a quantity as a line through the steps and dots at the kept rows, with the theory and the stated error.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Panel to draw in.
    name, over : str
        Quantities on the vertical and on the horizontal axis.
    steps : xarray.Dataset or None
        Both quantities at the steps; None if these are not known.
    kept : xarray.Dataset
        Both quantities at the kept rows.
    across : Unit
        Unit of the horizontal axis.
    """
    values = kept[name]
    at = across(kept[over])
    label, si = style.described(kept[name])
    colour = style.CONTACT if "contact" in name else style.BLUE
    line = values if steps is None else steps[name]
    unit = unit_for(line, si)
    is_finer = line.size > values.size
    if steps is not None:
        ax.plot(across(steps[over]), unit(line), color=colour, label="time steps" if is_finer else None)
    if values.size <= _DOTS or steps is None:
        unnamed = "computed" if f"persson_{name}" in kept else None
        label_of_dots = "kept times" if is_finer or steps is None else unnamed
        ax.plot(at, unit(values), "o", color=colour, label=label_of_dots)
    error = error_of(kept, name)
    if error is not None and float(error.max()) > _VISIBLE * float(abs(values).max()):
        ax.fill_between(
            at, unit(values - error), unit(values + error), color=colour, alpha=0.18, lw=0, label="stated error"
        )
    if f"persson_{name}" in kept:
        ax.plot(at, unit(kept[f"persson_{name}"]), "--", color="k", lw=0.9, label="Persson")
    drawn = np.concatenate([one.get_ydata() for one in ax.lines])
    style.value_axis(ax, drawn, unit, may_vanish=name == "leak_rate")
    is_long = style.LETTER * len(unit.label(label)) > ax.get_position().height * ax.figure.get_figheight()
    ax.set_ylabel(unit.label(label).replace(" [", "\n[") if is_long else unit.label(label))


@style.apply
@quantities(contact_modulus="Pa")
def area_against_load(results: xr.Dataset | Mapping[str, xr.Dataset], *, contact_modulus: Any = None) -> Figure:
    r"""Draw the contact area, corrected for the grid, against the force at every time step, one line per result.

    A result that has lost the history of its steps has dots at its kept times, without a line.

    Parameters
    ----------
    results : xarray.Dataset, or mapping of str to xarray.Dataset
        One case's result, or a mapping whose keys name the lines.
    contact_modulus : float or str, or mapping of str to float or str, optional
        Contact modulus for the lines of the theories, or several moduli by name, such as
        ``{"glassy": 4e6, "rubbery": 1e6}``. [Pa]

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If a result contains several cases, or the name of a modulus equals no name of a result.

    See Also
    --------
    roughvisc.plot.history, roughvisc.observables.area_by_theory

    Notes
    -----
    The line for low loads is :math:`A = \sqrt{2 \pi} F / (E^* h'_\mathrm{rms})` [1]_. The line of Persson's theory
    [2]_ is :math:`A = A_0 \, \mathrm{erf}(\sqrt2 F / (A_0 E^* h'_\mathrm{rms}))`. Both use the root-mean-square slope
    of the first surface, and are drawn up to the nominal area.

    References
    ----------
    .. [1] A. W. Bush, R. D. Gibson, T. R. Thomas, *Wear* 35 (1975) 87-111.
    .. [2] B. N. J. Persson, *J. Chem. Phys.* 115 (2001) 3840-3861.

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy("1 um", "0.1 mm", "0.1 mm", 16)
    >>> press = rv.Program().pressure("20 kPa", over="1 s")
    >>> ds = rv.simulate(wave, rv.elastic(1e6), press, times=3, progress=False)
    >>> figure = rv.plot.area_against_load(ds, contact_modulus="4 MPa")
    >>> len(figure.axes)
    1
    """
    if isinstance(results, xr.Dataset):
        results = {"computed": results}
    if not isinstance(results, Mapping) or not results:
        raise InputError(key="results", found=type(results).__name__, expected="a result, or a mapping of results")
    cases = {str(label): expect_result(dataset, "time", "force", "contact_area") for label, dataset in results.items()}
    steps = {label: steps_of(case) for label, case in cases.items()}
    lines = {label: case if steps[label] is None else steps[label] for label, case in cases.items()}
    loads, areas = (np.concatenate([one[name] for one in lines.values()]) for name in ("force", "contact_area"))
    across = unit_for(loads, "N")
    up = unit_for(areas, "m^2")
    figure, (ax,) = style.new_panels(1, 1, (3.4, 2.6), lines=0)
    for (label, one), look in zip(lines.items(), style.distinct(len(lines)), strict=True):
        if steps[label] is not None and one["force"].size > _DOTS:
            look["markevery"] = one["force"].size // 8
        if steps[label] is None:
            look["ls"] = ""
        ax.plot(across(one["force"]), up(one["contact_area"]), label=style.verbatim(label), **look)
    if contact_modulus is not None and loads.max() > 0:
        named = contact_modulus if isinstance(contact_modulus, Mapping) else {"": contact_modulus}
        first = next(iter(cases.values()))
        expect_result(first, "height")
        slope = rms_slope(first["height"], periodic=first.attrs.get("boundary") == "periodic")
        nominal = nominal_area(first)
        forces = np.geomspace(1e-3 * loads.max(), loads.max(), 50)
        for (name, modulus), dash in zip(named.items(), ("--", ":", "-.") * len(named), strict=False):
            for label, theory, shade in (("low loads", asperity_fraction, "k"), ("Persson", persson_fraction, "0.55")):
                area = nominal * theory(forces / (nominal * modulus * slope))
                look = {"color": shade, "ls": dash, "lw": 0.9, "label": f"{label}, {name}" if name else label}
                ax.plot(across(forces[area <= nominal]), up(area[area <= nominal]), **look)
    style.value_axis(ax, up(areas), up)
    if style.is_logarithmic(loads):
        style.log_axis(ax.xaxis, across(loads))
        style.log_axis(ax.yaxis, up(areas))
    style.label_panels([ax], across.label(VARIABLES["force"].label), up.label(VARIABLES["contact_area"].label))
    style.legend_above(figure, style.named_in(ax))
    return figure


def friction(dataset: xr.Dataset) -> Figure:
    """Draw friction coefficient and contact fraction against the logarithm of the speed.

    Bands show the stated error, as in :func:`history`. Speeds without a solution are missing.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.friction`, or of a study of friction. If it is merged with the result of
        :func:`roughvisc.observables.persson`, the theory is drawn as dashed lines. :func:`sweep` draws several cases.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset does not hold friction over the speed.

    See Also
    --------
    roughvisc.friction, roughvisc.plot.history

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave, rubber = rv.wavy("1 um", "1 mm", ("1 mm", "0.1 mm"), (24, 3), waves=1), rv.zener(3e6, 1e6, 1e3)
    >>> curve = rv.friction(wave, rubber, pressure="50 kPa", speeds=["1 mm/s", "1 m/s"], progress=False)
    >>> len(rv.plot.friction(curve).axes)
    2
    """
    names = ("friction_coefficient", "contact_fraction")
    expect_result(dataset, "speed", *names)
    return history(dataset, names)


@style.apply
def trade(dataset: xr.Dataset, quantity: str | None = None) -> Figure:
    """Draw wall time against error of every setting, with the Pareto front.

    Each grid has a marker. Labels above the points state their tolerances. Errors below the uncertainty of the
    reference lie in a grey band, and are not part of the front.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.trade`.
    quantity : str, optional
        Quantity whose error is drawn. Default: the first one of the trade.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not a trade or does not hold the quantity.

    See Also
    --------
    roughvisc.trade, roughvisc.plot.budget

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     measured = rv.trade(case, [(1e-1, 1.0)], out=folder, progress=False).load()
    >>> figure = rv.plot.trade(measured)
    """
    if not isinstance(dataset, xr.Dataset) or "run_time" not in dataset:
        raise InputError("expected the Dataset of rv.trade")
    known = dataset["quantity"].values.tolist()
    quantity = one_of("quantity", quantity or known[0], known)
    table = dataset.sel(quantity=quantity)[["run_time", "error", "tolerance", "cells_x", "cells_y"]].to_dataframe()
    table["error"] *= 100
    unsure = float(np.nan_to_num(100 * uncertainty(dataset, quantity)))
    front = table[pareto_front(dataset, quantity) & (table["error"] > unsure)].sort_values("run_time", kind="stable")
    table = table.dropna(subset=["run_time", "error"])
    figure, (ax,) = style.new_panels(1, 1, (3.4, 2.6), lines=0)
    style.log_axis(ax.xaxis, table["run_time"])
    style.log_axis(ax.yaxis, table["error"])
    ax.plot(front["run_time"], front["error"], color="0.35", lw=1.0, zorder=1, label="Pareto front")
    for marker, (grid, own) in zip(cycle("o^vsDP"), table.groupby(["cells_x", "cells_y"]), strict=False):
        label = f"{grid[0]} × {grid[1]} cells"
        ax.plot(own["run_time"], own["error"], marker, ms=5, mew=0, zorder=3, label=label)
    ax.margins(0.15)
    low, high = ax.get_ylim()
    if unsure > low:
        ax.axhspan(low, unsure, color="0.93", zorder=0, label="reference uncertainty")
    ax.set(ylim=(low, high), xlabel="Wall time [s]", ylabel=f"Error of {VARIABLES[quantity].label.lower()} [%]")
    points = table[["run_time", "error"]].to_numpy()
    for point, offset, tolerance in zip(points, _free_offsets(ax, points), table["tolerance"], strict=True):
        look = {"textcoords": "offset points", "fontsize": 6.5, "color": "0.25", "ha": "center", "va": "center"}
        ax.annotate(format_tolerance(tolerance), point, offset, **look)
    style.legend_above(figure, style.named_in(ax))
    return figure


def _free_offsets(ax: Any, points: np.ndarray) -> list[tuple[float, float]]:
    """Return the offset of the label of each point [pt], to the first of four places far from points and labels."""
    scale = 72 / ax.figure.dpi
    here = scale * ax.transData.transform(points)
    taken = [*here]
    offsets = []
    for point in here:
        away = [min(np.hypot(*((point + offset - other) / np.array(_LABEL))) for other in taken) for offset in _OFFSETS]
        best = next((number for number, distance in enumerate(away) if distance >= 1), int(np.argmax(away)))
        offsets.append(_OFFSETS[best])
        taken.append(point + _OFFSETS[best])
    return offsets


@style.apply
def budget(dataset: xr.Dataset, row: int = -1) -> Figure:
    """Draw the sources of error of a result as bars: the ends of their 95 % intervals.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.budget`, for one quantity.
    row : int
        Number of the row whose sources are drawn.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not a budget, or holds several quantities.

    See Also
    --------
    roughvisc.budget, roughvisc.plot.trade

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sources = rv.budget(case, "approach", out=folder, workers=0, progress=False).load()
    >>> figure = rv.plot.budget(sources)
    """
    if not isinstance(dataset, xr.Dataset) or "half_width" not in dataset or "source" not in dataset.dims:
        raise InputError("expected the Dataset of rv.budget")
    if "quantity" in dataset.dims:
        raise InputError("found several quantities: expected one, such as dataset.sel(quantity='contact_area')")
    axis = AXES[axis_of(dataset.variables)]
    unknown = dataset.attrs["open"].split("; ")
    names = [f"{name} (open)" if name in unknown else str(name) for name in dataset["source"].values]
    at = dataset.isel({axis.name: row})
    half = at["half_width"].values
    towards = at["direction"].values
    low = np.where(towards <= 0, -half, 0.0)
    high = np.where(towards >= 0, half, 0.0)
    whole = [float(at[end] / at["value"].where(at["value"] != 0)) for end in ("lower", "upper")]
    ends = 100 * (np.nan_to_num([*np.exp(np.c_[low, high]), whole], nan=1.0) - 1)
    figure, (ax,) = style.new_panels(1, 1, (2.6, 2.1), lines=0, left=0.2 + style.LETTER * max(map(len, names)))
    colours = [*[style.BLUE] * half.size, "0.35"]
    ax.barh([*names, "all together"], ends[:, 1] - ends[:, 0], left=ends[:, 0], height=0.62, color=colours)
    ax.invert_yaxis()
    ax.axvline(0.0, color="black", lw=0.7)
    what = str(dataset["quantity"].values).replace("_", " ")
    ax.set_xlabel(f"Error of {what} at {axis.place(float(at[axis.name]))} [%]")
    ax.use_sticky_edges = False  # else a bar ends at the frame
    ax.margins(x=0.15, y=0.06)
    return figure
