"""Leakage of a fluid through the gap of a contact."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import xarray as xr

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.mechanics.transport.flow import flow as flow_through
from roughvisc.observables.frames import frame_by_frame, need
from roughvisc.topography.grid import spacing
from roughvisc.units import Quantity, quantities


@quantities(viscosity="Pa s > 0", pressure_drop="Pa > 0")
def leakage(
    dataset: xr.Dataset,
    *,
    viscosity: Quantity = 1e-3,
    pressure_drop: Quantity = 1e5,
    along: Literal["x", "y"] = "x",
    flow: bool = False,
) -> xr.Dataset:
    r"""Compute the leak rate of a fluid through the gap, from one side of the map to the opposite one.

    The fluid pressure does not deform the surfaces.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``gap``, present everywhere.
    viscosity : float or str
        Viscosity of the fluid, constant: a number [Pa s], or a text such as ``"1 mPa s"``.
    pressure_drop : float or str
        Pressure difference between the two sides, over the whole length of the map (one period if it is periodic): a
        number [Pa], or a text such as ``"1 bar"``.
    along : {"x", "y"}
        Direction of the flow. The other two sides are joined if the attribute ``boundary`` of the result is
        ``"periodic"``; otherwise they are walls.
    flow : bool
        Whether to return the flow field, too.

    Returns
    -------
    xarray.Dataset
        Over time ``leak_rate``, zero if no path connects the sides, and ``leak_rate_error`` [m3/s]; ``transmissivity``
        [m3] and ``hydraulic_aperture`` [m], which are independent of the fluid; with `flow` also ``flux_x`` and
        ``flux_y`` over (time, x, y) [m2/s]. The attributes of ``leak_rate`` state the arguments.

    Raises
    ------
    InputError
        If the result contains no ``gap``, or the surface is absent in some cells, where the gap is unknown; if a
        quantity has a wrong unit, or a word is unknown.

    Notes
    -----
    Reynolds' equation, :math:`\nabla \cdot (g^3 / 12 \eta \, \nabla P) = 0`; cells in contact are closed, and cells
    that share only a corner are not connected. See :func:`roughvisc.mechanics.transport.flow.flow`. For the volume flow
    :math:`Q` through a map of length :math:`L` along the flow and width :math:`W`,

    .. math:: T = \frac{Q \eta L}{\Delta P \, W}, \qquad h = (12 T)^{1/3}.

    The error is the error of the solution of the equations on this grid, without the errors of the grid and of the gap.

    Examples
    --------
    >>> rv.observables.leakage(ds, viscosity="1 mPa s", pressure_drop="2 bar").leak_rate  # doctest: +SKIP
    """
    one_of("along", along, ("x", "y"))
    need(dataset, "gap")
    wrap = dataset.attrs.get("boundary") == "periodic"
    gap, cells = dataset["gap"], dict(zip("xy", spacing(dataset, "leakage"), strict=True))
    across = "y" if along == "x" else "x"
    sides_of_cell = cells[along], cells[across]

    def measure(field: np.ndarray) -> tuple[Any, ...]:
        missing = int(np.count_nonzero(np.isnan(field)))
        if missing == field.size:  # after the last row of a case of a sweep
            return (np.nan, np.nan, field, field)[: len(outputs)]
        if missing:
            raise InputError(
                f"leakage: the gap is missing in {missing} of {field.size} cells, where the surface is absent: the "
                "flow through these cells is unknown: expected a surface that is cropped, or filled"
            )
        found = flow_through(field, sides_of_cell, wrap=wrap)
        return (found.conductance, found.error, found.along, found.across)[: len(outputs)]

    outputs = [[], []] + [[along, across]] * (2 * flow)
    conductance, error, *fields = frame_by_frame(measure, gap, outputs=outputs, over=(along, across))
    transmissivity = conductance * (cells[along] * gap.sizes[along] / (cells[across] * gap.sizes[across]))
    drop = pressure_drop / viscosity
    variables = {
        "leak_rate": conductance * drop,
        "leak_rate_error": error * drop,
        "transmissivity": transmissivity,
        "hydraulic_aperture": (12 * transmissivity) ** (1 / 3),
    }
    for axis, one in zip((along, across), fields, strict=False):
        variables[f"flux_{axis}"] = (one * drop).transpose(*gap.dims)
    described = label(xr.Dataset(variables))
    described["leak_rate"].attrs |= {"along": along, "viscosity": viscosity, "pressure_drop": pressure_drop}
    return described
