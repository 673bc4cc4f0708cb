"""Thermal and electrical conductance of the contact spots."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.mechanics.transport.spots import frozen_contact
from roughvisc.observables.contact import contact
from roughvisc.observables.frames import frame_by_frame
from roughvisc.topography.grid import spacing
from roughvisc.units import is_quantity, number

#: Unit of each kind of resistivity.
_UNITS: dict[str, str] = {"thermal": "K m/W", "electrical": "ohm m"}


def conductance(dataset: xr.Dataset, resistivity: Sequence[float | str]) -> xr.Dataset:
    r"""Compute the conductance of the contact spots at every kept time.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``.
    resistivity : pair of float or str
        Resistivities of the two bodies; zero for a perfect conductor. Numbers are thermal. The unit of a string
        determines whether they are thermal, such as ``"0.2 K m/W"``, or electrical, such as ``"1.7e-8 ohm m"``.
        [K m/W] or [ohm m]

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
        wanted = 'a list of two, one of each body, in K m/W or, as strings such as "2e-8 ohm m", in ohm m'
        raise InputError(key="resistivity", found=resistivity, expected=wanted)
    texts = [one for one in resistivity if isinstance(one, str) and not is_quantity(one, "1")]
    kind = "electrical" if any(is_quantity(one, _UNITS["electrical"]) for one in texts) else "thermal"
    both = [number(one, _UNITS[kind], "resistivity") for one in resistivity]
    if min(both) < 0 or sum(both) == 0:
        raise InputError(key="resistivity", found=resistivity, expected="none below zero, and not both zero")
    touching = contact(dataset)
    present = dataset["height"].notnull() if "height" in dataset else xr.ones_like(touching)
    cells, boundary = spacing(dataset, "spots"), dataset.attrs.get("boundary", "free")

    def measure(touching: np.ndarray, present: np.ndarray) -> tuple[float, float]:
        return frozen_contact(touching, cells, boundary, present=present)

    stiffness, error = frame_by_frame(measure, touching, present, outputs=[(), ()])
    name, factor = f"{kind}_conductance", 2 / sum(both)
    described = label(xr.Dataset({name: factor * stiffness, f"{name}_error": factor * error}))
    for variable in described.data_vars.values():
        variable.attrs["resistivity"] = both
    return described
