"""The figure of contact area against load, and the lines that theories have for rough surfaces."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.topography.parameters import rms_slope
from roughvisc.variables import VARIABLES
from roughvisc.views.figures.axes import (
    CYCLE,
    new_figure,
    require,
    spans_decades,
    spread_axis,
    styled,
    unit_for,
    verbatim,
)
from roughvisc.views.figures.histories import leave_room, marker_of
from roughvisc.views.observables import history
from roughvisc.views.observables.area_theories import asperity_fraction, nominal_area_of, persson_fraction
from roughvisc.views.observables.derived import material_of

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
            return {str(one.values): results.sel(case=one) for one in results["case"]}
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


@styled
def area_against_load(results, *, contact_modulus=None) -> Figure:
    r"""Contact area, corrected for the grid, against force at every accepted step, one line a case.

    Parameters
    ----------
    results : xarray.Dataset, list or mapping of them
        Results; the keys of a mapping, or else their titles, name the lines.
    contact_modulus : float or mapping, optional
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
    :func:`~roughvisc.views.observables.area_by_theory`.

    References
    ----------
    .. [1] A. W. Bush, R. D. Gibson, T. R. Thomas, *Wear* 35 (1975) 87-111.
    .. [2] B. N. J. Persson, *J. Chem. Phys.* 115 (2001) 3840-3861.
    """
    cases = _as_cases(results)
    for dataset in cases.values():
        require(dataset, "time", "force", _AREA)
    steps = {label: history(dataset) for label, dataset in cases.items()}
    loads, areas = ([one[name].values for one in steps.values()] for name in ("force", _AREA))
    across, up = unit_for(np.concatenate(loads), "N"), unit_for(np.concatenate(areas), "m^2")
    moduli = _stated_moduli(cases) if contact_modulus is None else contact_modulus
    figure = new_figure(3.8, 3.0 + 0.13 * min(len(cases), 12) + (0.0 if moduli == {} else 0.6))
    ax = figure.add_subplot()
    for number, (label, x, y) in enumerate(zip(cases, map(across, loads), map(up, areas), strict=True)):
        colour = CYCLE[number % len(CYCLE)] if len(cases) <= len(CYCLE) else "0.5"
        nested = 2.2 - 1.2 * number / max(1, len(cases) - 1)  # a line shows on both sides of another on it
        style = {"color": colour, "marker": marker_of(len(x)), "ms": 1.5 + nested, "lw": nested}
        ax.plot(x, y, label=verbatim(label) if len(cases) <= 12 else "_", **style)
    top = float(np.max(np.concatenate(loads)))
    drawn = _draw_theories(ax, next(iter(cases.values())), moduli, top, across, up)
    if spans_decades(np.sort(np.concatenate(loads))):
        spread_axis(ax.xaxis, across(np.concatenate(loads)))
        spread_axis(ax.yaxis, up(np.concatenate(areas)))
    else:
        leave_room(ax, *map(up, areas))
        ax.set_xlim(left=min(0.0, ax.get_xlim()[0]))
    ax.set_xlabel(across.label(VARIABLES["force"].label))
    ax.set_ylabel(up.label(VARIABLES[_AREA].label))
    ax.grid(color="0.9", lw=0.5)
    if drawn:
        figure.supxlabel(_THEORIES, fontsize=6.5, color="0.35")
    if len(ax.get_legend_handles_labels()[1]) > 1:
        figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=1 if len(ax.lines) < 4 else 2)
    return figure


def _stated_moduli(cases: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Contact moduli that the results tell by themselves, where the theories hold; else none. [Pa]"""
    stated = [json.loads(one.attrs.get("case", "{}")) for one in cases.values()]
    first = next(iter(cases.values()))
    alike = all(one.get("material") == stated[0].get("material") for one in stated)
    rough = stated[0].get("surface", {}).get("generate") not in _SMOOTH
    if not (
        "material" in stated[0] and alike and rough and first.attrs.get("boundary") == "periodic" and "height" in first
    ) or {"thickness", "kernel"} & set(first.attrs):
        return {}
    material = material_of(first)
    end = max(float(one["time"][-1]) for one in cases.values())
    named = {"at once": 0.0, f"after {unit_for([end], 's').text(end)}": end}
    compliances = {name: float(material.contact_compliance(time)) for name, time in named.items()}
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
