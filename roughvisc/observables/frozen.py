"""The contact at a kept time with its area frozen: its stiffness against a fast increment."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.observables.derived import frame_by_frame, material_of
from roughvisc.observables.spots import contact
from roughvisc.topography.grid import spacing
from roughvisc.units import quantity


def incremental_stiffness(
    dataset: xr.Dataset, *, contact_modulus: float | str | None = None, kernel: Any = None
) -> xr.Dataset:
    r"""Stiffness of the contact for a fast increment of load at constant contact area.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``.
    contact_modulus : float or str, optional
        Contact modulus of the increment, :math:`E^* = 2G/(1-\nu)`: its complex magnitude for a small oscillation, the
        relaxed modulus for a slow increment that does not change the area. Default: the instantaneous modulus,
        :math:`1/C(0)`, of the material in the case of the result. [Pa]
    kernel : Kernel, optional
        Kernel of the body; default: that of the result, a half-space or a sheet.

    Returns
    -------
    xarray.Dataset
        ``incremental_stiffness`` [N/m] and ``frozen_stiffness`` [m], the former over the contact modulus, each with its
        error, over time. Without contact they are zero. If the material has no instantaneous compliance, the former is
        missing, because a jump of approach would need an infinite force.

    Raises
    ------
    InputError
        If the result holds neither ``pressure`` nor ``gap``, or states no material or body and none is given.

    Notes
    -----
    An increment of load increases the pressure like a flat punch with the shape of the contact, because the pressure at
    a growing edge is zero. The approach is defined as in results: with periodic boundaries on a half-space it is
    measured to the mean plane. :mod:`roughvisc.mechanics.transport.spots` describes the grid error.
    """
    stiffness, error = over_frames(dataset, partial(_stiffness, kernel=_kernel_of(dataset, kernel)), outputs=2)
    modulus = (
        _modulus_at_once(dataset) if contact_modulus is None else quantity(contact_modulus, "Pa", "contact_modulus")
    )
    if not (modulus > 0 or np.isnan(modulus)):
        raise InputError(f"contact_modulus is {contact_modulus!r}: expected a positive number [Pa]")
    found = {
        "incremental_stiffness": stiffness * modulus,
        "incremental_stiffness_error": error * modulus,
        "frozen_stiffness": stiffness,
        "frozen_stiffness_error": error,
    }
    return label(xr.Dataset(found))


def over_frames(dataset: xr.Dataset, measure: Callable[..., tuple[float, ...]], outputs: int) -> Any:
    """What a function of contact, present cells, spacing and boundary gives of every frame; lazily on Dask."""
    touching = contact(dataset)
    present = dataset["height"].notnull() if "height" in dataset else xr.ones_like(touching)
    boundary = dataset.attrs.get("boundary", "free")
    of_frame = partial(measure, spacing=spacing(dataset, "spots"), boundary=boundary)
    return frame_by_frame(of_frame, touching, present, outputs=outputs)


def _stiffness(
    touching: np.ndarray, present: np.ndarray, *, spacing: tuple[float, float], boundary: Any, kernel: Any
) -> tuple[float, float]:
    from roughvisc.mechanics.transport.spots import frozen_contact  # slow to import

    options = {} if kernel is None else {"kernel": kernel}
    found = frozen_contact(touching, spacing, boundary, present=present, **options)
    return found.stiffness, found.error


def _kernel_of(dataset: xr.Dataset, kernel: Any) -> Any:
    """Kernel of the body of a result; None: a half-space."""
    if kernel is not None:
        return kernel
    attributes = dataset.attrs
    if "kernel" in attributes:
        raise InputError(f"the result is of the kernel {attributes['kernel']}: give kernel=")
    if "thickness" not in attributes:
        return None
    from roughvisc.mechanics.sheet import sheet

    material = material_of(dataset, "the result is of a sheet and does not record its material: give kernel=")
    return sheet(material, float(attributes["thickness"]), attributes["base"]).kernel


def _modulus_at_once(dataset: xr.Dataset) -> float:
    """Contact modulus at once, of the material in the attributes; NaN where that gives way at once by nothing. [Pa]"""
    missing = "the result does not record its material: give contact_modulus= [Pa]"
    compliance = float(material_of(dataset, missing).contact_compliance(0.0))
    return 1 / compliance if compliance > 0 else np.nan
