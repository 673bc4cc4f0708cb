"""NetCDF files as xarray Datasets in any thread: no file stays open, and none is touched outside netCDF's lock.

xarray's own engine reads under that lock, but opens and closes files outside it, and netCDF-4 does not stand that.
"""

from __future__ import annotations

import os
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
from roughvisc.groups import carrying
from roughvisc.study.storage.checksum import verify_checksum

#: End of the name of the borders of cells in a file; a Dataset has none, its cells are all alike.
BOUNDS = "_bounds"


def read_variable(path: str, name: str, key: Any) -> NDArray[Any]:
    """Part of a variable of a result, as it is stored.

    Raises
    ------
    InputError
        If the file is damaged, gone, or holds no such variable.
    """
    verify_checksum(Path(path))
    try:
        with NETCDF, netCDF4.Dataset(path) as file:
            file.set_auto_maskandscale(False)
            return np.asarray(file[name][key])
    except (OSError, RuntimeError, LookupError) as error:
        raise InputError(
            f"{path}: its {name} cannot be read ({error}): the file is damaged; run its study again"
        ) from error


class ResultBackend(BackendEntrypoint):
    """Fields over x and y are read when they are asked for, all else at once; the root carries the groups."""

    def open_dataset(self, filename_or_obj: Any, *, drop_variables: Any = None) -> xr.Dataset:
        """As xarray's engine ``netcdf4`` opens it, durations as plain numbers."""
        path = os.path.abspath(os.fspath(filename_or_obj))  # for a process that works in another folder
        with NETCDF, netCDF4.Dataset(path) as file:
            file.set_auto_maskandscale(False)
            file.set_auto_chartostring(False)
            root, groups = _dataset(path, file), {name: _dataset(path, one) for name, one in file.groups.items()}
        return carrying(root.drop_vars(drop_variables or (), errors="ignore"), groups)


def _dataset(path: str, file: netCDF4.Dataset) -> xr.Dataset:
    """The variables of a file, or of a group of it."""
    variables = {name: _variable(path, variable) for name, variable in file.variables.items()}
    for axis in [name for name, one in variables.items() if one.attrs.get("bounds") == f"{name}{BOUNDS}"]:
        variables.pop(variables[axis].attrs.pop("bounds"), None)
    attributes = {name: file.getncattr(name) for name in file.ncattrs()}
    decoded = xr.decode_cf(xr.Dataset(variables, attrs=attributes), decode_timedelta=False)
    texts = {name: one.astype(str) for name, one in decoded.coords.items() if one.dtype.kind == "O"}
    return decoded.assign_coords(texts)


def _variable(path: str, stored: netCDF4.Variable) -> xr.Variable:
    attributes = {name: stored.getncattr(name) for name in stored.ncattrs()}
    lazily = stored.dimensions[-2:] == ("x", "y")
    data = indexing.LazilyIndexedArray(_Field(path, stored)) if lazily else np.asarray(stored[...])
    filters = stored.filters() or {}
    encoding = {name: filters[name] for name in ("zlib", "complevel", "shuffle") if name in filters}
    chunks = stored.chunking()
    encoding |= {"contiguous": True} if chunks == "contiguous" else {"chunksizes": tuple(chunks or ())}
    return xr.Variable(stored.dimensions, data, attributes, encoding)


class _Field(BackendArray):
    """A variable whose file is opened each time: it pickles, and may be read in threads and processes."""

    def __init__(self, path: str, stored: netCDF4.Variable) -> None:
        self.path, self.name = path, stored.name
        self.shape, self.dtype = stored.shape, stored.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> NDArray[Any]:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._read)

    def _read(self, key: tuple[Any, ...]) -> NDArray[Any]:
        return read_variable(self.path, self.name, key)
