"""Results in NetCDF files: atomic writing, and lazy reading in any thread; no file stays open.

Files follow CF-1.11 and netCDF-4, so that xarray, ncview, MATLAB and ParaView read them. xarray's own engine reads with
netCDF's lock, but opens and closes files without the lock, which netCDF-4 does not support. Here every call of the
library holds the lock.
"""

from __future__ import annotations

import errno
import math
import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import BackendArray, BackendEntrypoint
from xarray.backends.netCDF4_ import NETCDF4_PYTHON_LOCK as NETCDF
from xarray.core import indexing

from roughvisc.errors import InputError
from roughvisc.labels import CARRIED, STEPS, label, steps_of
from roughvisc.paths import cause_of_system, path_of
from roughvisc.runs.folder import atomic_write, require_result, results_at, unusable
from roughvisc.units import number
from roughvisc.variables import AXES, RESULT_FORMAT, VARIABLES, axis_of

#: Errors of the library for a file that it cannot read.
ERRORS = (OSError, RuntimeError, LookupError, ValueError, AttributeError)
#: Free space below which a full disk counts as the cause of a failed write. [byte]
_NEARLY_FULL = 1 << 20
#: Fields that are not compressed, because hardly any of their numbers are equal. On 512 x 512 cells compression takes
#: 34 ms for a gap, to 0.66 of its size, and 3.6, 6.2 and 9.7 ms for a pressure on 2, 9 and 18 % of the cells, to 0.03,
#: 0.10 and 0.19. With shuffled bytes a pressure takes longer and needs larger files.
_DENSE = ("gap", "height")
_TINY = 1 << 12  # largest size without compression [byte]
#: Chunk of a field over (time, x, y). Times to read one frame, and the history of one cell, at 512 x 512 x 50,
#: compressed, in ms: (1, 512, 512) 9 and 370; (4, 128, 128) 18 and 22; (8, 64, 64) 35 to 65 and 4 to 7; (16, 64, 64) 60
#: to 145 and 4 to 7; (50, 32, 32) 170 and 1.5. Fields without compression take a fifth of these times or less.
_CHUNK = (8, 64, 64)
#: Number of cells above which a chunk contains one frame, because several frames may exceed the memory; and this chunk.
#: At 4096 x 4096 x 20, compressed, both times are in ms: (8, 64, 64) 2809 and 12; (2, 256, 256) 1277 and 51;
#: (1, 256, 256) 331 and 41; (1, 1024, 1024) 309 and 302.
_MANY_CELLS = 1 << 20
_CHUNK_OF_MANY = (1, 256, 256)
#: Longest side of a chunk of any other variable: a map of 1024 x 1024 doubles has 8 MB.
_LONGEST_CHUNK = 1024
#: Variables without missing values.
_COORDINATES = (*AXES, "x", "y")


class DamagedError(InputError):
    """The content of a file is damaged."""


def unreadable(path: Path, error: Exception, what: str = "") -> InputError:
    """Return the error of a file that the library could not read: a system error, or damaged content."""
    try:
        with path.open("rb") as file:  # the library reports some causes, such as too many open files, as damage
            cause = cause_of_system(error)
            if not cause and path.suffix != ".nc" and not file.read(4).startswith((b"\x89HDF", b"CDF")):
                cause = "is not a NetCDF file"
    except OSError as failure:
        cause = cause_of_system(failure)
    if cause and path.suffix == ".toml":
        return unusable(path, "is a study", f"a result, such as those that roughvisc run writes to results/{path.stem}")
    if cause:
        return unusable(path, cause)
    reason = f"{what}{error}"
    text = f"{path}: is damaged: {reason}: expected a whole result; remove the file and run its study again"
    return DamagedError(text, key=str(path), found=reason, transient=True)


def open_result(path: str | Path) -> xr.Dataset:
    """Open a result; its fields are read when they are needed, in any thread or process.

    Parameters
    ----------
    path : path
        A file written by :func:`write_result`.

    Returns
    -------
    xarray.Dataset
        Times are plain numbers in seconds. The history of all accepted steps is ``ds.roughvisc.steps``.

    Raises
    ------
    InputError
        If the file is absent, cannot be read, has a later format, or is not a result.
    DamagedError
        If the content of the file is damaged.

    See Also
    --------
    roughvisc.run, roughvisc.save_result, roughvisc.open_results

    Notes
    -----
    Every block of a variable has a checksum (fletcher32), which is verified when the block is read. This function reads
    only the histories. :func:`verify` reads all blocks.

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=33)
    >>> press = rv.Program().load(1e-4, over=0)
    >>> ds = rv.simulate(ball, rv.elastic(1e6), press, times=[0.0], progress=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     again = rv.open_result(rv.save_result(ds, f"{folder}/ball.nc")).load()
    >>> bool((again.pressure == ds.pressure).all())
    True
    """
    return _opened(path_of(path, "path", "a result"))


def open_without_steps(path: Path) -> xr.Dataset:
    """Open a result without the history of its steps, whose reading takes half of the time; see :func:`open_result`."""
    return _opened(path, steps=False)


def read_steps(path: Path) -> xr.Dataset | None:
    """Read only the history of the steps of a result; None if it has none.

    Raises
    ------
    InputError
        If the file is absent, cannot be read, or is damaged.
    """
    require_result(path)
    try:
        with NETCDF, netCDF4.Dataset(**_named(path)) as file:
            file.set_auto_maskandscale(False)
            file.set_auto_chartostring(False)
            return _steps(str(path), file)
    except ERRORS as error:
        raise unreadable(path, error) from error


def _steps(path: str, file: netCDF4.Dataset) -> xr.Dataset | None:
    """Return the history of the steps in an open result."""
    return _dataset(path, file.groups[STEPS]).set_coords("time") if STEPS in file.groups else None


def _opened(path: Path, **options: Any) -> xr.Dataset:
    """Open a result with options of :class:`ResultBackend`."""
    require_result(path)
    try:
        dataset = xr.open_dataset(path, engine=ResultBackend, **options)
    except ERRORS as error:
        raise unreadable(path, error) from error
    expected = f"a result of roughvisc of format {RESULT_FORMAT}"
    rows = axis_of(dataset.variables)
    if (stated := dataset.attrs.get("result_format", RESULT_FORMAT)) != RESULT_FORMAT:
        raise unusable(path, f"is of format {stated}", expected)
    for name in AXES[rows].needed:
        if name not in dataset.variables or dataset[name].dims != (rows,):
            raise unusable(path, f"holds no {name} over {rows}", expected)
    return dataset


class ResultBackend(BackendEntrypoint):
    """Engine of xarray that reads fields over x and y when they are needed, and everything else immediately."""

    def open_dataset(self, filename_or_obj: Any, *, drop_variables: Any = None, steps: bool = True) -> xr.Dataset:
        """Open a file like the engine ``netcdf4``, with durations as plain numbers, and with the steps if requested."""
        path = os.path.abspath(os.fspath(filename_or_obj))  # other processes may work in another folder
        with NETCDF, netCDF4.Dataset(**_named(path)) as file:
            file.set_auto_maskandscale(False)
            file.set_auto_chartostring(False)
            result = _dataset(path, file).drop_vars(drop_variables or (), errors="ignore")
            carried = _steps(path, file) if steps else None
        if carried is not None:
            result.encoding[CARRIED] = carried
        return result


def _named(path: str | Path) -> dict[str, str]:
    """Return the arguments of the library for a path, by which it opens the same bytes as Python in any locale."""
    return {"filename": os.fsencode(path).decode("latin-1"), "encoding": "latin-1"}


def _dataset(path: str, file: netCDF4.Dataset) -> xr.Dataset:
    """Return the variables of a file or a group."""
    variables = {}
    for name, stored in file.variables.items():
        if stored.dimensions[-2:] == ("x", "y"):
            read = partial(read_variable, path, name)
            data = lazy(read, stored.shape, stored.dtype, indexing.IndexingSupport.OUTER)
        else:
            data = np.asarray(stored[...])
        variables[name] = xr.Variable(stored.dimensions, data, stored.__dict__)
    decoded = xr.decode_cf(xr.Dataset(variables, attrs=file.__dict__), decode_timedelta=False)
    for name in list(decoded.coords):
        if decoded[name].dtype.kind == "O":
            decoded[name] = decoded[name].astype(str)
    return decoded


@dataclass(eq=False)
class _Lazy(BackendArray):
    """Array that a function reads."""

    read: Callable[[Any], Any]
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    support: indexing.IndexingSupport

    def __getitem__(self, key: indexing.ExplicitIndexer) -> NDArray[Any]:
        return indexing.explicit_indexing_adapter(key, self.shape, self.support, self.read)


def lazy(
    read: Callable[[Any], Any],
    shape: tuple[int, ...],
    dtype: Any = float,
    support: indexing.IndexingSupport = indexing.IndexingSupport.BASIC,
) -> Any:
    """Return an array for xarray, parts of which are read when they are needed.

    Parameters
    ----------
    read : callable
        Returns a part for an index, a tuple with a whole number or a slice for each dimension. With ``OUTER`` an index
        may also contain arrays.
    shape, dtype
        Shape and dtype of the whole.
    support : IndexingSupport
        What `read` accepts.
    """
    return indexing.LazilyIndexedArray(_Lazy(read, shape, np.dtype(dtype), support))


def read_variable(path: str, name: str, key: Any) -> NDArray[Any]:
    """Return a part of a stored variable of a result.

    Raises
    ------
    InputError
        If the file was removed or cannot be read.
    DamagedError
        If a block does not match its checksum, or the file lacks the variable.
    """
    require_result(Path(path))
    try:
        with NETCDF, netCDF4.Dataset(**_named(path)) as file:
            file.set_auto_maskandscale(False)
            return np.asarray(file[name][key])
    except ERRORS as error:
        raise unreadable(Path(path), error, f"its {name}: ") from error


def verify(place: str | Path) -> dict[Path, str]:
    """Read results to their last byte and compare every block with its checksum.

    Parameters
    ----------
    place : path
        A result, or a folder of results.

    Returns
    -------
    dict
        File -> description of its damage, which is empty for an undamaged file; sorted by name.

    Raises
    ------
    InputError
        If the path does not exist, or the folder contains no result.
    """
    place = path_of(place, "place", "a result, or of a folder of results")
    flaws = {}
    if not place.exists():
        raise InputError(f"{place}: does not exist: expected a result, or a folder of results")
    for path in results_at(place):
        flaws[path] = ""
        try:
            with open_result(path) as result:
                for variable in result.variables.values():
                    for first in range(0, len(variable), 16) if variable.ndim else ():
                        _ = variable[first : first + 16].values
        except InputError as error:
            flaws[path] = str(error)
    return flaws


def write_result(dataset: xr.Dataset, path: str | Path) -> Path:
    """Write a result to one NetCDF file, by a temporary file and a rename.

    Parameters
    ----------
    dataset : xarray.Dataset
        Declared variables, see :mod:`roughvisc.variables`, and scalar coordinates. Lazy fields are read and written in
        layers of one chunk. The history of accepted steps in the Dataset becomes the group ``steps``.
    path : path
        The file to write; an existing file is replaced.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    KeyError, ValueError
        If a variable is not declared, or its dimensions differ.
    InputError
        If the folder cannot be written to.
    OSError
        If the disk is full.

    Notes
    -----
    Every reader supports the filter zlib, which is used at level 1. netCDF4 is called directly: on a Dask worker xarray
    would request a lock from the scheduler for every variable, although only this process uses the temporary file.
    """
    root = as_stored(dataset)
    steps = steps_of(dataset)
    with atomic_write(path) as temporary:
        try:
            with NETCDF:
                file = netCDF4.Dataset(**_named(temporary), mode="w", format="NETCDF4")
            try:
                # all variables are declared before values are written: each change of mode writes the metadata again
                with NETCDF:
                    declared = _declare(file, root)
                    if steps is not None:
                        declared += _declare(file.createGroup(STEPS), steps)
                for stored, variable in declared:
                    _write(stored, variable)
            finally:
                with NETCDF:
                    file.close()
        except (RuntimeError, PermissionError) as error:  # errors of the library for any failed write
            full = shutil.disk_usage(temporary.parent).free < _NEARLY_FULL
            if not full and isinstance(error, PermissionError):
                raise
            code = errno.ENOSPC if full else errno.EIO
            raise OSError(code, os.strerror(code), str(path)) from error
    return Path(path)


def as_stored(dataset: xr.Dataset) -> xr.Dataset:
    """Return a result with the attributes that its file states."""
    root = label(dataset).assign_attrs(Conventions="CF-1.11", result_format=RESULT_FORMAT)
    return root.assign_attrs(_readable(root.attrs))


def save_result(dataset: xr.Dataset, path: str | Path, *, gap_part: float | None = None) -> Path:
    """Write a result with the history of its steps to a file, packed as :func:`roughvisc.run` packs it.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result of one case, as from :func:`roughvisc.simulate` or :func:`roughvisc.friction`, in memory or in a file.
    path : path
        The file, such as ``"contact.nc"``; an existing file is replaced. :func:`open_result` opens it.
    gap_part : float, optional
        Rounds the gap of each row to at most this part of the stated error of its approach. The gap is then compressed
        to a fraction of its size, and its attribute ``rounding`` states the part. Default: the gap is not changed. [-]

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    InputError
        If the Dataset is not a result, the file cannot be written, or `gap_part` is given for a result without a gap or
        a stated error of the approach.

    See Also
    --------
    roughvisc.open_result, roughvisc.to_csv

    Examples
    --------
    >>> import tempfile, roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=33), rv.Program().load(1e-4, over=0).hold(1.0)
    >>> ds = rv.simulate(ball, rv.zener(3e6, 1e6, 1e5), press, times=3, progress=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     again = rv.open_result(rv.save_result(ds, f"{folder}/contact.nc")).load()
    >>> again.roughvisc.steps.sizes == ds.roughvisc.steps.sizes
    True
    """
    path = path_of(path, "path", "a result (.nc)").expanduser()
    if path.suffix.lower() != ".nc":
        raise InputError(key="path", found=str(path), expected="a name that ends in .nc")
    declared = isinstance(dataset, xr.Dataset) and all(name in VARIABLES for name in dataset.data_vars)
    if not declared or not set(AXES) & set(dataset.dims) or "case" in dataset.dims:
        given = list(dataset.sizes) if isinstance(dataset, xr.Dataset) else dataset
        raise InputError(key="dataset", found=given, expected="a result of one case, as from rv.simulate")
    if gap_part is not None:
        dataset = _with_rounded_gap(dataset, number(gap_part, "1", "gap_part", above=0, most=1))
    return write_result(dataset, path)


def _with_rounded_gap(dataset: xr.Dataset, part: float) -> xr.Dataset:
    """Return a result with the gap of each row as multiples of a power of two below a part of the row's error."""
    if not {"gap", "approach_error"} <= dataset.variables.keys():
        expected = "None, since the result lacks a gap or the stated error of the approach"
        raise InputError(key="gap_part", found=part, expected=expected)
    error = dataset["approach_error"].values
    exponents = np.floor(np.log2(2 * part * error, where=error > 0, out=np.full(error.shape, -np.inf)))
    steps = np.exp2(exponents)[:, None, None]  # rounding is at most half a step; zero: not rounded
    gap = dataset["gap"]
    rounded = np.divide(gap.values, steps, where=steps > 0, out=gap.values.copy())
    rounded = np.where(steps > 0, np.round(rounded) * steps, gap.values)
    stated = gap.attrs | {"rounding": f"at most {part:g} of approach_error"}
    packed = dataset.assign(gap=(gap.dims, rounded, stated))
    packed.encoding = dataset.encoding
    return packed


def _declare(place: netCDF4.Dataset, part: xr.Dataset) -> list[tuple[netCDF4.Variable, xr.Variable]]:
    """Declare the variables of a file or a group; return each with the values to write."""
    place.setncatts(_readable(part.attrs))
    declared = []
    coordinates = {*part.coords}
    labels = [name for name in part.coords if name not in part.dims]
    for name, variable in part.variables.items():
        attributes = dict(variable.attrs)
        if name not in coordinates:  # CF names its coordinates in an attribute
            for label_name in labels:
                if set(part.variables[label_name].dims) <= set(variable.dims):
                    attributes["coordinates"] = f"{attributes.get('coordinates', '')} {label_name}".lstrip()
        if variable.dtype.kind == "U":
            # characters along a dimension, as xarray and CF read text: netCDF4 1.7.5 crashes on strings of any length
            # if a file is open twice and one is closed
            characters = netCDF4.stringtochar(np.char.encode(variable.values, "utf-8", "surrogateescape"))
            variable = xr.Variable((*variable.dims, f"string{characters.shape[-1]}"), characters)
            attributes["_Encoding"] = "utf-8"
        for dimension, size in variable.sizes.items():
            if dimension not in place.dimensions and dimension not in getattr(place.parent, "dimensions", ()):
                place.createDimension(str(dimension), size)
        encoding: dict[str, Any] = {"fill_value": False}
        if variable.dtype.kind == "f" and name in VARIABLES and name not in _COORDINATES:  # may have missing values
            encoding["fill_value"] = variable.dtype.type(np.nan)
        if variable.ndim:
            encoding |= {"chunksizes": chunks(variable.shape), "fletcher32": True}
            if variable.nbytes > _TINY and (name not in _DENSE or "rounding" in attributes):
                encoding |= {"zlib": True, "complevel": 1, "shuffle": name != "pressure"}
        stored = place.createVariable(str(name), variable.dtype, variable.dims, **encoding)
        stored.set_auto_maskandscale(False)
        if "chunksizes" in encoding:  # chunks are written whole; by default the library caches 64 MB per variable
            stored.set_var_chunk_cache(size=math.prod(encoding["chunksizes"]) * variable.dtype.itemsize)
        stored.setncatts(_readable(attributes))
        declared.append((stored, variable))
    return declared


def _readable(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return attributes in which file names of another encoding than the locale's are text in UTF-8."""
    readable = {}
    for name, value in attributes.items():
        is_text = isinstance(value, str)
        readable[name] = value.encode(errors="surrogateescape").decode(errors="backslashreplace") if is_text else value
    return readable


def chunks(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the sides of nearly equal chunks, because a chunk across the border of a field is stored at full size."""
    many = len(shape) > 1 and shape[-2] * shape[-1] > _MANY_CELLS
    fields = _CHUNK_OF_MANY if many else _CHUNK
    longest = fields[-len(shape) :] if len(shape) == 3 or many else (_LONGEST_CHUNK,) * len(shape)
    counts = np.ceil(np.array(shape) / longest)
    return tuple(np.ceil(np.array(shape) / counts).astype(int).tolist())


def _write(stored: netCDF4.Variable, variable: xr.Variable) -> None:
    """Write a variable; a field in layers of one chunk, so that only one layer is in memory."""
    is_field = variable.ndim == 3
    rows, together = (len(variable), chunks(variable.shape)[0]) if is_field else (1, 1)
    for first in range(0, rows, together):
        layer = slice(first, first + together) if is_field else ...
        values = variable[layer].values  # without the lock, because reading the source may need it
        with NETCDF:
            stored[layer] = values
        del values  # frees the memory before the next layer is read


def write_dataset(dataset: xr.Dataset, path: str | Path) -> Path:
    """Write a Dataset other than a result to one NetCDF file atomically."""
    with atomic_write(path) as temporary:
        dataset.to_netcdf(temporary, engine="netcdf4")
    return Path(path)
