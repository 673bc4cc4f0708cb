"""The vocabulary of what flows through the contact: see :mod:`roughvisc.observables`."""

from __future__ import annotations

from roughvisc.variables.entry import Variable

_FRAME = ("time", "x", "y")
_SERIES = ("time",)

#: Whether fluid flows at a time, and whether its rate is known; the values of ``leak_status``, in order.
LEAK_MEANINGS = ("flows", "closed", "not_certified")

TRANSPORT: dict[str, Variable] = {
    "leak_rate": Variable(
        _SERIES,
        "m^3/s",
        "leak rate",
        "volume of fluid that flows through the gap in unit time, "
        "with the pressure drop over the length of the map along the flow; zero where leak_status says closed",
        ancillary=("leak_rate_solver_lower", "leak_rate_solver_upper", "leak_status"),
        in_table="last",
    ),
    "leak_rate_solver_lower": Variable(
        _SERIES,
        "m^3/s",
        "lower bound on this grid's leak rate",
        "of the solution of these equations alone (Thomson): without the error of the grid and that of the gap",
    ),
    "leak_rate_solver_upper": Variable(
        _SERIES,
        "m^3/s",
        "upper bound on this grid's leak rate",
        "of the solution of these equations alone (Dirichlet): without the error of the grid and that of the gap",
    ),
    "leak_status": Variable(
        _SERIES,
        "",
        "whether fluid flows",
        "closed: no path through the gap connects the two sides; cells that share only a corner are apart. "
        "not_certified: the bounds are more than 1e-6 of the leak rate apart",
        dtype="int8",
        meanings=LEAK_MEANINGS,
    ),
    "transmissivity": Variable(
        _SERIES,
        "m^3",
        "hydraulic transmissivity",
        "of the gap: "
        "leak rate times viscosity over the pressure gradient and the width across the flow: the cube of a parallel "
        "gap over 12; independent of the fluid",
        short="transmissivity",
        in_table="last",
    ),
    "hydraulic_aperture": Variable(
        _SERIES,
        "m",
        "hydraulic aperture",
        "the parallel gap that leaks as much: the cube root of 12 times the transmissivity; independent of the fluid",
        in_table="last",
    ),
    "flux": Variable(
        _FRAME,
        "m^2/s",
        "volume flux",
        "its size, of the fluid, over the height of the gap; missing in contact",
        short="flux",
    ),
    "flux_x": Variable(
        _FRAME,
        "m^2/s",
        "volume flux along x",
        "of the fluid, over the height of the gap: "
        "mean of the two faces of the cell; zero in contact and where nothing flows through",
        short="flux along x",
    ),
    "flux_y": Variable(
        _FRAME,
        "m^2/s",
        "volume flux along y",
        "of the fluid, over the height of the gap: "
        "mean of the two faces of the cell; zero in contact and where nothing flows through",
        short="flux along y",
    ),
}
