"""The vocabulary: every variable that a result Dataset may hold or that is derived from one, declared once.

Dimensions, units and prose of each variable stand in this folder and nowhere else; :mod:`roughvisc.labels` writes them
on a Dataset. Here are those of a history over ``time``. Those of programs that slide, of steady sliding, of what flows
through the gap and of the contact spots have files of their own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from roughvisc.variables.entry import Variable as Variable
from roughvisc.variables.grid_errors import grid_errors
from roughvisc.variables.slides import SLIDES
from roughvisc.variables.spots import SPOTS
from roughvisc.variables.transport import TRANSPORT

#: How an accepted step ended; the values of ``status``, in order.
STATUS_MEANINGS = ("converged", "not_converged", "open", "full_contact")
NOT_CONVERGED = STATUS_MEANINGS.index("not_converged")

#: Number of the format of result files, stated in their attribute ``result_format``.
RESULT_FORMAT = 1

_GRID = ("x", "y")
_FRAME = ("time", "x", "y")
_SERIES = ("time",)
_RUNS = ("setting",)

VARIABLES: dict[str, Variable] = {
    # coordinates: with an attribute `axis` on x and y ParaView would wrap the surface on a sphere
    "time": Variable(
        ("time",),
        "s",
        "time",
        "since the start of the program; at a jump the right-hand state is kept",
        axis="T",  # no standard_name "time": CF wants a date then that times count from, and a program has none
        in_table="last",
    ),
    "x": Variable(("x",), "m", "x", "of the cell centre", axis="X"),
    "y": Variable(("y",), "m", "y", "of the cell centre", axis="Y"),
    "x_bounds": Variable(("x", "bnds"), "", "borders of the cells along x", "in files alone"),
    "y_bounds": Variable(("y", "bnds"), "", "borders of the cells along y", "in files alone"),
    "case_key": Variable((), "", "key of the case", "what the file is named by", dtype="str"),
    # the surface
    "height": Variable(
        _GRID,
        "m",
        "height",
        "of the rigid profile, peaks up; "
        "as conditioned; missing where absent; attribute `highest`: its highest point [m], between cells or in one",
        may_be_missing=True,
    ),
    "filled": Variable(
        _GRID,
        "",
        "filled points",
        "where the height was missing and has been filled in",
        dtype="int8",
        meanings=("measured", "filled"),
    ),
    # fields
    "pressure": Variable(
        _FRAME,
        "Pa",
        "contact pressure",
        "zero outside the contact and where the profile is absent",
        ancillary=("grid_error_pressure",),
        short="pressure",
        cell_methods="x: y: mean",
    ),
    "gap": Variable(
        _FRAME,
        "m",
        "gap",
        "between the surfaces; zero inside the contact; missing where the profile is absent",
        may_be_missing=True,
        cell_methods="x: y: point",
    ),
    "displacement": Variable(
        _FRAME,
        "m",
        "normal displacement",
        "of the half-space's surface; positive into the half-space; its mean is zero unless space is free",
        short="displacement",
        cell_methods="x: y: point",
    ),
    # histories
    "force": Variable(
        _SERIES,
        "N",
        "normal force",
        "prescribed under load control, found under approach control",
        ancillary=("force_error", "grid_error_force"),
        short="force",
        every_step=True,
        in_table="last",
    ),
    "approach": Variable(
        _SERIES,
        "m",
        "rigid-body approach",
        "from first touch; "
        "free space: against the undeformed plane; periodic and mirror: against the mean plane of the half-space's "
        "surface, which is the mean undeformed gap minus the mean gap, plus the mean displacement of the present cells "
        "if any are absent; while the contact is open: the value at which it would just close; first touch is at the "
        "highest cell, or at the apex of an indenter: on a rough surface it does not converge with the grid, while "
        "mean_gap (periodic and mirror) does",
        ancillary=("approach_error", "grid_error_approach"),
        short="approach",
        every_step=True,
        in_table="last",
    ),
    "nominal_pressure": Variable(
        _SERIES,
        "Pa",
        "nominal pressure",
        "force over the nominal area: that of the surface as given, absent cells included",
        in_table="last",
    ),
    "work": Variable(
        _SERIES,
        "J",
        "work of the force",
        "on the approach since the start; "
        "over every accepted step, kept or not, as that of the pressure on the displacement, "
        "stored and dissipated, with that of the friction force in a slide; a jump is quasi-static; with periodic "
        "boundaries without the uniform displacement",
        short="work",
        every_step=True,
    ),
    "contact_area": Variable(
        _SERIES,
        "m^2",
        "real contact area",
        "corrected for the grid: "
        "counted area less 0.088 times the staircase perimeter times the cell side; the perimeter is that between "
        "cells in contact and present cells out of contact: where the material ends the count is exact",
        ancillary=("contact_area_error", "grid_error_area"),
        short="contact area",
        every_step=True,
        in_table="last",
    ),
    "contact_area_counted": Variable(
        _SERIES,
        "m^2",
        "contact area, counted",
        "the cells that carry pressure, counted; larger than contact_area, since cells at the edge count as a whole",
        every_step=True,
    ),
    "contact_fraction": Variable(
        _SERIES,
        "1",
        "contact fraction",
        "contact_area over the area of the whole grid, absent cells included",
        every_step=True,
        in_table="last",
    ),
    "mean_gap": Variable(
        _SERIES,
        "m",
        "mean gap",
        "over the present cells; "
        "with periodic boundaries and no cells absent: the separation of the mean planes of both surfaces",
        ancillary=("approach_error", "grid_error_gap"),
        every_step=True,
        may_be_missing=True,
        in_table="last",
    ),
    **SLIDES,
    # accuracy and cost
    "iterations": Variable(_SERIES, "1", "solver iterations", "since the previous kept time", dtype="int32"),
    "convolutions": Variable(
        _SERIES,
        "1",
        "convolutions",
        "since the previous kept time: "
        "displacements and preconditioner applications, each one forward and one inverse transform",
        dtype="int32",
    ),
    "stated_error": Variable(
        _SERIES,
        "1",
        "stated relative error",
        "the largest of pressure (L1), force and approach: "
        "sum of what time steps, contact solver and series leave, over the largest force and approach of the kept "
        "rows so far; comparable to the tolerance; the grid's part is stated apart",
        in_table="largest",
    ),
    "time_error": Variable(
        _SERIES,
        "1",
        "error due to time steps",
        "part of stated_error, "
        "from the difference to a coarse solution, which takes one step for every two; "
        "over the largest values of the kept rows so far",
        every_step=True,
        in_table="largest",
    ),
    "residual": Variable(
        _SERIES,
        "1",
        "error due to the contact solver",
        "part of stated_error: estimated error of the pressure (L1), over its sum",
        in_table="largest",
    ),
    "force_error": Variable(_SERIES, "N", "stated error of the force", "zero where the force is prescribed"),
    "approach_error": Variable(
        _SERIES,
        "m",
        "stated error of the approach",
        "zero where the approach is prescribed",
    ),
    "contact_area_error": Variable(
        _SERIES,
        "m^2",
        "stated error of the contact area",
        "the area of the cells that time steps and contact solver leave in doubt, in contact or out of it, whichever "
        "is larger; the grid's part is stated apart",
    ),
    "grid_error": Variable(
        _SERIES,
        "1",
        "error due to the grid",
        "the larger one of grid_error_pressure and grid_error_approach, as stated_error is of the errors on this grid",
        may_be_missing=True,
        short="grid error",
    ),
    **grid_errors("time", "the largest value of all rows", in_table="largest"),
    "status": Variable(_SERIES, "", "how the step ended", dtype="int8", every_step=True, meanings=STATUS_MEANINGS),
    "wall_time": Variable(_SERIES, "s", "wall time", "since the start of the run"),
    # derived from a result: see roughvisc.observables
    "cluster_count": Variable(_SERIES, "1", "number of contact clusters", dtype="int64"),
    "cluster_area_mean": Variable(_SERIES, "m^2", "mean area of a contact cluster", "its cells, counted"),
    "cluster_area_largest": Variable(_SERIES, "m^2", "area of the largest contact cluster", "its cells, counted"),
    "cluster_area": Variable(
        ("time", "cluster"),
        "m^2",
        "area of a contact cluster",
        "its cells, counted: all clusters together are contact_area_counted; largest first; missing beyond the number "
        "of clusters",
    ),
    "pressure_bin": Variable(("pressure_bin",), "Pa", "pressure at the middle of a bin"),
    "gap_bin": Variable(("gap_bin",), "m", "gap at the middle of a bin"),
    "pressure_density": Variable(
        ("time", "pressure_bin"),
        "1/Pa",
        "probability density of the contact pressure",
        "over the cells in contact: its integral is 1",
    ),
    "gap_density": Variable(
        ("time", "gap_bin"),
        "1/m",
        "probability density of the gap",
        "over the present cells out of contact: its integral is 1",
    ),
    "cycle": Variable(("cycle",), "1", "number of the loading cycle", "counted from 1", dtype="int64"),
    "cycle_start": Variable(("cycle",), "s", "time at which the cycle starts"),
    "cycle_work": Variable(("cycle",), "J", "work done by the force in the cycle"),
    **TRANSPORT,
    **SPOTS,
    # a trade of accuracy against speed: what was set, what it cost, how wrong it was
    "setting": Variable(_RUNS, "", "how the case was computed", dtype="str"),
    "quantity": Variable(("quantity",), "", "what is compared", dtype="str"),
    "tolerance": Variable(_RUNS, "1", "tolerance asked for"),
    "coarsening": Variable(_RUNS, "1", "length of a cell over that of the study's"),
    "cells_x": Variable(_RUNS, "1", "cells along x", dtype="int32"),
    "cells_y": Variable(_RUNS, "1", "cells along y", dtype="int32"),
    "run_time": Variable(_RUNS, "s", "run time", "wall time of computing the result"),
    "transforms": Variable(_RUNS, "1", "convolutions, each one forward and one inverse transform"),
    "steps": Variable(_RUNS, "1", "accepted time steps"),
    "note": Variable(_RUNS, "", "why the setting was not measured; empty if it was", dtype="str"),
    "error": Variable(
        ("setting", "quantity"),
        "1",
        "relative error against the reference",
        "the worst over the kept times; pressure: its absolute difference summed (L1) over the largest force; any "
        "other: over its largest value",
    ),
    "coarsening_error": Variable(
        ("setting", "quantity"),
        "1",
        "part of the error that the coarser grid alone makes",
        "of a run as sharp in time as the reference; on a scan it holds what the surface has lost",
    ),
    "reference_time_uncertainty": Variable(
        ("quantity",),
        "1",
        "uncertainty of the reference due to time steps",
        "how far it may be off: by Richardson extrapolation",
    ),
    "reference_grid_uncertainty": Variable(
        ("quantity",),
        "1",
        "uncertainty of the reference due to the grid",
        "how far it may be off: by Richardson extrapolation; of a scan: what its spacing leaves unknown",
    ),
}

#: Fields that the user may ask for in ``fields``: those that the solver finds.
FIELDS = tuple(name for name, variable in VARIABLES.items() if variable.dims == _FRAME and name not in TRANSPORT)


#: Histories of every accepted step, also of those between the kept times.
STEPPED = tuple(name for name, variable in VARIABLES.items() if variable.every_step)


#: Variables whose values are words, and these in order.
FLAGS = {name: variable.meanings for name, variable in VARIABLES.items() if variable.meanings}

#: Dimensions that a result of one case may have beside that of its rows.
OTHER_DIMS = ("x", "y", "bnds")
#: Of the surface, whatever the rows lie over.
_SURFACE = ("x", "y", "x_bounds", "y_bounds", "height", "filled")
#: What is derived of a row alone, whatever the rows lie over.
OF_A_ROW = (
    *(name for name in VARIABLES if name.startswith(("cluster_", "pressure_", "gap_")) and "error" not in name),
    *TRANSPORT,
    *(name for name in SPOTS if not name.endswith("contact_area")),
)


def over_axis(name: str, shared: Iterable[str]) -> dict[str, Variable]:
    """Variables of a history over time, over another axis.

    Parameters
    ----------
    name : str
        Of the axis.
    shared : iterable of str
        Names of the variables. Those of the surface, and what is derived of a row alone, are among them in any case.
    """
    known = {one: VARIABLES[one] for one in _SURFACE}
    for one in (*shared, *OF_A_ROW):
        dims = tuple(name if dim == "time" else dim for dim in VARIABLES[one].dims)
        ancillary = VARIABLES[one].ancillary if one in OF_A_ROW else ()
        known[one] = replace(VARIABLES[one], dims=dims, ancillary=ancillary, every_step=False)
    return known
