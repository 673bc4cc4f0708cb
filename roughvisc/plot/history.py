"""Histories of one case, area against load, and friction against speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from roughvisc.errors import InputError
from roughvisc.observables import history as steps_of
from roughvisc.observables.frames import expect_result
from roughvisc.observables.theory import asperity_fraction, persson_fraction
from roughvisc.plot import style
from roughvisc.topography.grid import nominal_area
from roughvisc.topography.parameters import rms_slope
from roughvisc.units import Unit, quantities, unit_for
from roughvisc.variables import VARIABLES, axis_of

#: Quantities that are drawn if the result holds them.
_QUANTITIES = (
    *("force", "approach", "contact_area", "mean_gap", "work", "friction_coefficient"),
    *("leak_rate", "thermal_conductance", "electrical_conductance"),
)
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
    """
    expect_result(dataset)
    axis = axis_of(dataset.variables)
    over = over or axis
    default = ("friction_coefficient", "contact_area") if over == "sliding_distance" else _QUANTITIES
    wanted = [name for name in default if name in dataset] if quantities is None else quantities
    names = [wanted] if isinstance(wanted, str) else list(wanted)
    expect_result(dataset, over, *names)
    if not names:
        raise InputError(f"the result holds none of {', '.join(default)}: nothing to draw over {over}")
    kept = dataset.sortby(axis)
    steps = steps_of(kept) if axis == "time" else kept
    places = (steps if over in steps else kept)[over]
    columns = 1 if len(names) <= 3 else 2
    size = (3.7, 1.1) if columns == 1 else (2.8, 1.05)
    figure, axes = style.new_panels(len(names), columns, *size, shared="x", left=0.8)
    for ax, name in zip(axes, names, strict=True):
        line = steps if name in steps and over in steps else kept
        _draw_history(ax, name, line, kept, over, style.row_unit(places))
    style.row_axis(axes, places)
    style.letter_panels(axes)
    style.align(axes)
    named = style.named_in(*axes)
    if steps.sizes[axis] > kept.sizes[axis] and kept.sizes[axis] <= _DOTS:
        dots = Line2D([], [], color="0.3", ls="", marker="o")
        named = {"time steps": Line2D([], [], color="0.3"), "kept times": dots} | named
    style.legend_above(figure, named)
    return figure


def _draw_history(ax: Axes, name: str, steps: xr.Dataset, kept: xr.Dataset, over: str, across: Unit) -> None:
    """Draw a quantity as a line through the steps and dots at the kept rows, with Persson's theory if known."""
    label, si = style.described(kept[name])
    look = {"color": style.CONTACT if name == "contact_area" else style.BLUE}
    line, dots = (one[name].where(np.isfinite(one[name])) for one in (steps, kept))
    if name == "leak_rate":  # a logarithmic axis has no zero
        line, dots = line.where(line > 0), dots.where(dots > 0)
    unit = unit_for(line, si)
    ax.plot(across(steps[over]), unit(line), **look)
    if dots.size <= _DOTS:
        ax.plot(across(kept[over]), unit(dots), "o", **look)
    if f"persson_{name}" in kept:
        ax.plot(across(kept[over]), unit(kept[f"persson_{name}"]), "--", color="k", lw=0.9, label="Persson")
    style.value_axis(ax, *(one.get_ydata() for one in ax.lines))
    if ax.get_yscale() == "linear":
        ax.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
    ax.set_ylabel(unit.label(label + "\n" if len(label) > 14 else label).rstrip())


@style.apply
@quantities(contact_modulus="Pa")
def area_against_load(results: xr.Dataset | Mapping[str, xr.Dataset], *, contact_modulus: Any = None) -> Figure:
    r"""Draw the contact area, corrected for the grid, against the force at every time step, one line per result.

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

    Notes
    -----
    The line for low loads is :math:`A = \sqrt{2 \pi} F / (E^* h'_\mathrm{rms})` [1]_. The line of Persson's theory
    [2]_ is :math:`A = A_0 \, \mathrm{erf}(\sqrt2 F / (A_0 E^* h'_\mathrm{rms}))`. Both use the root-mean-square slope
    of the first surface, and are drawn up to the nominal area.

    References
    ----------
    .. [1] A. W. Bush, R. D. Gibson, T. R. Thomas, *Wear* 35 (1975) 87-111.
    .. [2] B. N. J. Persson, *J. Chem. Phys.* 115 (2001) 3840-3861.
    """
    if isinstance(results, xr.Dataset):
        results = {"computed": results}
    if not isinstance(results, Mapping) or not results:
        raise InputError(key="results", found=type(results).__name__, expected="a result, or a mapping of results")
    for dataset in results.values():
        expect_result(dataset, "time", "force", "contact_area")
    lines = {str(label): steps_of(dataset) for label, dataset in results.items()}
    loads, areas = (np.concatenate([one[name].values for one in lines.values()]) for name in ("force", "contact_area"))
    across, up = unit_for(loads, "N"), unit_for(areas, "m^2")
    figure, (ax,) = style.new_panels(1, 1, 3.4, 2.6, lines=0)
    for (label, one), colour in zip(lines.items(), style.CYCLE * len(lines), strict=False):
        look = {"marker": "o" if one["force"].size <= _DOTS else "", "color": colour}
        ax.plot(across(one["force"]), up(one["contact_area"]), label=style.verbatim(label), **look)
    if contact_modulus is not None and loads.max() > 0:
        named = contact_modulus if isinstance(contact_modulus, Mapping) else {"": contact_modulus}
        first = next(iter(results.values()))
        expect_result(first, "height")
        slope = rms_slope(first["height"], periodic=first.attrs.get("boundary") == "periodic")
        nominal, forces = nominal_area(first), np.geomspace(1e-3 * loads.max(), loads.max(), 50)
        for (name, modulus), dash in zip(named.items(), ("--", ":", "-.") * len(named), strict=False):
            for label, theory, shade in (("low loads", asperity_fraction, "k"), ("Persson", persson_fraction, "0.55")):
                area = nominal * theory(forces / (nominal * modulus * slope))
                look = {"color": shade, "ls": dash, "lw": 0.9, "label": f"{label}, {name}" if name else label}
                ax.plot(across(forces[area <= nominal]), up(area[area <= nominal]), **look)
    style.value_axis(ax, up(areas))
    if style.is_logarithmic(loads):
        style.log_axis(ax.xaxis, across(loads))
        style.log_axis(ax.yaxis, up(areas))
    style.label_panels([ax], across.label(VARIABLES["force"].label), up.label(VARIABLES["contact_area"].label))
    if len(ax.lines) > 1:
        style.legend_above(figure, style.named_in(ax))
    return figure


@style.apply
def friction(dataset: xr.Dataset) -> Figure:
    """Draw friction coefficient and contact fraction against the logarithm of the speed.

    Bands show the error of the grid, if it is in the result. Speeds without a solution are missing.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.friction`, or of a study of friction. If it is merged with the result of
        :func:`roughvisc.observables.persson`, the theory is drawn as dotted lines. :func:`sweep` draws several cases.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset does not hold friction over the speed.
    """
    panels = {"friction_coefficient": "grid_error_friction", "contact_fraction": "grid_error_area"}
    for name in panels:
        if not isinstance(dataset, xr.Dataset) or name not in dataset or dataset[name].dims != ("speed",):
            raise InputError(f"expected a result of rv.friction, with {name!r} over the speed")
    ordered = dataset[[name for name in dataset.data_vars if dataset[name].dims == ("speed",)]].sortby("speed").load()
    across = unit_for(ordered["speed"].values, "m/s")
    speed = across(ordered["speed"].values)
    figure, axes = style.new_panels(2, 2, 2.4, 2.0)
    named: dict[str, Artist] = {}
    for ax, (name, error), colour in zip(axes, panels.items(), (style.BLUE, style.CONTACT), strict=True):
        values, theory = ordered[name].values, f"persson_{name}"
        ax.plot(speed, values, "o-", ms=3, color=colour)
        if error in ordered and np.isfinite(ordered[error]).any():
            half = ordered[error].values * values
            ax.fill_between(speed, np.maximum(values - half, 0), values + half, color=colour, alpha=0.18, lw=0)
            named["error of the grid"] = Patch(color="0.3", alpha=0.25, lw=0)
        if theory in ordered:
            ax.plot(speed, ordered[theory].values, ":", color=colour)
            named["Persson (2001): waves stressed as in full contact"] = Line2D([], [], color="0.3", ls=":")
        ax.set_xscale("log")
        ax.set_ylim(bottom=0)
        style.label_panels([ax], across.label(VARIABLES["speed"].label), VARIABLES[name].label)
        ax.grid()
    style.letter_panels(axes)
    style.legend_above(figure, {"computed": Line2D([], [], color="0.3", marker="o", ms=3)} | named if named else {})
    return figure
