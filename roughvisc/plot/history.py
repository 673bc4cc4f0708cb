"""Histories of one case, area against load, and friction against speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from roughvisc.errors import InputError
from roughvisc.labels import own_rows
from roughvisc.observables import history as steps_of
from roughvisc.observables.theory import asperity_fraction, nominal_area_of, persson_fraction
from roughvisc.plot import style
from roughvisc.plot.rows import expect_result, rows_of
from roughvisc.plot.sweep import case_label, sweep, swept_keys
from roughvisc.topography.parameters import rms_slope
from roughvisc.units import quantities, unit_for
from roughvisc.variables import VARIABLES, axis_of

#: Quantities that are drawn if the result holds them, and their colours.
_COLOURS = {
    "force": style.BLUE,
    "approach": style.GREEN,
    "contact_area": style.CONTACT,
    "mean_gap": style.PURPLE,
    "work": style.ORANGE,
    "friction_coefficient": style.BLUE,
    "leak_rate": style.SKY,
    "thermal_conductance": style.VERMILION,
    "electrical_conductance": style.VERMILION,
}
#: Quantity -> other quantities in its panel, with their labels.
_BESIDE = {"contact_area": {"contact_area_counted": "counted cells", "persson_contact_area": "Persson"}}
#: Largest number of rows for which dots are drawn.
_DOTS = 40


@style.apply
def history(dataset: xr.Dataset, quantities: Sequence[str] | str | None = None, *, over: str | None = None) -> Figure:
    """Draw quantities over time, over the distance slid, over the speed, or over each other.

    Lines pass through every time step in the result, dots mark the kept times. The axis is logarithmic if the largest
    value exceeds thirty times the smallest.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result. If it is merged with :func:`roughvisc.observables.area_by_theory`, the theory is drawn as
        well. For several cases, one quantity is drawn as in :func:`sweep`.
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
    """
    asked = [quantities] if isinstance(quantities, str) else quantities
    if isinstance(dataset, xr.Dataset) and "case" in dataset.dims:
        if asked is not None and len(asked) != 1:
            raise InputError(key="quantities", found=asked, expected="one quantity of several cases")
        return sweep(dataset, asked[0] if asked else None, along=over or axis_of(dataset.variables))
    expect_result(dataset)
    axis = axis_of(dataset.variables)
    over = over or axis
    default = ("friction_coefficient", "contact_area") if over == "sliding_distance" else _COLOURS
    names = [name for name in default if name in dataset] if asked is None else list(asked)
    expect_result(dataset, over, *names)
    if not names:
        raise InputError(f"the result holds none of {', '.join(default)}: nothing to draw over {over}")
    kept = dataset.sortby(axis)
    steps = steps_of(kept) if axis == "time" else kept
    if over == "sliding_distance":  # the loading before the first slide has one sliding distance
        begins = max(int((steps[over].values > 0).argmax()) - 1, 0)
        steps, kept = steps.isel(time=slice(begins, None)), kept.sel(time=slice(float(steps["time"][begins]), None))
    columns = 1 if len(names) <= 3 else 2
    rows = -(-len(names) // columns)
    figure = style.new_figure(4.6 if columns == 1 else 7.2, 1.5 * rows + 0.8)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax, name in zip(axes, names, strict=False):
        _draw_history(ax, steps if name in steps and over in steps else kept, kept, name, over)
    for unused in axes[len(names) :]:
        unused.remove()
    axes = list(axes[: len(names)])
    for ax in axes[:-columns]:
        ax.set_xlabel("")
        ax.tick_params(labelbottom=False)
    style.letter_panels(axes)
    named = style.named_in(*axes)
    if rows_of(steps).size > rows_of(kept).size and rows_of(kept).size <= _DOTS:
        look = {"color": "0.3", "label": ""}
        named = {"time steps": Line2D([], [], **look), "kept times": Line2D([], [], ls="", marker="o", **look)} | named
    style.legend_above(figure, named)
    figure.align_ylabels(axes)
    return figure


def _draw_history(ax: Axes, steps: xr.Dataset, kept: xr.Dataset, name: str, over: str) -> None:
    """Draw a quantity as a line through the steps and dots at the kept rows."""
    declared = VARIABLES[name]
    if name == "leak_rate":  # a logarithmic axis has no zero
        steps, kept = (one.assign({name: one[name].where(one[name] > 0)}) for one in (steps, kept))
    steps, kept = (one.assign({name: one[name].where(np.isfinite(one[name]))}) for one in (steps, kept))
    unit, across = unit_for(steps[name], declared.units), style.row_unit(steps[over])
    colour = _COLOURS.get(name, style.BLUE)
    beside = {
        label: one[other]
        for other, label in _BESIDE.get(name, {}).items()
        for one in (steps if other in steps else kept,)
        if other in one and one[other].notnull().any()
    }
    ax.plot(across(steps[over]), unit(steps[name]), color=colour, label="corrected for the grid" if beside else None)
    if kept[over].size <= _DOTS:
        ax.plot(across(kept[over]), unit(kept[name]), "o", color=colour)
    for (label, other), shade in zip(beside.items(), ("k", "0.5"), strict=False):
        at = (steps if other.size == steps[name].size else kept)[over]
        ax.plot(across(at), unit(other), "--", color=shade, lw=0.9, label=label)
    style.value_axis(ax, *map(unit, (steps[name], *beside.values())))
    if ax.get_yscale() == "linear":
        ax.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
    style.row_axis(ax, steps[over])
    ax.set_ylabel(unit.label(declared.label + "\n" if len(declared.label) > 14 else declared.label))


@style.apply
@quantities(contact_modulus="Pa")
def area_against_load(results: Any, *, contact_modulus: Any = None) -> Figure:
    r"""Draw the contact area, corrected for the grid, against the force at every time step, one line per case.

    Parameters
    ----------
    results : xarray.Dataset, or mapping of str to xarray.Dataset
        One case's result, several over ``case``, or a mapping whose keys name the lines.
    contact_modulus : float or str, or mapping of str to float or str, optional
        Contact modulus for the lines of the theories, or several moduli by name, such as
        ``{"glassy": 4e6, "rubbery": 1e6}``. [Pa]

    Returns
    -------
    matplotlib.figure.Figure

    Notes
    -----
    The line for low loads is :math:`A = \sqrt{2 \pi} F / (E^* h'_\mathrm{rms})` [1]_. The line of Persson's theory
    [2]_ is :math:`A = A_0 \, \mathrm{erf}(\sqrt2 F / (A_0 E^* h'_\mathrm{rms}))`. Both use the root-mean-square slope
    of the first case's surface, and are drawn up to the nominal area.

    References
    ----------
    .. [1] A. W. Bush, R. D. Gibson, T. R. Thomas, *Wear* 35 (1975) 87-111.
    .. [2] B. N. J. Persson, *J. Chem. Phys.* 115 (2001) 3840-3861.
    """
    if isinstance(results, xr.Dataset) and "case" in results.dims:
        keys, several = swept_keys(results), results
        cases = [several.isel(case=number) for number in range(several.sizes["case"])]
        labels = [case_label(keys, [one[key.column].item() for key in keys]) for one in cases]
        results = {
            label or f"case {i}": own_rows(one) for i, (label, one) in enumerate(zip(labels, cases, strict=True))
        }
    elif isinstance(results, xr.Dataset):
        results = {"computed": results}
    if not isinstance(results, Mapping) or not results:
        raise InputError(key="results", found=type(results).__name__, expected="a result, or a mapping of results")
    for dataset in results.values():
        expect_result(dataset, "time", "force", "contact_area")
    lines = {str(label): steps_of(dataset) for label, dataset in results.items()}
    loads, areas = (np.concatenate([one[name].values for one in lines.values()]) for name in ("force", "contact_area"))
    across, up = unit_for(loads, "N"), unit_for(areas, "m^2")
    figure = style.new_figure(4.2, 3.4)
    ax = figure.add_subplot()
    for (label, one), colour in zip(lines.items(), style.CYCLE * len(lines), strict=False):
        look = {"marker": "o" if one["force"].size <= _DOTS else "", "color": colour}
        ax.plot(across(one["force"]), up(one["contact_area"]), label=style.verbatim(label), **look)
    if contact_modulus is not None:
        named = contact_modulus if isinstance(contact_modulus, Mapping) else {"": contact_modulus}
        first = next(iter(results.values()))
        expect_result(first, "height")
        slope = rms_slope(first["height"], periodic=first.attrs.get("boundary") == "periodic")
        nominal, forces = nominal_area_of(first), np.geomspace(1e-3 * loads.max(), loads.max(), 50)
        for (name, modulus), dash in zip(named.items(), ("--", ":", "-.") * len(named), strict=False):
            for label, theory, shade in (("low loads", asperity_fraction, "k"), ("Persson", persson_fraction, "0.55")):
                area = nominal * theory(forces / (nominal * modulus * slope))
                look = {"color": shade, "ls": dash, "lw": 0.9, "label": f"{label}, {name}" if name else label}
                ax.plot(across(forces[area <= nominal]), up(area[area <= nominal]), **look)
    style.value_axis(ax, up(areas))
    if style.is_logarithmic(loads):
        style.log_axis(ax.xaxis, across(loads))
        style.log_axis(ax.yaxis, up(areas))
    ax.set_xlabel(across.label(VARIABLES["force"].label))
    ax.set_ylabel(up.label(VARIABLES["contact_area"].label))
    if len(ax.lines) > 1 and len(lines) <= 12:
        style.legend_above(figure, style.named_in(ax))
    return figure


#: Variables of a friction curve: computed value, value of Persson's theory, and error of the grid.
_FRICTION = (
    ("friction_coefficient", "persson_friction_coefficient", "grid_error_friction", style.BLUE),
    ("contact_fraction", "persson_contact_fraction", "grid_error_area", style.CONTACT),
)


@style.apply
def friction(dataset: xr.Dataset, *, reduced: bool = False) -> Figure:
    """Draw friction coefficient and contact fraction against the logarithm of the speed.

    Bands show the error of the grid, if it is in the result. Speeds without a solution are missing.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.friction`, or of a study of friction. If it is merged with the result of
        :func:`roughvisc.observables.persson`, the theory is drawn as dotted lines. For several cases, the friction
        coefficient is drawn as in :func:`sweep`.
    reduced : bool
        Whether to draw several cases against the speed times the shift factor of the temperature, ``a_T V``. Curves of
        several temperatures then fall on one master curve.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset does not hold friction over the speed.
    """
    if isinstance(dataset, xr.Dataset) and "case" in dataset.dims:
        return sweep(dataset, "friction_coefficient", along="reduced_speed" if reduced else "speed")
    for name, *_ in _FRICTION:
        if not isinstance(dataset, xr.Dataset) or name not in dataset or dataset[name].dims != ("speed",):
            raise InputError(f"expected a result of rv.friction, with {name!r} over the speed")
    ordered = dataset[[name for name in dataset.data_vars if dataset[name].dims == ("speed",)]].sortby("speed").load()
    across = unit_for(ordered["speed"].values, "m/s")
    speed = across(ordered["speed"].values)
    figure = style.new_figure(6.4, 2.9)
    axes = figure.subplots(1, 2)
    named: dict[str, Any] = {}
    for ax, (name, theory, grid, colour) in zip(axes, _FRICTION, strict=True):
        values = ordered[name].values
        shown = [values]
        ax.plot(speed, values, "o-", ms=3, color=colour, label=VARIABLES[name].label)
        if grid in ordered and np.isfinite(ordered[grid]).any():
            error = ordered[grid].values * values
            ax.fill_between(speed, np.maximum(values - error, 0), values + error, color=colour, alpha=0.18, lw=0)
            named["error of the grid"] = Patch(color="0.3", alpha=0.25, lw=0)
            shown.append(values + error)
        if theory in ordered:
            ax.plot(speed, ordered[theory].values, ":", color=colour)
            named["Persson (2001): waves stressed as in full contact"] = Line2D([], [], color="0.3", ls=":")
            shown.append(ordered[theory].values)
        ax.set_xscale("log")
        ax.set_ylim(0, 1.08 * float(np.nanmax(np.concatenate(shown), initial=0.0)) or 1.0)
        ax.set_xlabel(across.label(VARIABLES["speed"].label))
        ax.set_ylabel(VARIABLES[name].label)
        ax.grid()
    style.letter_panels(axes)
    style.legend_above(figure, {"computed": Line2D([], [], color="0.3", marker="o", ms=3)} | named if named else {})
    return figure
