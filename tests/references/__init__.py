"""Closed forms and independent solutions that only the tests compare the solver with."""

from references.cylinder import SlidingCylinder, sliding_cylinder
from references.fixed_contact import (
    full_contact_wave,
    punch_approach,
    punch_dissipation,
    punch_force,
    sticking_stiffness,
)
from references.layer import ElasticLayer
from references.reduction import ContactHistory, reduced_contact
from references.sheet import OnSheet, PunchOnSheet
from references.single_maximum import SingleMaximum, ting
from references.special_growth import KelvinVoigtStep, PowerLawRamp, kelvin_voigt_step, power_law_ramp

__all__ = [
    "ContactHistory",
    "ElasticLayer",
    "KelvinVoigtStep",
    "OnSheet",
    "PowerLawRamp",
    "PunchOnSheet",
    "SingleMaximum",
    "SlidingCylinder",
    "full_contact_wave",
    "kelvin_voigt_step",
    "power_law_ramp",
    "punch_approach",
    "punch_dissipation",
    "punch_force",
    "reduced_contact",
    "sliding_cylinder",
    "sticking_stiffness",
    "ting",
]
