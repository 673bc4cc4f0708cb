"""The xarray engine "roughvisc": instrument files opened lazily, by ``xr.open_dataarray(path, engine="roughvisc")``.

xarray asks every engine whether it can open a file, so importing this module must cost nothing: the readers are
imported when a scan is opened.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray, BackendEntrypoint
from xarray.core import indexing

from roughvisc.errors import InputError

#: Suffixes of one format each, which nothing but scans has; those that mean other things too are left to ``engine=``.
_SUFFIXES = "x3p sdf al3d sur frt opd opdx datx plux os3d nms vk3 vk4 vk6 vk7 zmg zon ezd nid bcrf gwy lext poir jpk"
UNAMBIGUOUS = frozenset(_SUFFIXES.split())


class ScanArray(BackendArray):
    """Heights that are read when they are asked for, from a file that is opened each time.

    It holds what names the heights, and no open file: it pickles, and may be read in threads and processes.

    Parameters
    ----------
    path : str
        The scan.
    options : dict
        ``format``, ``channel``, ``unit``, ``height_unit`` and ``spacing`` of :func:`roughvisc.open_scan`.
    shape : tuple of int
        Cells ``(nx, ny)``.
    checksum : str
        SHA-256 of the file as it was when it was opened first.
    """

    def __init__(self, path: str, options: dict[str, Any], shape: tuple[int, int], checksum: str) -> None:
        self.path, self.options, self.shape, self.checksum = path, options, shape, checksum
        self.dtype = np.dtype(float)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.BASIC, self._read)

    def _read(self, key: tuple[int | slice, ...]) -> np.ndarray:
        from roughvisc.topography.scans import open_scan

        h = open_scan(self.path, **self.options)
        if h.attrs["source_sha256"] != self.checksum:
            raise InputError(f"{self.path}: the file was changed since it was opened: expected to open it again")
        return h.values[key]


class RoughviscBackend(BackendEntrypoint):
    """Instrument files, grid files and surface cards as a Dataset with the variable ``height`` over (x, y)."""

    description = "Scans of surfaces: X3P, SDF and the instrument formats that SurfaceTopography reads"
    open_dataset_parameters = (
        "filename_or_obj",
        "drop_variables",
        "format",
        "channel",
        "unit",
        "height_unit",
        "spacing",
    )

    def open_dataset(
        self,
        filename_or_obj: Any,
        *,
        drop_variables: str | Iterable[str] | None = None,
        format: str | None = None,
        channel: int | str | None = None,
        unit: str | None = None,
        height_unit: str | None = None,
        spacing: float | tuple[float, float] | None = None,
    ) -> xr.Dataset:
        """The header of a scan; its heights are read when they are used.

        Parameters
        ----------
        filename_or_obj : path
            As :func:`roughvisc.open_scan` takes it.
        drop_variables : str or iterable of str, optional
            Variables to leave out.
        format, channel, unit, height_unit, spacing : optional
            As for :func:`roughvisc.open_scan`.

        Returns
        -------
        xarray.Dataset
            ``height`` over (x, y), with the attributes that :func:`roughvisc.open_scan` gives. [m] A surface card,
            which says what is done to the heights, is read at once.

        Raises
        ------
        InputError
            As :func:`roughvisc.open_scan`; what is wrong with the heights themselves shows when they are read.
        """
        from roughvisc.topography.scans import outline

        options = {"format": format, "channel": channel, "unit": unit, "height_unit": height_unit, "spacing": spacing}
        h = outline(filename_or_obj, **options)
        if "card" not in h.attrs:
            path = os.path.abspath(os.fspath(filename_or_obj))  # for a process that works in another folder
            heights = ScanArray(path, options, h.shape, h.attrs["source_sha256"])
            lazily = xr.Variable(("x", "y"), indexing.LazilyIndexedArray(heights), h.attrs)
            lazily.encoding["preferred_chunks"] = dict(h.sizes)  # a file is read whole
            dataset = xr.Dataset({"height": lazily}, coords=h.coords)
        else:
            dataset = h.to_dataset(name="height")
        dropped = [drop_variables] if isinstance(drop_variables, str) else list(drop_variables or ())
        return dataset.drop_vars(dropped, errors="ignore")

    def guess_can_open(self, filename_or_obj: Any) -> bool:
        """Whether the suffix is that of one scan format and of nothing else."""
        if not isinstance(filename_or_obj, str | os.PathLike):
            return False
        return Path(filename_or_obj).suffix.lower().removeprefix(".") in UNAMBIGUOUS
