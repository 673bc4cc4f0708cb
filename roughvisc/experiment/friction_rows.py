"""What a row holds of friction, in programs with slides."""

from __future__ import annotations

import math

from roughvisc.mechanics.stepping.attempt import segment_number
from roughvisc.mechanics.stepping.scene import Step
from roughvisc.mechanics.stepping.slide import Slid
from roughvisc.mechanics.stepping.tangential import force_across, tangential_force


def friction_row(step: Step) -> dict[str, float]:
    """Distance, forces and work of an accepted step; empty for a program without slides."""
    scene, state = step.scene, step.state
    if not scene.motions:
        return {}
    slide, slid = scene.motions[segment_number(state)], state.slid or Slid()
    pressure, force = step.shown.pressure, step.shown.force
    friction = tangential_force(scene.halfspace, pressure, step.displacement, slide)
    return {
        "sliding_distance": slid.distance,
        "friction_force": friction,
        "friction_coefficient": friction / force if force > 0 else math.nan,
        "friction_force_across": force_across(scene.halfspace, pressure, step.displacement, slide),
        "friction_force_error": step.uncertainty.friction,
        "friction_work": slid.work,
    }
