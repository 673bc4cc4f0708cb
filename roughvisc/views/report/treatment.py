"""Provenance of a surface: the conditioning between scan and contact, read from a result."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from roughvisc.errors import InputError
from roughvisc.study.case import Case
from roughvisc.topography.scans import is_card, open_card, raw_height

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Treatment:
    """A surface before and after.

    Attributes
    ----------
    steps : tuple of str
        What the result's history says of the surface, in order.
    before : xarray.DataArray or None
        Heights as measured or made; None where they cannot be had again, or two faces are pressed. [m]
    after : xarray.DataArray
        Heights as they were pressed. [m]
    """

    steps: tuple[str, ...]
    before: xr.DataArray | None
    after: xr.DataArray


def treatment(dataset: xr.Dataset) -> Treatment:
    """Treatment of the surface of a result.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result, with ``height``. Its scan is opened again if it is where it was, and unchanged.
    """
    lines = str(dataset.attrs.get("history", "")).splitlines()
    steps = tuple(line for line in lines if line and ": run of " not in line)
    return Treatment(steps, _measured(dataset), dataset["height"].copy(deep=False).load())  # not kept by the result


def _measured(dataset: xr.Dataset) -> xr.DataArray | None:
    """Heights before any conditioning, if what they come from still has the checksum of the result."""
    if "case" not in dataset.attrs:
        return None
    try:
        case = Case.from_json(dataset.attrs["case"])
        if case.surface_sha256 != dataset.attrs.get("surface_sha256"):
            return None
        if "second" in case.surface:
            return None
        path = case.surface.get("file")
        if path is not None and is_card(Path(path), case.surface.get("format")):
            return open_card(Path(path), conditioned=False)
        return raw_height("surface", case.surface)
    except (InputError, OSError):
        return None
