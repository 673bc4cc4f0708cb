"""Error of the grid, from the same history on cells two and four times as long and from the contact edge.

Three grids show how fast a history settles (:func:`grid_uncertainty`). They may agree by
chance, and do so where the contact is too small for any of them to see its shape. Therefore no error is stated that is
smaller than what the finest grid leaves open by itself: the edge of the contact, which lies anywhere in its cells, and
the peak between the highest ones.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import RoughviscError
from roughvisc.experiment.coarser import coarser, pressure_distance
from roughvisc.mechanics.contact.neighbours import bounds_with_grid, neighbours
from roughvisc.topography.indenters import grown
from roughvisc.variables.axes import axis_of

Array = NDArray[np.float64]
#: Powers of the cell's side with which the error of a quantity vanishes: no lower one is believed, and no higher one
#: expected. Measured: of the pressure's L1 norm; the mean gap follows the displacements, the counted area the cells at
#: its edge; of the contact area the scatter of the count is left. Friction shows the power 2 or more; with 1.5 what is
#: stated is 1.1 times the true error or more on 24 rough surfaces, and 10 times that in the median. The area of a
#: sliding contact settles more slowly than that of one at rest.
ORDERS = {
    "pressure": (1.0, 1.5),
    "approach": (1.0, 2.0),
    "contact_area": (1.5, 1.5),
    "contact_area_counted": (0.5, 1.0),
    "mean_gap": (1.0, 2.0),
    "friction": (1.0, 1.5),
    "sliding_area": (1.0, 1.0),
}
#: Roache's safety factors: with three grids, and with two.
_THREE, TWO_GRIDS = 1.25, 3.0


def grid_uncertainty(name: str, near: ArrayLike, far: ArrayLike, ratio: float) -> Array:
    """What the grid leaves unknown of a quantity, from the runs on three grids.

    Parameters
    ----------
    name : str
        The quantity.
    near, far : array_like
        Differences between the runs on the first and the second, and on the second and the third grid; the latter
        may be missing.
    ratio : float
        How many times longer the cells are from one grid to the next.

    Notes
    -----
    With an error that vanishes with the power ``p`` of the cell's side the finest run is off by
    ``near / (ratio^p - 1)``. The power seen, ``log(far / near) / log(ratio)``, is taken where it is below the one
    expected. Where it is above, the two finer grids agree by chance: then ``far / ratio^p`` with the power expected
    stands for ``near``. The safety factor is 1.25 with three grids and 3 with two (the grid convergence index of
    Roache [1]_).

    References
    ----------
    .. [1] P. J. Roache, Annu. Rev. Fluid Mech. 29 (1997) 123.
    """
    near, far = np.asarray(near, dtype=float), np.asarray(far, dtype=float)
    lowest, expected = ORDERS[name]
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = np.log(far / near) / math.log(ratio)
    order = np.where(np.isnan(seen), expected, np.clip(seen, lowest, expected))
    factor = np.where(np.isnan(far), TWO_GRIDS, _THREE)
    # a missing near makes it missing, a missing far does not
    difference = np.maximum(near, np.where(np.isnan(far), 0.0, far) / ratio**expected)
    return np.asarray(factor * difference / (ratio**order - 1))


log = logging.getLogger("roughvisc")
Mask = NDArray[np.bool_]
#: Error of the pressure (L1) for each newton on cells at the edge of the contact, at most: where contact ends on the
#: material (measured 0.2 in the median, 0.5 in 5 % of the cases), and where the material ends, with pressure infinite.
#: With all of the force at the edge, nothing is known.
_AT_EDGE, _AT_END = 0.45, 0.9
#: Error of the counted cells over the square root of the number of faces at the contact's edge, as edges lie at random
#: between the cells; what is mirrored doubles the same error.
_COUNTING = 0.5
#: Approaches that differ by less of the largest one were given.
_GIVEN = 1e-12


def with_grid_error(
    dataset: xr.Dataset, height: xr.DataArray, press_again: Callable[[xr.DataArray, list[float]], xr.Dataset]
) -> xr.Dataset:
    """A result with ``grid_error``, ``grid_error_area`` and bounds on the contact area in its rows.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure``.
    height : xarray.DataArray
        The surface that it was computed from, before the grid grew. [m]
    press_again : callable
        Computes the same on another surface, at given places of the axis, with ``pressure``.

    Notes
    -----
    ``grid_error`` is the larger one of the errors of the pressure (L1, over the largest force, so that the error of
    the force is in it) and of the approach (over the largest), ``grid_error_area`` that of the contact area. All
    runs have an error in time within the tolerance, so that these are no estimates much below it. Missing where
    there is no coarser solution; where there is one but no third grid, the safety factor is larger. The coarser grids
    have all waves that they can hold: see :func:`~roughvisc.experiment.coarser.coarser`.
    """
    places = [float(one) for one in dataset[axis_of(dataset.variables)].values]
    try:
        few = coarser(height, 2.0, dataset.attrs["boundary"])
        if few.size == height.size:
            raise RoughviscError(f"{height.shape[0]} x {height.shape[1]} cells cannot be coarsened")
        second = press_again(few, places)
    except RoughviscError as error:
        log.warning("no grid error: the coarser solve failed: %s", error)
        nothing = np.full(len(places), math.nan)
        return _with_errors(dataset, nothing, nothing)
    third = None
    try:
        fewest = coarser(height, 4.0, dataset.attrs["boundary"])
        third = press_again(fewest, places) if fewest.size < few.size else None
    except RoughviscError as error:
        log.info("grid error from two grids: the third solve failed: %s", error)
    ratio = math.sqrt(height.size / few.size)
    runs = (dataset, second, third)
    edge = [_left_open(dataset, number) for number in range(len(places))]
    from_edge, from_counting = (np.array(column) for column in zip(*edge, strict=True))
    near_approach, far_approach = _differences(runs, _histories("approach"))
    found = {
        "pressure": grid_uncertainty("pressure", *_differences(runs, _pressures), ratio),
        "approach": grid_uncertainty("approach", near_approach, far_approach, ratio),
        "area": grid_uncertainty("contact_area", *_differences(runs, _histories("contact_area")), ratio),
    }
    from_peak, from_force, from_area = _from_peak(dataset, _peak(height), near_approach < _GIVEN)
    error = np.max([found["pressure"], found["approach"], from_edge, from_peak, from_force], axis=0)
    area = np.max([found["area"], from_counting, from_area], axis=0)
    return _with_errors(dataset, error, area)


def _with_errors(dataset: xr.Dataset, error: Array, area: Array) -> xr.Dataset:
    """A result with errors of the grid, and bounds on the contact area that hold them."""
    bounds = (f"contact_area_solver_{end}" for end in ("lower", "upper"))
    solver = (dataset[name if name in dataset else "contact_area"].values for name in bounds)
    lower, upper = bounds_with_grid(*solver, area * _largest(dataset, "contact_area"))
    found = {"grid_error": error, "grid_error_area": area, "contact_area_lower": lower, "contact_area_upper": upper}
    return dataset.assign({name: (axis_of(dataset.variables), values) for name, values in found.items()})


Runs = tuple[xr.Dataset, xr.Dataset, xr.Dataset | None]


def _differences(runs: Runs, between: Callable[[xr.Dataset, xr.Dataset, xr.Dataset], Array]) -> tuple[Array, Array]:
    """Between the first two runs and the last two, the latter missing without a third; in units of the first."""
    first, second, third = runs
    near = between(second, first, first)
    return near, np.full_like(near, math.nan) if third is None else between(third, second, first)


def _pressures(found: xr.Dataset, wanted: xr.Dataset, unit: xr.Dataset) -> Array:
    return pressure_distance(found, wanted) / _largest(unit, "force")


def _histories(name: str) -> Callable[[xr.Dataset, xr.Dataset, xr.Dataset], Array]:
    return lambda found, wanted, unit: np.abs(found[name].values - wanted[name].values) / _largest(unit, name)


def _largest(dataset: xr.Dataset, name: str) -> float:
    return max(float(np.max(np.abs(dataset[name].values))), 1e-300)


def _peak(height: xr.DataArray) -> float:
    """How much higher than the highest cell a surface may be in that cell; zero where it is known. [m]

    Half of the way down to the lower neighbour along each axis: the flanks of a cone meet no higher.
    """
    if "recipe" in height.attrs and grown(height, 1.0) is not None:
        return 0.0
    values = height.values
    at = np.unravel_index(int(np.nanargmax(values)), values.shape)
    lines = (values[:, at[1]], values[at[0]])
    lowest = (np.fmin.reduce(line[max(i - 1, 0) : i + 2]) for line, i in zip(lines, at, strict=True))
    return float(sum(values[at] - low for low in lowest)) / 2


def _from_peak(dataset: xr.Dataset, peak: float, given: Mask) -> tuple[Array, Array, Array]:
    """Errors of approach, force and area if the peak is so much higher [m], relative to the largest.

    Where the approach is given, force and area follow from it; under a cone both with its square, under a ball with
    lower powers.
    """
    approach = np.abs(dataset["approach"].values)
    part = np.where(given & (approach > 0), 2 * peak / np.maximum(approach, peak or 1.0), 0.0)
    follow = [part * dataset[name].values / _largest(dataset, name) for name in ("force", "contact_area")]
    return np.where(given, 0.0, peak / _largest(dataset, "approach")), follow[0], follow[1]


def _left_open(dataset: xr.Dataset, row: int) -> tuple[float, float]:
    """Errors of pressure and contact area, relative to the largest, that the edge of a contact may hide."""
    pressure = dataset["pressure"].values[row]
    contact = pressure > 0
    if not contact.any():
        return 0.0, 0.0
    present = np.isfinite(dataset["height"].values)
    at_edge, at_end, faces = _edge(contact, present & ~contact, dataset.attrs["boundary"] == "periodic")
    counted = counting_error(contact, faces)
    total = float(pressure.sum())
    share = float(pressure[at_edge].sum()) / total
    hidden = _AT_EDGE * share / (1 - (1 - _AT_EDGE) * share)  # all of it where no cell lies inside
    hidden += _AT_END * float(pressure[at_end & ~at_edge].sum()) / total
    force = float(dataset["force"][row]) / _largest(dataset, "force")
    area = float(dataset["contact_area_counted"][row]) / _largest(dataset, "contact_area")
    return hidden * force, counted * area


def counting_error(contact: Mask, faces: int) -> float:
    """Relative error of an area that is counted, from the number of faces to cells out of contact."""
    images = math.prod(2 for axis in (0, 1) if np.array_equal(contact, np.flip(contact, axis)))
    return _COUNTING * math.sqrt(images * faces) / np.count_nonzero(contact)


def _edge(contact: Mask, free: Mask, periodic: bool) -> tuple[Mask, Mask, int]:
    """Cells in contact beside present cells out of contact, and beside none at all; faces to the former."""
    at_edge, at_end, faces = np.zeros_like(contact), np.zeros_like(contact), 0
    for beside, material in zip(neighbours(free, periodic), neighbours(free | contact, periodic), strict=True):
        here = contact & beside
        faces += int(np.count_nonzero(here))
        at_edge |= here
        at_end |= contact & ~material
    return at_edge, at_end, faces
