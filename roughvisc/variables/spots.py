"""The vocabulary of the contact spots: how stiff they are, what they conduct, and their area by theories."""

from __future__ import annotations

from roughvisc.variables.entry import Variable

#: What the spots conduct.
CONDUCTANCES = ("thermal_conductance", "electrical_conductance")

_SERIES = ("time",)
_MEANT = (
    "constriction on both sides, each body a half-space, without the gap and without films; infinite in full contact; "
    "with periodic boundaries of one period, without the bulk"
)


def _of(kind: str, units: str) -> dict[str, Variable]:
    name = f"{kind}_conductance"
    return {
        name: Variable(
            _SERIES,
            units,
            f"{kind} conductance",
            f"of the contact spots; {_MEANT}",
            ancillary=(f"{name}_error",),
            in_table="last",
        ),
        f"{name}_error": Variable(
            _SERIES,
            units,
            f"stated error of the {kind} conductance",
            "of the grid and of the solver",
        ),
    }


SPOTS: dict[str, Variable] = {
    "incremental_stiffness": Variable(
        _SERIES,
        "N/m",
        "incremental stiffness",
        "against a fast increment, the contact frozen: "
        "frozen_stiffness times the contact modulus, unless given that at once; missing where the material has none",
        ancillary=("incremental_stiffness_error",),
    ),
    "incremental_stiffness_error": Variable(
        _SERIES, "N/m", "stated error of the incremental stiffness", "of the grid and of the solver"
    ),
    "frozen_stiffness": Variable(
        _SERIES,
        "m",
        "frozen stiffness",
        "of the frozen contact, over the contact modulus: "
        "of a disc, twice its radius; infinite in full contact where uniform pressure displaces nothing",
        ancillary=("frozen_stiffness_error",),
    ),
    "frozen_stiffness_error": Variable(
        _SERIES, "m", "stated error of the frozen contact's stiffness", "of the grid and of the solver"
    ),
    "persson_contact_area": Variable(
        _SERIES,
        "m^2",
        "contact area, Persson",
        "by Persson's theory, at the rms slope of the surface; missing once the load has fallen",
    ),
    "asperity_contact_area": Variable(
        _SERIES,
        "m^2",
        "contact area, Bush, Gibson and Thomas",
        "at low loads, at the rms slope of the surface; missing once the load has fallen",
    ),
    **_of("thermal", "W/K"),
    **_of("electrical", "S"),
}
