"""Analytic solutions of frictionless normal contact: the references that the numerical solver is tested against.

Elastic solutions take the contact modulus ``E* = 2 G / (1 - nu) = E / (1 - nu^2)``; viscoelastic ones take a
material with the contact compliance ``C(t)``, which is ``1 / E*`` of an elastic one.
"""

from roughvisc.mechanics.bodies.sheet import Sheet
from roughvisc.mechanics.closed_forms.adhesion import (
    adhesive_load,
    conformal_energy,
    pull_off_force,
    punch_pull_off,
    rough_attraction,
    tabor_parameter,
)
from roughvisc.mechanics.closed_forms.cylinder import SlidingCylinder, sliding_cylinder
from roughvisc.mechanics.closed_forms.elastic import (
    AxisymmetricContact,
    FlatPunchContact,
    WavyContact,
    flat_punch,
    full_contact_pressure,
    hertz,
    johnson_greenwood_higginson,
    sneddon_cone,
    westergaard,
)
from roughvisc.mechanics.closed_forms.fixed_contact import (
    full_contact_wave,
    punch_approach,
    punch_dissipation,
    punch_force,
    westergaard_half_width,
)
from roughvisc.mechanics.closed_forms.growing_contact import (
    ContactRelaxation,
    GrowingContact,
    KelvinVoigtStep,
    PowerLawRamp,
    StepLoad,
    hereditary_integral,
    kelvin_voigt_step,
    lee_radok,
    lee_radok_step,
    power_law_ramp,
)
from roughvisc.mechanics.closed_forms.indenters import Cone, Indenter, Paraboloid, punch_pressure
from roughvisc.mechanics.closed_forms.layer import ElasticLayer
from roughvisc.mechanics.closed_forms.reduction import ContactHistory, reduced_contact
from roughvisc.mechanics.closed_forms.sheet import OnSheet, PunchOnSheet
from roughvisc.mechanics.closed_forms.ting import SingleMaximum, ting
from roughvisc.mechanics.closed_forms.validity import (
    dundurs_coupling,
    flash_temperature,
    half_space_excess,
    half_space_shortfall,
    moving_load_excess,
    radiation_lag,
    sticking_stiffness,
)

__all__ = [
    "AxisymmetricContact",
    "Cone",
    "ContactHistory",
    "ContactRelaxation",
    "ElasticLayer",
    "FlatPunchContact",
    "GrowingContact",
    "Indenter",
    "KelvinVoigtStep",
    "OnSheet",
    "Paraboloid",
    "PowerLawRamp",
    "PunchOnSheet",
    "Sheet",
    "SingleMaximum",
    "SlidingCylinder",
    "StepLoad",
    "WavyContact",
    "adhesive_load",
    "conformal_energy",
    "dundurs_coupling",
    "flash_temperature",
    "flat_punch",
    "full_contact_pressure",
    "full_contact_wave",
    "half_space_excess",
    "half_space_shortfall",
    "hereditary_integral",
    "hertz",
    "johnson_greenwood_higginson",
    "kelvin_voigt_step",
    "lee_radok",
    "lee_radok_step",
    "moving_load_excess",
    "power_law_ramp",
    "pull_off_force",
    "punch_approach",
    "punch_dissipation",
    "punch_force",
    "punch_pressure",
    "punch_pull_off",
    "radiation_lag",
    "reduced_contact",
    "rough_attraction",
    "sliding_cylinder",
    "sneddon_cone",
    "sticking_stiffness",
    "tabor_parameter",
    "ting",
    "westergaard",
    "westergaard_half_width",
]


def __dir__() -> list[str]:
    return __all__
