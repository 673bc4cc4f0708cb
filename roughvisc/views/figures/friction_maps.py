"""Maps of the pressure under a sliding profile, at low, peak and high speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.views.figures.axes import require, styled, unit_for
from roughvisc.views.figures.fields import draw_field, label_maps, map_panels, measured_part

#: Direction of the motion -> where it points on a map.
_ARROWS = {"x": "→", "-x": "←", "y": "↑", "-y": "↓"}
_MOST_MAPS = 12


@styled
def friction_maps(dataset: xr.Dataset, speeds: float | Sequence[float] | None = None) -> Figure:
    """Maps of the pressure in the frame of the profile, on one colour scale; an arrow shows where the profile moves.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.friction` with ``pressure`` among the fields, or of a study of friction.
    speeds : float or sequence of float, optional
        The nearest ones are drawn. By default the lowest, the one of the largest friction, and the highest. [m/s]

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the result holds no pressure, or more than 12 speeds are asked for.
    """
    require(dataset, "speed", "x", "y", "pressure", "friction_coefficient")
    dataset = measured_part(dataset)
    rows = _chosen(dataset, speeds)
    figure, axes = map_panels(dataset, len(rows), 1)
    draw_field(figure, axes[0], dataset, "pressure", rows)
    label_maps(axes, dataset, [_title(dataset, row) for row in rows])
    return figure


def _chosen(dataset: xr.Dataset, speeds: float | Sequence[float] | None) -> list[int]:
    known = dataset["speed"].values
    if speeds is None:
        peak = int(np.argmax(dataset["friction_coefficient"].values))
        chosen = {int(np.argmin(known)), peak, int(np.argmax(known))}
    else:
        asked = np.atleast_1d(np.asarray(speeds, dtype=float)).ravel()
        if not 0 < asked.size <= _MOST_MAPS or not (asked > 0).all():
            raise InputError(f"speeds is {speeds!r}: expected 1 to {_MOST_MAPS} positive numbers [m/s]")
        chosen = {int(np.abs(np.log(known / speed)).argmin()) for speed in asked}
    return sorted(chosen, key=lambda row: float(known[row]))


def _title(dataset: xr.Dataset, row: int) -> str:
    """Arrow of the motion, speed and friction."""
    speed, arrow = float(dataset["speed"][row]), _ARROWS[str(dataset.attrs.get("direction", "x"))]
    number, _, power = f"{float(dataset['friction_coefficient'][row]):.2g}".partition("e")
    friction = rf"{number}$\times 10^{{{int(power)}}}$" if power else number
    return f"{arrow} V = {unit_for([speed], 'm/s').text(speed, 3)}\nµ = {friction}"
