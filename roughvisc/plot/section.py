"""Section through the contact: the pressure, the profile, and the deformed surface that rests on it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from roughvisc.arguments import one_of
from roughvisc.observables import contact
from roughvisc.observables.deformed import deformed
from roughvisc.observables.frames import expect_result
from roughvisc.plot import style
from roughvisc.plot.maps import frames_at, largest_contact, plane_unit, rows_of
from roughvisc.topography.grid import cell_edges
from roughvisc.units import Quantity, quantities, unit_for
from roughvisc.variables import VARIABLES


@style.apply
@quantities(at="m")
def section(dataset: xr.Dataset, time: Quantity | None = None, axis: str = "x", at: Quantity | None = None) -> Figure:
    """Draw a cut through the contact: the pressure above, below it the profile and the deformed surface.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``height``, ``pressure``, and ``gap`` or ``displacement``.
    time : float or str, optional
        The nearest kept time is drawn; a negative whole number counts frames from the end. Default: the last time with
        the largest contact area. [s]
    axis : {"x", "y"}
        Direction of the cut.
    at : float or str, optional
        Coordinate of the cut along the other axis. Default: the line that carries most of the load. [m]

    Returns
    -------
    matplotlib.figure.Figure
    """
    expect_result(dataset, "x", "y", "height", "pressure")
    one_of("axis", axis, ("x", "y"))
    rows, across = rows_of(dataset), "y" if axis == "x" else "x"
    frame = largest_contact(dataset) if time is None else frames_at(dataset, time)[0]
    whole = dataset.isel({str(rows.name): frame})
    if at is not None:
        index = int(np.abs(dataset[across].values - at).argmin())
    else:
        index = int(whole["pressure"].sum(axis).values.argmax())
    cut = whole.isel({across: index}).load()
    height = cut["height"].values
    surface = deformed(dataset, float(rows[frame])).isel({across: index}).values
    plane = plane_unit(dataset)
    edges, x = plane(cell_edges(dataset[axis])), plane(dataset[axis])
    figure, (top, bottom) = style.new_panels(2, 1, 4.1, 1.4, shared="x", left=0.7)
    pressure = unit_for(cut["pressure"], "Pa")
    top.stairs(pressure(cut["pressure"]), edges, fill=True, fc=(0, 0.62, 0.45, 0.3), ec=style.GREEN, lw=1)
    top.set_ylim(bottom=0)
    top.set_ylabel(pressure.label(VARIABLES["pressure"].label))
    known = np.concatenate([[0.0] if np.isnan(height).all() else height, surface])
    unit = unit_for(np.nanmax(known) - np.nanmin(known), "m")
    low, high = float(unit(np.nanmin(known))), float(unit(np.nanmax(known)))
    margin = 0.12 * ((high - low) or 1.0)
    low, high = low - margin, high + 2 * margin
    bottom.fill_between(x, unit(height), low, color="0.72", lw=0, label="profile")
    bottom.fill_between(x, unit(surface), high, color=style.BLUE, alpha=0.16, lw=0, label="half-space")
    bottom.plot(x, unit(height), color="0.25", lw=1)
    bottom.plot(x, unit(surface), color=style.BLUE, lw=1)
    touching = np.where(contact(cut), unit(height), np.nan)
    bottom.plot(x, touching, "o-", color=style.CONTACT, lw=2.4, ms=2.4, mew=0, label="contact")
    level = float(dataset["height"].attrs.get("highest", dataset["height"].max())) - float(cut.get("approach", np.nan))
    if low < unit(level) < high:
        bottom.axhline(float(unit(level)), color=style.BLUE, lw=0.8, ls=(0, (4, 2)), label="undeformed")
    bottom.set_ylim(low, high)
    bottom.set_ylabel(unit.label(VARIABLES["height"].label))
    bottom.set_xlabel(plane.label(axis))
    bottom.set_xlim(edges[0], edges[-1])
    place = f"{across} = {plane.text(float(dataset[across][index]))}"
    top.set_title(f"{style.row_text(rows, frame)},  {place}", loc="right")
    style.letter_panels((top, bottom))
    style.align((top, bottom), 0.45)
    style.legend_above(figure, style.named_in(bottom))
    return figure
