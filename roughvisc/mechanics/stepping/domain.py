"""Growing domains: detects that the contact leaves the grid, and moves a state to a larger one."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from roughvisc.errors import EdgeContactError
from roughvisc.mechanics.fields.sparse import Sparse
from roughvisc.mechanics.hereditary.exponentials import padded
from roughvisc.mechanics.stepping.attempt import elastic_step
from roughvisc.mechanics.stepping.scene import Instant, Scene, State, Trajectory

# The approach stays below the least gap beyond the grid by this factor: what is shown of a step's end is solved anew.
_BEYOND = 1.05


def is_outgrown(scene: Scene, instant: Instant) -> bool:
    """Whether the grid is too small: contact cannot be excluded beyond it, or has reached the domain's border."""
    if scene.outside < math.inf:
        return _BEYOND * instant.approach >= scene.outside
    return at_edge(scene, instant.contact)


def at_edge(scene: Scene, contact: Sparse) -> bool:
    """Whether pressure at the border of a free-space domain acts as the edge of a punch that nobody asked for."""
    return not scene.accept_edge and at_border(scene, contact)


def at_border(scene: Scene, contact: Sparse) -> bool:
    """Whether there is pressure at the border of a free-space domain."""
    if scene.halfspace.boundary != "free":
        return False
    pressure = contact.field()
    borders = (-1,) if scene.halfspace.mirrored else (0, -1)
    return any(bool(np.any(pressure[i] > 0) or np.any(pressure[:, i] > 0)) for i in borders)


def edge_error(scene: Scene, time: float) -> EdgeContactError:
    """The error to raise where the grid cannot grow."""
    nx, ny = scene.halfspace.surface_shape
    return EdgeContactError(
        f"at {time:.6g} s contact reaches the border of the free-space domain of {nx} x {ny} cells: expected contact "
        "inside it; use boundary='periodic' for a nominally flat scan, a larger scan, a smaller load, or "
        "edge='accept' to press it as a punch of that outline"
    )


def enlarged(scene: Scene, state: State, time: float) -> tuple[Scene, State]:
    """Scene and state on a larger grid: nothing outside ever carried pressure."""
    larger = scene.enlarge(scene) if scene.enlarge is not None else None
    if larger is None:
        raise edge_error(scene, time)
    scene, offset = larger
    return scene, state.with_each(partial(_on_larger, scene, offset))


def _on_larger(scene: Scene, offset: tuple[int, int], state: Trajectory) -> dict[str, Any]:
    """What changes of a trajectory on a larger grid, in which the present one begins at a cell."""
    shape = scene.halfspace.shape
    memory = scene.memory.enlarged(state.memory, shape, offset, scene.halfspace.displacement)

    def moved(instant: Instant) -> Instant:
        if not instant.contact.size:  # of a companion
            return instant
        contact = Sparse.of(padded(instant.pressure, shape, offset))
        return replace(instant, contact=contact, unit_displacement=None)

    now, before = moved(state.now), None if state.before is None else moved(state.before)
    glassy, _, carried = elastic_step(scene, memory, 0.0, "linear")
    unit_displacement = scene.halfspace.displacement(now.pressure)
    now = replace(now, unit_displacement=unit_displacement)
    displacement = carried + glassy * unit_displacement
    return {"now": now, "displacement": displacement, "before": before, "memory": memory}
