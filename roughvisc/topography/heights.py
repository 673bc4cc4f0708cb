"""Heights from Python in a NetCDF file that is named by the digest of their values and attributes."""

from __future__ import annotations

import hashlib
import json
import re
from contextlib import suppress
from numbers import Number
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends.netCDF4_ import NETCDF4_PYTHON_LOCK

from roughvisc.errors import InputError, RoughviscError
from roughvisc.paths import atomic_write, opened
from roughvisc.topography.borders import MIRRORED
from roughvisc.topography.grid import checked, nominal_area

#: Name of the file of heights with a digest.
_NAME = re.compile(r"heights-([0-9a-f]{16})\.nc")
#: Key of the digest in the encoding of heights, which are not changed once it is known.
_KNOWN = "digest"
#: Nominal area of heights by their digest. [m2]
_AREAS: dict[str, float] = {}
#: Attributes of heights that influence a solve.
_USED = ("recipe", "period", "missing", "filled_fraction")


def digest_in(name: str) -> str:
    """Return the digest in the name of a file of heights; empty for any other file."""
    known = _NAME.fullmatch(Path(name).name)
    return known[1] if known else ""


def file_name(h: xr.DataArray) -> str:
    """Return the name of the file that stores heights; `h` is from :func:`plain_heights`."""
    if _KNOWN not in h.encoding:
        h.encoding[_KNOWN] = digest_of(h)
    return f"heights-{h.encoding[_KNOWN]}.nc"


def digest_of(h: xr.DataArray) -> str:
    """Return sixteen hexadecimal digits of the heights, their coordinates and the attributes that a solve uses."""
    attributes = {name: h.attrs[name] for name in _USED if name in h.attrs}
    attributes["mirrored"] = MIRRORED in str(h.attrs.get("history", "")).split("\n")
    whole = hashlib.sha256(json.dumps([h.shape, attributes], sort_keys=True, default=np.ndarray.tolist).encode())
    whole.update(np.ascontiguousarray(np.where(np.isnan(h.values), np.nan, h.values + 0.0)))  # of -0.0 and 0.0 the same
    for name in ("x", "y", "filled"):
        if name in h.coords:
            whole.update(np.ascontiguousarray(h[name].values))
    return whole.hexdigest()[:16]


def plain_heights(heights: Any) -> xr.DataArray:
    """Return heights [m] as a file keeps them: with the mask of filled points, and attributes of texts and numbers.

    Raises
    ------
    InputError
        If they are not a grid of heights.
    """
    try:
        h = checked(heights, "surface", least=1)
    except InputError as error:
        text = str(error) if str(error).startswith("surface") else f"surface: {error}"
        raise type(error)(text, key="surface", found=heights, expected=error.expected) from error
    h = h.drop_vars([name for name in h.coords if name not in ("x", "y", "filled")]).rename("height").drop_encoding()
    h = h.copy(data=h.values.copy())  # the caller may change the array
    plain: dict[str, Any] = {}
    for name, value in h.attrs.items():
        if isinstance(value, str | Number) and not isinstance(value, bool | complex):
            plain[name] = value
        elif isinstance(value, list | tuple | np.ndarray) and np.asarray(value).dtype.kind in "fiu":
            plain[name] = [float(number) for number in np.ravel(value)]
    h.attrs = plain
    return h


def write_heights(h: xr.DataArray, folder: Path) -> Path:
    """Return the path of the file of heights in a folder, and write it unless it exists; see :func:`plain_heights`."""
    path = folder.absolute() / file_name(h)
    if not path.is_file():
        packed: dict[str, Any] = {"zlib": True, "complevel": 1, "shuffle": True, "fletcher32": True}
        with atomic_write(path) as temporary:
            h.to_netcdf(temporary, engine="netcdf4", encoding={"height": packed})
    return path


def area_in(path: Path, h: xr.DataArray | None = None) -> float | None:
    """Return the nominal area of the heights of a file, from its coordinates; None without the file. [m2]

    Parameters
    ----------
    path : Path
        A file of heights, named by their digest.
    h : xarray.DataArray, optional
        The heights, which need not be in the file yet.
    """
    digest = digest_in(path.name)
    if digest not in _AREAS:
        if h is not None:
            _AREAS[digest] = nominal_area(h)
        else:
            with (
                suppress(OSError, RuntimeError, LookupError, ValueError, InputError),
                NETCDF4_PYTHON_LOCK,
                xr.open_dataset(path, engine="netcdf4", lock=False, decode_times=False) as dataset,
            ):
                _AREAS[digest] = nominal_area(dataset)
    return _AREAS.get(digest)


def read_heights(path: Path) -> xr.DataArray:
    """Read the file of heights that :func:`write_heights` wrote. [m]

    Raises
    ------
    InputError
        If the file cannot be read, or its content does not match the digest in its name.
    """
    with opened(path, "a file of heights"):
        pass
    try:
        with NETCDF4_PYTHON_LOCK, xr.open_dataset(path, engine="netcdf4", lock=False, decode_times=False) as dataset:
            h = dataset["height"].load()
    except (OSError, RuntimeError, LookupError, ValueError, AttributeError) as error:
        raise InputError(f"{path}: is damaged: {error}: expected heights", key=str(path), transient=True) from error
    h.attrs = {name: list(map(float, value)) if np.ndim(value) else value for name, value in h.attrs.items()}
    h = h.drop_encoding()
    if digest_of(h) != digest_in(path.name):
        raise RoughviscError(f"{path}: was changed: expected the heights of the digest in its name", transient=True)
    return h
