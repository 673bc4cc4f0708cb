"""Framing of scans: cropping, rotation, inversion, combination and mirror extension."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.topography.borders import MIRRORED, is_periodic, period_of
from roughvisc.topography.filters import membrane
from roughvisc.topography.grid import checked, labelled, like, noted, spacing, with_coordinates
from roughvisc.topography.spectrum import resample
from roughvisc.units import Quantity, format_quantity, number, quantities

#: Largest shift of a cell border or a centre by rounding, relative to the cell.
_ON_BORDER = 1e-9


@quantities(x="m", y="m")
def crop(
    h: xr.DataArray, x: tuple[Quantity, Quantity] | None = None, y: tuple[Quantity, Quantity] | None = None
) -> xr.DataArray:
    """Crop a scan to the cells whose centres lie within limits.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    x, y : pair of float or str, optional
        Lower and upper limit of each coordinate; default: all. [m]

    Returns
    -------
    xarray.DataArray
        The part, with its coordinates unchanged. [m]

    Raises
    ------
    InputError
        If limits are not a pair, or fewer than two cells lie within them along an axis.

    See Also
    --------
    roughvisc.combine, roughvisc.resample

    Examples
    --------
    >>> import roughvisc as rv
    >>> scan = rv.from_array([[0.0, 1e-6, 0.0], [0.0, 2e-6, 0.0], [0.0, 1e-6, 0.0]], spacing="1 um")
    >>> rv.crop(scan, y=("1 um", "3 um")).shape
    (3, 2)
    """
    chosen: dict[str, tuple[float, float]] = {}
    for axis, limits in (("x", x), ("y", y)):
        if limits is not None:
            chosen[axis] = _two_lengths(axis, limits)
            if chosen[axis][0] >= chosen[axis][1]:
                raise InputError(key=axis, found=limits, expected="a pair (low, high) [m], the lower limit first")
    h = checked(h, "crop")
    off = {axis: _ON_BORDER * side for axis, side in zip(("x", "y"), spacing(h), strict=True)}
    cropped = h.sel({axis: slice(low - off[axis], high + off[axis]) for axis, (low, high) in chosen.items()})
    for axis, limits in chosen.items():
        if cropped.sizes[axis] < 2:
            first, last = (format_quantity(float(h[axis][end]), "m") for end in (0, -1))
            raise InputError(
                key=axis, found=limits, expected=f"limits that hold at least two cells of {first} to {last}"
            )
    nx, ny = cropped.shape
    line = f"cropped to {nx} x {ny} cells: x {chosen.get('x', 'all')}, y {chosen.get('y', 'all')} m"
    return noted(cropped, line, **({} if cropped.shape == h.shape else {"period": None}))


def rotate90(h: xr.DataArray, turns: int = 1) -> xr.DataArray:
    """Rotate a surface by quarter turns, counter-clockwise seen from above (x to the right, y up).

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    turns : int, default 1
        Number of quarter turns; negative: clockwise.

    Returns
    -------
    xarray.DataArray
        The rotated surface; coordinates start half a cell from zero. [m]

    Raises
    ------
    InputError
        If `turns` is not a whole number, or `h` is not a height grid.

    See Also
    --------
    roughvisc.invert, roughvisc.crop

    Examples
    --------
    >>> import roughvisc as rv
    >>> h = rv.from_array([[0.0, 1e-6, 2e-6], [3e-6, 4e-6, 5e-6]], spacing="1 um")
    >>> rv.rotate90(h).shape
    (3, 2)
    """
    if not isinstance(turns, int) or isinstance(turns, bool):
        raise InputError(key="turns", found=turns, expected="a whole number of quarter turns")
    h = checked(h, "rotate90")
    sides = spacing(h) if turns % 2 == 0 else spacing(h)[::-1]
    grid = labelled(np.rot90(h.values, turns), sides, h.attrs)
    line = f"rotated by {turns % 4} quarter turns counter-clockwise"
    return noted(grid, line, period=period_of(grid) if is_periodic(h) else None)


def invert(h: xr.DataArray) -> xr.DataArray:
    """Exchange peaks and valleys, for the scan of a replica; x and y do not change.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights. [m]

    Returns
    -------
    xarray.DataArray, dims (x, y)
        Heights with the opposite sign. [m]

    Raises
    ------
    InputError
        If `h` is not a height grid.

    See Also
    --------
    roughvisc.rotate90, roughvisc.combine

    Examples
    --------
    >>> import roughvisc as rv
    >>> replica = rv.from_array([[0.0, 1e-6], [0.0, 3e-6]], spacing="1 um")
    >>> rv.invert(replica).min().item()
    -3e-06
    """
    h = checked(h, "invert")
    return noted(like(h, -h.values), "inverted")


@quantities(offset="m")
def combine(
    h1: xr.DataArray,
    h2: xr.DataArray,
    flip: Literal["x", "y"] | None = None,
    *,
    offset: tuple[Quantity, Quantity] = (0.0, 0.0),
) -> xr.DataArray:
    """Combine two scanned faces in contact to one rigid profile, the sum of their heights.

    The second face is centred on the first. The sum is on the cells of the first that the second covers completely. If
    the cells of the second face are smaller, it is first resampled to cells of the same size (:func:`resample`). A
    cubic spline between its cell centres then gives its heights at the cell centres of the first face, unless the cell
    centres coincide.

    Parameters
    ----------
    h1, h2 : xarray.DataArray
        Heights of the faces, each with its peaks towards the other. [m]
    flip : {"x", "y"}, optional
        Axis along which the second face is reversed when a scan taken from above is turned over onto the first.
        Default: `h2` has the directions of `h1`.
    offset : pair of float or str
        Position of the second centre relative to the first, along x and y. [m]

    Returns
    -------
    xarray.DataArray
        Sum of heights on cells of the first face, missing where either face is missing. [m]

    Raises
    ------
    InputError
        If an argument has another value, or the second face covers fewer than two cells of the first along an axis.

    See Also
    --------
    roughvisc.pair, roughvisc.invert, roughvisc.crop

    Notes
    -----
    The frictionless contact of two elastic or viscoelastic half-spaces is equivalent to the contact of one rigid
    profile, the sum of both faces, with a flat half-space. Its contact compliance is the sum of both compliances
    (:func:`roughvisc.pair`).

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, CUP, 1985, section 4.1.

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy("1 um", "0.1 mm", "1 mm", 40, waves=1)
    >>> bool(abs(rv.combine(wave, wave) - 2 * wave).max() < 1e-15)
    True
    """
    one_of("flip", flip, (None, "x", "y"))
    apart = _two_lengths("offset", offset)
    h1 = checked(h1, "combine")
    h2 = checked(h2, "combine")
    repeats = is_periodic(h1) and is_periodic(h2) and np.allclose(period_of(h1), period_of(h2), rtol=1e-6, atol=0)
    sha = h2.attrs.get("source_sha256")
    about = "; ".join(str(h2.attrs.get("history", "")).splitlines())
    line = f"combined with {h2.attrs.get('source_file', 'a second face')}" + (f" (SHA-256 {sha})" if sha else "")
    if flip is not None:  # reverse heights; the coordinate stays
        h2 = h2.isel({flip: slice(None, None, -1)}).assign_coords({flip: h2[flip]})
        line += f", reversed along {flip}"
    first, second = _on_common_cells(h1, h2, apart)
    nx, ny = first.shape
    line += f", its centre ({apart[0]:.6g}, {apart[1]:.6g}) m from that of the first, on {nx} x {ny} cells of the first"
    both = with_coordinates(first.values + second, first["x"].values, first["y"].values, h1.attrs)
    faces = (h1, first.values), (h2, second)
    solid = all(h.attrs.get("missing") == "absent" or np.isfinite(values).all() for h, values in faces)
    attrs = {"recipe": None, "period": h1.attrs.get("period") if repeats else None}
    attrs["missing"] = "absent" if solid and np.isnan(both.values).any() else None
    attrs["filled_fraction"] = max(h.attrs.get("filled_fraction", 0.0) for h in (h1, h2)) or None
    return noted(both, line + (f"; the second face: {about}" if about else ""), **attrs)


def _on_common_cells(h1: xr.DataArray, h2: xr.DataArray, apart: tuple[float, float]) -> tuple[xr.DataArray, np.ndarray]:
    """Return both faces on the cells of the first that the second covers completely.

    Parameters
    ----------
    h1, h2 : xarray.DataArray
        Heights over (x, y). [m]
    apart : pair of float
        Position of the second centre relative to the first, along x and y. [m]

    Returns
    -------
    first : xarray.DataArray
        The first face on these cells. [m]
    second : ndarray
        Heights of the second at the cell centres of the first. [m]

    Raises
    ------
    InputError
        If fewer than two cells are covered along an axis.
    """
    from scipy.interpolate import RectBivariateSpline  # slow to import

    sides1 = spacing(h1)
    sides2 = spacing(h2)
    shape = [min(n, max(2, round(n * d2 / d1))) for n, d1, d2 in zip(h2.shape, sides1, sides2, strict=True)]
    if tuple(shape) != h2.shape:
        h2 = resample(h2, (shape[0], shape[1]))
    kept = {}
    offsets = []
    for axis, d1, d2, by in zip(("x", "y"), sides1, spacing(h2), apart, strict=True):
        n1 = h1.sizes[axis]
        n2 = h2.sizes[axis]
        side = d1 / d2
        lower = ((np.arange(n1) - n1 / 2) * d1 - by) / d2 + n2 / 2  # borders of the first, in cells of the second
        covered = (lower >= -_ON_BORDER) & (lower + side <= n2 + _ON_BORDER)
        if covered.sum() < 2:
            *lengths, apart_by = (format_quantity(length, "m") for length in (n1 * d1, n2 * d2, by))
            raise InputError(
                f"combine: the second face covers {covered.sum()} of {n1} cells of the first along {axis}: they are "
                f"{' and '.join(lengths)} long, the centres {apart_by} apart: expected at least two cells"
            )
        kept[axis] = covered
        offsets.append(np.clip(lower[covered] + side / 2 - 0.5, 0, n2 - 1))  # new centres, in numbers of old cells

    nodes = [np.round(places).astype(int) for places in offsets]
    if all(np.abs(places - node).max() <= _ON_BORDER for places, node in zip(offsets, nodes, strict=True)):
        return h1.isel(kept), h2.values[np.ix_(*nodes)]  # the cells of both faces coincide: no rounding by a spline

    def laid(values: np.ndarray, order: int) -> np.ndarray:
        degrees = [min(order, n - 1) for n in values.shape]
        return RectBivariateSpline(*map(np.arange, values.shape), values, kx=degrees[0], ky=degrees[1])(*offsets)

    second = laid(membrane(h2.values), 3)
    second[laid(np.isnan(h2.values).astype(float), 1) > 0.5 + _ON_BORDER] = np.nan
    return h1.isel(kept), second


def _two_lengths(key: str, value: Any) -> tuple[float, float]:
    """Return the two lengths of a pair. [m]"""
    if not isinstance(value, Sequence | np.ndarray) or len(value) != 2:
        raise InputError(key=key, found=value, expected="a pair of lengths [m]")
    return number(value[0], "m", key), number(value[1], "m", key)


def mirror(h: xr.DataArray) -> xr.DataArray:
    """Add the mirror images of a surface, so that it repeats without a step.

    The result is twice as long along each axis, and slopes reverse at the seams. Contact of a surface and its mirror
    images is solved on the surface's own cells by ``boundary="mirror"``; this function is for surfaces that slide and
    for other programs.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights. [m]

    Returns
    -------
    xarray.DataArray, dims (x, y)
        Twice as many points along each axis. [m]

    Raises
    ------
    InputError
        If `h` is not a height grid.

    See Also
    --------
    roughvisc.simulate, roughvisc.friction, roughvisc.resample

    Examples
    --------
    >>> import roughvisc as rv
    >>> rough = rv.from_array([[0.0, 1e-6], [0.0, 3e-6]], spacing="1 um")
    >>> rv.mirror(rough).shape
    (4, 4)
    """
    h = checked(h, "mirror")
    axes = [float(h[axis][0]) + np.arange(2 * h.sizes[axis]) * d for axis, d in zip("xy", spacing(h), strict=True)]
    doubled = with_coordinates(np.pad(h.values, [(0, n) for n in h.shape], mode="symmetric"), axes[0], axes[1], h.attrs)
    return noted(doubled, MIRRORED, period=period_of(doubled))
