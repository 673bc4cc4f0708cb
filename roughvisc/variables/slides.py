"""The vocabulary of programs in which the profile slides: what a history over ``time`` holds then."""

from __future__ import annotations

from roughvisc.variables.entry import Variable

_SERIES = ("time",)

SLIDES: dict[str, Variable] = {
    "sliding_distance": Variable(
        _SERIES,
        "m",
        "sliding distance",
        "since the start, along the path, whatever its direction; in whole cells of the grid",
        every_step=True,
        in_table="last",
    ),
    "friction_force": Variable(
        _SERIES,
        "N",
        "friction force",
        "against the motion; "
        "of pressure on inclined faces alone, by the slope of the body's surface; in a hold against the last slide, "
        "before the first one against that",
        ancillary=("friction_force_error", "grid_error_friction"),
        every_step=True,
        in_table="last",
    ),
    "friction_force_across": Variable(
        _SERIES,
        "N",
        "force across the motion",
        "keeps the profile on its path; "
        "positive to the left of the motion, 90 degrees counter-clockwise from it with x to the right and y upwards: "
        "towards y for a motion along x, -x for y, -y for -x, x for -y; friction_force is its component forwards; "
        "in a hold by the same slide as friction_force",
        every_step=True,
        in_table="last",
    ),
    "friction_coefficient": Variable(
        _SERIES,
        "1",
        "friction coefficient",
        "friction_force over force: without shear at the interface; missing while the surfaces are apart",
        every_step=True,
        may_be_missing=True,
        in_table="last",
    ),
    "friction_force_error": Variable(
        _SERIES,
        "N",
        "stated error of the friction force",
        "of steps of one cell, by a coarse solution in steps of two; the rest of the grid's error comes on top",
        may_be_missing=True,
    ),
}
