"""Leakage: what a pressure drives through the gap of a contact."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.mechanics.transport.flow import Flow, fluxes
from roughvisc.mechanics.transport.flow import flow as flow_through
from roughvisc.observables.derived import need
from roughvisc.topography.grid import spacing
from roughvisc.units import Quantity, number, quantities
from roughvisc.variables import LEAK_MEANINGS, axis_of

#: Distance of the bounds, relative, up to which a leak rate counts as known.
_CERTIFIED = 1e-6
_FLOWS, _CLOSED, _NOT_CERTIFIED = range(len(LEAK_MEANINGS))


@quantities(viscosity="Pa s", pressure_drop="Pa")
def leakage(
    dataset: xr.Dataset,
    *,
    viscosity: Quantity = 1e-3,
    pressure_drop: Quantity = 1e5,
    along: Literal["x", "y"] = "x",
    sides: Literal["closed", "periodic"] | None = None,
    flow: bool = False,
) -> xr.Dataset:
    r"""Leak rate of a fluid through the gap, from one side of the map to the opposite one.

    The gap is that of the dry contact: the fluid pressure does not deform the surfaces.

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
        Direction of the flow.
    sides : {"closed", "periodic"}, optional
        Whether the other two sides are walls or joined. Default: joined if the attribute ``boundary`` of the result is
        ``"periodic"``; only then may they be joined.
    flow : bool
        Whether to return the flow field, too.

    Returns
    -------
    xarray.Dataset
        Over time ``leak_rate``, ``leak_rate_solver_lower`` and ``leak_rate_solver_upper`` [m3/s]; ``leak_status``, one
        of its ``flag_values``; ``transmissivity`` [m3] and ``hydraulic_aperture`` [m], which are independent of the
        fluid; with `flow` also ``flux_x`` and ``flux_y`` over (time, x, y) [m2/s]. The attributes of ``leak_rate``
        state the arguments.

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

    The bounds enclose the exact solution of the equations on this grid.

    Examples
    --------
    >>> rv.observables.leakage(ds, viscosity="1 mPa s", pressure_drop="2 bar").leak_rate  # doctest: +SKIP
    """
    fluid = {
        "viscosity": number(viscosity, "Pa s", "viscosity", above=0),
        "pressure_drop": number(pressure_drop, "Pa", "pressure_drop", above=0),
    }
    gap = _gap_of(dataset)
    drop, wrap = fluid["pressure_drop"] / fluid["viscosity"], _sides_meet(dataset, sides)
    if along not in ("x", "y"):
        raise InputError(key="along", found=along, expected="'x' or 'y'")
    cells = spacing(dataset, "leakage")
    sizes = {"x": cells[0] * gap.sizes["x"], "y": cells[1] * gap.sizes["y"]}
    across = "y" if along == "x" else "x"
    turned = cells if along == "x" else cells[::-1]

    def measure(field):
        if np.isnan(field).all():  # after the last row of a case of a sweep
            return (np.array([np.nan, np.nan, np.nan, 0]), field, field) if flow else np.array([np.nan] * 3 + [0])
        found = _flow(field, turned, wrap)
        numbers = np.array([found.conductance, found.lower, found.upper, _status(found)])
        return (numbers, *fluxes(field, turned, found.pressure, wrap=wrap)) if flow else numbers

    outputs = [["number"], [along, across], [along, across]] if flow else [["number"]]
    found = xr.apply_ufunc(
        measure,
        gap,
        input_core_dims=[[along, across]],
        output_core_dims=outputs,
        vectorize=True,
        dask="parallelized",
        output_dtypes=[float] * len(outputs),
        dask_gufunc_kwargs={"output_sizes": {"number": 4}},
    )
    numbers, *fields = found if flow else (found,)
    conductance, lower, upper, status = (numbers.isel(number=place) for place in range(4))
    transmissivity = conductance * (sizes[along] / sizes[across])
    variables = {
        "leak_rate": conductance * drop,
        "leak_rate_solver_lower": lower * drop,
        "leak_rate_solver_upper": upper * drop,
        "leak_status": status.astype("int8"),
        "transmissivity": transmissivity,
        "hydraulic_aperture": (12 * transmissivity) ** (1 / 3),
    }
    for axis, one in zip((along, across), fields, strict=False):
        variables[f"flux_{axis}"] = (one * drop).transpose(*gap.dims)
    described = label(xr.Dataset(variables))
    asked: dict[str, Any] = {"along": along, "sides": "periodic" if wrap else "closed"}
    described["transmissivity"].attrs |= asked
    described["hydraulic_aperture"].attrs |= asked
    for name in ("leak_rate", "leak_rate_solver_lower", "leak_rate_solver_upper"):
        described[name].attrs |= asked | fluid
    return described


def _gap_of(dataset: xr.Dataset) -> xr.DataArray:
    """The gap, one frame a block."""
    need(dataset, "gap")
    gap = dataset["gap"]
    if gap.dims[-2:] != ("x", "y") or len(gap.dims) < 3:
        raise InputError(f"leakage: the gap has dimensions {', '.join(map(str, gap.dims))}: expected rows, x, y")
    return gap.chunk({dim: -1 if dim in ("x", "y") else 1 for dim in gap.dims}) if gap.chunks else gap


def _sides_meet(dataset: xr.Dataset, sides: str | None) -> bool:
    """Whether the two sides along the flow meet."""
    boundary = dataset.attrs.get("boundary", "free")
    if sides not in (None, "closed", "periodic"):
        raise InputError(f"sides is {sides!r}: expected 'closed' or 'periodic'")
    if sides == "periodic" and boundary != "periodic":
        raise InputError(f"sides is 'periodic' and the result's boundary is {boundary!r}: expected 'closed'")
    return boundary == "periodic" and sides != "closed"


def _flow(gap: np.ndarray, cells: tuple[float, float], wrap: bool) -> Flow:
    """Flow through the gap of one frame."""
    missing = np.count_nonzero(np.isnan(gap))
    if missing:
        raise InputError(
            f"leakage: the gap is missing in {missing} of {gap.size} cells, where the surface is absent: what the "
            "fluid finds there is not known: expected a surface that is cropped, or filled"
        )
    return flow_through(gap, cells, wrap=wrap)


def _status(found: Flow) -> int:
    """Its place among the meanings of ``leak_status``."""
    if found.is_closed:
        return _CLOSED
    return _FLOWS if found.upper - found.lower <= _CERTIFIED * found.upper else _NOT_CERTIFIED


def closing_times(dataset: xr.Dataset) -> tuple[float, float] | None:
    """The last kept time at which fluid flows, and the first after it, from which on the contact is closed. [s]"""
    closed = dataset["leak_status"].values == LEAK_MEANINGS.index("closed")
    if not closed[-1] or closed.all():
        return None
    last = int(np.flatnonzero(~closed)[-1])
    times = dataset[axis_of(dataset.variables)].values
    return float(times[last]), float(times[last + 1])
