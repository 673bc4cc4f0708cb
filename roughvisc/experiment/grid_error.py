"""Error of the grid in each quantity, from a solution on cells twice as long and from the edge of the contact.

Both grids may agree by chance, and do so if the contact is too small for either to resolve its shape. Therefore no
error is stated that is smaller than what the finer grid alone leaves open: the edge of the contact, which lies anywhere
in its cells, and the peak between the highest cells.

Steady sliding and trades have three grids, which show the order of convergence (:func:`grid_uncertainty`). With two, on
24 rough surfaces at three pressures and three speeds, the error would be below 0.8 of the true one in 27 of 216 areas,
8 of 216 mean gaps and 4 of 216 friction forces, and with three in none.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import RoughviscError
from roughvisc.experiment.coarser import coarser, pressure_distance
from roughvisc.mechanics.contact.neighbours import neighbours
from roughvisc.mechanics.grid import Boundary
from roughvisc.topography.indenters import is_indenter
from roughvisc.variables import GRID_ERROR, axis_of

Array = NDArray[np.float64]
#: Powers of the cell's side with which the error of a quantity vanishes: no lower one is believed, and no higher one
#: expected. Measured: of the pressure's L1 norm; the mean gap follows the displacements, but in free space more slowly;
#: the counted area the cells at its edge; of the contact area the scatter of the count is left. Friction shows the
#: power 2 or more; with 1.5 what is stated is 1.1 times the true error or more on 24 rough surfaces, and 10 times that
#: in the median.
ORDERS = {
    "pressure": (1.0, 1.5),
    "force": (1.0, 1.5),
    "approach": (1.0, 2.0),
    "contact_area": (1.5, 1.5),
    "contact_area_counted": (0.5, 1.0),
    "mean_gap": (1.0, 1.5),
    "friction_force": (1.0, 1.5),
    "friction_coefficient": (1.0, 1.5),
    "leak_rate": (1.0, 1.5),
    "thermal_conductance": (1.0, 1.5),
    "incremental_stiffness": (1.0, 1.5),
}
#: Safety factor and order for one coarser grid, which cannot show the order. On the 456 contacts of
#: ``workflows/benchmarks/grid_accuracy.py`` the error is then below 0.8 of the true one in 1 of 446 pressures, 1 of 299
#: approaches, 1 of 155 forces, 5 of 142 mean gaps and 16 of 454 areas; with a third grid in 1, 0, 1, 2 and 10.
_ONE_COARSER = {
    "pressure": (2.0, 1.5),
    "force": (3.0, 1.5),
    "approach": (3.0, 1.5),
    "contact_area": (2.0, 1.5),
    "mean_gap": (3.0, 1.0),
    "friction_force": (3.0, 1.5),
}
#: The area of a sliding contact settles more slowly than that of one at rest.
_MOVING = {"contact_area": (1.0, 1.0)}
#: Roache's safety factors: with three grids, and with two.
_THREE, TWO_GRIDS = 1.25, 3.0


def grid_uncertainty(name: str, near: ArrayLike, far: ArrayLike, ratio: float, *, moving: bool = False) -> Array:
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
    moving : bool
        Whether the surface slides.

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
    lowest, expected = _MOVING.get(name, ORDERS[name]) if moving else ORDERS[name]
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = np.log(far / near) / math.log(ratio)
    order = np.where(np.isnan(seen), expected, np.clip(seen, lowest, expected))
    factor = np.where(np.isnan(far), TWO_GRIDS, _THREE)
    # a missing near makes it missing, a missing far does not
    difference = np.maximum(near, np.where(np.isnan(far), 0.0, far) / ratio**expected)
    return np.asarray(factor * difference / (ratio**order - 1))


def grid_uncertainties(
    runs: Sequence[Mapping[str, ArrayLike]], ratio: float, *, moving: bool = False
) -> dict[str, Array]:
    """The same of several quantities, relative to the largest value of the first run.

    Parameters
    ----------
    runs : sequence of mapping
        Quantity -> values over the rows, on two or three grids, the finest first.
    ratio, moving
        As :func:`grid_uncertainty` has them.
    """
    found = {}
    for name, first in runs[0].items():
        unit = float(np.fmax.reduce(np.abs(np.atleast_1d(first)), initial=1e-300))
        values = [np.asarray(run[name], dtype=float) for run in runs]
        near, *more = (np.abs(other - one) / unit for one, other in pairwise(values))
        found[name] = grid_uncertainty(
            name, near, more[0] if more else np.full_like(near, math.nan), ratio, moving=moving
        )
    return found


log = logging.getLogger("roughvisc")
Mask = NDArray[np.bool_]
#: Error of the pressure (L1) for each newton on cells at the edge of the contact, at most: where contact ends on the
#: material (measured 0.2 in the median, 0.5 in 5 % of the cases), and where the material ends, with pressure infinite.
#: With all of the force at the edge, nothing is known.
_AT_EDGE, _AT_END = 0.45, 0.9
#: Error of the counted cells over the square root of the number of faces at the contact's edge, as edges lie at random
#: between the cells; what is mirrored doubles the same error.
_COUNTING = 0.5
#: Area that full contact may hide over that of the cells of small pressure: an opening between the centres of cells may
#: be wider than one of them. At 0.999 of the pressure of full contact this is 2.3 times the open area of a wave on 64
#: cells, and 4.7 times that on 32.
_HIDDEN = 1.5
#: Approaches that differ by less of the largest one were given.
_GIVEN = 1e-12


def with_grid_error(
    dataset: xr.Dataset, height: xr.DataArray, press_again: Callable[[xr.DataArray, list[float]], xr.Dataset]
) -> xr.Dataset:
    """A result with the errors of its grid, one for each quantity, and bounds on the contact area in its rows.

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
    Errors are relative to the largest value, that of the pressure (L1) to the largest force; ``grid_error`` is the
    largest of pressure, force and approach. All runs have an error in time within the tolerance, so that these are no
    estimates much below it. Missing where there is no coarser solution. The coarser grid has all waves that it can
    hold: see :func:`~roughvisc.experiment.coarser.coarser`.
    """
    axis = axis_of(dataset.variables)
    places = dataset[axis].values.tolist()
    histories = [name for name in GRID_ERROR if name in dataset and name != "pressure"]
    found = {name: np.full(len(places), math.nan) for name in ("pressure", *histories)}
    least: dict[str, Array] = {}
    try:
        few = coarser(height, 2.0, dataset.attrs["boundary"])
        if few.size == height.size:
            raise RoughviscError(f"{height.shape[0]} x {height.shape[1]} cells cannot be coarsened")
        coarse = press_again(few, places)
    except RoughviscError as error:
        log.warning("no grid error: the coarser solve failed: %s", error)
    else:
        known = {"force", "approach", "contact_area", "mean_gap", *histories} & set(map(str, dataset.variables))
        largest = {name: float(np.fmax.reduce(np.abs(dataset[name].values), initial=1e-300)) for name in known}
        off = {name: np.abs(coarse[name].values - dataset[name].values) for name in histories}
        apart = {name: off[name] / largest[name] for name in histories}
        apart["pressure"] = pressure_distance(coarse, dataset) / largest["force"]
        ratio = math.sqrt(height.size / few.size)
        for name, difference in apart.items():
            safety, order = _ONE_COARSER[name]
            found[name] = safety * difference / (ratio**order - 1)
        is_given, peak = off["approach"] < _GIVEN * largest["approach"], _peak(height)
        rows = [_least_errors(dataset, row, largest, bool(is_given[row]), peak) for row in range(len(places))]
        least = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    errors = grid_errors(found, least)
    errors["grid_error"] = np.maximum(errors["grid_error"], errors["grid_error_approach"])
    return dataset.assign({name: (axis, values) for name, values in errors.items()})


def grid_errors(found: Mapping[str, Array], least: Mapping[str, Array]) -> dict[str, Array]:
    """Return the errors of the grid by the variables that state them: of two the larger one, of quantities the largest.

    Parameters
    ----------
    found : mapping
        Quantity -> error by the difference between the grids; missing (NaN) if there is no coarser solution.
    least : mapping
        Quantity -> error that the finest grid alone leaves open.
    """
    errors: dict[str, Array] = {}
    for name, error in found.items():
        larger, variable = np.maximum(error, least.get(name, 0.0)), GRID_ERROR[name]
        errors[variable] = np.maximum(errors.get(variable, larger), larger)
    return errors


def _peak(height: xr.DataArray) -> float:
    """How much higher than the highest cell a surface may be in that cell; zero where it is known. [m]

    Half of the way down to the lower neighbour along each axis: the flanks of a cone meet no higher.
    """
    if is_indenter(height):
        return 0.0
    values = height.values
    at = np.unravel_index(int(np.nanargmax(values)), values.shape)
    lines = (values[:, at[1]], values[at[0]])
    lowest = (np.fmin.reduce(line[max(i - 1, 0) : i + 2]) for line, i in zip(lines, at, strict=True))
    return float(sum(values[at] - low for low in lowest)) / 2


def _least_errors(
    dataset: xr.Dataset, row: int, largest: Mapping[str, float], given: bool, peak: float
) -> dict[str, float]:
    """Return the errors of a row by quantity, relative to the largest, that its own grid leaves open.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.
    row : int
        Number of the row.
    largest : mapping
        Largest values of force [N], approach [m], contact area [m2] and, if it is known, mean gap. [m]
    given : bool
        Whether the approach is given, and not the load.
    peak : float
        How much higher the surface may be between the highest cells. [m]
    """
    here = {name: float(dataset[name][row]) for name in ("force", "approach", "contact_area", "contact_area_counted")}
    wide = largest.get("mean_gap", math.inf)
    force, area = here["force"] / largest["force"], here["contact_area"] / largest["contact_area"]

    # The peak: under a given approach the gap is wider by as much, and force and area follow from it; under a cone both
    # with its square, under a ball with lower powers. Under a given load the approach is less.
    depth = abs(here["approach"])
    part = 2 * peak / max(depth, peak or 1.0) if given and depth > 0 else 0.0
    least = {"pressure": part * force, "force": part * force, "contact_area": part * area}
    least |= {"approach": 0.0 if given else peak / largest["approach"], "mean_gap": peak / wide if given else 0.0}

    pressure, height = dataset["pressure"].values[row], dataset["height"].values
    contact, present = pressure > 0, np.isfinite(height)
    if not contact.any():
        return least
    # Full contact on this grid may hide small openings.
    hidden, gap = hidden_opening(pressure, height, dataset.attrs["boundary"] == "periodic")
    least["contact_area"] = max(least["contact_area"], hidden * area)
    least["mean_gap"] = max(least["mean_gap"], gap / max(gap, wide) if gap > 0 else 0.0)
    # The edge of the contact lies anywhere in its cells.
    at_edge, at_end, faces, ends = _edge(contact, present & ~contact, dataset.attrs["boundary"])
    total = float(pressure.sum())
    share = float(pressure[at_edge].sum()) / total
    unknown = _AT_EDGE * share / (1 - (1 - _AT_EDGE) * share)  # all of it where no cell lies inside
    unknown += _AT_END * float(pressure[at_end & ~at_edge].sum()) / total
    counted = here["contact_area_counted"] / largest["contact_area"]
    least["pressure"] = max(least["pressure"], unknown * force)
    least["contact_area"] = max(least["contact_area"], counting_error(contact, faces) * counted)
    # The outline where the material ends: a wider punch sinks in less, or carries more.
    found = "force" if given else "approach"
    least[found] = max(least[found], counting_error(contact, ends))
    return least


def hidden_opening(pressure: Array, height: Array, periodic: bool) -> tuple[float, float]:
    """Return the area and the mean gap of openings too small for a grid in full contact; zero if all pressure is high.

    Parameters
    ----------
    pressure : ndarray, shape (nx, ny)
        [Pa]
    height : ndarray, shape (nx, ny)
        Of the profile; NaN where there is none. [m]
    periodic : bool
        Whether the surface repeats.

    Returns
    -------
    area : float
        Part of the contact area.
    gap : float
        Mean gap. [m]

    Notes
    -----
    The surface may open between the centres of cells whose pressure is less than it changes from the cell of least
    pressure to the next one. Such an opening is at most as high as the profile changes there.
    """
    present = np.isfinite(height)
    if not (pressure[present] > 0).all():
        return 0.0, 0.0
    filled = np.where(present, pressure, math.inf)
    at = np.unravel_index(int(np.argmin(filled)), filled.shape)
    beside = [(i, at[1]) for i in (at[0] - 1, at[0] + 1)] + [(at[0], j) for j in (at[1] - 1, at[1] + 1)]
    if periodic:
        beside = [(i % filled.shape[0], j % filled.shape[1]) for i, j in beside]
    beside = [(i, j) for i, j in beside if 0 <= i < filled.shape[0] and 0 <= j < filled.shape[1] and present[i, j]]
    changes = [float(filled[cell] - filled[at]) for cell in beside]
    if not changes:
        return 0.0, 0.0
    part = _HIDDEN * np.count_nonzero(filled <= max(changes)) / np.count_nonzero(present)
    return part, part * max(abs(float(height[cell] - height[at])) for cell in beside)


def counting_error(contact: Mask, faces: int) -> float:
    """Relative error of an area that is counted, from the number of faces at its edge."""
    images = math.prod(2 for axis in (0, 1) if np.array_equal(contact, np.flip(contact, axis)))
    return _COUNTING * math.sqrt(images * faces) / np.count_nonzero(contact)


def _edge(contact: Mask, free: Mask, boundary: Boundary) -> tuple[Mask, Mask, int, int]:
    """Cells in contact beside present cells out of contact, and beside none at all; faces to either."""
    at_edge, at_end, faces, ends = np.zeros_like(contact), np.zeros_like(contact), 0, 0
    for beside, material in zip(neighbours(free, boundary), neighbours(free | contact, boundary), strict=True):
        here = contact & beside
        faces += int(np.count_nonzero(here))
        at_edge |= here
        at_end |= contact & ~material
        ends += int(np.count_nonzero(contact & ~material))
    return at_edge, at_end, faces, ends
