"""Declarations of all variables of results and of quantities derived from results, and the axes of their rows.

:func:`roughvisc.labels.label` writes units and names on a Dataset. The rows of a result lie over ``time`` or over
``speed``: a variable over rows is declared once for both.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from roughvisc.units import unit_for

#: Number of the format of result files, stated in their attribute ``result_format``.
RESULT_FORMAT = 1

#: How an accepted step ended; the values of ``status``, in order.
STATUS_MEANINGS = ("converged", "open", "full_contact", "jump")

#: Dimension of the kept times or speeds of cases that do not share them, and number of these in each case.
ROW, ROWS = "row", "rows"
#: Dimension of all accepted steps.
STEP = "step"
#: Dimensions that a result of one case may have in addition to the dimension of its rows.
OTHER_DIMS = ("x", "y")

_GRID = ("x", "y")
_FRAME = (ROW, "x", "y")
_SERIES = (ROW,)
_STEPS = (STEP,)


@dataclass(frozen=True)
class Variable:
    """Declaration of a variable.

    Attributes
    ----------
    dims : tuple of str
        ``row`` means the axis of the rows. So does ``step``, for a history that is also known at all accepted steps
        between the rows.
    units, long_name, comment, dtype : str
        As in the file of a result.
    meanings : tuple of str
        Meanings of the values 0, 1, ... of a flag.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    comment: str = ""
    dtype: str = "float64"
    meanings: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Name on an axis of a figure or in a table."""
        return self.long_name[:1].upper() + self.long_name[1:]

    def over(self, axis: str) -> tuple[str, ...]:
        """Return the dimensions in a result whose rows lie over an axis."""
        return tuple(axis if dim in (ROW, STEP) else dim for dim in self.dims)

    @cached_property
    def attributes(self) -> dict[str, Any]:
        """The CF attributes."""
        names = ("long_name", "units", "comment")
        found: dict[str, Any] = {name: value for name in names if (value := getattr(self, name))}
        if self.meanings:
            found["flag_values"] = np.arange(len(self.meanings), dtype=self.dtype)
            found["flag_meanings"] = " ".join(self.meanings)
        return found


#: Comments of several variables.
_COARSER = "bound in practice, from a coarser grid; relative to the largest row over time, to the same row over speed"
_SPOTS = "of the contact spots between half-spaces; infinite in full contact; the gap does not conduct"
_FLUX = "of the fluid, over the height of the gap; zero in contact and without flow"
_SOLVER = "of the solution on this grid alone: without the errors of the grid and of the gap"
_BOTH = "of the grid and of the solver"
_PERSSON = "by Persson's theory of the same waves"
_ASPERITIES = "at the rms slope of the surface; missing once the load has fallen"

VARIABLES: dict[str, Variable] = {
    # coordinates; no standard_name "time", which in CF is a date
    "time": Variable(_STEPS, "s", "time", "since the start of the program; at a jump the state after it"),
    "speed": Variable(_SERIES, "m/s", "speed", "of steady sliding"),
    "x": Variable(("x",), "m", "x", "of the cell centre"),
    "y": Variable(("y",), "m", "y", "of the cell centre"),
    "case_key": Variable((), "", "key of the case", "name of its file", dtype="str"),
    "attributes": Variable(
        (), "", "attributes of the file", "of a case of a sweep: those that differ, JSON", dtype="str"
    ),
    # surface
    "height": Variable(_GRID, "m", "height", "of the rigid profile, peaks up; attribute `highest`: its apex [m]"),
    "filled": Variable(_GRID, "", "filled points", dtype="int8", meanings=("measured", "filled")),
    # fields
    "pressure": Variable(_FRAME, "Pa", "pressure", "of the contact, mean over the cell"),
    "gap": Variable(_FRAME, "m", "gap", "between the surfaces at the cell centre; missing where the profile is absent"),
    "displacement": Variable(_FRAME, "m", "displacement", "into the body; of zero mean unless space is free"),
    # histories
    "force": Variable(_STEPS, "N", "force", "normal force"),
    "approach": Variable(
        _STEPS,
        "m",
        "approach",
        "of the rigid profile since first touch of its highest point; in free space against the undeformed plane, "
        "otherwise against the mean plane of the body; of an open contact the value at which it would just close",
    ),
    "adhesive_force": Variable(_STEPS, "N", "adhesive force", "integral of the tension, in contact cells too"),
    "dissipated_energy": Variable(_STEPS, "J", "dissipated energy", "of jumps of an elastic body with adhesion"),
    "nominal_pressure": Variable(_STEPS, "Pa", "nominal pressure", "force over the area of all cells, absent ones too"),
    "work": Variable(_STEPS, "J", "work", "of the force on the approach; if periodic without the uniform displacement"),
    "contact_area": Variable(_STEPS, "m^2", "contact area", "without the excess of the staircase of cells at its edge"),
    "contact_area_counted": Variable(_STEPS, "m^2", "contact area, counted", "cells that carry pressure"),
    "contact_fraction": Variable(_STEPS, "1", "contact fraction", "over the area of all cells, absent ones too"),
    "mean_gap": Variable(_STEPS, "m", "mean gap", "over the present cells"),
    # sliding
    "sliding_distance": Variable(_STEPS, "m", "sliding distance", "since the start, along the path, in whole cells"),
    "reduced_speed": Variable(_SERIES, "m/s", "reduced speed a_T V", "speed times the shift factor of the material"),
    "friction_coefficient": Variable(_STEPS, "1", "friction coefficient", "over the normal force; missing while apart"),
    "friction_force": Variable(_STEPS, "N", "friction force", "against the motion, in a hold against the last motion"),
    "friction_force_across": Variable(_STEPS, "N", "force across the motion", "to the left of the motion"),
    "friction_force_error": Variable(_SERIES, "N", "stated error of the friction force", "of steps of one cell"),
    # accuracy and cost
    "stated_error": Variable(
        _SERIES,
        "1",
        "numerical error",
        "largest of pressure (L1), force and approach, over the largest of the rows so far: steps, solver and series; "
        "of steady sliding pressure (L1) and friction, by the iteration; without the grid",
    ),
    "time_error": Variable(_STEPS, "1", "error of the time steps", "part of stated_error"),
    "residual": Variable(_STEPS, "1", "error of the contact solver", "part of stated_error"),
    "approach_error": Variable(_SERIES, "m", "stated error of the approach", "zero if the approach is prescribed"),
    "work_error": Variable(_SERIES, "J", "stated error of the work", "adds up over the steps; without the grid"),
    "contact_area_error": Variable(_SERIES, "m^2", "stated error of the area", "of uncertain cells; without the grid"),
    "grid_error": Variable(_SERIES, "1", "grid error", f"largest of pressure (L1), force, approach; {_COARSER}"),
    "grid_error_approach": Variable(_SERIES, "1", "grid error of the approach", _COARSER),
    "grid_error_gap": Variable(_SERIES, "1", "grid error of the gap", f"mean gap; {_COARSER}"),
    "grid_error_area": Variable(_SERIES, "1", "grid error of the area", _COARSER),
    "grid_error_friction": Variable(_SERIES, "1", "grid error of friction", f"missing below three cells; {_COARSER}"),
    "status": Variable(_STEPS, "", "how the step ended", dtype="int8", meanings=STATUS_MEANINGS),
    "convolutions": Variable(_STEPS, "1", "convolutions", "since the last step, or of the speed", dtype="int32"),
    "wall_time": Variable(_STEPS, "s", "wall time", "since the start of the run"),
    # observables: contact and gap
    "cluster_count": Variable(_SERIES, "1", "number of contact clusters", dtype="int64"),
    "cluster_area_mean": Variable(_SERIES, "m^2", "mean area of a contact cluster", "its cells, counted"),
    "cluster_area_largest": Variable(_SERIES, "m^2", "area of the largest contact cluster", "its cells, counted"),
    "pressure_bin": Variable(("pressure_bin",), "Pa", "pressure at the middle of a bin"),
    "gap_bin": Variable(("gap_bin",), "m", "gap at the middle of a bin"),
    "pressure_density": Variable((ROW, "pressure_bin"), "1/Pa", "probability density of the pressure", "in contact"),
    "gap_density": Variable((ROW, "gap_bin"), "1/m", "probability density of the gap", "out of contact"),
    "cycle": Variable(("cycle",), "1", "number of the loading cycle", "counted from 1", dtype="int64"),
    "cycle_start": Variable(("cycle",), "s", "time at which the cycle starts"),
    "cycle_work": Variable(("cycle",), "J", "work done by the force in the cycle"),
    "pull_off_force": Variable(("cycle",), "N", "pull-off force", "largest tension in the cycle"),
    "pull_off_time": Variable(("cycle",), "s", "time of the pull-off", "missing without tension"),
    "work_of_separation": Variable(("cycle",), "J", "work of separation", "of the tension while the surfaces recede"),
    # observables: leakage
    "leak_rate": Variable(_SERIES, "m^3/s", "leak rate", "volume of fluid in unit time, by the pressure drop"),
    "leak_rate_error": Variable(_SERIES, "m^3/s", "stated error of the leak rate", _SOLVER),
    "transmissivity": Variable(_SERIES, "m^3", "transmissivity", "hydraulic: of a parallel gap its cube over 12"),
    "hydraulic_aperture": Variable(_SERIES, "m", "hydraulic aperture", "the parallel gap that leaks as much"),
    "flux": Variable(_FRAME, "m^2/s", "flux", "volume flux over the height of the gap; missing in contact"),
    "flux_x": Variable(_FRAME, "m^2/s", "flux along x", f"volume flux {_FLUX}"),
    "flux_y": Variable(_FRAME, "m^2/s", "flux along y", f"volume flux {_FLUX}"),
    # observables: contact spots
    "thermal_conductance": Variable(_SERIES, "W/K", "thermal conductance", _SPOTS),
    "thermal_conductance_error": Variable(_SERIES, "W/K", "stated error of the thermal conductance", _BOTH),
    "electrical_conductance": Variable(_SERIES, "S", "electrical conductance", _SPOTS),
    "electrical_conductance_error": Variable(_SERIES, "S", "stated error of the electrical conductance", _BOTH),
    # theories
    "persson_contact_area": Variable(_SERIES, "m^2", "contact area, Persson", _ASPERITIES),
    "asperity_contact_area": Variable(_SERIES, "m^2", "contact area, Bush et al.", f"at low loads, {_ASPERITIES}"),
    "persson_friction_coefficient": Variable(_SERIES, "1", "friction coefficient, Persson", _PERSSON),
    "persson_contact_fraction": Variable(_SERIES, "1", "contact fraction, Persson", _PERSSON),
}

#: Fields that the user may request in ``fields``; the solver computes them.
FIELDS = ("pressure", "gap", "displacement")
#: Histories that are known at all accepted steps.
STEPPED = tuple(name for name, one in VARIABLES.items() if one.dims == _STEPS and name != "time")
#: Variables that a result over time has at its accepted steps alone, in the group ``steps``.
_FORCES = ("nominal_pressure", "contact_area_counted", "friction_force_across")
OF_STEPS = (*_FORCES, "time_error", "residual", "status", "convolutions", "wall_time")
#: Conductances of the contact spots.
CONDUCTANCES = ("thermal_conductance", "electrical_conductance")
#: Quantity -> variable with its grid error.
GRID_ERROR = {
    "pressure": "grid_error",
    "force": "grid_error",
    "approach": "grid_error_approach",
    "mean_gap": "grid_error_gap",
    "contact_area": "grid_error_area",
    "friction_force": "grid_error_friction",
}
#: Variables whose values in the last row are in the table of a sweep, and those whose largest values are.
_CONTACT = ("force", "approach", "nominal_pressure", "contact_area", "contact_fraction", "mean_gap")
_SLIDING = ("sliding_distance", "friction_coefficient", "friction_force", "friction_force_across")
_FLOW = ("leak_rate", "transmissivity", "hydraulic_aperture")
IN_TABLE = ("time", "speed", *_CONTACT, *_SLIDING, *_FLOW, *CONDUCTANCES)
LARGEST_IN_TABLE = ("stated_error", *dict.fromkeys(GRID_ERROR.values()))
#: Variable -> variables that may state its error. The variable `time_error` is about the time steps, not the time. The
#: force is prescribed, or has an error below the error of the pressure, which `grid_error` states.
ERRORS = {
    name: tuple(one for one in (f"{name}_error", GRID_ERROR.get(name, "")) if one in VARIABLES) for name in VARIABLES
} | {"time": (), "force": ()}


@dataclass(frozen=True)
class Axis:
    """Axis of the rows of a result.

    Attributes
    ----------
    name : str
        Coordinate of the rows.
    rows : str
        Plural name of the rows.
    symbol : str
        Symbol of a value, as ``t`` in ``t = 50 ms``.
    needed : tuple of str
        Variables without which a file is not a result.
    telling : str
        Variable whose largest value marks the row that represents the result in a table; empty: the last row does.
    """

    name: str
    rows: str
    symbol: str
    needed: tuple[str, ...]
    telling: str = ""

    def place(self, value: float, digits: int = 6) -> str:
        """Return a value on the axis as text.

        Examples
        --------
        >>> AXES["time"].place(0.05), AXES["speed"].place(2e-3)
        ('t = 50 ms', 'V = 2 mm/s')
        """
        return f"{self.symbol} = {unit_for([value], VARIABLES[self.name].units).text(value, digits)}"

    def telling_row(self, histories: Mapping[str, Any]) -> int:
        """Return the number of the row that represents a result in a table."""
        found = np.asarray(histories[self.telling]) if self.telling else np.zeros(0)
        return int(np.nanargmax(found)) if np.isfinite(found).any() else -1


#: Name of an axis -> the axis.
AXES: dict[str, Axis] = {
    "time": Axis("time", "kept times", "t", ("time", "force", "approach")),
    "speed": Axis("speed", "speeds", "V", ("speed", "force", "friction_coefficient"), "friction_coefficient"),
}


def axis_of(names: Container[str]) -> str:
    """Return the axis of the rows of a result from the names of its variables.

    Examples
    --------
    >>> axis_of({"time", "force"}), axis_of({"speed", "force"})
    ('time', 'speed')
    """
    return "speed" if "speed" in names else "time"
