"""Thermal and electrical conductance of the contact spots, and their stiffness against a fast increment of load."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.mechanics.body import HALF_SPACE, Kernel
from roughvisc.mechanics.transport.spots import frozen_contact
from roughvisc.observables.contact import contact
from roughvisc.observables.frames import frame_by_frame
from roughvisc.topography.grid import spacing
from roughvisc.units import Quantity, is_quantity, number

#: Unit of each kind of resistivity.
_UNITS: dict[str, str] = {"thermal": "K m/W", "electrical": "ohm m"}


def conductance(
    dataset: xr.Dataset, resistivity: Sequence[float | str], *, kind: Literal["thermal", "electrical"] | None = None
) -> xr.Dataset:
    r"""Compute the conductance of the contact spots at every kept time.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``.
    resistivity : pair of float or str
        Resistivities of the two bodies; zero for a perfect conductor. The unit of a string determines whether they are
        thermal, such as ``"0.2 K m/W"``, or electrical, such as ``"1.7e-8 ohm m"``. [K m/W] or [ohm m]
    kind : {"thermal", "electrical"}, optional
        Kind of flow if the resistivities are numbers. Default: heat.

    Returns
    -------
    xarray.Dataset
        Over time ``thermal_conductance`` [W/K] or ``electrical_conductance`` [S], and its error. Zero without contact;
        infinite in full contact unless space is free. The attribute ``resistivity`` states both resistivities.

    Raises
    ------
    InputError
        If the result contains neither ``pressure`` nor ``gap``. If there are not two resistivities of one kind, one is
        negative, or both are zero.

    Notes
    -----
    All spots have one potential, and each body is at a constant potential far from the spots. The conductance is
    :math:`G = 2k / (\rho_1 + \rho_2)`, where :math:`k` is the stiffness of a flat punch with the shape of the spots,
    over the contact modulus [1]_; for a single disc :math:`G = 4a / (\rho_1 + \rho_2)`. Each body conducts like a
    half-space, even if it is a sheet. With periodic or mirror boundaries only the constriction resistance of the cells
    of the grid counts, without the resistance of the bulk. Nothing flows through the gap, and films on the spots have
    no resistance.

    References
    ----------
    .. [1] J. R. Barber, *Proc. R. Soc. A* 459 (2003) 53-66.
    """
    if isinstance(resistivity, str) or not isinstance(resistivity, Sequence) or len(resistivity) != 2:
        wanted = 'a list of two, one of each body, in K m/W or, as strings such as "2e-8 ohm m" or with kind, in ohm m'
        raise InputError(key="resistivity", found=resistivity, expected=wanted)
    if one_of("kind", kind, (None, *_UNITS)) is None:
        texts = [one for one in resistivity if isinstance(one, str) and not is_quantity(one, "1")]
        kind = "electrical" if any(is_quantity(one, _UNITS["electrical"]) for one in texts) else "thermal"
    both = [number(one, _UNITS[kind], "resistivity") for one in resistivity]
    if min(both) < 0 or sum(both) == 0:
        raise InputError(key="resistivity", found=resistivity, expected="none below zero, and not both zero")
    stiffness, error = _frozen(dataset, HALF_SPACE)
    name, factor = f"{kind}_conductance", 2 / sum(both)
    described = label(xr.Dataset({name: factor * stiffness, f"{name}_error": factor * error}))
    for variable in described.data_vars.values():
        variable.attrs["resistivity"] = both
    return described


def incremental_stiffness(
    dataset: xr.Dataset, contact_modulus: Quantity, *, kernel: Kernel | None = None
) -> xr.Dataset:
    r"""Compute the stiffness of the contact for a fast increment of load at constant contact area.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``.
    contact_modulus : float or str
        Contact modulus of the increment, :math:`E^* = 2G/(1-\nu)`: its complex magnitude for a small oscillation, the
        relaxed modulus for a slow increment that does not change the area, the instantaneous modulus :math:`1/C(0)` for
        a fast one. [Pa]
    kernel : Kernel, optional
        Kernel of the body if it is not a half-space, such as ``rv.sheet(material, thickness).kernel``.

    Returns
    -------
    xarray.Dataset
        ``incremental_stiffness`` [N/m] and ``frozen_stiffness`` [m], the former over the contact modulus, each with its
        error, over time. Without contact they are zero.

    Raises
    ------
    InputError
        If the result contains neither ``pressure`` nor ``gap``. If its body is not a half-space and no kernel is given.
        If the modulus is not positive.

    Notes
    -----
    An increment of load increases the pressure like a flat punch with the shape of the contact, because the pressure at
    a growing edge is zero. The approach is defined as in results: with periodic boundaries on a half-space it is
    measured to the mean plane. :mod:`roughvisc.mechanics.transport.spots` describes the grid error.
    """
    if kernel is None and (named := {"kernel", "thickness"} & dataset.attrs.keys()):
        name = min(named)
        raise InputError(
            key="kernel", found=dataset.attrs[name], expected=f"the kernel of the body, because it has a {name}"
        )
    modulus = number(contact_modulus, "Pa", "contact_modulus", above=0)
    stiffness, error = _frozen(dataset, kernel or HALF_SPACE)
    found = {
        "incremental_stiffness": stiffness * modulus,
        "incremental_stiffness_error": error * modulus,
        "frozen_stiffness": stiffness,
        "frozen_stiffness_error": error,
    }
    return label(xr.Dataset(found))


def _frozen(dataset: xr.Dataset, kernel: Kernel) -> Any:
    """Return the stiffness of the contact over the contact modulus, and its error, at every kept time. [m]"""
    touching = contact(dataset)
    present = dataset["height"].notnull() if "height" in dataset else xr.ones_like(touching)
    cells, boundary = spacing(dataset, "spots"), dataset.attrs.get("boundary", "free")

    def measure(touching: np.ndarray, present: np.ndarray) -> tuple[float, float]:
        found = frozen_contact(touching, cells, boundary, present=present, kernel=kernel)
        return found.stiffness, found.error

    return frame_by_frame(measure, touching, present, outputs=[(), ()])
