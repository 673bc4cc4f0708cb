"""Conversion of scan files to labelled height grids: units, missing values, orientation and plausibility.

Every problem raises one :class:`~roughvisc.errors.InputError` that names the file, the cause and the argument to pass.
"""

from __future__ import annotations

import hashlib
import math
import textwrap
import threading
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.paths import cause_of_system, opened, path_of, regular, unreadable
from roughvisc.topography.formats import TOP_FIRST, open_file, orientation
from roughvisc.topography.formats.mesh import heights_above
from roughvisc.topography.formats.scan_file import Channel, ScanFile
from roughvisc.topography.grid import MOST_CELLS, checked, in_metres, labelled, noted, pair, with_coordinates
from roughvisc.topography.grid import spacing as cell_sides
from roughvisc.units import Quantity, format_quantity, number, quantities

#: Largest side, finest spacing and largest distance of a height from zero. [m] Scans of 150 mm exist; absolute heights
#: of 76 mm too.
WIDEST = 1.0
FINEST = 1e-11
HIGHEST = 1.0
#: Fewest points for a check of the heights.
_FEWEST = 16
#: Heights of an array further from zero than this mark missing points. [m]
FARTHEST = 1e3
#: A number marks missing points under four conditions: it is the lowest or highest height, it is at least this large in
#: the file, it occurs at least this many times, and its distance from the next height exceeds this multiple of the
#: range of all other heights. Exactly flat pits of a manufactured texture have smaller numbers.
_NO_DATA = 999.0
_REPEATED = 4
_FAR = 10.0
#: Usual marks of missing points, by size, for which one range is far enough: heights of 1 um are thousands of nm.
_MARKS = (9999.0, 99999.0, 999999.0, 32767.0, 32768.0)
_READER = threading.RLock()
#: Largest distance of a point from its lattice, in steps, and deviation of the axes of the lattice from x and y [rad].
_OFF = 0.01
#: Largest distance between points of one line of the lattice, over the distance between lines; and largest number of
#: nodes per point.
_WITHIN = 0.1
_SPARSE = 64
#: Largest distance of a point from the border of a cell by rounding, in cells.
_ON_BORDER = 1e-9


def read_file(path: Path, given: Mapping[str, Any]) -> xr.DataArray:
    """Read one channel of an instrument or grid file.

    Parameters
    ----------
    path : Path
        The file.
    given : mapping
        Options of :func:`roughvisc.open_scan` that the user gives.
    """
    with _reading(path), closing(open_file(path, given.get("format"))) as file:
        channel = _chosen(file, given.get("channel"))
        h = _labelled(file, channel, given)
    for complaint in file.complaints:
        warnings.warn(f"{path}: {complaint}", UserWarning, stacklevel=5)
    attrs: dict[str, Any] = {
        "source_file": path.name,
        "source_sha256": sha256(path),
        "format": file.format,
        "channel": channel.name,
    }
    attrs["other_channels"] = ", ".join(other.name for other in file.channels if other is not channel) or None
    stated = "".join(f", {key} {value} as given" for key, value in given.items() if key not in attrs)
    line = f"read {path.name} ({file.format}), channel {channel.name!r}{stated}"
    return noted(h, line, orientation=orientation(file.format), **attrs)


def _labelled(file: ScanFile, channel: Channel, given: Mapping[str, Any]) -> xr.DataArray:
    """Return the heights of a channel over x and y; refuse implausible ones. [m]"""
    xy, z = _metres(channel, given)
    grid: Any = given.get("grid")
    no_data = given.get("no_data")
    spacing = pair("spacing", given["spacing"]) if "spacing" in given else None
    if grid is None and channel.kind == "triangles":
        raise InputError(key="grid", found=grid, expected="the side of the cells, for a mesh of triangles")
    if grid is not None and (channel.kind == "height" or spacing is not None):
        raise InputError(key="grid", found=grid, expected="none for a map, or with a spacing")
    raw = channel.load()
    sides: Any = channel.spacing
    values = np.asarray(raw, dtype=float)
    if channel.kind == "triangles":
        values = meshed(values, grid / xy, file.complaints)
        sides = (grid / xy, grid / xy)
    elif channel.kind == "points":
        points = values[np.isfinite(values[:, :2]).all(axis=1)]
        points[:, 2] = _without_no_data(points[:, 2], no_data, file.complaints)
        values, sides = laid_out(points, None if grid is None else grid / xy, xy, file.complaints)
    else:
        values = _without_no_data(values, no_data, file.complaints)
    values = values * z * given.get("height_scale", 1.0)
    if file.format in TOP_FIRST:
        values = values[:, ::-1]
    if channel.positions is None or spacing is not None:
        dx, dy = spacing or (float(f"{d * xy:.15g}") for d in sides)
        h = labelled(values, (dx, dy))
    else:
        x, y = channel.positions
        h = with_coordinates(values, x * xy, y * xy)
    if isinstance(raw, xr.DataArray):  # keep further attributes and coordinates of a grid file
        h = h.assign_coords(
            {name: (("x", "y"), coordinate.values) for name, coordinate in raw.coords.items() if coordinate.ndim == 2}
        )
        h.attrs |= {key: value for key, value in raw.attrs.items() if key not in ("units", "long_name")}
    h = h.isel({axis: slice(None, None, -1) for axis in ("x", "y") if h[axis][0] > h[axis][-1]})
    h = checked(h, "an areal scan")
    for axis, d, n in zip(("x", "y"), cell_sides(h), h.shape, strict=True):
        if n * d > WIDEST or d < FINEST:
            width = format_quantity(n * d, "m")
            side = format_quantity(d, "m")
            found = f"it is {width} wide along {axis} at a spacing of {side}, which is not plausible"
            expected = "another unit or spacing, and height_scale if its heights are in another unit too"
            found += f" (at most {format_quantity(WIDEST, 'm')}, at least {format_quantity(FINEST, 'm')})"
            raise InputError(f"{found}: expected {expected}")
    finite(h, HIGHEST)
    return h


def _metres(channel: Channel, given: Mapping[str, Any]) -> tuple[float, float]:
    """Return the metres per unit of x and y, and per unit of the heights, from the file or else from the options."""
    lateral, vertical = _units(given.get("unit"))
    stated = channel.unit
    is_sized = channel.kind != "height" or bool(channel.positions) or all(side > 0 for side in channel.spacing or [0.0])
    needs_unit = stated is None or (is_sized and channel.lateral_unit is None and "spacing" not in given)
    lacking = {}
    if needs_unit and lateral is None:
        lacking["unit"] = 'unit = "um"'
    if not is_sized and "spacing" not in given:
        lacking["spacing"] = 'spacing = "1 um"'
    for key in lacking:
        expected = f"{' and '.join(lacking.values())}, or another"
        raise InputError(f"it states no {' and no '.join(lacking)}: expected {expected}", key=key, expected=expected)
    if vertical is not None and stated is not None and not (needs_unit and vertical == lateral):
        factor = number(f"1 {vertical}", "m", "unit") / number(f"1 {stated}", "m")
        if not math.isclose(factor, 1.0):
            wrong = f"height_scale = {factor:.6g} if its heights are in {vertical}"
            raise InputError(key="unit", found=given["unit"], expected=f"the unit of the file, {stated!r}, or {wrong}")
    if lateral != vertical and channel.lateral_unit is not None:
        factor = number(f"1 {lateral}", "m", "unit") / number(f"1 {channel.lateral_unit}", "m")
        if not math.isclose(factor, 1.0):
            raise InputError(
                key="unit", found=given["unit"], expected=f"x and y in {channel.lateral_unit}, as in the file"
            )
    xy = channel.lateral_unit or lateral or "m"
    z = stated or vertical
    return number(f"1 {xy}", "m", "unit"), number(f"1 {z}", "m", "unit")


def _units(unit: str | Sequence[str] | None) -> tuple[str | None, str | None]:
    """Return the units of x and y, and of the heights, from a text such as "um" or "mm,um", or from a pair."""
    if unit is None:
        return None, None
    parts = unit.split(",") if isinstance(unit, str) else unit if isinstance(unit, list | tuple) else ()
    if not 0 < len(parts) <= 2 or not all(
        isinstance(part_of_unit, str) and part_of_unit.strip() for part_of_unit in parts
    ):
        expected = 'a unit of length, or those of x and y and of heights, such as "mm,um"'
        raise InputError(key="unit", found=unit, expected=expected)
    return parts[0].strip(), parts[-1].strip()


def _without_no_data(values: np.ndarray, no_data: float | None, complaints: list[str]) -> np.ndarray:
    """Return heights with NaN at missing points, which a given number or an outlying number marks."""
    if no_data is not None:
        return np.where(np.isclose(values, number(no_data, "1", "no_data"), rtol=1e-6, atol=0.0), np.nan, values)
    extremes = [extreme for extreme in {float(np.nanmin(values)), float(np.nanmax(values))} if abs(extreme) >= _NO_DATA]
    extremes = sorted(extreme for extreme in extremes if np.count_nonzero(values == extreme) >= _REPEATED)
    rest = values[np.isfinite(values) & ~np.isin(values, extremes)]
    spread = float(np.ptp(rest)) if rest.size >= _FEWEST else 0.0
    for extreme in extremes if spread > 0 else ():
        if np.abs(rest - extreme).min() > (1.0 if abs(extreme) in _MARKS else _FAR) * spread:
            here = values == extreme
            values = np.where(here, np.nan, values)
            others = f"all others lie within {rest.min():g} to {rest.max():g}"
            remedy = f"no_data = {extreme:g} confirms this, any other number keeps these heights"
            complaints.append(
                f"{here.sum()} points have the height {extreme:g} and {others}: taken as missing; {remedy}"
            )
    return values


def _chosen(file: ScanFile, channel: int | str | None) -> Channel:
    """Return the channel of a name or a number; the default height if None."""
    named = ", ".join(f"{i}: {c.name!r}{'' if c.is_height else f' ({c.kind})'}" for i, c in enumerate(file.channels))
    heights = {i: height_channel for i, height_channel in enumerate(file.channels) if height_channel.is_height}
    if not heights:
        raise InputError(f"it holds no heights over x and y (channels {named or 'none'}): expected an areal scan")
    if channel is None:
        channel = file.default if file.default in heights else min(heights)
    for i, height_channel in heights.items():
        if channel in (i, height_channel.name):
            return height_channel
    raise InputError(key="channel", found=channel, expected=f"a height of {named}")


@quantities(spacing="m")
def from_array(heights: Any, spacing: Quantity | tuple[Quantity, Quantity]) -> xr.DataArray:
    """Convert an array to a labelled height grid.

    Parameters
    ----------
    heights : array_like, shape (nx, ny)
        Heights over (x, y), peaks up, NaN or masked where missing. [m] Transpose a matrix whose rows run along x, as in
        the files that :func:`roughvisc.open_scan` reads.
    spacing : float or str, or a pair
        Cell sides (dx, dy). [m]

    Returns
    -------
    xarray.DataArray
        Height over (x, y), coordinates at the cell centres. [m]

    Raises
    ------
    InputError
        If the array is not two-dimensional with at least two points along each axis, or contains infinite heights or
        no valid ones.

    See Also
    --------
    roughvisc.open_scan, roughvisc.from_topography, roughvisc.save_scan

    Examples
    --------
    >>> import roughvisc as rv
    >>> h = rv.from_array([[0.0, 1e-6, 2e-6], [1e-6, 2e-6, 3e-6]], spacing=("1 um", "2 um"))
    >>> h.sel(x=0.5e-6, y=1e-6, method="nearest").item()
    0.0
    """
    values = np.array(in_metres(heights, "heights"))
    if values.ndim != 2 or min(values.shape) < 2:
        raise InputError(f"heights has shape {values.shape}: expected (nx, ny) of at least 2 x 2")
    h = labelled(values, pair("spacing", spacing))
    finite(h)
    return noted(h, "from an array")


def sha256(path: Path) -> str:
    """Return the checksum of the content of a file."""
    with opened(path, "a scan file") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def existing(path: Any, key: str = "path") -> Path:
    """Return the path of an existing file; raise :class:`~roughvisc.errors.InputError` otherwise."""
    path = path_of(path, key)
    regular(path, "a scan file or a surface card")
    return path


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Add the name of the file to every error, and hide the warnings of libraries.

    Only one reader runs at a time in a process: netCDF and the filters of warnings are not thread-safe.
    """
    with _READER, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            yield
        except InputError as error:
            raise error.prefixed(str(path)) from error
        except Exception as error:  # damaged files raise many types, such as MemoryError and struct.error
            if cause := cause_of_system(error):
                raise unreadable(path, cause, "a scan file") from error
            found = textwrap.shorten(str(error), 200, placeholder="...") or type(error).__name__
            text = f"{path}: it cannot be read ({found}): the file is damaged, or of another format"
            raise InputError(text) from error


def finite(h: xr.DataArray, highest: float = FARTHEST) -> None:
    """Refuse heights that are all missing or implausibly far from zero.

    Heights of metres are accepted in a file of a dozen points, which is an example.
    """
    if np.isnan(h.values).all():
        raise InputError(f"all {h.size} points are missing: expected heights")
    beyond = h.values[np.abs(h.values) > (highest if h.size >= _FEWEST else FARTHEST)]
    if beyond.size:
        found = f"{beyond.size} heights are like {format_quantity(beyond[0], 'm')}, which is not plausible"
        found += f" (at most {format_quantity(highest, 'm')})"
        expected = "height_scale = 1e-6, or another factor, if they are in another unit than stated; "
        expected += "no_data = the number in the file, or NaN in an array, if it marks missing points"
        raise InputError(f"{found}: expected {expected}", key="heights")


def laid_out(
    points: np.ndarray, side: float | None, metres: float, complaints: list[str]
) -> tuple[np.ndarray, tuple[float, float]]:
    """Return heights over x and y, and the sides of their cells.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        x, y and height.
    side : float, optional
        Side of the cells into which the points are sorted, in the unit of the points; None for their own lattice.
    metres : float
        Metres per unit of the points, for messages.
    complaints : list of str
        Gains a remark if cells hold no point.

    Raises
    ------
    InputError
        If the points lie on a line, or on no lattice if `side` is None.
    """
    spread = np.ptp(points[:, :2], axis=0)
    if not spread.all():
        raise InputError("its points lie on one line, a profile: expected an areal scan")
    if side is not None:
        heights = gridded(points, side)
        if empty := int(np.isnan(heights).sum()):
            complaints.append(f"{empty} of {heights.size} cells of the grid hold no point")
        return heights, (side, side)
    if (lattice := lattice_of(points)) is None:
        side = float(f"{2 * metres * math.sqrt(spread[0] * spread[1] / len(points)):.1g}")
        proposed = f'grid = "{format_quantity(side, "m").replace("µ", "u")}"'
        text = f"its {len(points)} points lie on no regular lattice: expected {proposed}, or similar"
        raise InputError(text, key="grid", expected="the side of the cells into which the points are sorted")
    return lattice


def meshed(corners: np.ndarray, side: float, complaints: list[str]) -> np.ndarray:
    """Return the heights of a mesh on square cells, see :func:`roughvisc.topography.formats.mesh.heights_above`.

    Parameters
    ----------
    corners : ndarray, shape (n, 3, 3)
        Corners of the triangles.
    side : float
        Side of the cells, in the unit of the corners.
    complaints : list of str
        Gains a remark if cells have no triangle.
    """
    if not len(corners) or not np.isfinite(corners).all():
        raise InputError("its triangles are absent or not finite: expected a mesh of triangles")
    size = np.ptp(corners[..., :2], axis=(0, 1))
    if min(size) < 2 * side or np.prod(size / side) > MOST_CELLS:
        raise InputError(key="grid", found=side, expected=f"a side that fits at least twice into {size}")
    heights = heights_above(corners, side)
    if empty := int(np.isnan(heights).sum()):
        complaints.append(f"{empty} of {heights.size} cells of the grid have no triangle")
    return heights


def lattice_of(points: np.ndarray) -> tuple[np.ndarray, tuple[float, float]] | None:
    """Return the heights and steps of the lattice of some points, to a hundredth of a step; None without a lattice.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        x, y and height, in any order of the points.

    Returns
    -------
    heights : ndarray, shape (nx, ny)
        NaN at nodes without a point.
    steps : tuple of float
        Along x and y, in the unit of the points.
    """
    places = points[:, :2]
    nodes = np.empty((len(points), 2))
    for axis in (0, 1):
        ordered = np.sort(places[:, axis])
        gaps = np.diff(ordered)
        starts = np.append(0, np.flatnonzero(gaps > _WITHIN * gaps.max()) + 1)
        lines = np.add.reduceat(ordered, starts) / np.diff(np.append(starts, ordered.size))
        between = np.diff(lines)
        step = (lines[-1] - lines[0]) / np.round(between / np.median(between)).sum()
        nodes[:, axis] = np.round((places[:, axis] - lines[0]) / step)
    centred = np.column_stack([np.ones(len(points)), nodes - nodes.mean(axis=0)])
    fit = np.linalg.lstsq(centred, places, rcond=None)[0]
    steps = np.array([fit[1, 0], fit[2, 1]])
    off = np.vstack([places - centred @ fit, [fit[1, 1], fit[2, 0]]])
    if (np.abs(off) > _OFF * steps).any():
        return None
    i, j = (nodes - nodes.min(axis=0)).astype(int).T
    shape = (int(i.max()) + 1, int(j.max()) + 1)
    if shape[0] * shape[1] > _SPARSE * len(points) or np.unique(i * shape[1] + j).size < len(points):
        return None
    heights = np.full(shape, np.nan)
    heights[i, j] = points[:, 2]
    return heights, (float(f"{steps[0]:.12g}"), float(f"{steps[1]:.12g}"))


def gridded(points: np.ndarray, side: float) -> np.ndarray:
    """Return the mean height of the points in each square cell; cells without a point are missing.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        x, y and height.
    side : float
        Side of the cells, in the unit of the points.
    """
    points = points[np.isfinite(points).all(axis=1)]
    low = points[:, :2].min(axis=0)
    high = points[:, :2].max(axis=0)
    shape = np.maximum(np.ceil((high - low) / side - _ON_BORDER), 1)
    if min(shape) < 2 or np.prod(shape) > MOST_CELLS:
        raise InputError(key="grid", found=side, expected=f"a side that fits at least twice into {high - low}")
    nx, ny = shape.astype(int)
    # a point on a border belongs to the upper cell, in any unit of length
    i, j = np.minimum((points[:, :2] - low) / side + _ON_BORDER, shape - 1).astype(int).T
    count, total = (np.bincount(i * ny + j, weights, nx * ny) for weights in (None, points[:, 2]))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(nx, ny)
