"""The xarray engine "roughvisc": scans by ``xr.open_dataarray(path, engine="roughvisc")``.

xarray asks every engine whether it can open a file, so importing this module must cost nothing: the readers are
imported when a scan is opened.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import xarray as xr
from xarray.backends import BackendEntrypoint

#: Suffixes of one format each, which nothing but scans has; those that mean other things too are left to ``engine=``.
_SUFFIXES = "x3p sdf al3d sur frt opd opdx datx plux os3d nms vk3 vk4 vk6 vk7 zmg zon ezd nid bcrf gwy lext poir jpk"
UNAMBIGUOUS = frozenset(_SUFFIXES.split())


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
        "grid",
        "no_data",
        "height_scale",
    )

    def open_dataset(
        self,
        filename_or_obj: Any,
        *,
        drop_variables: str | Iterable[str] | None = None,
        **options: Any,
    ) -> xr.Dataset:
        """Read a scan, as :func:`roughvisc.open_scan` does.

        Parameters
        ----------
        filename_or_obj : path
            As :func:`roughvisc.open_scan` takes it.
        drop_variables : str or iterable of str, optional
            Variables to leave out.
        **options
            As for :func:`roughvisc.open_scan`.

        Returns
        -------
        xarray.Dataset
            ``height`` over (x, y). [m]

        Raises
        ------
        InputError
            As :func:`roughvisc.open_scan`.
        """
        from roughvisc.topography.scans import open_scan

        dataset = open_scan(filename_or_obj, **options).to_dataset(name="height")
        dropped = [drop_variables] if isinstance(drop_variables, str) else list(drop_variables or ())
        return dataset.drop_vars(dropped, errors="ignore")

    def guess_can_open(self, filename_or_obj: Any) -> bool:
        """Whether the suffix is that of one scan format and of nothing else."""
        if not isinstance(filename_or_obj, str | os.PathLike):
            return False
        return Path(filename_or_obj).suffix.lower().removeprefix(".") in UNAMBIGUOUS
