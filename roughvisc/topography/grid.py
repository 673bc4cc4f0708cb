"""The labelled grid that every reader, recipe and conditioning step gives: height over (x, y).

Coordinates are those of the cell centres, in metres; the grid covers ``n`` cells of one size in each direction, so
that the spacing is size over n. Missing points are NaN. Whatever a user gives as heights passes :func:`checked`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Integral, Real
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.arguments import DataNeeded, NoData
from roughvisc.errors import InputError, short_repr
from roughvisc.units import quantity
from roughvisc.variables import VARIABLES

#: Attributes of numbers as a file packs them, before xarray decodes them.
_PACKED = {"scale_factor", "add_offset", "_FillValue", "missing_value"}

#: 16384 squared: a field of doubles takes 2 GB.
MOST_CELLS = 1 << 28


def labelled(heights: Any, spacing: tuple[float, float], attrs: dict[str, Any] | None = None) -> xr.DataArray:
    """Height over cell-centre coordinates that start half a cell from zero.

    Parameters
    ----------
    heights : array_like, shape (nx, ny)
        Heights, peaks up; NaN where missing. [m]
    spacing : tuple of float
        Cell sides ``(dx, dy)``. [m]
    attrs : dict, optional
        Attributes beside units and names.
    """
    values = np.asarray(heights, dtype=float)
    x, y = ((np.arange(n) + 0.5) * d for n, d in zip(values.shape, spacing, strict=True))
    return with_coordinates(values, x, y, attrs)


def with_coordinates(
    values: np.ndarray,
    x: Any,
    y: Any,
    attrs: dict[str, Any] | None = None,
    *,
    filled: np.ndarray | None = None,
) -> xr.DataArray:
    """Height over the given coordinates of the cell centres, with the declared attributes.

    Parameters
    ----------
    values : ndarray, shape (nx, ny)
        Heights. [m]
    x, y : array_like
        Cell centres. [m]
    attrs : dict, optional
        Attributes beside the declared ones.
    filled : ndarray of bool, shape (nx, ny), optional
        See :func:`filled_points`.
    """
    coordinates = {"x": x, "y": y}
    h = xr.DataArray(
        values,
        coords={axis: (axis, at, VARIABLES[axis].attributes) for axis, at in coordinates.items()},
        dims=("x", "y"),
        name="height",
        attrs={**VARIABLES["height"].attributes, **(attrs or {})},
    )
    return h if filled is None else with_filled_points(h, filled)


def checked(h: Any, step: str, least: int = 2) -> xr.DataArray:
    """The grid as float64 in metres over ``("x", "y")``, after a check that it is one: the door for all heights.

    Heights and coordinates that state a unit of length in the attribute ``units`` are converted; those that state none
    are metres. A Dataset stands for its variable ``height``; masked points become NaN; any
    order of the dimensions and any type of real numbers will do.

    Parameters
    ----------
    h : xarray.DataArray or xarray.Dataset
        Heights over x and y, or a Dataset that holds them as ``height``.
    step : str
        Who asks, for the message.
    least : int
        Points that there have to be in each direction.

    Raises
    ------
    InputError
        If `h` holds no real numbers over exactly the dimensions x and y, has fewer than `least` points in a
        direction, no numeric coordinates, unequal steps, or a unit that is no length; the message names the `step`
        that asked.
    DataNeeded
        If `h` only stands for heights: the step has checked its arguments.
    """
    if isinstance(h, NoData):
        raise DataNeeded(step)
    if isinstance(h, xr.Dataset):
        if "height" not in h.data_vars:
            held = ", ".join(map(str, h.data_vars)) or "nothing"
            raise InputError(f"{step}: found a Dataset that holds {held}: expected one that holds 'height'")
        h = h["height"]
    if not isinstance(h, xr.DataArray):
        raise InputError(f"{step}: found {type(h).__name__}: expected an xarray.DataArray of heights (see from_array)")
    if set(h.dims) != {"x", "y"}:
        raise InputError(f"{step}: found dimensions {tuple(map(str, h.dims))}: expected heights over ('x', 'y')")
    h = h.transpose("x", "y").compute()
    h = h.copy(deep=False, data=in_metres(h, f"{step}: the height")).assign_attrs(units="m")
    for axis in ("x", "y"):
        if axis in h.coords:
            if unit_of(h[axis]) not in (None, "m"):
                centres = in_metres(h[axis], f"{step}: coordinate {axis!r}")
                h = h.assign_coords({axis: (axis, centres, h[axis].attrs)})
            h[axis].attrs["units"] = "m"
    spacing(h, step)
    for axis in ("x", "y"):
        if h.sizes[axis] < least:
            raise InputError(f"{step}: coordinate {axis!r} has {h.sizes[axis]} point(s): expected at least {least}")
    return h


def unit_of(numbers: Any) -> str | None:
    """Attribute ``units`` of a DataArray; None if there is none."""
    stated = numbers.attrs.get("units") if isinstance(numbers, xr.DataArray) else None
    return None if stated is None else str(stated)


def metres_in(unit: str, name: str) -> float:
    """Metres in a unit of length; an :class:`InputError` that names who is in it, if it is none."""
    try:
        return quantity(f"1 {unit}", "m")
    except InputError as error:
        raise InputError(f"{name} has the unit {unit!r}: expected a length, such as 'm' or 'um'") from error


def in_metres(numbers: Any, name: str) -> np.ndarray:
    """Plain float64 numbers of heights or positions, converted from the unit that they state; NaN where masked. [m]

    Parameters
    ----------
    numbers : DataArray or array_like
        Real numbers; metres if they state no unit.
    name : str
        What they are, for the message.

    Raises
    ------
    InputError
        If they are no real numbers, are packed as in a file or held by pint, or their unit is no length.
    """
    unit = unit_of(numbers)
    factor = 1.0 if unit in (None, "m") else metres_in(unit, name)
    if isinstance(numbers, xr.DataArray):
        packed = _PACKED & set(numbers.attrs)
        if packed:
            raise InputError(
                f"{name} is packed (attribute {sorted(packed)[0]!r}): expected decoded numbers, as xarray opens them "
                "with mask_and_scale=True"
            )
        numbers = numbers.data
    if hasattr(numbers, "magnitude"):  # NumPy would drop its unit
        raise InputError(f"{name} is a pint array: expected plain numbers [m]")
    try:
        held = numbers if isinstance(numbers, np.ma.MaskedArray) else np.asarray(numbers)
    except ValueError as error:  # rows of different lengths
        raise InputError(f"{name} is {type(numbers).__name__}: expected real numbers, as many in each row") from error
    if held.dtype.kind not in "fiu":
        raise InputError(f"{name} is of {held.dtype}: expected real numbers")
    values = np.ma.filled(held.astype(float, copy=False), np.nan)
    return values if factor == 1.0 else values * factor


def spacing(h: xr.DataArray | xr.Dataset, step: str = "spacing") -> tuple[float, float]:
    """Cell sides (dx, dy) of a grid [m]; an :class:`InputError` if the steps along a coordinate are not equal."""
    sides = []
    for axis in ("x", "y"):
        if axis not in h.coords:
            raise InputError(f"{step}: the grid has no coordinate {axis!r}: expected cell centres in metres")
        name = f"{step}: coordinate {axis!r}"
        sides.append(cell_side(in_metres(h[axis], name), name))
    return sides[0], sides[1]


def filled_points(h: xr.DataArray) -> np.ndarray | None:
    """Mask over (x, y) of the points that were missing and filled in, None if nothing was ever filled."""
    return h["filled"].transpose("x", "y").values.astype(bool) if "filled" in h.coords else None


def with_filled_points(h: xr.DataArray, filled: np.ndarray | None) -> xr.DataArray:
    """The same grid with these points marked as filled in, without any mark if there is no mask."""
    if filled is None:
        return h.drop_vars("filled", errors="ignore")
    return h.assign_coords(filled=(("x", "y"), filled, {"long_name": "height was missing and filled in"}))


def nominal_area(h: xr.DataArray | xr.Dataset) -> float:
    """Area of the whole grid, absent cells included, to which the nominal pressure refers. [m2]"""
    return h.sizes["x"] * h.sizes["y"] * math.prod(spacing(h, "height"))


def cell_side(centres: Any, name: str = "the coordinate") -> float:
    """Side of the equal cells of an axis: the step between their centres; a lone cell begins at zero.

    Parameters
    ----------
    centres : array_like, shape (n,)
        Centres of the cells, ascending. [m]
    name : str
        What they are, for the message.

    Returns
    -------
    float
        The side. [m]

    Raises
    ------
    InputError
        If there is no centre, a number is not finite, the steps are not equal and positive, or the centre of a lone
        cell is not above zero.

    Examples
    --------
    >>> cell_side([1.0, 3.0, 5.0]), cell_side([1.0])
    (2.0, 2.0)
    """
    at = np.asarray(centres)
    if at.dtype.kind not in "fiu" or at.ndim != 1 or not at.size or not np.isfinite(at).all():
        raise InputError(f"{name} has {at.size} point(s) of {at.dtype}: expected finite numbers")
    if at.size == 1:
        if not at[0] > 0:
            raise InputError(f"{name} has its only cell centred at {at[0]:g} m: expected half its side")
        return 2 * float(at[0])
    d = float(at[-1] - at[0]) / (at.size - 1)
    if not d > 0 or np.abs(np.diff(at) - d).max() > 1e-4 * d:
        steps = np.diff(at)
        raise InputError(
            f"{name} has steps from {steps.min():.6g} to {steps.max():.6g} m: expected a uniform, ascending grid"
        )
    return float(f"{d:.15g}")


def cell_edges(centres: Any) -> np.ndarray:
    """Borders of the equal cells of an axis, one more than there are cells. [m]

    Examples
    --------
    >>> cell_edges([1.0, 3.0]), cell_edges([1.0])
    (array([0., 2., 4.]), array([0., 2.]))
    """
    at = np.asarray(centres, dtype=float)
    side = cell_side(at)
    edges = np.append(at - side / 2, at[-1] + side / 2)
    edges[np.abs(edges) < 1e-9 * side] = 0.0  # where grids begin; rounding
    return edges


def noted(h: xr.DataArray, line: str, **attrs: Any) -> xr.DataArray:
    """The same grid with one more line in its history, and further attributes; those given as None are dropped."""
    history = h.attrs.get("history")
    h = h.copy(deep=False)
    if "filled" in h.coords:
        attrs["filled_points"] = int(h["filled"].sum())
    stated = {**h.attrs, **attrs, "history": f"{history}\n{line}" if history else line}
    h.attrs = {name: value for name, value in stated.items() if value is not None}
    return h


def like(h: xr.DataArray, values: np.ndarray) -> xr.DataArray:
    """New heights on the grid of `h`, with its attributes and coordinates."""
    return h.copy(deep=False, data=values)


def require_heights(h: xr.DataArray, step: str) -> None:
    """Refuse a grid of which all points are missing."""
    if not np.isfinite(h.values).any():
        raise InputError(f"{step}: all {h.size} points are missing: expected at least one height")


def require_complete(h: xr.DataArray, step: str, wanted: str = "none (see fill)") -> None:
    """Refuse a grid of which points are missing."""
    if missing := int(h.size - np.isfinite(h.values).sum()):
        raise InputError(f"{step}: {missing} points are missing: expected {wanted}")


def number(name: str, value: Any, unit: str, *, low: float = 0.0, high: float = math.inf) -> float:
    """A finite number above `low` and not above `high`."""
    right = isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    if not (right and low < value <= high):
        below = f" and at most {high:g}" if math.isfinite(high) else ""
        raise InputError(key=name, found=value, expected=f"a finite number above {low:g}{below} [{unit}]")
    return float(value)


def pair(name: str, value: Any) -> tuple[float, float]:
    """Two positive lengths, or one for both. [m]"""
    both = _both(value)
    if len(both) != 2:
        raise InputError(key=name, found=value, expected="one number or a pair (x, y) [m]")
    return number(name, both[0], "m"), number(name, both[1], "m")


def counts(name: str, value: Any, low: int = 2) -> tuple[int, int]:
    """Two whole numbers of cells, or one for both."""
    both = _both(value)
    whole = len(both) == 2 and all(isinstance(n, Integral) and not isinstance(n, bool) and n >= low for n in both)
    if not whole:
        expected = f"a whole number of cells of at least {low}, or a pair of them"
        raise InputError(key=name, found=value, expected=expected)
    if both[0] * both[1] > MOST_CELLS:
        text = f"{name} is {short_repr(value)}, {both[0] * both[1]:.3g} cells: expected at most {MOST_CELLS:.3g}"
        raise InputError(text, key=name, found=value, expected=f"at most {MOST_CELLS:.3g} cells")
    return int(both[0]), int(both[1])


def _both(value: Any) -> Any:
    """What is given for x and y, or once for both."""
    return value if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str) else (value, value)
