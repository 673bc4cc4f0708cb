"""Declarations of all variables of results and of quantities derived from results, and the axes of their rows.

:func:`roughvisc.labels.label` writes units and names on a Dataset. The rows of a result lie over ``time`` or over
``speed``: a variable over rows is declared once for both.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from roughvisc.units import unit_for

#: Number of the format of result files, stated in their attribute ``result_format``.
RESULT_FORMAT = 1

#: How an accepted step ended; the values of ``status``, in order.
STATUS_MEANINGS = ("converged", "open", "full_contact", "jump")

#: Dimension of the kept times or speeds of cases that do not share them, and number of these in each case.
ROW = "row"
ROWS = "rows"
#: Dimension of all accepted steps.
STEP = "step"
#: Dimensions that a result of one case may have in addition to the dimension of its rows.
OTHER_DIMS = ("x", "y", "wavelength")

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
    error : str
        Variable with its stated error, in the same unit; empty if none is stated.
    grid_error : str
        Variable with its relative error due to the grid; empty if none is estimated. Quantities in a constant ratio
        share it.
    missing : str
        When the value does not exist: it is then NaN. A variable without this text is never NaN in a result.
    table : {"", "value", "largest"}
        What tables of cases and summaries contain: nothing, the value in the row that represents the case, with its
        errors, or the largest value of all rows.
    is_panel : bool
        Whether :func:`roughvisc.plot.history` draws it by default.
    is_of_steps : bool
        Whether a result over time contains it at its accepted steps alone, in the group ``steps``.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    comment: str = ""
    dtype: str = "float64"
    meanings: tuple[str, ...] = ()
    error: str = ""
    grid_error: str = ""
    missing: str = ""
    table: Literal["", "value", "largest"] = ""
    is_panel: bool = False
    is_of_steps: bool = False

    @property
    def errors(self) -> tuple[str, ...]:
        """Variables with its errors."""
        return tuple(filter(None, (self.error, self.grid_error)))

    @property
    def remarks(self) -> str:
        """Comment, and when the value is missing."""
        return "; ".join(filter(None, (self.comment, self.missing and f"missing {self.missing}")))

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
        texts = {"long_name": self.long_name, "units": self.units, "comment": self.remarks}
        attributes: dict[str, Any] = {name: text for name, text in texts.items() if text}
        if self.meanings:
            attributes["flag_values"] = np.arange(len(self.meanings), dtype=self.dtype)
            attributes["flag_meanings"] = " ".join(self.meanings)
        return attributes


#: Comments of several variables, and when several are missing.
_COARSER = "bound in practice, from a coarser grid; relative to the largest row over time, to the same row over speed"
_SPOTS = "of the contact spots between half-spaces; infinite in full contact; the gap does not conduct"
_FLUX = "of the fluid, over the height of the gap; zero in contact and without flow"
_SOLVER = "of the solution on this grid alone: without the errors of the grid and of the gap"
_BOTH = "of the grid and of the solver"
_PERSSON = "by Persson's theory of the same waves"
_ASPERITIES = "at the rms slope of the surface"
_NO_ESTIMATE = "if the coarser grid has no solution, or the quantity is zero within its error"
_ABSENT = "where the profile is absent"
_FALLEN = "once the load has fallen"
_CUT_OFF = "without an upper limit"

VARIABLES: dict[str, Variable] = {
    # coordinates; no standard_name "time", which in CF is a date
    "time": Variable(
        _STEPS, "s", "time", "since the start of the program; at a jump the state after it", table="value"
    ),
    "speed": Variable(_SERIES, "m/s", "speed", "of steady sliding", table="value"),
    "x": Variable(("x",), "m", "x", "of the cell centre"),
    "y": Variable(("y",), "m", "y", "of the cell centre"),
    "case_key": Variable((), "", "key of the case", "name of its file", dtype="str"),
    "attributes": Variable(
        (), "", "attributes of the file", "of a case of a sweep: those that differ, JSON", dtype="str"
    ),
    # surface
    "height": Variable(
        _GRID, "m", "height", "of the rigid profile, peaks up; attribute `highest`: its apex [m]", missing=_ABSENT
    ),
    "filled": Variable(_GRID, "", "filled points", dtype="int8", meanings=("measured", "filled")),
    # fields
    "pressure": Variable(_FRAME, "Pa", "pressure", "of the contact, mean over the cell", grid_error="grid_error"),
    "gap": Variable(_FRAME, "m", "gap", "between the surfaces at the cell centre", missing=_ABSENT),
    "displacement": Variable(_FRAME, "m", "displacement", "into the body; of zero mean unless space is free"),
    # histories
    "force": Variable(_STEPS, "N", "force", "normal force", error="force_error", table="value", is_panel=True),
    "approach": Variable(
        _STEPS,
        "m",
        "approach",
        "of the rigid profile since first touch of its highest point; in free space against the undeformed plane, "
        "otherwise against the mean plane of the body; of an open contact the value at which it would just close",
        error="approach_error",
        grid_error="grid_error_approach",
        table="value",
        is_panel=True,
    ),
    "nominal_pressure": Variable(
        _STEPS,
        "Pa",
        "nominal pressure",
        "force over the area of the given surface, absent cells too",
        table="value",
        is_of_steps=True,
    ),
    "contact_area": Variable(
        _STEPS,
        "m^2",
        "contact area",
        "without the excess of the staircase of cells at its edge",
        error="contact_area_error",
        grid_error="grid_error_area",
        table="value",
        is_panel=True,
    ),
    "contact_area_counted": Variable(
        _STEPS, "m^2", "contact area, counted", "cells that carry pressure", is_of_steps=True
    ),
    "contact_fraction": Variable(
        _STEPS,
        "1",
        "contact fraction",
        "over the area of all cells, absent ones too",
        grid_error="grid_error_area",
        table="value",
    ),
    "mean_contact_pressure": Variable(
        _STEPS,
        "Pa",
        "mean contact pressure",
        "force over the contact area",
        error="mean_contact_pressure_error",
        grid_error="grid_error_mean_pressure",
        missing="without contact",
        table="value",
    ),
    "mean_gap": Variable(
        _STEPS, "m", "mean gap", "over the present cells", grid_error="grid_error_gap", table="value", is_panel=True
    ),
    "work": Variable(
        _STEPS,
        "J",
        "work",
        "of the force on the approach; if periodic without the uniform displacement",
        error="work_error",
        is_panel=True,
    ),
    "adhesive_force": Variable(_STEPS, "N", "adhesive force", "integral of the tension, in contact cells too"),
    "dissipated_energy": Variable(_STEPS, "J", "dissipated energy", "of jumps of an elastic body with adhesion"),
    # sliding
    "sliding_distance": Variable(
        _STEPS, "m", "sliding distance", "since the start, along the path, in whole cells", table="value"
    ),
    "reduced_speed": Variable(_SERIES, "m/s", "reduced speed a_T V", "speed times the shift factor of the material"),
    "friction_coefficient": Variable(
        _STEPS,
        "1",
        "friction coefficient",
        "over the normal force",
        error="friction_coefficient_error",
        grid_error="grid_error_friction",
        missing="while apart",
        table="value",
        is_panel=True,
    ),
    "friction_force": Variable(
        _STEPS,
        "N",
        "friction force",
        "against the motion, in a hold against the last motion",
        error="friction_force_error",
        grid_error="grid_error_friction",
        table="value",
    ),
    "friction_force_across": Variable(
        _STEPS, "N", "force across the motion", "to the left of the motion", table="value", is_of_steps=True
    ),
    "temperature": Variable(_SERIES, "K", "temperature of the contact", "of a theory: of its shortest waves"),
    # accuracy and cost
    "stated_error": Variable(
        _SERIES,
        "1",
        "numerical error",
        "largest of pressure (L1), force and approach, over the largest of the rows so far: steps, solver and series; "
        "of steady sliding pressure (L1) and friction, by the iteration; without the grid",
        table="largest",
    ),
    "time_error": Variable(_STEPS, "1", "error of the time steps", "part of stated_error", is_of_steps=True),
    "residual": Variable(_STEPS, "1", "error of the contact solver", "part of stated_error", is_of_steps=True),
    "force_error": Variable(_SERIES, "N", "stated error of the force", "zero if the load is prescribed"),
    "approach_error": Variable(_SERIES, "m", "stated error of the approach", "zero if the approach is prescribed"),
    "work_error": Variable(_SERIES, "J", "stated error of the work", "adds up over the steps; without the grid"),
    "contact_area_error": Variable(_SERIES, "m^2", "stated error of the area", "of uncertain cells; without the grid"),
    "mean_contact_pressure_error": Variable(
        _SERIES,
        "Pa",
        "stated error of the mean contact pressure",
        "from the errors of force and area",
        missing=_CUT_OFF,
    ),
    "friction_coefficient_error": Variable(
        _SERIES,
        "1",
        "stated error of the friction coefficient",
        "from the errors of both forces",
        missing=_CUT_OFF,
    ),
    "friction_force_error": Variable(
        _SERIES,
        "N",
        "stated error of the friction force",
        "of steps of one cell; over speed stated_error times friction",
    ),
    "grid_error": Variable(
        _SERIES,
        "1",
        "grid error",
        f"largest of pressure (L1), force, approach; {_COARSER}",
        missing=_NO_ESTIMATE,
        table="largest",
    ),
    "grid_error_approach": Variable(
        _SERIES, "1", "grid error of the approach", _COARSER, missing=_NO_ESTIMATE, table="largest"
    ),
    "grid_error_gap": Variable(
        _SERIES, "1", "grid error of the gap", f"mean gap; {_COARSER}", missing=_NO_ESTIMATE, table="largest"
    ),
    "grid_error_area": Variable(
        _SERIES, "1", "grid error of the area", _COARSER, missing=_NO_ESTIMATE, table="largest"
    ),
    "grid_error_mean_pressure": Variable(
        _SERIES,
        "1",
        "grid error of the mean contact pressure",
        f"from the errors of force and area; {_COARSER}",
        missing=f"{_NO_ESTIMATE}, or the area may be zero",
        table="largest",
    ),
    "grid_error_friction": Variable(
        _SERIES,
        "1",
        "grid error of friction",
        _COARSER,
        missing=f"below three cells, {_NO_ESTIMATE}",
        table="largest",
    ),
    "status": Variable(_STEPS, "", "how the step ended", dtype="int8", meanings=STATUS_MEANINGS, is_of_steps=True),
    "convolutions": Variable(
        _STEPS, "1", "convolutions", "since the last step, or of the speed", dtype="int32", is_of_steps=True
    ),
    "wall_time": Variable(_STEPS, "s", "wall time", "since the start of the run", is_of_steps=True),
    # observables: contact and gap
    "cluster_count": Variable(_SERIES, "1", "number of contact clusters", dtype="int64"),
    "cluster_area_mean": Variable(
        _SERIES, "m^2", "mean area of a contact cluster", "its cells, counted", missing="without contact"
    ),
    "cluster_area_largest": Variable(
        _SERIES, "m^2", "area of the largest contact cluster", "its cells, counted", missing="without contact"
    ),
    "pressure_bin": Variable(("pressure_bin",), "Pa", "pressure at the middle of a bin"),
    "gap_bin": Variable(("gap_bin",), "m", "gap at the middle of a bin"),
    "pressure_density": Variable(
        (ROW, "pressure_bin"),
        "1/Pa",
        "probability density of the pressure",
        "in contact",
        missing="without contact",
    ),
    "gap_density": Variable(
        (ROW, "gap_bin"), "1/m", "probability density of the gap", "out of contact", missing="in full contact"
    ),
    "cycle": Variable(("cycle",), "1", "number of the loading cycle", "counted from 1", dtype="int64"),
    "cycle_start": Variable(("cycle",), "s", "time at which the cycle starts"),
    "cycle_work": Variable(("cycle",), "J", "work done by the force in the cycle"),
    "pull_off_force": Variable(("cycle",), "N", "pull-off force", "largest tension in the cycle"),
    "pull_off_time": Variable(("cycle",), "s", "time of the pull-off", "missing without tension"),
    "work_of_separation": Variable(("cycle",), "J", "work of separation", "of the tension while the surfaces recede"),
    # observables: leakage
    "leak_rate": Variable(
        _SERIES,
        "m^3/s",
        "leak rate",
        "volume of fluid in unit time, by the pressure drop",
        error="leak_rate_error",
        table="value",
        is_panel=True,
    ),
    "leak_rate_error": Variable(_SERIES, "m^3/s", "stated error of the leak rate", _SOLVER),
    "transmissivity": Variable(
        _SERIES, "m^3", "transmissivity", "hydraulic: of a parallel gap its cube over 12", table="value"
    ),
    "hydraulic_aperture": Variable(
        _SERIES, "m", "hydraulic aperture", "the parallel gap that leaks as much", table="value"
    ),
    "flux": Variable(_FRAME, "m^2/s", "flux", "volume flux over the height of the gap", missing="in contact"),
    "flux_x": Variable(_FRAME, "m^2/s", "flux along x", f"volume flux {_FLUX}"),
    "flux_y": Variable(_FRAME, "m^2/s", "flux along y", f"volume flux {_FLUX}"),
    # observables: contact spots
    "thermal_conductance": Variable(
        _SERIES,
        "W/K",
        "thermal conductance",
        _SPOTS,
        error="thermal_conductance_error",
        table="value",
        is_panel=True,
    ),
    "thermal_conductance_error": Variable(_SERIES, "W/K", "stated error of the thermal conductance", _BOTH),
    "electrical_conductance": Variable(
        _SERIES,
        "S",
        "electrical conductance",
        _SPOTS,
        error="electrical_conductance_error",
        table="value",
        is_panel=True,
    ),
    "electrical_conductance_error": Variable(_SERIES, "S", "stated error of the electrical conductance", _BOTH),
    # observables: closure of a joint
    "closure": Variable(_SERIES, "m", "closure", "fall of the mean gap since first touch"),
    "normal_stiffness": Variable(
        _SERIES,
        "Pa/m",
        "normal stiffness",
        "slope of nominal pressure over closure",
    ),
    # records of indentation
    "relaxation_modulus": Variable(_SERIES, "Pa", "relaxation modulus", "in shear"),
    "relaxation_modulus_low": Variable(_SERIES, "Pa", "relaxation modulus, low", "lower end of its interval of 90 %"),
    "relaxation_modulus_high": Variable(_SERIES, "Pa", "relaxation modulus, high", "upper end of its interval of 90 %"),
    # theories
    "wavelength": Variable(("wavelength",), "m", "wavelength", "geometric middle of a decade of waves"),
    "shortest_wavelength": Variable(("wavelength",), "m", "shortest wavelength", "of a decade of waves"),
    "longest_wavelength": Variable(("wavelength",), "m", "longest wavelength", "of a decade of waves"),
    "friction_of_waves": Variable(
        (ROW, "wavelength"), "1", "contribution to friction", "of a decade of waves; their sum is the coefficient"
    ),
    "temperature_of_waves": Variable((ROW, "wavelength"), "K", "temperature of the waves", "in the depth of a decade"),
    "heat_flux": Variable(_SERIES, "W/m^2", "heat flux", "of friction, into the body, over the nominal area"),
    "persson_contact_area": Variable(_SERIES, "m^2", "contact area, Persson", _ASPERITIES, missing=_FALLEN),
    "asperity_contact_area": Variable(
        _SERIES, "m^2", "contact area, Bush et al.", f"at low loads, {_ASPERITIES}", missing=_FALLEN
    ),
    "persson_friction_coefficient": Variable(_SERIES, "1", "friction coefficient, Persson", _PERSSON),
    "persson_contact_fraction": Variable(_SERIES, "1", "contact fraction, Persson", _PERSSON),
}

#: Fields that the user may request in ``fields``; the solver computes them.
FIELDS = ("pressure", "gap", "displacement")
#: Histories that are known at all accepted steps.
STEPPED = tuple(name for name, variable in VARIABLES.items() if variable.dims == _STEPS and name != "time")
#: Conductances of the contact spots.
CONDUCTANCES = ("thermal_conductance", "electrical_conductance")


def in_table(kind: Literal["value", "largest"]) -> dict[str, Variable]:
    """Return the variables whose value in one row, or whose largest value, is in tables of cases."""
    return {name: variable for name, variable in VARIABLES.items() if variable.table == kind}


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

    def telling_row(self, histories: Mapping[Any, Any]) -> int:
        """Return the number of the row that represents a result in a table."""
        values = np.asarray(histories[self.telling]) if self.telling else np.zeros(0)
        return int(np.nanargmax(values)) if np.isfinite(values).any() else -1


#: Name of an axis -> the axis.
AXES: dict[str, Axis] = {
    "time": Axis("time", "kept times", "t", ("time", "force", "approach")),
    "speed": Axis("speed", "speeds", "V", ("speed", "force", "friction_coefficient"), "friction_coefficient"),
}


def axis_of(names: Container[Any]) -> str:
    """Return the axis of the rows of a result from the names of its variables.

    Examples
    --------
    >>> axis_of({"time", "force"}), axis_of({"speed", "force"})
    ('time', 'speed')
    """
    return "speed" if "speed" in names else "time"
