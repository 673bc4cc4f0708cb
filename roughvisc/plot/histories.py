"""Figures of histories: quantities over the axis of a result, and area against load."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from roughvisc.errors import InputError
from roughvisc.labels import own_rows
from roughvisc.observables import area_by_theory
from roughvisc.observables import history as over_steps
from roughvisc.observables.theory import asperity_fraction, nominal_area_of, persson_fraction
from roughvisc.plot import style
from roughvisc.plot.rows import RowAxis, require, rows_of, spans_decades
from roughvisc.plot.sweeps import histories
from roughvisc.study.case import Case
from roughvisc.topography.parameters import rms_slope
from roughvisc.units import quantities, unit_for
from roughvisc.variables import AXES, VARIABLES, axis_of

_PANELS = (
    ("force", style.BLUE),
    ("approach", style.GREEN),
    ("contact_area", style.CONTACT),
    ("mean_gap", style.PURPLE),
    ("work", style.ORANGE),
    ("friction_coefficient", style.BLUE),
    ("leak_rate", style.SKY),
    ("thermal_conductance", style.VERMILION),
    ("electrical_conductance", style.VERMILION),
)
#: What else belongs in a panel, with its label, colour and dashes.
_BESIDE = {
    "contact_area": (
        ("contact_area_counted", "counted", "k", (0, (4, 2))),
        ("persson_contact_area", "Persson", "0.5", (0, (1, 1.5))),
    ),
}
#: Largest over smallest leak rate from which its axis is logarithmic.
_SPANS = 30.0
#: Panels up to which they stand in one column.
_ONE_COLUMN = 3


def steps_of(dataset: xr.Dataset) -> xr.Dataset:
    """Histories of every time step over the axis of a result; its rows if it holds no steps."""
    return over_steps(dataset) if axis_of(dataset.variables) == "time" else dataset


def _draw_history(ax: Axes, axis: RowAxis, dataset: xr.Dataset, steps: xr.Dataset, name: str, colour: str) -> None:
    """Draw a line through every time step, if the result holds them all, and a dot at each kept time."""
    on = steps if name in steps else dataset
    times, values = axis.unit(rows_of(on)), on[name].where(np.isfinite(on[name])).values
    spans = name == "leak_rate" and np.nanmax(values, initial=0.0) > _SPANS * values[values > 0].min(initial=np.inf)
    values = np.where(values > 0, values, np.nan) if spans else values
    unit = unit_for(values, VARIABLES[name].units)
    beside = [one for one in _BESIDE.get(name, ()) if one[0] in on and on[one[0]].notnull().any()]
    ax.plot(times, unit(values), color=colour, label="corrected" if beside else "_")
    kept = axis.unit(rows_of(dataset))
    if marker := style.marker_of(len(kept)):
        shown = dataset[name].where(dataset[name] > 0) if spans else dataset[name].where(np.isfinite(dataset[name]))
        ax.plot(kept, unit(shown), ls="", marker=marker, color=colour)
    else:
        ax.plot(kept, np.zeros(len(kept)), "|", color="0.4", ms=5, mew=0.4, transform=ax.get_xaxis_transform())
    for other, said, shade, dashes in beside:
        ax.plot(times, unit(on[other]), color=shade, ls=dashes, lw=0.9, label=said)
    if spans:
        style.spread_axis(ax.yaxis, unit(values))
    else:
        style.leave_room(
            ax, *(unit(on[one].where(np.isfinite(on[one]))) for one in (name, *(one[0] for one in beside)))
        )
        ax.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
    ax.set_ylabel(style.broken(unit.label(VARIABLES[name].label), 1.0))


def marks_of_rows(dataset: xr.Dataset, steps: xr.Dataset) -> dict[str, Line2D]:
    """Legend of lines and marks of histories: time steps, kept times or speeds."""
    rows, named = AXES[axis_of(dataset.variables)].rows, {}
    count = rows_of(dataset).size
    if rows_of(steps).size > count:
        named["time steps"] = Line2D([], [], color="0.3")
    look = {"marker": style.marker_of(count)} if style.marker_of(count) else {"marker": "|", "mew": 0.4, "ms": 5}
    named[rows] = Line2D([], [], color="0.3", ls="", **look)
    return named


def _fraction_axis(ax: Axes, steps: xr.Dataset) -> None:
    """Contact fraction on the right of the panel of the area, where the two are proportional."""
    if "contact_fraction" not in steps:
        return
    area = unit_for(steps["contact_area"], "m^2")(steps["contact_area"])
    touching = area > 0
    if not touching.any():
        return
    ratios = 100 * steps["contact_fraction"].values[touching] / area[touching]
    ratio = float(np.nanmean(ratios))
    if ratio > 0 and float(np.nanmax(np.abs(ratios - ratio))) < 1e-6 * ratio:
        right = ax.secondary_yaxis("right", functions=(lambda shown: shown * ratio, lambda shown: shown / ratio))
        right.set_ylabel("Contact\nfraction [%]")


@style.apply
def history(
    dataset: xr.Dataset, quantity: str | None = None, *, by: str | None = None, persson: bool = False
) -> Figure:
    """Draw force, approach, contact area, mean gap, work and rates over the axis of a result; of a sweep one of them.

    Lines are drawn through every time step, dots at the kept times; if the dots would touch, strokes at the axis mark
    the kept times. Friction is drawn for a program that slides; leak rate and conductance are drawn if the result holds
    them, a leak rate over decades on a logarithmic axis. Of a sweep one quantity of all cases is drawn, coloured by one
    parameter, with a panel for each value of the others; of realisations their mean, the 95 % prediction interval of a
    single one and, of a scan, the measured scan.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result, or the results of a sweep.
    quantity : str, optional
        Of a sweep: a history of every case. Default: the contact area, or the contact fraction of surfaces of several
        sizes.
    by : str, optional
        Of a sweep: dotted key of the parameter that colours the lines. Default: the one with the most numbers.
    persson : bool
        Whether to draw the contact area by Persson's theory too, up to where the load falls: see
        :func:`~roughvisc.observables.area_by_theory`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is no result, or holds none of the histories; of Persson's theory, as that.
    """
    if "case" in getattr(dataset, "dims", ()):
        return histories(dataset, quantity, by=by)
    require(dataset)
    over = axis_of(dataset.variables)
    dataset = dataset.sortby(over)
    steps = steps_of(dataset)
    if persson:
        material = Case.of_result(dataset).material()
        theory = area_by_theory(steps.assign(height=dataset["height"]).assign_attrs(dataset.attrs), material)
        steps = steps.assign(persson_contact_area=theory["persson_contact_area"])
    panels = [panel for panel in _PANELS if panel[0] in dataset]
    if not panels:
        names = ", ".join(name for name, _ in _PANELS)
        raise InputError(f"the result holds none of {names}: nothing to draw over {over}")
    columns = 1 if len(panels) <= _ONE_COLUMN else 2
    rows = -(-len(panels) // columns)
    figure = style.new_figure(4.6 if columns == 1 else 7.2, 1.5 * rows + 0.8)
    axes = list(figure.subplots(rows, columns, squeeze=False).ravel())
    for empty in axes[len(panels) :]:
        empty.remove()
    axes, axis = axes[: len(panels)], RowAxis.of(rows_of(steps))
    for number, (ax, (name, colour)) in enumerate(zip(axes, panels, strict=True)):
        _draw_history(ax, axis, dataset, steps, name, colour)
        if name == "contact_area":
            _fraction_axis(ax, steps)
        axis.apply(ax, rows_of(steps), most=7 if columns == 1 else 5)
        lowest = number + columns >= len(panels)
        ax.tick_params(labelbottom=lowest)
        ax.set_xlabel(ax.get_xlabel() if lowest else "")
        ax.grid(axis="both", color="0.9", lw=0.5)
        style.legend_over(ax, 3.6 if columns == 1 else 2.7)
    style.letter_panels(axes)
    style.legend_above(figure, marks_of_rows(dataset, steps))
    figure.align_ylabels(axes)
    return figure


_AREA = "contact_area"
#: What the lines of the theories are, and what they assume.
_THEORIES = (
    "low loads: $A = \\sqrt{2\\pi}\\,F / (E^*\\,h^\\prime)$, little contact (Bush, Gibson, Thomas)\n"
    "Persson: $A = A_0\\,\\mathrm{erf}(\\sqrt{2}\\,F / (A_0\\,E^*\\,h^\\prime))$\n"
    "both: a Gaussian surface of rms slope $h^\\prime$,\nan elastic material of the modulus at the time named"
)
#: Recipes of surfaces without roughness.
_SMOOTH = ("sphere", "cone", "flat_punch", "wavy")


def _as_cases(results) -> dict[str, xr.Dataset]:
    """Results by the label each has in the legend."""
    if isinstance(results, xr.Dataset):
        if "case" in results.dims:
            numbers = range(results.sizes["case"])
            return {_case_name(results, number): own_rows(results.isel(case=number)) for number in numbers}
        results = [results]
    if isinstance(results, Mapping):
        return {str(label): dataset for label, dataset in results.items()}
    if not isinstance(results, Iterable):
        raise InputError(f"expected one result, a list or a mapping of them, found {type(results).__name__}")
    cases: dict[str, xr.Dataset] = {}
    for number, dataset in enumerate(results, 1):
        label = str(getattr(dataset, "attrs", {}).get("title") or f"case {number}")
        cases[label if label not in cases else f"{label} ({number})"] = dataset
    if not cases:
        raise InputError("no result given: nothing to draw")
    return cases


def _case_name(results: xr.Dataset, number: int) -> str:
    """What was varied in a case, as its coordinates tell; else its number."""
    texts = []
    for key, coordinate in results.coords.items():
        if coordinate.dims == ("case",) and key not in ("case", "case_key", "rows"):
            name = str(coordinate.attrs.get("long_name", key)).rpartition(".")[2].replace("_", " ")
            value, si = coordinate.values[number], coordinate.attrs.get("units")
            texts.append(f"{name} {value if si is None else unit_for([value], si).text(value)}")
    return ", ".join(texts) or str(results["case"].values[number])


@style.apply
@quantities(contact_modulus="Pa")
def area_against_load(results, *, contact_modulus=None) -> Figure:
    r"""Contact area, corrected for the grid, against force at every time step, one line per case.

    Parameters
    ----------
    results : xarray.Dataset, list or mapping of them
        Results; the keys of a mapping, or else their titles, name the lines.
    contact_modulus : float or str, or mapping of them, optional
        Contact modulus, or several by name such as ``{"glassy": 4e6, "rubbery": 1e6}``, for which to draw the lines
        of the theories; ``{}`` for none. By default, where all cases state one material and a rough surface with
        periodic boundaries: that at once and that after the last kept time. [Pa]

    Returns
    -------
    matplotlib.figure.Figure

    Notes
    -----
    The line of low loads is :math:`A = \sqrt{2 \pi} F / (E^* h'_\mathrm{rms})` [1]_, up to the nominal area; that of
    Persson's theory [2]_ :math:`A = A_0 \, \mathrm{erf}(\sqrt2 F / (A_0 E^* h'_\mathrm{rms}))`; both with the
    root-mean-square slope of the first case's surface. What a result's own history of load gives by them is
    :func:`~roughvisc.observables.area_by_theory`.

    References
    ----------
    .. [1] A. W. Bush, R. D. Gibson, T. R. Thomas, *Wear* 35 (1975) 87-111.
    .. [2] B. N. J. Persson, *J. Chem. Phys.* 115 (2001) 3840-3861.
    """
    cases = _as_cases(results)
    for dataset in cases.values():
        require(dataset, "time", "force", _AREA)
    steps = {label: over_steps(dataset) for label, dataset in cases.items()}
    loads, areas = ([one[name].values for one in steps.values()] for name in ("force", _AREA))
    across, up = unit_for(np.concatenate(loads), "N"), unit_for(np.concatenate(areas), "m^2")
    moduli = _stated_moduli(cases) if contact_modulus is None else contact_modulus
    figure = style.new_figure(4.0, 3.0 + 0.15 * min(len(cases), 12) + (0.0 if moduli == {} else 1.2))
    ax = figure.add_subplot()
    for number, (label, x, y) in enumerate(zip(cases, map(across, loads), map(up, areas), strict=True)):
        colour = style.CYCLE[number % len(style.CYCLE)] if len(cases) <= len(style.CYCLE) else "0.5"
        nested = 2.2 - 1.2 * number / max(1, len(cases) - 1)  # a line shows on both sides of another on it
        look = {"color": colour, "marker": style.marker_of(len(x)), "ms": 1.5 + nested, "lw": nested}
        ax.plot(x, y, label=style.verbatim(label) if len(cases) <= 12 else "_", **look)
    top = float(np.max(np.concatenate(loads)))
    drawn = _draw_theories(ax, next(iter(cases.values())), moduli, top, across, up)
    if spans_decades(np.sort(np.concatenate(loads))):
        style.spread_axis(ax.xaxis, across(np.concatenate(loads)))
        style.spread_axis(ax.yaxis, up(np.concatenate(areas)))
    else:
        style.leave_room(ax, *map(up, areas))
        ax.set_xlim(left=min(0.0, ax.get_xlim()[0]))
    ax.set_xlabel(across.label(VARIABLES["force"].label))
    ax.set_ylabel(up.label(VARIABLES[_AREA].label))
    ax.grid(color="0.9", lw=0.5)
    if drawn:
        figure.supxlabel(_THEORIES, fontsize=style.SMALL, color="0.35")
    if len(named := style.named_in(ax)) > 1:
        style.legend_above(figure, named)
    return figure


def _stated_moduli(cases: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Contact moduli that the results tell by themselves, where the theories hold; else none. [Pa]"""
    stated = [json.loads(one.attrs.get("case", "{}")) for one in cases.values()]
    first, material = next(iter(cases.values())), stated[0].get("material")
    of_one_material = material is not None and all(one.get("material") == material for one in stated)
    rough = "height" in first and stated[0].get("surface", {}).get("generate") not in _SMOOTH
    endless = first.attrs.get("boundary") in ("periodic", "mirror") and not {"thickness", "kernel"} & first.attrs.keys()
    if not (of_one_material and rough and endless):
        return {}
    known = Case.of_result(first).material()
    end = max(float(one["time"][-1]) for one in cases.values())
    named = {"at once": 0.0, f"after {unit_for([end], 's').text(end)}": end}
    compliances = {name: float(known.contact_compliance(time)) for name, time in named.items()}
    if len(set(compliances.values())) == 1:
        return {"": 1 / compliances["at once"]}
    return {name: 1 / compliance for name, compliance in compliances.items() if compliance > 0}


def _draw_theories(ax: Axes, dataset: xr.Dataset, moduli, top: float, across, up) -> bool:
    """Lines up to a load [N]; whether there is any to draw."""
    named = moduli if isinstance(moduli, Mapping) else {"": moduli}
    if not named:
        return False
    require(dataset, "height")
    slope = rms_slope(dataset["height"], periodic=dataset.attrs.get("boundary") == "periodic")
    nominal = nominal_area_of(dataset)
    for (name, modulus), dash in zip(named.items(), ((4, 2), (1, 1.5), (6, 1, 1, 1)) * len(named), strict=False):
        for label, theory, shade in (("low loads", asperity_fraction, "k"), ("Persson", persson_fraction, "0.55")):
            loads = np.geomspace(1e-3 * top, top, 50)
            areas = nominal * theory(loads / (nominal * modulus * slope))
            known = areas <= nominal
            said = f"{label}, {name}" if name else label
            ax.plot(across(loads[known]), up(areas[known]), color=shade, lw=0.9, ls=(0, dash), label=said)
    return True
