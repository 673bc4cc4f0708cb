"""Friction and contact area of several cases against the speed."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from roughvisc.errors import InputError
from roughvisc.units import unit_for
from roughvisc.variables import NOT_CONVERGED
from roughvisc.variables.sliding import SLIDING
from roughvisc.views.figures import style
from roughvisc.views.sweep_figures.cases import Parameter, cases_of, combined, middle_of_decades
from roughvisc.views.sweep_figures.colouring import Colouring
from roughvisc.views.sweep_figures.ensembles import ITSELF_STYLE, Band, band_handles, draw_band

_PANELS = ("friction_coefficient", "contact_fraction")
_OPEN = Line2D([], [], color="0.3", marker="o", mfc="w", ls="", ms=4, label="not converged")


@style.apply
def friction_of_cases(results: Any, *, reduced: bool = False) -> Figure:
    """Friction coefficient and contact area over the nominal one of every case, against the logarithm of the speed.

    Lines are coloured by what was varied. Speeds that did not converge are open circles. Of realisations the mean is
    drawn, the band in which 95 % of patches lie and, of a scan, the scan itself.

    Parameters
    ----------
    results : xarray.Dataset or xarray.DataTree
        What :func:`roughvisc.sweep` or :func:`roughvisc.open_results` gives of a study of friction; of a tree the
        speeds may differ.
    reduced : bool
        Against the speed times the shift factor of the material's temperature, ``a_T V``: curves of several
        temperatures then fall on one master curve.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the results are no sweep of friction, or no temperature is stated where `reduced` asks for it.
    """
    cases = cases_of(results)
    over = "reduced_speed" if reduced else "speed"
    for name in (*_PANELS, over):
        if not all(name in member.variables and member[name].dims == ("speed",) for member in cases.members):
            raise InputError(f"expected results of friction, with {name!r} over the speed in every case")
    colouring = Colouring(_parameter(cases.parameters, len(cases.members)))
    speeds = np.concatenate([member[over].values for member in cases.members])
    across = unit_for(middle_of_decades(speeds), "m/s")
    handles: list[Artist] = [*colouring.handles()] if len(colouring.parameter.levels) > 1 else []
    figure = style.new_figure(6.6, 2.9 + 0.12 * len(handles))
    panels = figure.subplots(1, 2)
    settled = [
        _draw(panels, member, band, over, across, colouring.colour(int(place)))
        for member, band, place in zip(cases.members, cases.bands, colouring.parameter.places, strict=True)
    ]
    for ax, name in zip(panels, _PANELS, strict=True):
        ax.set_xscale("log")
        ax.set_ylim(bottom=0)
        ax.set_xlabel(across.label(_speed_label(reduced)))
        ax.set_ylabel(SLIDING[name].label)
        ax.grid(color="0.9", lw=0.5)
    style.letter_panels(list(panels))
    title = colouring.parameter.name if handles else ""
    handles += band_handles(cases.bands) + ([] if all(settled) else [_OPEN])
    style.legend_above(figure, {str(one.get_label()): one for one in handles}, title)
    colouring.draw_bar(figure, list(panels))
    return figure


def _parameter(parameters: list[Parameter], cases: int) -> Parameter:
    """What colours the lines: all that was varied, in one."""
    if not parameters:
        return Parameter("case", np.arange(1, cases + 1), "", "Case")
    return combined(parameters)


def _draw(panels: list[Axes], member: xr.Dataset, band: Band | None, over: str, across: Any, colour: Any) -> bool:
    """One case in both panels; whether all of it converged."""
    ordered = member.sortby("speed")
    speed, settled = across(ordered[over].values), ordered["status"].values != NOT_CONVERGED
    for ax, name in zip(panels, _PANELS, strict=True):
        values = ordered[name].values
        if band is not None:
            lower, upper = (one.sortby("speed")[name].values for one in (band.lower, band.upper))
            draw_band(ax, speed, lower, upper, colour)
        if band is not None and band.itself is not None:
            itself = band.itself.sortby("speed")
            ax.plot(across(itself[over].values), itself[name].values, color=colour, **ITSELF_STYLE)
        ax.plot(speed, values, "-", color=colour)
        ax.plot(speed[settled], values[settled], "o", ms=2.5, color=colour)
        ax.plot(speed[~settled], values[~settled], "o", ms=4, mfc="w", color=colour)
    return bool(settled.all())


def _speed_label(reduced: bool) -> str:
    return "Reduced speed $a_T V$" if reduced else SLIDING["speed"].label
