"""Thermal and electrical conductance of the contact spots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.labels import label
from roughvisc.observables.frozen import over_frames
from roughvisc.observables.resistivity import Kind, resistivities


def conductance(dataset: xr.Dataset, resistivity: Sequence[float | str], *, kind: Kind | None = None) -> xr.Dataset:
    r"""Conductance of the contact spots at every kept time.

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
        infinite in full contact unless space is free. The attribute ``resistivity`` states those of the two bodies.

    Raises
    ------
    InputError
        If the result holds neither ``pressure`` nor ``gap``, or the resistivities are not two of one kind, not
        negative, and not both zero.

    Notes
    -----
    All spots are at one potential, and far away each body is at its own potential: :math:`G = 2k / (\rho_1 + \rho_2)`
    with the stiffness :math:`k` of a flat punch of the same spots over the contact modulus [1]_; a single disc has
    :math:`4a / (\rho_1 + \rho_2)`. Each body conducts like a half-space, even if it is a sheet. With periodic
    or mirror boundaries the conductance is that of the constriction alone, for these cells; the resistance of the bulk
    is not included. Nothing flows through the gap, and films on the spots have no resistance.

    References
    ----------
    .. [1] J. R. Barber, *Proc. R. Soc. A* 459 (2003) 53-66.
    """
    flows, both = resistivities(resistivity, kind)
    stiffness, error = over_frames(dataset, _punch, outputs=2)
    name, factor = f"{flows}_conductance", 2 / sum(both)
    found = {name: factor * stiffness, f"{name}_error": factor * error}
    described = label(xr.Dataset(found))
    for variable in described.data_vars.values():
        variable.attrs["resistivity"] = list(both)
    return described


def _punch(
    touching: np.ndarray, present: np.ndarray, *, spacing: tuple[float, float], boundary: Any
) -> tuple[float, float]:
    """Stiffness of the spots over the contact modulus, and its error. [m]"""
    from roughvisc.mechanics.transport.spots import frozen_contact  # slow to import

    found = frozen_contact(touching, spacing, boundary, present=present)
    return found.stiffness, found.error
