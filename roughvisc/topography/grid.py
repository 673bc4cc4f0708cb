"""Labelled grid, the result of every reader, recipe and conditioning step: height over (x, y).

Coordinates are the cell centres, in metres. The grid covers ``n`` equal cells in each direction, so that the spacing is
size over n. Missing points are NaN. All heights from users pass :func:`checked`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from numbers import Integral
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.arguments import DataNeeded, NoData
from roughvisc.errors import InputError
from roughvisc.units import number
from roughvisc.variables import VARIABLES

#: 16384 squared: a field of doubles takes 2 GB.
MOST_CELLS = 1 << 28


def labelled(heights: Any, spacing: tuple[float, float], attrs: dict[str, Any] | None = None) -> xr.DataArray:
    """Return heights over cell-centre coordinates that start half a cell from zero.

    Parameters
    ----------
    heights : array_like, shape (nx, ny)
        Heights, peaks up; NaN where missing. [m]
    spacing : tuple of float
        Cell sides ``(dx, dy)``. [m]
    attrs : dict, optional
        Attributes in addition to units and names.
    """
    values = np.asarray(heights, dtype=float)
    nx, ny = values.shape
    dx, dy = spacing
    return with_coordinates(values, (np.arange(nx) + 0.5) * dx, (np.arange(ny) + 0.5) * dy, attrs)


def with_coordinates(values: np.ndarray, x: Any, y: Any, attrs: dict[str, Any] | None = None) -> xr.DataArray:
    """Return heights over given cell-centre coordinates, with the declared attributes.

    Parameters
    ----------
    values : ndarray, shape (nx, ny)
        Heights. [m]
    x, y : array_like
        Cell centres. [m]
    attrs : dict, optional
        Attributes in addition to the declared ones.
    """
    coordinates = {"x": ("x", x, VARIABLES["x"].attributes), "y": ("y", y, VARIABLES["y"].attributes)}
    stated = VARIABLES["height"].attributes | (attrs or {})
    return xr.DataArray(values, coordinates, ("x", "y"), "height", stated)


def checked(h: Any, step: str, least: int = 2) -> xr.DataArray:
    """Check a height grid and return it as float64 in metres over ``("x", "y")``; all heights pass this function.

    Heights and coordinates with the attribute ``units`` are converted to metres; without it, they are in metres. Masked
    points become NaN. Any order of the dimensions and any type of real numbers is accepted.

    Parameters
    ----------
    h : xarray.DataArray
        Heights over x and y.
    step : str
        Name of the calling step, for messages.
    least : int
        Least number of points in each direction.

    Raises
    ------
    InputError
        If the dimensions of `h` are not exactly x and y, its values are not real numbers, a direction has fewer than
        `least` points, the coordinates are not numeric or have unequal steps, or a unit is not a length. The message
        names the `step`.
    DataNeeded
        If `h` is a placeholder for heights: the step has checked its arguments.
    """
    if isinstance(h, NoData):
        raise DataNeeded(step)
    if not isinstance(h, xr.DataArray) or set(h.dims) != {"x", "y"}:
        found = f"{type(h).__name__} over {tuple(map(str, getattr(h, 'dims', ())))}"
        expected = "an xarray.DataArray of heights over ('x', 'y') (see from_array)"
        raise InputError(f"{step}: found {found}: expected {expected}")
    h = h.transpose("x", "y").compute()
    h = h.copy(deep=False, data=in_metres(h, f"{step}: the height")).assign_attrs(units="m")
    spacing(h, step)
    centres = {}
    for axis in ("x", "y"):
        if h.sizes[axis] < least:
            raise InputError(f"{step}: coordinate {axis!r} has {h.sizes[axis]} point(s): expected at least {least}")
        centre = h[axis]
        if centre.dtype != float or centre.attrs.get("units") != "m":
            centres[axis] = axis, in_metres(centre, f"{step}: coordinate {axis!r}"), centre.attrs | {"units": "m"}
    return h.assign_coords(centres)


def in_metres(numbers: Any, name: str) -> np.ndarray:
    """Return heights or positions as plain float64 numbers, converted from their unit; NaN where masked. [m]

    Parameters
    ----------
    numbers : DataArray or array_like
        Real numbers; in metres if they have no unit.
    name : str
        Name of the numbers, for messages.

    Raises
    ------
    InputError
        If they are not real numbers or held by pint, or their unit is not a length.
    """
    unit = "m"
    raw = numbers
    if isinstance(numbers, xr.DataArray):
        unit = str(numbers.attrs.get("units", "m"))
        raw = numbers.data
    if hasattr(raw, "magnitude"):  # NumPy would drop its unit
        raise InputError(f"{name} is a pint array: expected plain numbers [m]")
    try:
        raw = raw if isinstance(raw, np.ma.MaskedArray) else np.asarray(raw)
    except ValueError as error:  # rows of different lengths
        raise InputError(f"{name} is {type(numbers).__name__}: expected real numbers, as many in each row") from error
    if raw.dtype.kind not in "fiu":
        raise InputError(f"{name} is of {raw.dtype}: expected real numbers")
    values = np.ma.filled(raw.astype(float, copy=False), np.nan)
    return values if unit == "m" else values * number(f"1 {unit}", "m", name)


def spacing(h: xr.DataArray | xr.Dataset, step: str = "spacing") -> tuple[float, float]:
    """Return the cell sides (dx, dy) of a grid: the distances between neighbouring centres. [m]

    A single cell begins at zero, so that its side is twice the coordinate of its centre.

    Parameters
    ----------
    h : DataArray or Dataset
        Grid with the centres of its cells as coordinates ``x`` and ``y``.
    step : str
        Name of the calling step, for messages.

    Raises
    ------
    InputError
        If a coordinate is absent or not finite, its steps are not equal and positive, or the centre of a single cell is
        not above zero.

    Examples
    --------
    >>> spacing(xr.Dataset(coords={"x": [1.0, 3.0, 5.0], "y": [1.0]}))
    (2.0, 2.0)
    """
    sides = []
    for axis in ("x", "y"):
        if axis not in h.coords:
            raise InputError(f"{step}: the grid has no coordinate {axis!r}: expected cell centres in metres")
        name = f"{step}: coordinate {axis!r}"
        centres = in_metres(h[axis], name)
        side = 0.0
        if centres.ndim == 1 and centres.size and np.isfinite(centres).all():
            side = (
                float(f"{(centres[-1] - centres[0]) / (centres.size - 1):.15g}")
                if centres.size > 1
                else 2 * float(centres[0])
            )
        if not (side > 0 and (np.abs(np.diff(centres) - side) <= 1e-4 * side).all()):
            found = f"{centres.size} centres of {centres.dtype}, like {centres.ravel()[:3]}, "
            found += "not finite and in equal, ascending steps"
            expected = "a uniform, ascending grid, or half the side of a single cell"
            raise InputError(f"{name} has {found}: expected {expected}")
        sides.append(side)
    return sides[0], sides[1]


def nominal_area(h: xr.DataArray | xr.Dataset) -> float:
    """Return the area of the whole grid, including absent cells: the area of the nominal pressure. [m2]"""
    return h.sizes["x"] * h.sizes["y"] * math.prod(spacing(h, "height"))


def cell_edges(h: xr.DataArray | xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return the borders of the cells along x and along y, one more than cells. [m]

    Examples
    --------
    >>> cell_edges(xr.Dataset(coords={"x": [1.0, 3.0], "y": [1.0]}))
    (array([0., 2., 4.]), array([0., 2.]))
    """
    edges = []
    for axis, side in zip("xy", spacing(h), strict=True):
        centres = h[axis].values
        ends = np.append(centres - side / 2, centres[-1] + side / 2)
        ends[np.abs(ends) < 1e-9 * side] = 0.0  # removes rounding where the grid begins
        edges.append(ends)
    return edges[0], edges[1]


def rms_slope(h: xr.DataArray, periodic: bool = False, depth: float = math.inf) -> float:
    """Return the root mean square slope, Sdq of :func:`roughvisc.parameters`; see :func:`squared_slopes`. [-]

    The result is NaN if no corner counts.
    """
    return math.sqrt(squared_slopes(checked(h, "rms_slope", least=1), periodic, depth).mean())


def squared_slopes(h: xr.DataArray, periodic: bool = False, depth: float = math.inf) -> np.ndarray:
    """Return the squared slopes at the corners of three present points: a point and one neighbour along each axis. [-]

    Each point inside has four corners, so that a map and its mirror images have the same slopes.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights, NaN where missing. [m]
    periodic : bool
        Whether differences are also taken across the border.
    depth : float
        A corner counts if its highest point is at most this far below the highest point of all. [m]

    Returns
    -------
    ndarray, shape (corners,)
        A single NaN if no corner counts.
    """
    dx, dy = spacing(h)
    nx, ny = h.shape
    beyond = (0, int(periodic or nx == 1)), (0, int(periodic or ny == 1))  # a strip one cell wide repeats too
    z = np.pad(h.values, beyond, mode="wrap")
    along_x = (np.diff(z, axis=0) / dx) ** 2
    along_y = (np.diff(z, axis=1) / dy) ** 2
    sides = slice(None, -1), slice(1, None)
    lowest = None
    if depth < math.inf:
        at_x = np.maximum(z[1:], z[:-1])
        at_y = np.maximum(z[:, 1:], z[:, :-1])
        lowest = np.nanmax(h.values) - depth
    corners = []
    for i, j in product(sides, sides):  # one after the other: together they take the memory of many fields
        squares = along_x[:, j] + along_y[i]
        counts = np.isfinite(squares)
        if lowest is not None:
            counts &= np.maximum(at_x[:, j], at_y[i]) >= lowest
        corners.append(squares[counts])
    squares = np.concatenate(corners)
    return squares if squares.size else np.array([np.nan])


def noted(h: xr.DataArray, line: str, **attrs: Any) -> xr.DataArray:
    """Return the grid with one more line in its history and with further attributes; None removes an attribute."""
    history = "\n".join(filter(None, (h.attrs.get("history"), line)))
    h = h.copy(deep=False)
    if "filled" in h.coords:
        attrs["filled_points"] = int(h["filled"].sum())
        attrs["filled_fraction"] = attrs["filled_points"] / h.size
    stated = {**h.attrs, **attrs, "history": history}
    h.attrs = {name: value for name, value in stated.items() if value is not None}
    return h


def like(h: xr.DataArray, values: np.ndarray) -> xr.DataArray:
    """Return new heights on the grid of `h`, with its attributes and coordinates."""
    return h.copy(deep=False, data=values)


def require_heights(h: xr.DataArray, step: str) -> None:
    """Refuse a grid if all its points are missing."""
    if not np.isfinite(h.values).any():
        raise InputError(f"{step}: all {h.size} points are missing: expected at least one height")


def require_complete(h: xr.DataArray, step: str) -> None:
    """Refuse a grid with missing points."""
    if missing := int(h.size - np.isfinite(h.values).sum()):
        raise InputError(f"{step}: {missing} points are missing: expected none (see fill)")


def pair(name: str, value: Any) -> tuple[float, float]:
    """Return two positive lengths; one length counts for both axes. [m]"""
    both = _both(value)
    if len(both) != 2:
        raise InputError(key=name, found=value, expected="one number or a pair (x, y) [m]")
    return number(both[0], "m", name, above=0), number(both[1], "m", name, above=0)


def counts(name: str, value: Any, low: int = 2) -> tuple[int, int]:
    """Return two whole numbers of cells; one number counts for both axes."""
    both = _both(value)
    whole = len(both) == 2 and all(isinstance(n, Integral) and not isinstance(n, bool) for n in both)
    if not whole or min(both) < low or both[0] * both[1] > MOST_CELLS:
        expected = f"one or two whole numbers of cells of at least {low}, at most {MOST_CELLS:.3g} cells in all"
        raise InputError(key=name, found=value, expected=expected)
    return int(both[0]), int(both[1])


def _both(value: Any) -> Any:
    """Return a pair for x and y; a single value counts for both."""
    return value if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str) else (value, value)
