"""Units of the settings of a study, told by their dotted keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_UNITS = {
    "shear_modulus": "Pa",
    "kelvin_modulus": "Pa",
    "bulk_modulus": "Pa",
    "equilibrium": "Pa",
    "viscosity": "Pa s",
    "kelvin_viscosity": "Pa s",
    "load": "N",
    "approach": "m",
    "over": "s",
    "hold": "s",
    "period": "s",
    "time_scale": "s",
    "radius": "m",
    "wavelength": "m",
    "amplitude": "m",
    "rms_height": "m",
    "rolloff": "m",
    "shortcut": "m",
    "cutoff": "m",
    "time_step": "s",
}


def unit_of(key: str, case: Mapping[str, Any] | None = None) -> str:
    """Unit of the value at a dotted key of a study; empty where the key tells none.

    Parameters
    ----------
    key : str
        Such as ``"program.0.load"``.
    case : mapping, optional
        The case in JSON, which tells whether a cycle is one of load or of approach.

    Examples
    --------
    >>> unit_of("program.0.load"), unit_of("surface.seed"), unit_of("program.1.cycle.mean")
    ('N', '', '')
    >>> unit_of("program.0.cycle.amplitude", {"program": [{"cycle": {}, "control": "approach"}]})
    'm'
    """
    head, _, name = key.rpartition(".")
    if head.startswith("program.") and head.endswith(".cycle") and name in ("mean", "amplitude"):
        segments, number = (case or {}).get("program", []), int(head.split(".")[1])
        if number >= len(segments):
            return ""
        return "m" if segments[number].get("control") == "approach" else "N"
    return _UNITS.get(name, "")
