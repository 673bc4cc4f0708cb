"""Single indenters, defined beyond their grid: sphere, cone and flat punch.

Heights are the analytic functions at the cell centres ``((i + 1/2) dx, (j + 1/2) dy)``. The recipe stays in the
attributes, so that the grid can grow (:func:`grown`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.arguments import DataNeeded, NoData
from roughvisc.errors import InputError
from roughvisc.topography.grid import counts, labelled, noted, pair, with_coordinates
from roughvisc.units import Quantity, quantities


@quantities(radius="m > 0", size="m")
def sphere(radius: Quantity, size: Any, shape: Any, exact: bool = False) -> xr.DataArray:
    r"""Return a spherical indenter, centred, with its apex at height zero.

    Parameters
    ----------
    radius : float or str
        Radius of curvature. [m]
    size : float or str, or a pair
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``; one along an axis is a strip, which begins at zero.
    exact : bool, default False
        False: the paraboloid :math:`-r^2 / 2R` of Hertz theory. True: the circular cap
        :math:`\sqrt{R^2 - r^2} - R`; cells beyond the equator are absent.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), not above zero. [m] The apex is at ``size / 2``, which lies between the cells if their
        number is even.

    Raises
    ------
    InputError
        If a parameter is not positive and finite.
    """
    return _indenter("sphere", {"radius": radius, "exact": bool(exact)}, size, shape)


@quantities(slope="1 > 0", size="m")
def cone(slope: float, size: Any, shape: Any) -> xr.DataArray:
    """Return a conical indenter of height ``-slope * r``, centred, with its apex at height zero.

    Parameters
    ----------
    slope : float
        Tangent of the angle between the flank and the plane. [-]
    size : float or str, or a pair
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``; one along an axis is a strip, which begins at zero.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), not above zero. [m]

    Raises
    ------
    InputError
        If a parameter is not positive and finite.
    """
    return _indenter("cone", {"slope": slope}, size, shape)


@quantities(radius="m > 0", size="m")
def flat_punch(radius: Quantity, size: Any, shape: Any) -> xr.DataArray:
    """Return a flat-ended cylindrical punch, centred: height zero inside the radius, absent (NaN) outside.

    Parameters
    ----------
    radius : float or str
        Radius of the punch. [m]
    size : float or str, or a pair
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``; one along an axis is a strip, which begins at zero.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), NaN where material is absent (``attrs["missing"] == "absent"``). [m]

    Raises
    ------
    InputError
        If a parameter is not positive and finite, or no cell centre lies within the radius.
    """
    return _indenter("flat_punch", {"radius": radius}, size, shape)


def is_indenter(h: xr.DataArray) -> bool:
    """Return whether a surface is a sphere, cone or flat punch on cells of its grid, so that the grid can grow."""
    return _known(h) is not None


def grown(h: xr.DataArray, factor: float = 1.5) -> xr.DataArray | None:
    """Return the same indenter on a larger grid: new cells on all sides, existing cells unchanged.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    factor : float, default 1.5
        Least ratio of each new side to the old one; every side gains at least one cell at each end.

    Returns
    -------
    xarray.DataArray or None
        None if `h` is not a sphere, cone or flat punch, see :func:`is_indenter`.
    """
    known = _known(h)
    if known is None:
        return None
    evaluate, cell, centre = known
    wider = []
    for axis, side in zip("xy", cell, strict=True):
        margin = max(1, math.ceil(h.sizes[axis] * (factor - 1) / 2 - 1e-6))
        first = round(float(h[axis][0]) / side - 0.5)
        wider.append((np.arange(first - margin, first + h.sizes[axis] + margin) + 0.5) * side)
    heights = evaluate(wider[0][:, None] - centre[0], wider[1] - centre[1])
    line = f"grown from {h.sizes['x']} x {h.sizes['y']} to {heights.shape[0]} x {heights.shape[1]} cells"
    return noted(with_coordinates(heights, *wider, h.attrs), line)


def remade(h: xr.DataArray, shape: tuple[int, int]) -> xr.DataArray | None:
    """Return the same indenter on another number of cells over its domain; None if `h` is not an indenter. [m]"""
    if not is_indenter(h):
        return None
    recipe = json.loads(h.attrs["recipe"])
    return _indenter(recipe["name"], recipe["parameters"], recipe["size"], shape)


def highest(h: xr.DataArray) -> float:
    """Return the height of first contact: the apex of an indenter, also between cells, or the highest cell. [m]

    The apex counts if the recipe reproduces the heights and the apex lies within the outline of the cells.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y); finite somewhere. [m]

    Examples
    --------
    >>> tip = cone(0.5, 4.0, 4)
    >>> highest(tip), float(tip.max()) < -0.3, highest(tip + 1.0) == float(tip.max()) + 1.0
    (0.0, True, True)
    """
    known = _known(h)
    has_apex = known is not None and all(
        float(h[axis][0]) - side / 2 <= centre <= float(h[axis][-1]) + side / 2
        for axis, side, centre in zip("xy", *known[1:], strict=True)
    )
    return 0.0 if has_apex else float(np.nanmax(h.values))


def _known(h: xr.DataArray) -> tuple[Callable[..., np.ndarray], tuple[float, float], tuple[float, float]] | None:
    """Return height as a function of x and y from the apex, cell sides, and position of the apex. [m]

    None if the recipe does not reproduce the heights on cells of its grid. xarray keeps attributes through arithmetic,
    so that the recipe alone does not count.
    """
    try:
        recipe = json.loads(h.attrs["recipe"])
        evaluate = partial(_INDENTERS[recipe["name"]], **recipe["parameters"])
        (width, depth), (nx, ny) = recipe["size"], recipe["shape"]
        cell, centre = (width / nx, depth / ny), (width / 2, depth / 2)
        expected = evaluate(h["x"].values[:, None] - centre[0], h["y"].values - centre[1])
    except (KeyError, TypeError, ValueError, IndexError, ZeroDivisionError, AttributeError):
        return None
    for axis, side in zip("xy", cell, strict=True):
        at = h[axis].values / side - 0.5
        if np.abs(at - round(at[0]) - np.arange(at.size)).max() > 1e-6:
            return None
    near = 1e-9 * np.nanmax(np.abs(expected), initial=0.0)
    if not np.allclose(h.transpose("x", "y").values, expected, rtol=0, atol=near, equal_nan=True):
        return None
    return evaluate, cell, centre


def _sphere(x: np.ndarray, y: np.ndarray, radius: float, exact: bool) -> np.ndarray:
    r2 = x**2 + y**2
    if not exact:
        return r2 / (-2 * radius)
    # not sqrt(R^2 - r^2) - R, which loses the digits of a shallow cap
    cap = -r2 / (radius + np.sqrt(np.maximum(radius**2 - r2, 0)))
    return np.where(r2 <= radius**2, cap, np.nan)


#: Profiles, defined beyond their grid: (x, y from the centre, parameters) -> height.
_INDENTERS: dict[str, Callable[..., np.ndarray]] = {
    "sphere": _sphere,
    "cone": lambda x, y, slope: -slope * np.hypot(x, y),
    "flat_punch": lambda x, y, radius: np.where(np.hypot(x, y) <= radius, 0.0, np.nan),
}


def _indenter(name: str, parameters: dict[str, Any], size: Any, shape: Any) -> xr.DataArray:
    size, shape = pair("size", size), cells(shape)
    x, y = ((np.arange(n) + 0.5) * (side / n) - side / 2 for side, n in zip(size, shape, strict=True))
    heights = _INDENTERS[name](x[:, None], y, **parameters)
    absent = np.isnan(heights)
    if absent.all():
        expected = f"one that contains a cell centre, for {shape[0]} x {shape[1]} cells"
        raise InputError(key="radius", found=parameters["radius"], expected=expected)
    return generated(heights, name, parameters, size, **({"missing": "absent"} if absent.any() else {}))


def cells(shape: Any, least: int = 1) -> tuple[int, int]:
    """Return the number of cells of a recipe along x and y.

    Recipes call this function after the checks of all other arguments.

    Raises
    ------
    InputError
        If `shape` is neither a whole number of at least `least` nor a pair of them.
    DataNeeded
        If `shape` is a placeholder: the recipe has checked its other arguments.
    """
    if isinstance(shape, NoData):
        raise DataNeeded("shape")
    return counts("shape", shape, low=least)


def generated(heights: np.ndarray, name: str, parameters: dict[str, Any], size: Any, **attrs: Any) -> xr.DataArray:
    """Return heights over their domain, with a recipe from which they can be generated again. [m]"""
    recipe = {"name": name, "parameters": parameters, "size": list(size), "shape": list(heights.shape)}
    stated = {"recipe": json.dumps(recipe), "history": f"generated: {name}"} | attrs
    return labelled(heights, (size[0] / heights.shape[0], size[1] / heights.shape[1]), stated)
