"""What a row holds of friction, in programs with slides."""

from __future__ import annotations

import math

from roughvisc.mechanics.stepping.attempt import segment_number
from roughvisc.mechanics.stepping.scene import Step
from roughvisc.mechanics.stepping.slide import Slid
from roughvisc.mechanics.stepping.tangential import slope_force, tangential_force


def friction_row(step: Step) -> dict[str, float]:
    """Distance, forces and work of an accepted step; nothing where the profile never slides."""
    scene, state = step.scene, step.state
    if not scene.motions:
        return {}
    slide, slid = scene.motions[segment_number(state)], state.slid or Slid()
    pressure, force = step.shown.pressure, step.shown.force
    friction = tangential_force(scene.halfspace, pressure, step.displacement, slide)
    whole = scene.present is None  # where cells are absent nothing is known of the profile's slope
    return {
        "sliding_distance": slid.distance,
        "friction_force": friction,
        "friction_coefficient": friction / force if force > 0 else math.nan,
        "slope_friction_force": slope_force(scene.halfspace, pressure, scene.gap, slide) if whole else math.nan,
        "friction_force_error": step.uncertainty.friction,
        "friction_work": slid.work,
    }
