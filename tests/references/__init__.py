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

__all__ = [
    "ContactHistory",
    "ElasticLayer",
    "OnSheet",
    "PunchOnSheet",
    "SingleMaximum",
    "SlidingCylinder",
    "full_contact_wave",
    "punch_approach",
    "punch_dissipation",
    "punch_force",
    "reduced_contact",
    "sliding_cylinder",
    "sticking_stiffness",
    "ting",
]
