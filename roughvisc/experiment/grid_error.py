"""Error of the grid in each quantity, from a solution on cells twice as long and from the edge of the contact.

Both grids may agree by chance, and they do so if the contact is too small for either grid to resolve its shape.
Therefore the stated error is never smaller than the uncertainty of the finer grid alone. The edge of the contact may
lie anywhere in its cells, and the peak of the surface may lie between the highest cells.

Steady sliding and trades have three grids, which show the order of convergence (:func:`grid_uncertainty`). With two, on
24 rough surfaces at three pressures and three speeds, the error would be below 0.8 of the true one in 27 of 216 areas,
8 of 216 mean gaps and 4 of 216 friction forces, and with three in none.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import RoughviscError
from roughvisc.experiment.accuracy import Stated
from roughvisc.mechanics.contact.solver import neighbours
from roughvisc.mechanics.grid import Boundary
from roughvisc.topography.grid import cell_edges, spacing
from roughvisc.topography.recipes import indenter_of, remade
from roughvisc.topography.spectrum import resample, shares
from roughvisc.variables import VARIABLES

log = logging.getLogger("roughvisc")
Array = NDArray[np.float64]
#: Histories that runs on different grids are compared by; ``grid_error`` includes the error of the force.
COMPARED = ("force", "approach", "mean_gap", "contact_area", "friction_force")
_COLUMN = {name: VARIABLES[name].grid_error for name in ("pressure", *COMPARED)} | {"force": "grid_error"}
#: Orders of convergence in the cell side: lowest accepted order and expected order. They are measured; for the pressure
#: in the L1 norm. The mean gap converges like the displacements, but more slowly in free space. The counted area
#: converges like the number of cells at its edge. The contact area keeps the scatter of the count. Friction shows order
#: 2 or more. With order 1.5 the stated error is at least 1.1 times the true error on 24 rough surfaces, and 10 times
#: the true error in the median.
ORDERS = {"approach": (1.0, 2.0), "contact_area": (1.5, 1.5), "contact_area_counted": (0.5, 1.0)}
#: Orders of the other quantities.
_USUAL = 1.0, 1.5
#: Safety factor and order for one coarser grid, from which the order cannot be estimated. On the 456 contacts of
#: ``workflows/benchmarks/grid_accuracy.py`` the error is then below 0.8 of the true one in 1 of 446 pressures, 1 of 299
#: approaches, 1 of 155 forces, 5 of 142 mean gaps and 16 of 454 areas; with a third grid in 1, 0, 1, 2 and 10.
_ONE_COARSER = {"pressure": (2.0, 1.5), "contact_area": (2.0, 1.5), "mean_gap": (3.0, 1.0)}
#: The same for other quantities.
_ONE_COARSER_USUAL = 3.0, 1.5
#: The area of a sliding contact converges more slowly than the area of a contact at rest.
_MOVING = {"contact_area": (1.0, 1.0)}
#: Roache's safety factors: with three grids, and with two.
_THREE = 1.25
TWO_GRIDS = 3.0


def grid_uncertainty(name: str, near: ArrayLike, far: ArrayLike, ratio: float, *, moving: bool = False) -> Array:
    """Return the error of a quantity due to the grid, from runs on three grids.

    Parameters
    ----------
    name : str
        Name of the quantity.
    near, far : array_like
        Differences between the runs on the first and second grid, and on the second and third grid. `far` may be
        missing.
    ratio : float
        Ratio of the cell sides of one grid and the next finer grid.
    moving : bool
        Whether the surface slides.

    Notes
    -----
    If the error is proportional to the cell side to the power ``p``, the error of the finest run is
    ``near / (ratio^p - 1)``. The observed order ``p = log(far / near) / log(ratio)`` is used if it is below the
    expected order. If it is above, the two finer grids agree by chance; ``near`` is then replaced by ``far / ratio^p``
    with the expected order. The safety factor is 1.25 with three grids and 3 with two (the grid convergence index of
    Roache [1]_).

    References
    ----------
    .. [1] P. J. Roache, Annu. Rev. Fluid Mech. 29 (1997) 123.
    """
    near = np.asarray(near, dtype=float)
    far = np.asarray(far, dtype=float)
    usual = ORDERS.get(name, _USUAL)
    lowest, expected = _MOVING.get(name, usual) if moving else usual
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = np.log(far / near) / math.log(ratio)
    order = np.where(np.isnan(seen), expected, np.clip(seen, lowest, expected))
    factor = np.where(np.isnan(far), TWO_GRIDS, _THREE)
    # the error is missing if near is missing, but not if far is
    difference = np.maximum(near, np.where(np.isnan(far), 0.0, far) / ratio**expected)
    return np.asarray(factor * difference / (ratio**order - 1))


Mask = NDArray[np.bool_]
#: Largest error of the pressure (L1) per unit force on cells at the edge of the contact. The first is for edges on the
#: material (measured 0.2 in the median, 0.5 in 5 % of the cases), the second for edges of the material, where the
#: pressure is infinite. If the edge carries all of the force, the pressure is unknown.
_AT_EDGE = 0.45
_AT_END = 0.9
#: Error of the number of contact cells over the square root of the number of faces at the edge of the contact, since
#: the edge lies at random between the cells. Each mirror symmetry of the contact doubles the same error.
_COUNTING = 0.5
#: Open area that a grid in full contact may hide, over the area of the cells with small pressure: an opening between
#: cell centres may be wider than one cell. At 0.999 of the pressure of full contact the hidden area is 2.3 times the
#: open area of a wave on 64 cells, and 4.7 times the open area on 32 cells.
_HIDDEN = 1.5
#: Size that counts as zero in a ratio.
_ZERO = 1e-300
#: Approaches of both grids that differ by less than this part of the largest approach were prescribed.
_GIVEN = 1e-12


def with_grid_error(
    dataset: xr.Dataset, height: xr.DataArray, press_again: Callable[[xr.DataArray, list[float]], xr.Dataset]
) -> xr.Dataset:
    """Return a result with the error of each quantity due to the grid.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure``.
    height : xarray.DataArray
        Surface of the result, before the grid grew. [m]
    press_again : callable
        Repeats the loading on another surface, with rows at given times and ``pressure``.

    Notes
    -----
    Errors are relative to the largest value of the quantity, the error of the pressure (L1) to the largest force.
    ``grid_error`` is the largest error of pressure, force and approach. All runs have an error in time within the
    tolerance, so the estimates are meaningless far below the tolerance. They are missing if the coarser run fails, and
    for a quantity that is zero in all rows but may differ from zero: zero has no relative error. The coarser grid has
    all waves that it can resolve, see :func:`coarser`.
    """
    histories = [name for name in COMPARED if name in dataset]
    times = dataset["time"].values.tolist()
    try:
        few = coarser(height, 2.0, dataset.attrs["boundary"])
        if few.size == height.size:
            raise RoughviscError(f"{height.shape[0]} x {height.shape[1]} cells cannot be coarsened")
        coarse = press_again(few, times)
    except RoughviscError as error:
        log.warning("no grid error: the coarser solve failed: %s", error)
        missing = "time", np.full(len(times), math.nan)
        columns = [VARIABLES["mean_contact_pressure"].grid_error, *map(_COLUMN.__getitem__, ("pressure", *histories))]
        return dataset.assign(dict.fromkeys(columns, missing))
    largest = {name: float(np.fmax.reduce(np.abs(dataset[name].values), initial=_ZERO)) for name in histories}
    if "adhesive_force" in dataset:  # pressure and tension may cancel
        largest["force"] = max(largest["force"], *pressure_size(dataset))
    off = {name: np.abs(coarse[name].values - dataset[name].values) for name in histories}
    apart = {"pressure": pressure_distance(coarse, dataset) / largest["force"]}
    apart |= {name: off[name] / largest[name] for name in histories}
    ratio = math.sqrt(height.size / few.size)
    differences = {}
    for name, difference in apart.items():
        safety, order = _ONE_COARSER.get(name, _ONE_COARSER_USUAL)
        differences[name] = safety * difference / (ratio**order - 1)
    is_given = off["approach"] < _GIVEN * largest["approach"]
    periodic = dataset.attrs["boundary"] == "periodic"
    peak = 0.0 if indenter_of(height) is not None else hidden_peak(height.values, periodic)
    rows = [_least_errors(dataset, row, largest, bool(is_given[row]), peak) for row in range(len(times))]
    of_quantity = at_least(differences, {name: np.array([row[name] for row in rows]) for name in rows[0]})
    errors = by_column(of_quantity)
    for name in histories:
        errors[_COLUMN[name]] = missing_of_zero(errors[_COLUMN[name]], largest[name])
    errors["grid_error"] = np.maximum(errors["grid_error"], errors["grid_error_approach"])
    pressures = []
    for row in range(len(times)):
        force, area = (
            Stated(float(dataset[name][row]), float(of_quantity[name][row]) * largest[name])
            for name in ("force", "contact_area")
        )
        pressures.append(force.over(area))
    most = np.fmax.reduce([pressure.value for pressure in pressures], initial=_ZERO)
    errors[VARIABLES["mean_contact_pressure"].grid_error] = np.array([pressure.error / most for pressure in pressures])
    return dataset.assign({name: ("time", values) for name, values in errors.items()})


def missing_of_zero(error: ArrayLike, size: float) -> Array:
    """Return relative errors of a quantity of some size; NaN if it is zero, but has an error.

    Sizes up to 1e-300 count as zero.
    """
    error = np.asarray(error, dtype=float)
    return error if size > _ZERO else np.where(error > 0, math.nan, error)


def at_least(differences: Mapping[str, ArrayLike], least: Mapping[str, ArrayLike]) -> dict[str, Array]:
    """Return the error of each quantity due to the grid.

    Parameters
    ----------
    differences : mapping
        Quantity -> error from the difference between the grids; NaN if the coarser run failed.
    least : mapping
        Quantity -> least error to state, from the finest grid alone.
    """
    return {name: np.asarray(np.maximum(error, least.get(name, 0.0))) for name, error in differences.items()}


def by_column(errors: Mapping[str, Array]) -> dict[str, Array]:
    """Return the errors of quantities due to the grid by result variable, each the largest error of its quantities."""
    columns: dict[str, Array] = {}
    for name, error in errors.items():
        column = _COLUMN[name]
        columns[column] = np.maximum(columns.get(column, error), error)
    return columns


def hidden_peak(height: Array, periodic: bool) -> float:
    """Return the possible height of the peak above the centre of the highest cell. [m]

    The bound is half of the descent to the lower neighbour, summed over both axes: the flanks of a cone meet no higher.

    Parameters
    ----------
    height : ndarray, shape (nx, ny)
        Heights of the surface; NaN at absent cells. [m]
    periodic : bool
        Whether the surface repeats.
    """
    beyond: Any = "wrap" if periodic else "clip"
    highest = np.unravel_index(int(np.nanargmax(height)), height.shape)
    lines = (height[:, highest[1]], height[highest[0]])
    lowest = (np.fmin.reduce(line.take([i - 1, i, i + 1], mode=beyond)) for line, i in zip(lines, highest, strict=True))
    return float(sum(height[highest] - low for low in lowest)) / 2


def _least_errors(
    dataset: xr.Dataset, row: int, largest: Mapping[str, float], given: bool, peak: float
) -> dict[str, float]:
    """Return the least errors to state for a row, by quantity, from its own grid, relative to the largest values.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.
    row : int
        Number of the row.
    largest : mapping
        Largest values of force [N], approach [m], contact area [m2] and mean gap. [m]
    given : bool
        Whether the approach is prescribed, not the load.
    peak : float
        Possible height of the peak above the highest cell, see :func:`hidden_peak`. [m]
    """
    here = {name: float(dataset[name][row]) for name in ("force", "approach", "contact_area", "contact_area_counted")}
    wide = largest["mean_gap"]
    force = here["force"] / largest["force"]
    area = here["contact_area"] / largest["contact_area"]

    # The peak: under a given approach the gap is too wide by its height. Force and area grow with the square of the
    # approach under a cone, and with lower powers under a ball. Under a given load the approach is too small.
    depth = abs(here["approach"])
    share_of_approach = 2 * peak / max(depth, peak or 1.0) if given and depth > 0 else 0.0
    least = {
        "pressure": share_of_approach * force,
        "force": share_of_approach * force,
        "contact_area": share_of_approach * area,
    }
    least |= {"approach": 0.0 if given else peak / largest["approach"], "mean_gap": peak / wide if given else 0.0}

    pressure = dataset["pressure"].values[row]
    height = dataset["height"].values
    contact = pressure > 0
    present = np.isfinite(height)
    if "adhesive_force" in dataset:
        contact = dataset["gap"].values[row] == 0
        pressure = np.abs(pressure)
    if not contact.any():
        return least
    # Full contact on this grid may hide small openings.
    hidden, gap = hidden_opening(pressure, height, dataset.attrs["boundary"] == "periodic")
    least["contact_area"] = max(least["contact_area"], hidden * area)
    least["mean_gap"] = max(least["mean_gap"], gap / wide)
    # The edge of the contact lies anywhere in its cells.
    at_edge, at_end, faces, ends, outline = _edge(contact, present, dataset.attrs["boundary"])
    total = float(pressure.sum())
    share = float(pressure[at_edge].sum()) / total
    unknown = _AT_EDGE * share / (1 - (1 - _AT_EDGE) * share)  # 1 if all contact cells lie at the edge
    unknown += _AT_END * float(pressure[at_end & ~at_edge].sum()) / total
    counted = here["contact_area_counted"] / largest["contact_area"]
    least["pressure"] = max(least["pressure"], unknown * force)
    least["contact_area"] = max(least["contact_area"], counting_error(contact, faces + outline) * counted)
    # The edge of the material: a wider punch sinks in less, or carries more.
    solved_for = "force" if given else "approach"
    least[solved_for] = max(least[solved_for], counting_error(contact, ends))
    return least


def hidden_opening(pressure: Array, height: Array, periodic: bool) -> tuple[float, float]:
    """Return the area and mean gap of openings that a grid in full contact may hide; zero if all pressures are high.

    Parameters
    ----------
    pressure : ndarray, shape (nx, ny)
        Pressure. [Pa]
    height : ndarray, shape (nx, ny)
        Heights of the profile; NaN at absent cells. [m]
    periodic : bool
        Whether the surface repeats.

    Returns
    -------
    area : float
        Open area, as a fraction of the contact area.
    gap : float
        Mean gap. [m]

    Notes
    -----
    Let ``dp`` be the largest change of the pressure from the cell of least pressure to a neighbouring cell. The
    surfaces may separate between the centres of cells whose pressure is at most ``dp``. The height of this opening is
    at most the change of the profile between the same neighbours.
    """
    present = np.isfinite(height)
    if not (pressure[present] > 0).all():
        return 0.0, 0.0
    lowest = np.unravel_index(int(np.argmin(np.where(present, pressure, math.inf))), pressure.shape)
    beyond: dict[str, Any] = {"mode": "wrap"} if periodic else {"constant_values": math.nan}
    # counted from the cells beyond the border
    beside = (lowest[0] + np.array([0, 2, 1, 1]), lowest[1] + np.array([1, 1, 0, 2]))
    changes = np.pad(np.where(present, pressure, math.nan), 1, **beyond)[beside] - pressure[lowest]
    steps = np.pad(height, 1, **beyond)[beside] - height[lowest]
    if np.isnan(changes).all():
        return 0.0, 0.0
    share = _HIDDEN * np.count_nonzero(pressure[present] <= np.nanmax(changes)) / np.count_nonzero(present)
    return share, share * float(np.nanmax(np.abs(steps)))


def counting_error(contact: Mask, faces: int) -> float:
    """Return the relative error of a counted area, from the number of faces at its edge."""
    images = math.prod(2 for axis in (0, 1) if np.array_equal(contact, np.flip(contact, axis)))
    return _COUNTING * math.sqrt(images * faces) / np.count_nonzero(contact)


def _edge(contact: Mask, present: Mask, boundary: Boundary) -> tuple[Mask, Mask, int, int, int]:
    """Return the contact cells at the edge of the contact and at the edge of the material, and numbers of faces.

    The faces are faces to free cells, faces at the edge of the material, and faces of the last to absent cells. The
    others lie at the border of the grid, whose place is known.
    """
    at_edge = np.zeros_like(contact)
    at_end = np.zeros_like(contact)
    faces = 0
    ends = 0
    outline = 0
    around = (neighbours(mask, boundary) for mask in (present & ~contact, present, ~present))
    for free, material, absent in zip(*around, strict=True):
        at_edge |= contact & free
        at_end |= contact & ~material
        faces += int(np.count_nonzero(contact & free))
        ends += int(np.count_nonzero(contact & ~material))
        outline += int(np.count_nonzero(contact & absent))
    return at_edge, at_end, faces, ends, outline


# ------------------------------------------------------------------------------------------------------ coarser grids


def coarser_shape(shape: tuple[int, int], factor: float, same_parity: bool) -> tuple[int, int]:
    """Return the shape of a grid with cells longer by about a factor, at least two cells along each axis.

    The apex of an indenter lies in a cell if the number of cells is odd, and between cells if it is even;
    ``same_parity`` keeps the position.

    Examples
    --------
    >>> coarser_shape((31, 64), 2, True), coarser_shape((31, 64), 2, False), coarser_shape((8, 1), 2, True)
    ((17, 32), (16, 32), (4, 1))
    """
    counts = []
    for count in shape:
        fewer = max(round(count / factor), min(2, count))
        counts.append(fewer + (same_parity and (fewer - count) % 2 != 0))
    return counts[0], counts[1]


def coarser(height: xr.DataArray, factor: float, boundary: Boundary) -> xr.DataArray:
    """Return a surface on cells longer by about a factor. [m]

    An indenter is generated again. Any other surface keeps the waves that the new cells can resolve.

    Parameters
    ----------
    height : xarray.DataArray
        Heights of the surface. [m]
    factor : float
        Ratio of the new cell side to the old one.
    boundary : {"free", "periodic", "mirror"}
        Boundary of the run. With "periodic" the surface repeats, with "mirror" it repeats with its mirror images.
    """
    shape = (height.sizes["x"], height.sizes["y"])
    few = remade(height, coarser_shape(shape, factor, True))
    periodic = {"periodic": True, "mirror": False}.get(boundary)
    return resample(height, coarser_shape(shape, factor, False), periodic=periodic) if few is None else few


def pressure_size(dataset: xr.Dataset) -> Array:
    """Return the integral of the absolute pressure of a result at each time. [N]"""
    cell_area = math.prod(spacing(dataset["height"], "height"))
    return np.array([float(np.nansum(np.abs(frame.values))) * cell_area for frame in dataset["pressure"]])


def pressure_distance(found: xr.Dataset, wanted: xr.Dataset) -> Array:
    """Return the L1 distance between the pressures on two grids at each common time. [N]

    Parameters
    ----------
    found, wanted : xarray.Dataset
        Results at the same times with ``pressure``. Both pressures are averaged over the coarser cells.

    Returns
    -------
    ndarray, shape (time,)
        Integral of the absolute difference.
    """
    grids = [cell_edges(ds) for ds in (found, wanted)]
    sides = [np.diff(grid[0])[0] for grid in grids]
    common = grids[int(np.argmax(sides))]
    low, high = ([reach(grid[axis][end] for grid in grids) for axis in (0, 1)] for end, reach in ((0, min), (-1, max)))
    onto = (_extended(common[0], low[0], high[0]), _extended(common[1], low[1], high[1]))
    means = []
    for ds, grid in zip((found, wanted), grids, strict=True):
        along_x, along_y = (shares(a, b).toarray() for a, b in zip(grid, onto, strict=True))
        means.append(along_x @ ds["pressure"].values @ along_y.T)
    area = np.diff(onto[0])[:, None] * np.diff(onto[1])
    return np.asarray((np.abs(means[0] - means[1]) * area).sum(axis=(-2, -1)))


def _extended(edges: Array, low: float, high: float) -> Array:
    """Return cell edges, extended by cells of the same side until they cover both limits."""
    side = edges[1] - edges[0]
    before, after = (max(0, math.ceil(gap / side - 1e-9)) for gap in (edges[0] - low, high - edges[-1]))
    return np.concatenate(
        [edges[0] - side * np.arange(before, 0, -1), edges, edges[-1] + side * np.arange(1, after + 1)]
    )
