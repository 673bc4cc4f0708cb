"""Conversion of scan files to labelled height grids: units, missing values, orientation and plausibility.

Every problem raises one :class:`~roughvisc.errors.InputError` that names the file, the cause and the argument to pass.
"""

from __future__ import annotations

import hashlib
import math
import os
import textwrap
import threading
import warnings
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.tables import regular
from roughvisc.topography.formats.registry import open_file
from roughvisc.topography.formats.scan_file import Channel, ScanFile
from roughvisc.topography.grid import checked, in_metres, labelled, noted, pair, with_coordinates
from roughvisc.topography.grid import spacing as cell_sides
from roughvisc.topography.orientation import orientation, top_line_first
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


class Reading(NamedTuple):
    """Options with which a user reads a file, see :func:`roughvisc.open_scan`."""

    unit: str | None = None
    height_unit: str | None = None
    spacing: Any = None
    grid: Any = None
    no_data: float | None = None
    height_scale: float | None = None


def read_file(path: Path, format: str | None, channel: int | str | None, how: Reading) -> xr.DataArray:
    """Read one channel of an instrument or grid file, see :func:`roughvisc.open_scan`."""
    if how.spacing is not None:
        how = how._replace(spacing=pair("spacing", how.spacing))
    with _reading(path), closing(open_file(path, format)) as file:
        chosen = _chosen(file, channel)
        h = _labelled(file, chosen, how)
    for complaint in file.complaints:
        warnings.warn(f"{path}: {complaint}", UserWarning, stacklevel=5)
    given = how._asdict() | {"spacing": how.spacing and "{:.6g} x {:.6g} m".format(*how.spacing)}
    stated = "".join(f", {key} {value} as given" for key, value in given.items() if value is not None)
    attrs = {"source_file": path.name, "source_sha256": sha256(path), "format": file.format, "channel": chosen.name}
    attrs |= {"orientation": orientation(file.format), "instrument": file.instrument or None}
    attrs["other_channels"] = ", ".join(other.name for other in file.channels if other is not chosen) or None
    return noted(h, f"read {path.name} ({file.format}), channel {chosen.name!r}{stated}", **attrs)


def _labelled(file: ScanFile, channel: Channel, how: Reading) -> xr.DataArray:
    """Return the heights of a channel over x and y; refuse implausible ones. [m]"""
    xy, z = _metres(channel, how)
    if how.grid is not None and (channel.kind != "points" or how.spacing is not None):
        raise InputError(key="grid", found=how.grid, expected="none for a map, or with a spacing")
    raw, sides = channel.load(), channel.spacing
    if channel.kind == "points":
        points = raw[np.isfinite(raw[:, :2]).all(axis=1)]
        points[:, 2] = _without_no_data(points[:, 2], how.no_data, file.complaints)
        values, sides = laid_out(points, None if how.grid is None else how.grid / xy, xy, file.complaints)
    else:
        values = _without_no_data(np.asarray(raw, dtype=float), how.no_data, file.complaints)
    values = values * z * (how.height_scale or 1.0)
    if top_line_first(file.format):
        values = values[:, ::-1]
    if channel.positions is None or how.spacing is not None:
        spacing = how.spacing or tuple(float(f"{d * xy:.15g}") for d in sides)
        h = labelled(values, spacing)
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


def _metres(channel: Channel, how: Reading) -> tuple[float, float]:
    """Return the metres per unit of x and y, and per unit of the heights, from the file or else from the options."""
    has_sides = all(side > 0 for side in channel.spacing or [0.0])
    is_sized = channel.kind == "points" or has_sides or any((channel.positions, how.spacing))
    needs_xy = is_sized and channel.lateral_unit is None and how.spacing is None
    needs_z = channel.unit is None
    is_used = {"unit": needs_xy or (needs_z and how.height_unit is None), "height_unit": needs_z}
    for key, given in (("unit", how.unit), ("height_unit", how.height_unit)):
        for stated in filter(None, (channel.unit, channel.lateral_unit)) if given and not is_used[key] else ():
            factor = number(f"1 {given}", "m", key) / number(f"1 {stated}", "m")
            if not math.isclose(factor, 1.0):
                expected = f"no {key} = {given!r}, or height_scale = {factor:.6g} if its heights are in {given}"
                text = f"it states its unit as {stated!r}: expected {expected}"
                raise InputError(text, key=key, found=given, expected=expected)
    expected = {}
    if (needs_xy and how.unit is None) or (needs_z and how.unit is how.height_unit is None):
        expected["unit"] = 'unit = "um", and height_unit if heights have another unit'
    if not is_sized:
        expected["spacing"] = 'spacing = "1 um", or another length'
    for key in expected:
        text = f"it states no {' and no '.join(expected)}: expected {'; and '.join(expected.values())}"
        raise InputError(text, key=key, expected=expected[key])
    xy, z = channel.lateral_unit or how.unit or "m", channel.unit or how.height_unit or how.unit
    return number(f"1 {xy}", "m", "unit"), number(f"1 {z}", "m", "height_unit" if how.height_unit else "unit")


def _without_no_data(values: np.ndarray, no_data: float | None, complaints: list[str]) -> np.ndarray:
    """Return heights with NaN at missing points, which a given number or an outlying number marks."""
    if no_data is not None:
        return np.where(np.isclose(values, number(no_data, "1", "no_data"), rtol=1e-6, atol=0.0), np.nan, values)
    if values.size < _FEWEST:
        return values
    extremes = sorted({float(np.nanmin(values)), float(np.nanmax(values))})
    extremes = [one for one in extremes if abs(one) >= _NO_DATA and np.count_nonzero(values == one) >= _REPEATED]
    rest = values[np.isfinite(values) & ~np.isin(values, extremes)] if extremes else values[:0]
    spread = float(np.ptp(rest)) if rest.size >= _FEWEST else 0.0
    for one in extremes:
        if spread > 0 and np.abs(rest - one).min() > _FAR * spread:
            here = values == one
            values = np.where(here, np.nan, values)
            others = f"all others lie within {rest.min():g} to {rest.max():g}"
            remedy = f"no_data = {one:g} confirms this, any other number keeps these heights"
            complaints.append(f"{here.sum()} points have the height {one:g} and {others}: taken as missing; {remedy}")
    return values


def _chosen(file: ScanFile, channel: int | str | None) -> Channel:
    """Return the channel of a name or a number; the default height if None."""
    named = ", ".join(f"{i}: {c.name!r}{'' if c.is_height else f' ({c.kind})'}" for i, c in enumerate(file.channels))
    heights = [i for i, c in enumerate(file.channels) if c.is_height]
    if not heights:
        raise InputError(f"it holds no heights over x and y (channels {named or 'none'}): expected an areal scan")
    if channel is None:
        return file.channels[file.default if file.default in heights else heights[0]]
    for i in heights:
        if channel in (i, file.channels[i].name):
            return file.channels[i]
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


def list_channels(path: str | os.PathLike[str], *, format: str | None = None) -> tuple[Channel, ...]:
    """List the channels of a scan file, without loading it.

    Parameters
    ----------
    path : path
        Instrument or grid file.
    format : str, optional
        As for :func:`roughvisc.open_scan`.

    Returns
    -------
    tuple of Channel
        Name, whether it is a height, shape (nx, ny) and unit of each channel.

    Raises
    ------
    InputError
        If the file is absent, damaged or of an unknown format.
    """
    path = existing(path)
    with _reading(path), closing(open_file(path, format)) as file:
        return tuple(file.channels)


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
