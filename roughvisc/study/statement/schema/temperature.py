"""Temperature in ``[material]``: the keys of the time-temperature shift, and the factor that they state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.scaled import LARGEST_SHIFT
from roughvisc.mechanics.materials.temperature import arrhenius_shift, wlf_shift
from roughvisc.study.statement.schema.entries import measured
from roughvisc.study.statement.schema.section import refuse

#: key -> its kind; every model takes them, and none of them is needed
KEYS: dict[str, Any] = {
    "temperature": measured("K", above=0),
    "reference_temperature": measured("K", above=0),
    "wlf_c1": measured("1", above=0),
    "wlf_c2": measured("K", above=0, difference=True),
    "activation_energy": measured("J/mol", above=0),
    "shift_factor": measured("1", least=1 / LARGEST_SHIFT, most=LARGEST_SHIFT),
}
_LAWS = (("wlf_c1", "wlf_c2"), ("activation_energy",))
_WANTED = "wlf_c1 and wlf_c2, or activation_energy"


def shift_factor(stated: Mapping[str, Any]) -> float:
    """What all times of a material are multiplied by; one if nothing is stated.

    Parameters
    ----------
    stated : mapping
        Values of :data:`KEYS`, None where there is none.

    Raises
    ------
    ValidationError
        Naming the key, if one is missing or too many, or the temperature is out of the law's range.
    """
    given = {key: stated[key] for key in KEYS if stated.get(key) is not None}
    if "shift_factor" in given:
        if len(given) > 1:
            beside = next(key for key in given if key != "shift_factor")
            raise refuse("shift_factor", f"found beside {beside}: expected one of them")
        return float(given["shift_factor"])
    if not given:
        return 1.0
    for key in ("temperature", "reference_temperature"):
        if key not in given:
            raise refuse(key, f"missing: expected a temperature in K, or with its unit, beside {next(iter(given))}")
    laws = [law for law in _LAWS if any(key in given for key in law)]
    if len(laws) != 1:
        found = f"found {' and '.join(laws[0] + laws[1])}" if laws else "missing"
        raise refuse(laws[1][0] if laws else "wlf_c1", f"{found}: expected {_WANTED}")
    for key in laws[0]:
        if key not in given:
            raise refuse(key, f"missing: expected {_WANTED}")
    at = given["temperature"], given["reference_temperature"]
    try:
        factor = (
            wlf_shift(*at, given["wlf_c1"], given["wlf_c2"])
            if "wlf_c1" in given
            else arrhenius_shift(*at, given["activation_energy"])
        )
    except InputError as error:
        raise refuse("temperature", str(error).replace("temperature is", "found", 1)) from error
    if not 1 / LARGEST_SHIFT <= factor <= LARGEST_SHIFT:
        raise refuse(
            "temperature",
            f"found {at[0]:g} K and a reference of {at[1]:g} K, a shift by {factor:.1g}: expected one from 1e-30 to "
            "1e30; a number is in kelvin, and '25 degC' is a text",
        )
    return factor
