"""What a plan tells of each case: names, units and prose."""

from __future__ import annotations

#: variable of a plan -> unit and long name
COLUMNS = {
    "boundary": ("", "boundary"),
    "padded": ("", "whether transforms are padded to twice the grid"),
    "memory_model": ("", "what models the material's memory"),
    "exponentials": ("1", "exponentials of the series"),
    "scheme": ("", "how time is stepped"),
    "cells_x": ("1", "cells along x"),
    "cells_y": ("1", "cells along y"),
    "grows": ("", "whether the grid may grow"),
    "final_cells_x": ("1", "cells along x in the end, where the grid grows; 0: not known"),
    "final_cells_y": ("1", "cells along y in the end, where the grid grows; 0: not known"),
    "left_out": ("", "what costs nothing, and why: it is not modelled, computed or kept"),
    "speeds": ("1", "speeds of a curve of friction"),
    "steps": ("1", "accepted time steps expected"),
    "rows": ("1", "kept times expected"),
    "contact_fraction": ("1", "largest contact fraction of an elastic press on the pressed cells; if marched"),
    "pressed_cells_x": ("1", "cells along x that were pressed for the contact fraction; 0: none"),
    "pressed_cells_y": ("1", "cells along y that were pressed for the contact fraction; 0: none"),
    "coarser_contact_fraction": ("1", "the same on cells twice as long, where the surface has more cells than pressed"),
    "coarser_cells_x": ("1", "cells along x that were pressed for that; 0: none"),
    "coarser_cells_y": ("1", "cells along y that were pressed for that; 0: none"),
    "nominal_pressure": ("Pa", "largest nominal pressure, prescribed or of the coarse march: force over nominal area"),
    "full_contact_pressure": ("Pa", "nominal pressure from which on contact takes 95 % of the area (Persson's theory)"),
    "convolutions": ("1", "convolutions expected, one forward and one inverse transform each"),
    "wall_time": ("s", "wall time expected, in one process with one thread"),
    "memory": ("byte", "memory of the process at its peak"),
    "half_wall_time": ("s", "wall time expected on cells twice as long"),
    "rms_slope": ("1", "root mean square slope between neighbouring cells"),
    "half_rms_slope": ("1", "the same of means over cells twice as long"),
    "half_memory": ("byte", "memory of the process at its peak on cells twice as long"),
    "disk": ("byte", "size of the result"),
    "marched": ("", "whether the cost is from a coarse march of this case, not of the one most like it"),
    "body_note": ("", "what the base of a sheet does, by the coarse march; empty of a half-space"),
    "program_note": ("", "how a measured history became segments"),
    "audit": (
        "",
        "assumptions that are broken or doubtful, as far as known before a run; empty if none is, or not marched",
    ),
    "warning": ("", "what is foreseen that may not be meant; empty if nothing"),
    "border_warning": ("", "whether contact is foreseen to reach the border of a free surface, which stops the run"),
    "refusal": ("", "why it cannot run; empty if it can"),
}


def attributes(name: str) -> dict[str, str]:
    """Attributes of a variable of a plan."""
    units, long_name = COLUMNS[name]
    return {"long_name": long_name} | ({"units": units} if units else {})
