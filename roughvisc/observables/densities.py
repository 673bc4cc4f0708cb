"""Distributions of pressure and gap over the cells."""

from __future__ import annotations

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.observables.derived import frame_by_frame, need
from roughvisc.units import quantities


def _bin_edges(field: xr.DataArray, bins) -> np.ndarray:
    if not np.isscalar(bins):
        given = np.asarray(bins, dtype=float)
        if given.ndim != 1 or len(given) < 2 or not np.all(np.diff(given) > 0):
            raise InputError("bin edges must increase, and be two or more")
        return given
    largest = float(frame_by_frame(lambda values: np.fmax.reduce(values, axis=None), field).max())
    return np.linspace(0.0, largest if largest > 0 else 1.0, int(bins) + 1)


def _density(field: xr.DataArray, bins, name: str) -> xr.Dataset:
    """Probability density of the positive values of a field, frame by frame."""
    limits = _bin_edges(field, bins)

    def measure(frame):
        values = frame[frame > 0]
        inside = np.histogram(values, limits)[0]
        return inside / (values.size * np.diff(limits)) if values.size else np.full(len(limits) - 1, np.nan)

    dim = f"{name}_bin"
    density = frame_by_frame(measure, field, over=(dim, len(limits) - 1))
    return label(xr.Dataset({f"{name}_density": density}).assign_coords({dim: (dim, (limits[1:] + limits[:-1]) / 2)}))


@quantities(bins="Pa")
def pressure_distribution(dataset: xr.Dataset, bins=60) -> xr.Dataset:
    """Probability density of the pressure over the cells in contact.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure``.
    bins : int, or array_like of float or str
        Number of equal bins from zero to the largest pressure at all times (which is read immediately), or their edges.
        [Pa]

    Returns
    -------
    xarray.Dataset
        ``pressure_density`` over time and ``pressure_bin``; missing while there is no contact. [1/Pa]

    Raises
    ------
    InputError
        If the result holds no ``pressure``, or edges do not increase.
    """
    need(dataset, "pressure")
    return _density(dataset["pressure"], bins, "pressure")


@quantities(bins="m")
def gap_distribution(dataset: xr.Dataset, bins=60) -> xr.Dataset:
    """Probability density of the gap over the present cells out of contact.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``gap``.
    bins : int, or array_like of float or str
        Number of equal bins from zero to the largest gap at all times (which is read immediately), or their edges. [m]

    Returns
    -------
    xarray.Dataset
        ``gap_density`` over time and ``gap_bin``; missing in full contact. [1/m]

    Raises
    ------
    InputError
        If the result holds no ``gap``, or edges do not increase.
    """
    need(dataset, "gap")
    return _density(dataset["gap"], bins, "gap")
