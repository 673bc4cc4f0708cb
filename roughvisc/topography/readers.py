"""Readers: an instrument file or a grid file becomes a labelled height grid.

The libraries parse; here is dispatch, labelling and checking. Whatever goes wrong is one
:class:`~roughvisc.errors.InputError` that names the file, what was found, and what to pass.
"""

from __future__ import annotations

import hashlib
import math
import os
import threading
import warnings
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.tables import regular
from roughvisc.topography import gridfiles, instruments
from roughvisc.topography.grid import checked, in_metres, labelled, noted, pair
from roughvisc.topography.grid import spacing as cell_sides
from roughvisc.topography.instruments import Channel, Opened, Raw, brief, forget
from roughvisc.topography.orientation import orientation
from roughvisc.units import Quantity, quantities, quantity

#: No scan is wider, no spacing finer, no height in a file further from zero. [m] Scans of 150 mm exist; absolute
#: heights of 76 mm too.
WIDEST, FINEST, HIGHEST = 1.0, 1e-11, 1.0
#: Points from which heights are judged.
_FEWEST = 16
#: No height in an array is further from zero: beyond, numbers stand for missing points. [m]
FARTHEST = 1e3
#: What to give if a file lacks it: the name is that of the argument, the option and the key.
_UNIT, _SPACING = 'expected unit, such as "um"', 'expected spacing, such as "1 um"'
_UNITS = f"{_UNIT}, and height_unit if heights have another"
_READER = threading.RLock()
#: Format of the grid files that are read through xarray.
_GRID = "nc"


def read_file(
    path: Path,
    *,
    format: str | None = None,
    channel: int | str | None = None,
    unit: str | None = None,
    height_unit: str | None = None,
    spacing: float | tuple[float, float] | None = None,
) -> xr.DataArray:
    """Grid of an instrument or grid file; the options are those of :func:`roughvisc.open_scan`."""
    given = {"unit": unit, "height_unit": height_unit}
    lateral, vertical = (None if one is None else quantity(f"1 {one}", "m", key) for key, one in given.items())
    sides = None if spacing is None else pair("spacing", spacing)
    with _reading(path), closing(_opened(path, format)) as opened:
        chosen = _chosen(opened, channel)
        _refuse_another_unit(chosen, lateral, vertical)
        if opened.format == _GRID:
            h = checked(gridfiles.open_grid(path, chosen, lateral, vertical, sides), "grid")
        else:
            h = _labelled(opened.load(chosen), chosen.unit, lateral, vertical, sides)
    for complaint in opened.complaints:
        warnings.warn(f"{path}: {complaint}", UserWarning, stacklevel=5)
    _plausible(h, path)
    attrs = {"source_file": path.name, "source_sha256": sha256(path), "format": opened.format, "channel": chosen.name}
    others = [other.name for other in opened.channels if other.index != chosen.index]
    attrs["orientation"] = orientation(opened.format)
    attrs |= {"instrument": opened.instrument} if opened.instrument else {}
    attrs |= {"other_channels": ", ".join(others)} if others else {}
    how = f", spacing {sides[0]:.6g} x {sides[1]:.6g} m as given" if sides else ""
    how += "".join(f", {key} {one} as given" for key, one in given.items() if one)
    h = noted(h, f"read {path.name} ({opened.format}), channel {chosen.name!r}{how}", **attrs)
    finite(h, str(path))
    _low_enough(h, path)
    return h


@quantities(spacing="m")
def from_array(heights: Any, spacing: Quantity | tuple[Quantity, Quantity]) -> xr.DataArray:
    """Convert an array to a labelled height grid.

    Parameters
    ----------
    heights : array_like, shape (nx, ny)
        Heights over (x, y), peaks up, NaN or masked where missing. [m] Transpose a matrix whose rows run along x, as in
        the files that :func:`roughvisc.open_scan` reads.
    spacing : float or str, or pair of them
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
    finite(h, "heights")
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
        Index, name, whether it is a height, shape (nx, ny) and unit of each channel.

    Raises
    ------
    InputError
        If the file is absent, damaged or of an unknown format.
    """
    path = existing(path)
    with _reading(path), closing(_opened(path, format)) as opened:
        return opened.channels


def supported_formats() -> dict[str, tuple[str, ...]]:
    """Names of all formats, for ``format=``, with their usual suffixes.

    Returns
    -------
    dict
        Name -> suffixes, in alphabetical order.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the library's imports
        return dict(sorted(instruments.suffixes().items()))


def sha256(path: Path) -> str:
    """Checksum of a file's content; of a folder's files in order of their names."""
    regular(path)
    if path.is_dir():
        parts = (f"{p.relative_to(path)} {sha256(p)}" for p in sorted(path.rglob("*")) if p.is_file())
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _opened(path: Path, format: str | None) -> Opened:
    """Header of an instrument file or of a grid file, which is not left open."""
    if _is_grid(path, format):
        return Opened(_GRID, gridfiles.grid_channels(path))
    return instruments.open_instrument(path, format)


def _labelled(
    raw: Raw, stated: str | None, lateral: float | None, vertical: float | None, sides: tuple[float, float] | None
) -> xr.DataArray:
    """Grid of one channel of an instrument file. [m]

    Parameters
    ----------
    raw : Raw
        What is in the file.
    stated : str or None
        Unit of the channel.
    lateral, vertical : float or None
        Metres in the unit that a user gives for x and y, and in another one for heights.
    sides : tuple of float or None
        Cell sides that a user gives. [m]
    """
    no_size, known = raw.sides is None and sides is None, raw.units is not None
    if stated is not None:
        unit = quantity(f"1 {stated}", "m", "the unit in the file")
    elif lateral is None and vertical is None:
        if no_size:
            text = f"it states no unit of its heights and no size: {_UNIT}, and {_SPACING[9:]}"
            raise InputError(text, key="unit", expected=_UNIT)
        if sides is None and not known:
            raise InputError(f"it states no unit of x, y and its heights: {_UNITS}", key="unit", expected=_UNITS)
        raise InputError(f"it states no unit of its heights: {_UNIT}", key="unit", expected=_UNIT)
    else:
        unit = lateral if vertical is None else vertical
        if vertical is not None and sides is None and known and lateral is not None:
            raise InputError(
                "it states the unit of x and y only: expected the unit of its heights as unit, and no height_unit",
                key="height_unit",
                found=vertical,
            )
        if sides is None and not known and raw.sides is not None and lateral is None:
            raise InputError(f"it states no unit of x and y: {_UNIT}", key="unit", expected=_UNIT)
    values = raw.heights if unit == 1.0 else raw.heights * unit
    if sides is None and raw.sides is not None:
        metres = [quantity(f"1 {one}", "m", "the unit in the file") for one in raw.units or ()] or [lateral or unit] * 2
        sides = tuple(float(f"{d * metre:.15g}") for d, metre in zip(raw.sides, metres, strict=True))
    if sides is None or not all(math.isfinite(d) and d > 0 for d in sides):
        raise InputError(f"it states no size: {_SPACING}", key="spacing", expected=_SPACING)
    return labelled(values, sides)


def _chosen(opened: Opened, channel: int | str | None) -> Channel:
    listed = ", ".join(f"{c.index}: {c.name!r}{'' if c.is_height else ' (no areal height)'}" for c in opened.channels)
    if channel is None:
        heights = [c for c in opened.channels if c.is_height]
        preferred = [c for c in heights if c.index == opened.default] + heights
        if not preferred:
            profiles = [c for c in opened.channels if len(c.shape) == 1 or 1 in c.shape]
            kind = "a profile, not an areal scan" if profiles else "no areal height"
            raise InputError(f"it holds {kind} (channels {listed or 'none'}): expected heights over x and y")
        return preferred[0]
    for c in opened.channels:
        if channel == c.name or (isinstance(channel, int) and channel == c.index):
            if not c.is_height:
                raise InputError(
                    f"channel {channel!r} is not an areal height: expected another of {listed}",
                    key="channel",
                    found=channel,
                )
            return c
    raise InputError(key="channel", found=channel, expected=f"one of {listed}")


def _refuse_another_unit(chosen: Channel, lateral: float | None, vertical: float | None) -> None:
    """Refuse units that contradict the one in the file."""
    if chosen.unit is not None:
        stated = quantity(f"1 {chosen.unit}", "m", "the unit in the file")
        for key, unit in (("unit", lateral), ("height_unit", vertical)):
            if unit is not None and not math.isclose(stated, unit):
                raise InputError(
                    f"it states its unit as {chosen.unit!r}: expected no {key}; scale the heights afterwards",
                    key=key,
                    found=unit,
                )


def existing(path: Any) -> Path:
    """The path of a file that is there; an :class:`~roughvisc.errors.InputError` otherwise."""
    try:
        path = Path(path)
    except TypeError as error:
        raise InputError(f"path is {type(path).__name__}: expected the name of a file") from error
    if not path.exists():
        raise InputError(f"{path}: there is no such file")
    regular(path)
    if path.is_dir() and path.suffix != ".zarr":
        raise InputError(f"{path}: this is a folder: expected a scan file or a surface card")
    return path


def _is_grid(path: Path, format: str | None) -> bool:
    suffix = path.suffix.lower().removeprefix(".")
    if format is None and suffix == "h5":  # a grid written by way of HDF5, or an instrument's
        return gridfiles.is_labelled(path)
    return format == _GRID or (format is None and suffix in instruments.ELSEWHERE[_GRID])


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Name the file in every error, and keep the libraries' warnings to ourselves.

    One reader at a time in a process: netCDF is not safe in threads, nor are the filters of warnings.
    """
    if path.is_file() and not path.stat().st_size:
        raise InputError(f"{path}: the file is empty")
    with _READER, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            yield
        except InputError as error:
            raise error.prefixed(str(path)) from error
        except Exception as error:  # damaged files raise of every kind, MemoryError and struct.error among them
            forget(error)
            raise InputError(
                f"{path}: it cannot be read ({brief(error)}): the file is damaged, or of another format"
            ) from error


def _plausible(h: xr.DataArray, path: Path) -> None:
    if min(h.shape) < 2:
        raise InputError(f"{path}: it holds {h.shape[0]} x {h.shape[1]} points, a profile: expected an areal scan")
    for axis, d, n in zip(("x", "y"), cell_sides(h, str(path)), h.shape, strict=True):
        if n * d > WIDEST or d < FINEST:
            raise InputError(
                f"{path}: it is {n * d:.6g} m wide along {axis} at a spacing of {d:.6g} m, which is not plausible "
                f"(at most {WIDEST:g} m, at least {FINEST:g} m): expected another unit or spacing"
            )


def _low_enough(h: xr.DataArray, path: Path) -> None:
    """Refuse heights of metres, whose unit is another; not in a file of a dozen points, which is an example."""
    count, example = _beyond(h.values, HIGHEST)
    if count and h.size >= _FEWEST:
        raise InputError(
            f"{path}: {count} heights are like {example:.6g} m, which is not plausible (at most "
            f"{HIGHEST:g} m from zero): expected heights in the unit that the file or `unit` states"
        )


def _beyond(values: np.ndarray, most: float) -> tuple[int, float]:
    """How many heights are further from zero, and the first of them. [m]"""
    beyond = values[np.abs(values) > most]
    return beyond.size, float(beyond[0]) if beyond.size else math.nan


def finite(h: xr.DataArray, source: str) -> None:
    """Refuse heights that are all missing, or that are numbers standing for missing points."""
    values = h.values
    if np.isnan(values).all():
        raise InputError(f"{source}: all {h.size} points are missing: expected heights")
    count, example = _beyond(values, FARTHEST)
    if count:
        raise InputError(
            f"{source}: {count} heights are like {example:.6g} m: expected none beyond {FARTHEST:g} m "
            "(where they mark missing points, put NaN in their place and use from_array)"
        )
