"""Axes of varied parameters: numeric scales or categories."""

from __future__ import annotations

import numpy as np
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, NullFormatter

from roughvisc.views.sweep_figures.cases import Parameter
from roughvisc.views.sweep_figures.colouring import even_in_log, readable_ticks


def positions(parameter: Parameter) -> np.ndarray:
    """Where the levels of a parameter lie on its axis."""
    return parameter.unit(parameter.levels) if parameter.numeric else np.arange(len(parameter.levels), dtype=float)


def borders_between(parameter: Parameter) -> np.ndarray:
    """Borders between the cells of a map, half way between the levels on the scale of the axis."""
    places = positions(parameter)
    logarithmic = parameter.numeric and even_in_log(places)
    places = np.log(places) if logarithmic else places
    middle = (places[1:] + places[:-1]) / 2
    borders = np.concatenate([[2 * places[0] - middle[0]], middle, [2 * places[-1] - middle[-1]]])
    return np.exp(borders) if logarithmic else borders


def set_parameter_axis(axis: Axis, parameter: Parameter) -> None:
    """Scale, limits, ticks and label of an axis of a parameter."""
    places, count = positions(parameter), len(parameter.levels)
    horizontal = axis.axis_name == "x"
    logarithmic = parameter.numeric and even_in_log(places)
    set_limits = axis.axes.set_xlim if horizontal else axis.axes.set_ylim
    if logarithmic:
        (axis.axes.set_xscale if horizontal else axis.axes.set_yscale)("log")
    borders = borders_between(parameter)
    set_limits(borders[0], borders[-1])
    if parameter.numeric:
        scaled = np.log(places) if logarithmic else places
        if count <= 6 and np.diff(scaled).min() > 0.11 * np.ptp(scaled):
            axis.set_major_locator(FixedLocator(places))
            axis.set_major_formatter(lambda value, _: f"{value:.4g}")
            axis.set_minor_locator(FixedLocator([]))
            axis.set_minor_formatter(NullFormatter())
        else:
            readable_ticks(axis, places[0], places[-1], logarithmic)
    else:
        step = -(-count // 25)
        texts = parameter.texts()[::step]
        axis.set_ticks(places[::step], labels=texts)
        if horizontal and sum(map(len, texts)) > 34:
            for label in axis.get_ticklabels():
                label.set(rotation=30 if len(texts) <= 6 else 90, ha="right", rotation_mode="anchor")
                label.set_va("top" if len(texts) <= 6 else "center")
        axis.axes.tick_params(axis=axis.axis_name, length=0)
    axis.set_label_text(parameter.label)
