"""First study of a scan: its pressure, found by pressing the scan on a few cells, and its text with comments."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from roughvisc.experiment.grid_error import coarser
from roughvisc.experiment.profile import Profile
from roughvisc.mechanics.contact.solver import contact_area, solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.materials.models import zener
from roughvisc.paths import shell_word
from roughvisc.topography.conditioning import condition
from roughvisc.topography.grid import rms_slope
from roughvisc.topography.inspection import Inspection
from roughvisc.topography.scans import surface_table, written_quantity

#: Text of a first study, with comments.
TEMPLATE = Path(__file__).with_name("first_study.toml")
#: Its material, a rubber.
RUBBER = zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=1e5)
#: Final contact fraction, unless another is requested.
CONTACT = 0.05
#: Largest number of cells along the longer side for a press, and tolerance of the pressure.
MOST_PRESSED = 256
_TOLERANCE = 1e-2
#: Largest number of presses, accepted relative error of the contact, and largest factor between the pressure and the
#: pressure of a theory: a surface with plateaus has more contact than in theory under any pressure.
_PRESSES = 12
_NEAR = 0.01
_FARTHEST = 100.0
#: Largest relative difference between contact and requested contact without a warning.
_MISSED = 0.2
#: Pressure on a flat scan. [Pa]
_ON_FLAT = 1e3
#: Boundary of the study, for a scan that represents a larger, nominally flat surface.
_BOUNDARIES = {
    "periodic": 'boundary = "periodic"               # the scan stands for a larger, nominally flat surface',
    "mirror": 'boundary = "mirror"                 # opposite borders differ: the scan repeats with its mirror images',
}


class FirstPressure(NamedTuple):
    """Pressure of a first study, and the resulting contact.

    Attributes
    ----------
    pressure : float
        Nominal pressure. [Pa]
    contact, late : float
        Requested contact fraction, and the contact fraction at the end. [-]
    shape : tuple of int
        Numbers of cells of the pressed grid.
    """

    pressure: float
    contact: float
    late: float
    shape: tuple[int, int]

    @property
    def miss(self) -> str:
        """Warning if the contact differs from the requested contact by more than a fifth, else ''."""
        if abs(self.late - self.contact) <= _MISSED * self.contact:
            return ""
        requested = (
            f"{100 * self.late:.2g} % of the area is in contact at the end, {100 * self.contact:.3g} % requested"
        )
        return f"{requested}: the scan is flat, or has plateaus, filled holes or stray points."


def first_pressure(scan: xr.DataArray, found: Inspection, contact: float = CONTACT) -> FirstPressure:
    r"""Return the nominal pressure that finally brings a part of a scan into contact with the rubber of a first study.

    A large scan is pressed on fewer cells, which have a lower root mean square slope. Light contact is proportional to
    the pressure over the slope, so the pressure on fewer cells is reduced by the ratio of the slopes. On self-affine
    surfaces of 500 x 480 cells the contact is within 4 % of the contact in a run on all cells.

    Parameters
    ----------
    scan : xarray.DataArray
        Heights of the scan before conditioning. [m]
    found : Inspection
        Inspection of the scan, with its proposed conditioning.
    contact : float
        Contact fraction to aim at, above 0 and below 1. [-]

    Notes
    -----
    The first guess is :math:`p = f E^* h'_{rms} / 2`. At small loads :math:`A / A_0 = \kappa p / (E^* h'_{rms})`, with
    :math:`\kappa = \sqrt{8 / \pi} = 1.6` in Persson's theory [1]_ and :math:`\sqrt{2 \pi} = 2.5` in the theory of Bush,
    Gibson and Thomas [2]_.

    References
    ----------
    .. [1] B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840.
    .. [2] A. W. Bush, R. D. Gibson, T. R. Thomas, Wear 35 (1975) 87.
    """
    few = condition(scan, found.steps)
    factor = max(few.shape) / MOST_PRESSED
    few = few if factor <= 1 else coarser(few, factor, "free")
    profile = Profile(few, "absent")
    grid = Grid(profile.gap.shape, profile.spacing, found.boundary)
    present = profile.present
    compliance = float(RUBBER.contact_compliance(math.inf))
    slope = found.rms_slope
    share = rms_slope(few) / slope if slope > 0 else 1.0

    def touching(pressure: float) -> float:
        load = share * pressure * profile.area * compliance / grid.cell_area
        pressed = solve_contact(grid, profile.gap, load=load, tolerance=_TOLERANCE, present=present).pressure > 0
        return contact_area(pressed, present & ~pressed, grid.cell_area, found.boundary)[1] / profile.area

    guess = pressure = contact / compliance * slope / 2 or _ON_FLAT
    for _ in range(_PRESSES if slope > 0 else 0):
        ratio = min(contact / max(touching(pressure), contact / 10), 10.0)
        if abs(ratio - 1) < _NEAR:
            break
        pressure = min(max(pressure * ratio, guess / _FARTHEST), guess * _FARTHEST)
    pressure = float(f"{pressure:.2g}")
    return FirstPressure(pressure, contact, touching(pressure), (few.sizes["x"], few.sizes["y"]))


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
    return TEMPLATE.read_text(encoding="utf-8").format(
        title=Path(file).stem.replace("_", " ").replace("\\", "").replace('"', ""),
        name=Path(file).name,
        study=shell_word(Path(Path(study).name)),
        surface=surface_table(file, Path(study).parent, options, found.steps),
        contact=f"{100 * first.contact:.3g}",
        miss=f"# {first.miss}\n" if first.miss else "",
        late=f"{100 * first.late:.2g}",
        pressed=f"{first.shape[0]} x {first.shape[1]}",
        pressure=written_quantity(first.pressure, "Pa"),
        force=written_quantity(first.pressure * found.area, "N", 4),
        boundary=_BOUNDARIES[found.boundary],
    )
