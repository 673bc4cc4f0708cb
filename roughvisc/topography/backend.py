"""xarray engine "roughvisc": ``xr.open_dataarray(path, engine="roughvisc")`` opens a scan.

xarray asks every engine whether it can open a file, so importing this module must cost nothing: the readers are
imported when a scan is opened.
"""

from __future__ import annotations

from typing import Any

import xarray as xr
from xarray.backends import BackendEntrypoint


class RoughviscBackend(BackendEntrypoint):
    """Scan files and surface cards as a Dataset with the variable ``height`` over (x, y)."""

    description = "Scans of surfaces: X3P, SDF and the instrument formats that SurfaceTopography reads"
    open_dataset_parameters = ("filename_or_obj", "drop_variables")

    def open_dataset(self, filename_or_obj: Any, *, drop_variables: Any = None, **options: Any) -> xr.Dataset:
        """Read a scan with the options of :func:`roughvisc.open_scan`, and drop `drop_variables`."""
        from roughvisc.topography.scans import open_scan

        dataset = open_scan(filename_or_obj, **options).to_dataset(name="height")
        return dataset.drop_vars(drop_variables or [], errors="ignore")
