"""Closed forms and independent solutions that only the tests compare the solver with."""

from references.cylinder import sliding_cylinder
from references.half_space import (
    Cone,
    Paraboloid,
    StepLoad,
    lee_radok_step,
    pressure_of_springs,
    punch_approach,
    punch_dissipation,
    punch_force,
    reduced_contact,
    relaxation_spectrum,
)
from references.layered import ElasticLayer, OnSheet, PunchOnSheet

__all__ = [
    "Cone",
    "ElasticLayer",
    "OnSheet",
    "Paraboloid",
    "PunchOnSheet",
    "StepLoad",
    "lee_radok_step",
    "pressure_of_springs",
    "punch_approach",
    "punch_dissipation",
    "punch_force",
    "reduced_contact",
    "relaxation_spectrum",
    "sliding_cylinder",
]
