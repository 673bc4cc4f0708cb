"""Nominal pressure of a case before it runs, and whether it presses the surface flat."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from roughvisc.mechanics.materials.creep import Material
from roughvisc.mechanics.stepping.program import Program
from roughvisc.topography.grid import nominal_area

#: No full contact is foreseen where a press finds less: theories of roughness do not tell of single indenters.
NEARLY_FULL = 0.9


def border_warning(shape: tuple[int, ...]) -> str:
    """What to say of contact that reaches the border of a free surface of so many cells, where that ends a run."""
    return (
        f"Contact is expected to reach the border of the free-space domain of {shape[0]} x {shape[1]} cells, which "
        "ends a run: use boundary = 'mirror' for a nominally flat scan, a larger surface, a smaller load, or edge = "
        "'accept' to treat the scan outline as a punch."
    )


def largest_pressure(height: xr.DataArray, program: Program, force: float) -> float:
    """Largest nominal pressure that a program comes to; NaN where only its approach is known. [Pa]

    Parameters
    ----------
    height : xarray.DataArray
        The surface. [m]
    program : Program
        What is prescribed.
    force : float
        Largest force of a coarse march, NaN if there was none. [N]
    """
    area = nominal_area(height)
    program = program.on_area(area)
    given = any(segment.control == "load" and segment.end is not None for segment in program.segments)
    return float(np.fmax(program.largest_load if given else math.nan, force)) / area


def full_contact_pressure(slope: float, material: Material, duration: float) -> float:
    r"""Nominal pressure from which on contact is nearly full: on 95 % of the area. [Pa]

    Parameters
    ----------
    slope : float
        Root mean square slope between neighbouring cells. [-]
    material : Material
        Of the half-space.
    duration : float
        Time by which the material has crept. [s]

    Notes
    -----
    Persson's theory of contact has the contact fraction :math:`\mathrm{erf}(\sqrt 2\, p / (E^* h'))` under a nominal
    pressure ``p``, with the root mean square slope ``h'``: 95 % at ``p = E* h'``. Here ``E* = 1 / C(t)`` is that of
    the end of the program, where the material is softest.

    References
    ----------
    B. N. J. Persson, J. Chem. Phys. 115, 3840 (2001).
    """
    compliance = float(material.contact_compliance(duration))
    return slope / compliance if compliance > 0 else math.inf  # nothing has crept yet


def full_contact_warning(pressure: float, full: float) -> str:
    """What to say of a nominal pressure that presses a surface flat; empty if it does not.

    Parameters
    ----------
    pressure, full : float
        Largest nominal pressure; that of nearly full contact, zero for a flat surface. [Pa]
    """
    if not pressure >= full > 0:
        return ""
    return (
        f"Full contact is expected: the nominal pressure comes to {pressure / 1e6:.3g} MPa. At {full / 1e6:.3g} MPa "
        "more than 95 % of the area is in contact (Persson: modulus at the end of the program times rms slope)."
    )
