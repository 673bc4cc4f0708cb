"""The vocabulary of steady sliding: what a Dataset over ``speed`` may hold."""

from __future__ import annotations

from roughvisc.variables import Variable, over_axis
from roughvisc.variables.grid_errors import grid_errors

#: What steady sliding has in common with a history over time.
_SHARED = (
    "pressure",
    "gap",
    "force",
    "nominal_pressure",
    "approach",
    "contact_area",
    "contact_area_counted",
    "contact_fraction",
    "mean_gap",
    "iterations",
    "convolutions",
    "status",
    "wall_time",
)


SLIDING: dict[str, Variable] = {
    "speed": Variable(("speed",), "m/s", "sliding speed", short="speed", in_table="last"),
    "reduced_speed": Variable(
        ("speed",),
        "m/s",
        "reduced speed a_T V",
        "speed times the shift factor of the material: curves of several temperatures fall on one over it",
    ),
    "friction_coefficient": Variable(
        ("speed",),
        "1",
        "friction coefficient",
        "of steady sliding: "
        "friction_force over the load: of pressure on inclined faces alone, without shear at the interface",
        ancillary=("friction_residual", "grid_error_friction"),
        may_be_missing=True,
        in_table="last",
    ),
    "friction_force": Variable(
        ("speed",),
        "N",
        "friction force",
        "against the motion: the power that the material dissipates, over the speed",
        ancillary=("friction_residual", "grid_error_friction"),
        in_table="last",
    ),
    "friction_force_across": Variable(
        ("speed",),
        "N",
        "force across the motion",
        "keeps the profile on its path; "
        "positive to the left of the motion, 90 degrees counter-clockwise from it with x to the right and y upwards: "
        "towards y for a motion along x, -x for y, -y for -x, x for -y; friction_force is its component forwards",
        in_table="last",
    ),
    **over_axis("speed", _SHARED),
    "stated_error": Variable(
        ("speed",),
        "1",
        "stated relative error",
        "the larger one of pressure (L1) and friction: "
        "what the iteration leaves; comparable to the tolerance; the grid's part is stated apart",
        may_be_missing=True,
        in_table="largest",
    ),
    "pressure_residual": Variable(
        ("speed",),
        "1",
        "iteration's error of the pressure",
        "estimated, L1, over the load",
        in_table="largest",
    ),
    "friction_residual": Variable(
        ("speed",),
        "1",
        "iteration's error of the friction",
        "estimated, relative",
        in_table="largest",
    ),
    "persson_friction_coefficient": Variable(
        ("speed",), "1", "friction coefficient, Persson", "by Persson's theory of the same waves"
    ),
    "persson_contact_fraction": Variable(
        ("speed",), "1", "contact fraction, Persson", "contact area over nominal area, by Persson's theory"
    ),
    **grid_errors(
        "speed",
        "the value at the speed",
        ("grid_error_friction", "grid_error_area", "grid_error_approach", "grid_error_gap"),
        in_table="last",
    ),
}
