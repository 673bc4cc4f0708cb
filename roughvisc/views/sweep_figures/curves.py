"""A curve of every case of a sweep, coloured by what was varied: histories, and friction against speed."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from roughvisc.errors import InputError
from roughvisc.units import Unit, unit_for
from roughvisc.variables import AXES, VARIABLES
from roughvisc.views.figures import style
from roughvisc.views.figures.histories import steps_of
from roughvisc.views.figures.rows import RowAxis, rows_of
from roughvisc.views.sweep_figures.cases import (
    Parameter,
    cases_of,
    combined,
    label_of,
    middle_of_decades,
    named_texts,
    quantity_unit,
    without_zeros,
)
from roughvisc.views.sweep_figures.colouring import Colouring, readable_ticks
from roughvisc.views.sweep_figures.ensembles import ITSELF_STYLE, Band, band_legend, draw_band

_MOST_PANELS = 9


@style.apply
def histories_of_cases(results: Any, quantity: str | None = None, *, by: str | None = None) -> Figure:
    """A history of every case over its axis, coloured by what was varied; kept times are dots, where these are few.

    Of realisations the mean is drawn with the 95 % prediction interval of a single one and, of a scan, the measured
    scan.

    Up to eight values have a legend, more a colour bar. Other parameters make panels, up to nine.

    Parameters
    ----------
    results : xarray.Dataset
        What :func:`roughvisc.sweep` or :func:`roughvisc.open_results` gives.
    quantity : str, optional
        A history of every case, such as ``"approach"``; by default the contact area, or
        the contact fraction where the surfaces differ in size.
    by : str, optional
        Dotted key of the parameter that colours the lines; by default the one with the most numbers.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the results are no sweep, or a name is unknown.
    """
    cases = cases_of(results)
    quantity = cases.history_named(quantity)
    ordered = sorted(cases.parameters, key=lambda one: (not one.numeric, -len(one.levels)))
    first = cases.parameter(by) if by else ordered[0] if ordered else _numbered(len(cases.members))
    facets = _facets([one for one in ordered if one is not first], len(cases.members))
    colouring = Colouring(first)
    lines = [_line(member, quantity) for member in cases.members]
    bands = [None if band is None else [_line(one, quantity) for one in _parts(band)] for band in cases.bands]
    times = np.unique(np.concatenate([rows_of(line).values for line in lines]))
    axis = RowAxis.of(times, cases.axis)
    unit = quantity_unit(cases, quantity, np.concatenate([line.values for line in lines]))
    count = len(facets.levels)
    columns = min(count, 2 if count in (2, 4) else 3)
    rows = -(-count // columns)
    figure = style.new_figure(
        4.6 if count == 1 else min(1.0 + 2.4 * columns, 7.4), (3.1 if rows == 1 else 1.0 + 1.9 * rows) + 0.2
    )
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    dotted = False
    for level, ax in enumerate(panels[:count]):
        chosen = np.flatnonzero(facets.places == level)
        drawn = [(lines[i], cases.members[i], int(first.places[i]), bands[i]) for i in chosen]
        dotted |= _draw_panel(ax, axis, unit, colouring, drawn)
    if count > 1:
        style.letter_panels(panels[:count], [textwrap.fill(text, 22) for text in named_texts(facets)])
    _limits(list(panels[:count]), unit(np.concatenate([one.values for band in bands for one in band or ()] or [[]])))
    for ax in panels[:count]:
        axis.apply(ax, times, most=7 if count == 1 else 4)
        ax.grid(color="0.9", lw=0.5)
        ax.set_xlabel("")
    for number, ax in enumerate(panels):  # places without a panel stay empty
        ax.set_visible(number < count)
        ax.tick_params(labelbottom=number + columns >= count)
    figure.supxlabel(axis.unit.label(axis.label))
    figure.supylabel(label_of(cases, quantity, unit))
    named = colouring.legend() if len(first.levels) > 1 else {}
    title = first.name if named else ""
    named |= band_legend(cases.bands)
    if dotted:
        named[AXES[cases.axis].rows] = Line2D([], [], color="0.3", ls="", marker="o", ms=3)
    style.legend_above(figure, named, title)
    colouring.draw_bar(figure, list(panels[:count]))
    return figure


def _facets(others: list[Parameter], cases: int) -> Parameter:
    """What makes panels: every combination of the other parameters; of too many, their values one by one, or none."""
    for one in ([combined(others)] if others else []) + others:
        if len(one.levels) <= _MOST_PANELS:
            return one
    return Parameter("", np.zeros(cases), "", "")


def _draw_panel(ax: Axes, axis: RowAxis, unit: Unit, colouring: Colouring, drawn: list[Any]) -> bool:
    """Lines of some cases, the later ones thinner, so that none hides another that it lies on; whether with dots."""
    dotted, few = False, len({level for _, _, level, _ in drawn}) <= 8
    for number, (line, member, level, band) in enumerate(sorted(drawn, key=lambda one: one[2])):
        width = 2.3 - 1.3 * number / max(1, len(drawn) - 1) if few and len(drawn) > 1 else 1.0
        colour = colouring.colour(level)
        ax.plot(axis.unit(rows_of(line)), unit(line), color=colour, lw=width)
        if band is not None:
            lower, upper, *itself = band
            draw_band(ax, axis.unit(rows_of(lower)), unit(lower), unit(upper), colour)
            for one in itself:
                ax.plot(axis.unit(rows_of(one)), unit(one), color=colour, **ITSELF_STYLE)
        if few and len(drawn) <= 8 and rows_of(member).size <= 40 and line.name in member:
            ax.plot(axis.unit(rows_of(member)), unit(member[line.name]), "o", ms=1.5 + width, color=colour)
            dotted = True
    return dotted


def _parts(band: Band) -> list[xr.Dataset]:
    """Both ends of a band and, if there is one, the measured surface itself."""
    return [band.lower, band.upper, *([] if band.itself is None else [band.itself])]


def _line(member: xr.Dataset, quantity: str) -> xr.DataArray:
    """A quantity over every accepted step, or over the kept times if it is known at these alone."""
    member = member.sortby(str(rows_of(member).name))
    steps = steps_of(member)
    line = steps[quantity] if quantity in steps else member[quantity]
    return line.copy(data=without_zeros(quantity, line.values))


def _limits(panels: list[Axes], bands: np.ndarray) -> None:
    """Linear from zero, or logarithmic where all that is drawn is positive and spans two decades; for all alike."""
    ax = panels[0]  # the others share its axis
    lines = [np.asarray(line.get_ydata(), dtype=float) for one in panels for line in one.lines]
    shown = np.concatenate([*lines, bands])
    shown = shown[np.isfinite(shown)]
    low, high = (shown.min(), shown.max()) if shown.size else (0.0, 1.0)
    logarithmic = bool(low > 0 and high >= 100 * low)
    if logarithmic:
        ax.set_yscale("log")
        ax.set_ylim(low / 1.5, high * 1.5)
    else:
        bottom, top = min(low, 0.0), max(high, 0.0)
        span = (top - bottom) or 1.0
        ax.set_ylim(bottom - 0.05 * span, top + 0.12 * span)
    readable_ticks(ax.yaxis, *ax.get_ylim(), logarithmic)


def _numbered(count: int) -> Parameter:
    """Cases that nothing tells apart, by their number."""
    return Parameter("case", np.arange(1, count + 1), "", "Case")


# ---------------------------------------------------------------------------------------------------- friction

_FRICTION = ("friction_coefficient", "contact_fraction")


@style.apply
def friction_of_cases(results: Any, *, reduced: bool = False) -> Figure:
    """Friction coefficient and contact area over the nominal one of every case, against the logarithm of the speed.

    Lines are coloured by what was varied. Of realisations the mean is drawn with the 95 % prediction interval of a
    single one and, of a scan, the measured scan.

    Parameters
    ----------
    results : xarray.Dataset
        What :func:`roughvisc.sweep` or :func:`roughvisc.open_results` gives of a study of friction.
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
    for name in (*_FRICTION, over):
        if not all(name in member.variables and member[name].dims == ("speed",) for member in cases.members):
            raise InputError(f"expected results of friction, with {name!r} over the speed in every case")
    colouring = Colouring(combined(cases.parameters or [_numbered(len(cases.members))]))
    speeds = np.concatenate([member[over].values for member in cases.members])
    across = unit_for(middle_of_decades(speeds), "m/s")
    named = colouring.legend() if len(colouring.parameter.levels) > 1 else {}
    figure = style.new_figure(6.6, 2.9 + 0.12 * len(named))
    panels = figure.subplots(1, 2)
    for member, band, place in zip(cases.members, cases.bands, colouring.parameter.places, strict=True):
        _draw_friction(panels, member, band, over, across, colouring.colour(int(place)))
    for ax, name in zip(panels, _FRICTION, strict=True):
        ax.set_xscale("log")
        ax.set_ylim(bottom=0)
        ax.set_xlabel(across.label("Reduced speed $a_T V$" if reduced else VARIABLES["speed"].label))
        ax.set_ylabel(VARIABLES[name].label)
        ax.grid(color="0.9", lw=0.5)
    style.letter_panels(list(panels))
    title = colouring.parameter.name if named else ""
    named |= band_legend(cases.bands)
    style.legend_above(figure, named, title)
    colouring.draw_bar(figure, list(panels))
    return figure


def _draw_friction(
    panels: list[Axes], member: xr.Dataset, band: Band | None, over: str, across: Any, colour: Any
) -> None:
    """Draw one case in both panels."""
    ordered = member.sortby("speed")
    speed = across(ordered[over].values)
    for ax, name in zip(panels, _FRICTION, strict=True):
        values = ordered[name].values
        if band is not None:
            lower, upper = (one.sortby("speed")[name].values for one in (band.lower, band.upper))
            draw_band(ax, speed, lower, upper, colour)
        if band is not None and band.itself is not None:
            itself = band.itself.sortby("speed")
            ax.plot(across(itself[over].values), itself[name].values, color=colour, **ITSELF_STYLE)
        ax.plot(speed, values, "o-", ms=2.5, color=colour)
