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
from roughvisc.plot.maps import plane_unit
from roughvisc.plot.rows import frames_at, largest_contact, measured_part, rows_of
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
    dataset = measured_part(dataset)
    rows, across = rows_of(dataset), "y" if axis == "x" else "x"
    frame = largest_contact(dataset) if time is None else frames_at(dataset, time)[0]
    whole = dataset.isel({str(rows.name): frame})
    if at is not None:
        index = int(np.abs(dataset[across].values - at).argmin())
    elif float(whole["pressure"].max()) > 0:
        index = int(whole["pressure"].sum(axis).values.argmax())
    else:
        index = int(whole["height"].max(axis).values.argmax())
    cut = whole.isel({across: index}).load()
    height = cut["height"].values
    surface = deformed(dataset, float(rows[frame])).isel({across: index}).values
    plane = plane_unit(dataset)
    edges, x = plane(cell_edges(dataset[axis])), plane(dataset[axis])
    figure = style.new_figure(5.0, 3.9)
    top, bottom = figure.subplots(2, sharex=True, height_ratios=[1, 1.3])
    pressure = unit_for(cut["pressure"], "Pa")
    top.stairs(pressure(cut["pressure"]), edges, fill=True, color=style.GREEN, alpha=0.3)
    top.stairs(pressure(cut["pressure"]), edges, color=style.GREEN, lw=1)
    top.set_ylim(bottom=0)
    top.set_ylabel(pressure.label(VARIABLES["pressure"].label))
    known = np.concatenate([height, surface])
    known = known[np.isfinite(known)] if np.isfinite(known).any() else np.zeros(1)
    unit = unit_for(np.ptp(known), "m")
    low, high = float(unit(known.min())), float(unit(known.max()))
    margin = 0.12 * ((high - low) or 1.0)
    bottom.set_ylim(low - margin, high + 2 * margin)
    bottom.fill_between(x, unit(height), low - margin, color="0.72", lw=0, label="profile")
    bottom.fill_between(x, unit(surface), high + 2 * margin, color=style.BLUE, alpha=0.16, lw=0, label="half-space")
    bottom.plot(x, unit(height), color="0.25", lw=1)
    bottom.plot(x, unit(surface), color=style.BLUE, lw=1)
    touching = np.where(contact(cut), unit(height), np.nan)
    bottom.plot(x, touching, "o-", color=style.CONTACT, lw=2.4, ms=2.4, mew=0, label="contact")
    level = float(dataset["height"].attrs.get("highest", dataset["height"].max())) - float(cut.get("approach", np.nan))
    if known.min() - margin * unit.factor < level < known.max() + 2 * margin * unit.factor:
        bottom.axhline(float(unit(level)), color=style.BLUE, lw=0.8, ls=(0, (4, 2)), label="undeformed")
    bottom.set_ylabel(unit.label(VARIABLES["height"].label))
    bottom.set_xlabel(plane.label(axis))
    bottom.set_xlim(edges[0], edges[-1])
    place = f"{across} = {plane.text(float(dataset[across][index]))}"
    top.set_title(f"{style.row_text(rows, frame)},  {place}", loc="right")
    style.letter_panels((top, bottom))
    figure.align_ylabels((top, bottom))
    style.legend_above(figure, style.named_in(bottom))
    return figure
