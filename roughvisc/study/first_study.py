"""First study of a scan: its pressure, found by pressing the scan on a few cells, and its text with comments."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from roughvisc.experiment.coarser import coarser
from roughvisc.experiment.profile import Profile
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.contact.neighbours import contact_area
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.materials.models import zener
from roughvisc.topography.conditioning import condition
from roughvisc.topography.inspection import Inspection
from roughvisc.topography.parameters import rms_slope
from roughvisc.topography.writers import surface_table, written_quantity

#: The material of a first study: a rubber. [Pa, Pa, Pa s]
SHEAR_MODULUS, KELVIN_MODULUS, KELVIN_VISCOSITY = 3e6, 1e6, 1e5
#: Final contact fraction, unless another is requested.
CONTACT = 0.05
#: Number of points above which the study proposes a coarser grid for the first run.
_LARGE = 400_000
#: Largest number of cells along the longer side for a press, and tolerance of the pressure.
MOST_PRESSED, _TOLERANCE = 256, 1e-2
#: Largest number of presses, accepted relative error of the contact, and largest factor between the pressure and the
#: pressure of a theory: a surface with plateaus has more contact than in theory under any pressure.
_PRESSES, _NEAR, _FARTHEST = 12, 0.01, 100.0
#: Pressure on a flat scan. [Pa]
_ON_FLAT = 1e3


@dataclass(frozen=True)
class FirstPressure:
    """Pressure of a first study, and the resulting contact.

    Attributes
    ----------
    pressure : float
        Nominal pressure. [Pa]
    contact : float
        Requested final contact fraction. [-]
    late, early : float
        Contact fractions at the end and immediately after loading. [-]
    shape : tuple of int
        Numbers of cells of the pressed grid.
    """

    pressure: float
    contact: float
    late: float
    early: float
    shape: tuple[int, int]


_REMARKS = {
    "crop": "the largest part without large holes",
    "level": "subtracts the mean (0), a plane (1) or plane and curvature (2)",
    "outliers": "spikes become missing points",
    "fill": "missing points are filled in; the result keeps their mask",
    "filter": "shorter wavelengths are noise",
}
#: Boundary of the study, for a scan that represents a larger, nominally flat surface.
_BOUNDARIES = {
    "periodic": 'boundary = "periodic"               # the scan stands for a larger, nominally flat surface',
    "mirror": 'boundary = "mirror"                 # opposite borders differ: the scan repeats with its mirror images',
}


def first_pressure(scan: xr.DataArray, found: Inspection, contact: float = CONTACT) -> FirstPressure:
    """Return the nominal pressure that finally brings a part of a scan into contact with the rubber of a first study.

    A large scan is pressed on fewer cells, which have a lower root mean square slope. Light contact is proportional to
    the pressure over the slope (:func:`pressure_for`), so the pressure on fewer cells is
    reduced by the ratio of the slopes. On self-affine surfaces of 500 x 480 cells the contact is within 4 % of the
    contact in a run on all cells.

    Parameters
    ----------
    scan : xarray.DataArray
        Heights of the scan before conditioning. [m]
    found : Inspection
        Inspection of the scan, with its proposed conditioning.
    contact : float
        Contact fraction to aim at, above 0 and below 1. [-]
    """
    few = condition(scan, found.steps)
    factor = max(few.shape) / MOST_PRESSED
    few = few if factor <= 1 else coarser(few, factor, "free")
    slope, profile = rms_slope(few), Profile(few, "absent")
    grid, present = Grid(profile.gap.shape, profile.spacing, found.boundary), profile.present
    rubber = zener(SHEAR_MODULUS, KELVIN_MODULUS, KELVIN_VISCOSITY)
    early, late = (float(rubber.contact_compliance(time)) for time in (0.0, math.inf))
    share = slope / found.rms_slope if found.rms_slope > 0 else 1.0

    def touching(pressure: float, compliance: float) -> float:
        load = share * pressure * profile.area * compliance / grid.cell_area
        pressed = solve_contact(grid, profile.gap, load=load, tolerance=_TOLERANCE, present=present).pressure > 0
        free, periodic = present & ~pressed, found.boundary == "periodic"
        return contact_area(pressed, free, grid.cell_area, periodic)[1] / profile.area

    guess = pressure = pressure_for(contact, 1 / late, found.rms_slope) or _ON_FLAT
    for _ in range(_PRESSES if found.rms_slope > 0 else 0):
        ratio = min(contact / max(touching(pressure, late), contact / 10), 10.0)
        if abs(ratio - 1) < _NEAR:
            break
        pressure = min(max(pressure * ratio, guess / _FARTHEST), guess * _FARTHEST)
    pressure = float(f"{pressure:.2g}")
    shape = (few.sizes["x"], few.sizes["y"])
    return FirstPressure(pressure, contact, touching(pressure, late), touching(pressure, early), shape)


def starter_study(
    file: str | os.PathLike[str],
    study: str | os.PathLike[str],
    options: Mapping[str, Any],
    found: Inspection,
    first: FirstPressure,
) -> str:
    """Return the TOML text of a study of a scan pressed on a rubber, for the user to run and change.

    Parameters
    ----------
    file : path
        The scan.
    study : path
        File of the study.
    options : mapping
        ``format``, ``channel``, ``unit`` and ``spacing`` [m] for opening the file; None for options that the file does
        not need.
    found : Inspection
        Inspection of the scan.
    first : FirstPressure
        Pressure of the scan, and its contact.
    """
    surface = surface_table(file, Path(study).parent, options, found.steps, _REMARKS)
    if math.prod(found.shape) > _LARGE:
        coarse = [max(16, n // 2) for n in found.shape]
        surface += f"# resample = {coarse}{' ' * 4}# fewer cells: for a quick trial, not for final results\n"
    return _TEXT.format(
        title=Path(file).stem.replace("_", " ").replace("\\", "").replace('"', ""),
        name=Path(file).name,
        study=Path(study).name,
        surface=surface,
        shear=written_quantity(SHEAR_MODULUS, "Pa"),
        kelvin=written_quantity(KELVIN_MODULUS, "Pa"),
        viscosity=written_quantity(KELVIN_VISCOSITY, "Pa") + " s",
        contact=f"{100 * first.contact:.3g}",
        late=f"{100 * first.late:.2g}",
        early=f"{100 * first.early:.2g}",
        pressed=f"{first.shape[0]} x {first.shape[1]}",
        pressure=written_quantity(first.pressure, "Pa"),
        force=written_quantity(first.pressure * found.area, "N", 4),
        boundary=_BOUNDARIES[found.boundary],
    )


def pressure_for(fraction: float, modulus: float, rms_slope: float) -> float:
    r"""Return the nominal pressure that brings a small fraction of a rough surface into contact, to two digits.

    Parameters
    ----------
    fraction : float
        Real over nominal contact area, well below one. [-]
    modulus : float
        Contact modulus :math:`E^* = E / (1 - \nu^2)`. [Pa]
    rms_slope : float
        Root mean square slope of the surface. [-]

    Returns
    -------
    float
        :math:`p = f E^* h'_{rms} / 2`. [Pa]

    Notes
    -----
    At small loads :math:`A / A_0 = \kappa p / (E^* h'_{rms})`, with :math:`\kappa = \sqrt{8 / \pi} = 1.6` in Persson's
    theory [1]_ and :math:`\sqrt{2 \pi} = 2.5` in the theory of Bush, Gibson and Thomas [2]_. This function uses 2.

    References
    ----------
    .. [1] B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840.
    .. [2] A. W. Bush, R. D. Gibson, T. R. Thomas, Wear 35 (1975) 87.

    Examples
    --------
    >>> pressure_for(0.05, 3e6, 0.1)
    7500.0
    """
    return float(f"{fraction * modulus * rms_slope / 2:.2g}")


_TEXT = """\
# First study of {name}: pressed on a rubber, and held while the contact creeps.
#   roughvisc plan {study}     expected contact, time and memory
#   roughvisc run {study}      results and figures, in the folder results/ next to it
# Quantities are numbers in SI, or texts with a unit. An invalid value is reported with its key.
title = "{title} on a rubber"

{surface}
[material]                          # a spring in series with a Kelvin element; enter your own material
model = "zener"
shear_modulus = "{shear}"             # instantaneous
kelvin_modulus = "{kelvin}"            # softer at long times ...
kelvin_viscosity = "{viscosity}"      # ... after some 0.1 s: viscosity over modulus
poisson = 0.5

# This pressure brings about {contact} % of the area into contact at the end (roughvisc new --contact "{contact} %").
# Elastic solutions on {pressed} cells give {late} % with the final modulus and {early} % with the initial modulus.
[[program]]
pressure = "{pressure}"  # nominal: {force} over the whole surface
over = "50 ms"                      # a linear ramp

[[program]]
hold = "0.95 s"                     # ten times the retardation time

[solve]
{boundary}
tolerance = 1e-2                    # relative error of pressure, force and approach; 1e-3 for final results

[keep]
fields = ["pressure", "gap"]
times = ["10 ms", "25 ms", "50 ms", "0.1 s", "0.15 s", "0.2 s", "0.3 s", "0.5 s", "1 s"]
"""
