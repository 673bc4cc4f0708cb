"""Contact spots of each frame: cells, clusters, distributions, conductance; and leakage through the gap."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.labels import boundary_of, label
from roughvisc.mechanics.transport import flow as flow_through
from roughvisc.mechanics.transport import frozen_contact, label_clusters
from roughvisc.observables.history import by_frame, frame_by_frame, need
from roughvisc.topography.grid import spacing
from roughvisc.units import Quantity, in_si, is_quantity, number, quantities
from roughvisc.variables import VARIABLES

#: Unit of each kind of resistivity.
_UNITS: dict[str, str] = {"thermal": "K m/W", "electrical": "ohm m"}


def contact(dataset: xr.Dataset) -> xr.DataArray:
    """Return the mask of cells in contact: cells with pressure or, if pressure is not stored, cells without a gap.

    With adhesion, contact cells may be under tension, as open cells are: contact follows from the gap.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``; with adhesion a result with ``gap``.

    Returns
    -------
    xarray.DataArray of bool, dims (time, x, y)
        A Dask array if the field is one, or is not read from its file yet.

    Raises
    ------
    InputError
        If the result contains neither ``pressure`` nor ``gap``.

    See Also
    --------
    roughvisc.observables.clusters

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=33)
    >>> press = rv.Program().load(1e-4, over=0)
    >>> ds = rv.simulate(ball, rv.elastic(1e6), press, times=[0.0], progress=False)
    >>> int(rv.observables.contact(ds).sum()) == int((ds.pressure > 0).sum())
    True
    """
    name = "pressure" if "pressure" in dataset and "adhesive_force" not in dataset else "gap"
    need(dataset, name)
    field = by_frame(dataset[name]).drop_attrs(deep=False)
    return field > 0 if name == "pressure" else field <= 0


def clusters(dataset: xr.Dataset) -> xr.Dataset:
    """Count and measure the contact clusters. Cells that share only a corner are not connected.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``. If its attribute ``boundary`` is ``"periodic"``, clusters continue across
        opposite borders. If it is ``"mirror"``, only the part of a cluster inside the border counts.

    Returns
    -------
    xarray.Dataset
        ``cluster_count``, ``cluster_area_mean`` and ``cluster_area_largest`` over time; areas are missing without
        contact. [1], [m2], [m2]

    Raises
    ------
    InputError
        If the result contains neither ``pressure`` nor ``gap``, or the cells of its grid are not equal.

    See Also
    --------
    roughvisc.observables.contact

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=33)
    >>> press = rv.Program().load(1e-4, over=0)
    >>> ds = rv.simulate(ball, rv.elastic(1e6), press, times=[0.0], progress=False)
    >>> rv.observables.clusters(ds).cluster_count.item()
    1
    """
    periodic = boundary_of(dataset) == "periodic"

    def measure(frame: np.ndarray) -> tuple[float, float, float]:
        sizes = np.bincount(label_clusters(frame, (periodic, periodic)).ravel())[1:]
        return (sizes.size, sizes.mean(), sizes.max()) if sizes.size else (0.0, np.nan, np.nan)

    cell = math.prod(spacing(dataset, "clusters"))
    count, mean, largest = frame_by_frame(measure, contact(dataset), outputs=[(), (), ()])
    columns = {
        "cluster_count": count.astype("int64"),
        "cluster_area_mean": mean * cell,
        "cluster_area_largest": largest * cell,
    }
    return label(xr.Dataset(columns))


def distribution(
    dataset: xr.Dataset, name: Literal["pressure", "gap"] = "pressure", bins: int | Sequence[float | str] = 60
) -> xr.Dataset:
    """Return the probability density of the pressure in the contact, or of the gap outside it, over present cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with the field.
    name : {"pressure", "gap"}
        The field.
    bins : int, or array_like of float or str
        Number of equal bins from zero to the largest value at all times (which is read immediately), or their edges.
        [Pa] or [m]

    Returns
    -------
    xarray.Dataset
        ``pressure_density`` over time and ``pressure_bin`` [1/Pa], missing without contact; or ``gap_density`` over
        time and ``gap_bin`` [1/m], missing in full contact.

    Raises
    ------
    InputError
        If the result does not contain the field, or edges do not increase.

    See Also
    --------
    roughvisc.observables.contact

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=33)
    >>> press = rv.Program().load(1e-4, over=0)
    >>> ds = rv.simulate(ball, rv.elastic(1e6), press, times=[0.0], progress=False)
    >>> density = rv.observables.distribution(ds, bins=10).pressure_density
    >>> density.dims
    ('time', 'pressure_bin')
    """
    one_of("name", name, ("pressure", "gap"))
    need(dataset, name)
    field = by_frame(dataset[name])
    dim = f"{name}_bin"
    if isinstance(bins, int | np.integer):
        largest = float(field.max())
        edges = np.linspace(0.0, largest if largest > 0 else 1.0, int(bins) + 1)
    else:
        edges = np.asarray(in_si(bins, VARIABLES[name].units, "bins"), dtype=float)
    if edges.ndim != 1 or len(edges) < 2 or not np.all(np.diff(edges) > 0):
        raise InputError(key="bins", found=bins, expected="a number, or two or more edges that increase")

    def measure(frame: np.ndarray) -> np.ndarray:
        values = frame[frame > 0]
        inside = np.histogram(values, edges)[0]
        return inside / (values.size * np.diff(edges)) if values.size else np.full(len(edges) - 1, np.nan)

    density = frame_by_frame(measure, field, outputs=[(dim,)], sizes={dim: len(edges) - 1})
    return label(xr.Dataset({f"{name}_density": density}, {dim: (edges[1:] + edges[:-1]) / 2}))


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
        Pressure difference between the two sides, over the whole length of the map: a number [Pa], or a text such as
        ``"1 bar"``.
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

    See Also
    --------
    roughvisc.observables.closure, roughvisc.plot.maps

    Notes
    -----
    Reynolds' equation, :math:`\nabla \cdot (g^3 / 12 \eta \, \nabla P) = 0`; cells in contact are closed, and cells
    that share only a corner are not connected. See :func:`roughvisc.mechanics.transport.flow`. For the volume flow
    :math:`Q` through a map of length :math:`L` along the flow and width :math:`W`,

    .. math:: T = \frac{Q \eta L}{\Delta P \, W}, \qquad h = (12 T)^{1/3}.

    The map is one sample: the fluid has one pressure along the side of the first cells and another along the side of
    the last cells. Periodic boundaries of the contact join only the other two sides. The leak rate of one period
    therefore depends on the place along the flow at which the period begins.

    The error is the error of the solution of the equations on this grid, without the errors of the grid and of the gap.
    It is as large as the leak rate if the gaps of a large map span too many decades for the solver.

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy("1 um", "0.1 mm", "0.1 mm", 16)
    >>> press = rv.Program().pressure("20 kPa", over="1 s")
    >>> ds = rv.simulate(wave, rv.elastic(1e6), press, times=3, progress=False)
    >>> leak = rv.observables.leakage(ds, viscosity="1 mPa s", pressure_drop="2 bar").leak_rate
    >>> bool(leak[-1] < leak[0])  # the gap has closed
    True
    """
    one_of("along", along, ("x", "y"))
    need(dataset, "gap")
    wrap = boundary_of(dataset) == "periodic"
    gap = dataset["gap"]
    cells = dict(zip("xy", spacing(dataset, "leakage"), strict=True))
    across = "y" if along == "x" else "x"
    sides_of_cell = cells[along], cells[across]

    def measure(field: np.ndarray) -> tuple[Any, ...]:
        missing = int(np.count_nonzero(np.isnan(field)))
        if missing == field.size:  # after the last row of a case of a sweep
            return (np.nan, np.nan, field, field)[: len(outputs)]
        if missing:
            found = f"the gap is missing in {missing} of {field.size} cells, where the surface is absent"
            raise InputError(f"leakage: {found}: expected a surface that is cropped, or filled")
        return flow_through(field, sides_of_cell, wrap=wrap)[: len(outputs)]

    outputs: list[list[str]] = [[], []] + [[along, across]] * (2 * flow)
    conductance, error, *fields = frame_by_frame(measure, gap, outputs=outputs, over=(along, across))
    transmissivity = conductance * (cells[along] * gap.sizes[along] / (cells[across] * gap.sizes[across]))
    drop = pressure_drop / viscosity
    variables = {
        "leak_rate": conductance * drop,
        "leak_rate_error": error * drop,
        "transmissivity": transmissivity,
        "hydraulic_aperture": (12 * transmissivity) ** (1 / 3),
    }
    for axis, flux in zip((along, across), fields, strict=False):
        variables[f"flux_{axis}"] = (flux * drop).transpose(*gap.dims)
    described = label(xr.Dataset(variables))
    described["leak_rate"].attrs |= {"along": along, "viscosity": viscosity, "pressure_drop": pressure_drop}
    return described


def closure(dataset: xr.Dataset, *, along: Literal["x", "y"] = "x") -> xr.Dataset:
    r"""Compute stress, gap, hydraulic aperture and stiffness of a joint at every kept time, as a table.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result over time with ``gap``, present everywhere, such as of two faces (:func:`roughvisc.combine`).
    along : {"x", "y"}
        Direction of the flow.

    Returns
    -------
    xarray.Dataset
        Over time ``nominal_pressure``, the normal stress [Pa]; ``mean_gap``, the mechanical aperture, ``closure`` and
        ``hydraulic_aperture`` [m]; ``normal_stiffness`` [Pa/m], missing without pressure and at rows whose neighbours
        have the same pressure or closure.

    Raises
    ------
    InputError
        See :func:`leakage`.

    See Also
    --------
    roughvisc.observables.leakage, roughvisc.combine

    Notes
    -----
    The closure is the fall of the mean gap since first touch of the undeformed faces. The stiffness is
    :math:`\bar p \, / (\mathrm d c / \mathrm d \ln \bar p)` by central differences of the closure :math:`c`, which
    are exact for a logarithmic joint. It follows the rows of the result: keep rows of a slow load for the relaxed
    stiffness.

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy("1 um", "0.1 mm", "0.1 mm", 16)
    >>> press = rv.Program().pressure("20 kPa", over="1 s")
    >>> ds = rv.simulate(wave, rv.elastic(1e6), press, times=3, progress=False)
    >>> joint = rv.observables.closure(ds)
    >>> bool(joint.closure[-1] > joint.closure[0])
    True
    """
    need(dataset, "gap", "height", "mean_gap", "force")
    aperture = leakage(dataset, along=along)["hydraulic_aperture"]
    height = dataset["height"]
    mean_gap = dataset["mean_gap"]
    highest = height.attrs.get("highest", height.max(("x", "y")))
    closed = (highest - height.mean(("x", "y"))) - mean_gap
    pressure = dataset["force"] / (math.prod(spacing(dataset, "closure")) * height.sizes["x"] * height.sizes["y"])

    def stiffness(pressure: np.ndarray, closed: np.ndarray) -> np.ndarray:
        values = np.full(pressure.shape, np.nan)
        rows = np.flatnonzero(pressure > 0)
        if rows.size > 1:
            with np.errstate(divide="ignore", invalid="ignore"):
                slope = np.gradient(closed[rows], np.log(pressure[rows]))
                values[rows] = pressure[rows] / slope
        return np.where(np.isfinite(values), values, np.nan)

    axis = [str(dim) for dim in mean_gap.dims][-1:]
    stiff = xr.apply_ufunc(
        stiffness, pressure, closed, input_core_dims=[axis, axis], output_core_dims=[axis], vectorize=True
    )
    variables = {
        "nominal_pressure": pressure,
        "mean_gap": mean_gap,
        "closure": closed,
        "normal_stiffness": stiff,
        "hydraulic_aperture": aperture,
    }
    return label(xr.Dataset(variables).drop_attrs(deep=True))


def conductance(dataset: xr.Dataset, resistivity: Sequence[float | str]) -> xr.Dataset:
    r"""Compute the conductance of the contact spots at every kept time.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``.
    resistivity : pair of float or str
        Resistivities of the two bodies; zero for a perfect conductor. Numbers are thermal. The unit of a string
        determines whether they are thermal, such as ``"0.2 K m/W"``, or electrical, such as ``"1.7e-8 ohm m"``.
        [K m/W] or [ohm m]

    Returns
    -------
    xarray.Dataset
        Over time ``thermal_conductance`` [W/K] or ``electrical_conductance`` [S], and its error. Zero without contact;
        infinite in full contact unless space is free. The attribute ``resistivity`` states both resistivities.

    Raises
    ------
    InputError
        If the result contains neither ``pressure`` nor ``gap``. If there are not two resistivities of one kind, one is
        negative, or both are zero.

    See Also
    --------
    roughvisc.observables.contact

    Notes
    -----
    All spots have one potential, and each body is at a constant potential far from the spots. The conductance is
    :math:`G = 2k / (\rho_1 + \rho_2)`, where :math:`k` is the stiffness of a flat punch with the shape of the spots,
    over the contact modulus [1]_; for a single disc :math:`G = 4a / (\rho_1 + \rho_2)`. Each body conducts like a
    half-space, even if it is a sheet. With periodic or mirror boundaries only the constriction resistance of the cells
    of the grid counts, without the resistance of the bulk. Nothing flows through the gap, and films on the spots have
    no resistance.

    References
    ----------
    .. [1] J. R. Barber, *Proc. R. Soc. A* 459 (2003) 53-66.

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-3, size=1e-4, shape=65)
    >>> press = rv.Program().load(1e-4, over=0)
    >>> ds = rv.simulate(ball, rv.elastic(1e6), press, times=[0.0], progress=False)
    >>> spot = rv.observables.conductance(ds, resistivity=["0.2 K m/W", 0.0]).thermal_conductance
    >>> radius = rv.closed_forms.hertz(1e-3, 4e6, 1e-4).radius
    >>> bool(abs(spot / (4 * radius / 0.2) - 1) < 0.03)
    True
    """
    if isinstance(resistivity, str) or not isinstance(resistivity, Sequence) or len(resistivity) != 2:
        wanted = 'a list of two, one of each body, in K m/W or, as strings such as "2e-8 ohm m", in ohm m'
        raise InputError(key="resistivity", found=resistivity, expected=wanted)
    texts = [value for value in resistivity if isinstance(value, str) and not is_quantity(value, "1")]
    kind = "electrical" if any(is_quantity(value, _UNITS["electrical"]) for value in texts) else "thermal"
    both = [number(value, _UNITS[kind], "resistivity") for value in resistivity]
    if min(both) < 0 or sum(both) == 0:
        raise InputError(key="resistivity", found=resistivity, expected="none below zero, and not both zero")
    touching = contact(dataset)
    present = dataset["height"].notnull() if "height" in dataset else xr.ones_like(touching)
    cells = spacing(dataset, "spots")
    boundary: Any = boundary_of(dataset)

    def measure(touching: np.ndarray, present: np.ndarray) -> tuple[float, float]:
        return frozen_contact(touching, cells, boundary, present=present)

    stiffness, error = frame_by_frame(measure, touching, present, outputs=[(), ()])
    name = f"{kind}_conductance"
    factor = 2 / sum(both)
    described = label(xr.Dataset({name: factor * stiffness, f"{name}_error": factor * error}))
    described[name].attrs["resistivity"] = both
    return described
