"""Conversion of scan files to labelled height grids: units, missing values, orientation and plausibility.

Every problem raises one :class:`~roughvisc.errors.InputError` that names the file, the cause and the argument to pass.
"""

from __future__ import annotations

import hashlib
import math
import textwrap
import threading
import warnings
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.tables import regular
from roughvisc.topography.formats import open_file, orientation, top_line_first
from roughvisc.topography.formats.scan_file import Channel, ScanFile
from roughvisc.topography.grid import checked, in_metres, labelled, noted, pair, with_coordinates
from roughvisc.topography.grid import spacing as cell_sides
from roughvisc.topography.points import laid_out
from roughvisc.units import Quantity, number, quantities

#: Largest side, finest spacing and largest distance of a height from zero. [m] Scans of 150 mm exist; absolute heights
#: of 76 mm too.
WIDEST, FINEST, HIGHEST = 1.0, 1e-11, 1.0
#: Fewest points for a check of the heights.
_FEWEST = 16
#: Heights of an array further from zero than this mark missing points. [m]
FARTHEST = 1e3
#: A number marks missing points under four conditions: it is the lowest or highest height, it is at least this large in
#: the file, it occurs at least this many times, and its distance from the next height exceeds this multiple of the
#: range of all other heights. Exactly flat pits of a manufactured texture have smaller numbers.
_NO_DATA, _REPEATED, _FAR = 999.0, 4, 10.0
_READER = threading.RLock()


def read_file(path: Path, format: str | None, given: Mapping[str, Any]) -> xr.DataArray:
    """Read one channel of an instrument or grid file.

    Parameters
    ----------
    path : Path
        The file.
    format : str or None
        As for :func:`roughvisc.open_scan`.
    given : mapping
        Further options of :func:`roughvisc.open_scan` that the user gives.
    """
    if "spacing" in given:
        given = {**given, "spacing": pair("spacing", given["spacing"])}
    with _reading(path), closing(open_file(path, format)) as file:
        channel = _chosen(file, given.get("channel"))
        h = _labelled(file, channel, given)
    for complaint in file.complaints:
        warnings.warn(f"{path}: {complaint}", UserWarning, stacklevel=5)
    attrs = {"source_file": path.name, "source_sha256": sha256(path), "format": file.format, "channel": channel.name}
    attrs["other_channels"] = ", ".join(other.name for other in file.channels if other is not channel) or None
    stated = "".join(f", {key} {value} as given" for key, value in given.items() if key != "channel")
    line = f"read {path.name} ({file.format}), channel {channel.name!r}{stated}"
    return noted(h, line, orientation=orientation(file.format), **attrs)


def _labelled(file: ScanFile, channel: Channel, given: Mapping[str, Any]) -> xr.DataArray:
    """Return the heights of a channel over x and y; refuse implausible ones. [m]"""
    xy, z = _metres(channel, given)
    spacing, grid, no_data = (given.get(key) for key in ("spacing", "grid", "no_data"))
    if grid is not None and (channel.kind != "points" or spacing is not None):
        raise InputError(key="grid", found=grid, expected="none for a map, or with a spacing")
    raw, sides = channel.load(), channel.spacing
    values = np.asarray(raw, dtype=float)
    if channel.kind == "points":
        points = values[np.isfinite(values[:, :2]).all(axis=1)]
        points[:, 2] = _without_no_data(points[:, 2], no_data, file.complaints)
        values, sides = laid_out(points, None if grid is None else grid / xy, xy, file.complaints)
    else:
        values = _without_no_data(values, no_data, file.complaints)
    values = values * z * given.get("height_scale", 1.0)
    if top_line_first(file.format):
        values = values[:, ::-1]
    if channel.positions is None or spacing is not None:
        h = labelled(values, spacing or tuple(float(f"{d * xy:.15g}") for d in sides))
    else:
        h = with_coordinates(values, *(at * xy for at in channel.positions))
    if isinstance(raw, xr.DataArray):  # keep further attributes and coordinates of a grid file
        h = h.assign_coords({name: (("x", "y"), one.values) for name, one in raw.coords.items() if one.ndim == 2})
        h.attrs |= {key: value for key, value in raw.attrs.items() if key not in ("units", "long_name")}
    h = checked(h.isel({axis: slice(None, None, -1) for axis in ("x", "y") if h[axis][0] > h[axis][-1]}), "grid", 1)
    if min(h.shape) < 2:
        raise InputError(f"it holds {h.shape[0]} x {h.shape[1]} points, a profile: expected an areal scan")
    for axis, d, n in zip(("x", "y"), cell_sides(h), h.shape, strict=True):
        if n * d > WIDEST or d < FINEST:
            limits = f"which is not plausible (at most {WIDEST:g} m, at least {FINEST:g} m)"
            expected = "another unit or spacing, and height_scale if its heights are in another unit too"
            found = f"it is {n * d:.6g} m wide along {axis} at a spacing of {d:.6g} m"
            raise InputError(f"{found}, {limits}: expected {expected}")
    finite(h, HIGHEST)
    return h


def _metres(channel: Channel, given: Mapping[str, Any]) -> tuple[float, float]:
    """Return the metres per unit of x and y, and per unit of the heights, from the file or else from the options."""
    unit, stated = given.get("unit"), channel.unit
    is_sized = channel.kind == "points" or bool(channel.positions) or all(side > 0 for side in channel.spacing or [0.0])
    needs = {
        "unit": stated is None or (is_sized and channel.lateral_unit is None and "spacing" not in given),
        "spacing": not is_sized,
    }
    examples = {"unit": 'unit = "um"', "spacing": 'spacing = "1 um"'}
    if lacking := [key for key, is_needed in needs.items() if is_needed and key not in given]:
        expected = f"{' and '.join(examples[key] for key in lacking)}, or another"
        raise InputError(
            f"it states no {' and no '.join(lacking)}: expected {expected}", key=lacking[0], expected=expected
        )
    if unit is not None and not needs["unit"]:
        factor = number(f"1 {unit}", "m", "unit") / number(f"1 {stated}", "m")
        if not math.isclose(factor, 1.0):
            expected = f"the unit of the file, {stated!r}, or height_scale = {factor:.6g} if its heights are in {unit}"
            raise InputError(key="unit", found=unit, expected=expected)
    return number(f"1 {channel.lateral_unit or unit or 'm'}", "m", "unit"), number(f"1 {stated or unit}", "m", "unit")


def _without_no_data(values: np.ndarray, no_data: float | None, complaints: list[str]) -> np.ndarray:
    """Return heights with NaN at missing points, which a given number or an outlying number marks."""
    if no_data is not None:
        return np.where(np.isclose(values, number(no_data, "1", "no_data"), rtol=1e-6, atol=0.0), np.nan, values)
    extremes = [one for one in {float(np.nanmin(values)), float(np.nanmax(values))} if abs(one) >= _NO_DATA]
    extremes = sorted(one for one in extremes if np.count_nonzero(values == one) >= _REPEATED)
    rest = values[np.isfinite(values) & ~np.isin(values, extremes)]
    spread = float(np.ptp(rest)) if rest.size >= _FEWEST else 0.0
    for one in extremes if spread > 0 else ():
        if np.abs(rest - one).min() > _FAR * spread:
            here = values == one
            values = np.where(here, np.nan, values)
            others = f"all others lie within {rest.min():g} to {rest.max():g}"
            remedy = f"no_data = {one:g} confirms this, any other number keeps these heights"
            complaints.append(f"{here.sum()} points have the height {one:g} and {others}: taken as missing; {remedy}")
    return values


def _chosen(file: ScanFile, channel: int | str | None) -> Channel:
    """Return the channel of a name or a number; the default height if None."""
    named = ", ".join(f"{i}: {c.name!r}{'' if c.is_height else f' ({c.kind})'}" for i, c in enumerate(file.channels))
    heights = {i: one for i, one in enumerate(file.channels) if one.is_height}
    if not heights:
        raise InputError(f"it holds no heights over x and y (channels {named or 'none'}): expected an areal scan")
    if channel is None:
        channel = file.default if file.default in heights else min(heights)
    for i, one in heights.items():
        if channel in (i, one.name):
            return one
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
    """
    values = np.array(in_metres(heights, "heights"))
    if values.ndim != 2 or min(values.shape) < 2:
        raise InputError(f"heights has shape {values.shape}: expected (nx, ny) of at least 2 x 2")
    h = labelled(values, pair("spacing", spacing))
    finite(h)
    return noted(h, "from an array")


def sha256(path: Path) -> str:
    """Return the checksum of the content of a file."""
    regular(path)
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def existing(path: Any) -> Path:
    """Return the path of an existing file; raise :class:`~roughvisc.errors.InputError` otherwise."""
    path = Path(path)
    regular(path)
    if not path.is_file():
        found = "this is a folder" if path.is_dir() else "the file does not exist"
        raise InputError(f"{path}: {found}: expected a scan file or a surface card")
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
        limit = f"which is not plausible (at most {highest:g} m from zero)"
        expected = "height_scale = 1e-6, or another factor, if they are in another unit than stated; "
        expected += "no_data = the number in the file, or NaN in an array, if it marks missing points"
        raise InputError(
            f"{beyond.size} heights are like {beyond[0]:.6g} m, {limit}: expected {expected}", key="heights"
        )
