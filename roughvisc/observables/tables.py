"""What ``[observe]`` of a study asks for."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.observables.conductance import conductance
from roughvisc.observables.leakage import leakage

#: Table of ``[observe]`` -> what derives it from a result; the keys of the table are its keyword arguments.
OBSERVABLES: dict[str, Callable[..., xr.Dataset]] = {"leakage": leakage, "conductance": conductance}


def asked(dataset: xr.Dataset, observe: Mapping[str, Mapping[str, Any]] | None = None) -> xr.Dataset:
    """Compute the observables that the study of a result requests.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.
    observe : mapping, optional
        Name of each observable -> its keyword arguments. Default: those of ``[observe]`` in the study, as the
        attribute ``case`` states it.

    Returns
    -------
    xarray.Dataset
        Only the new variables; none if nothing is requested.

    Raises
    ------
    InputError
        If an observable is unknown, or as in its own function.
    """
    if observe is None:
        observe = json.loads(dataset.attrs.get("case", "{}")).get("observe", {})
    if unknown := set(observe) - set(OBSERVABLES):
        raise InputError(f"observe: {min(unknown)!r} is no observable: expected some of {', '.join(OBSERVABLES)}")
    found = [OBSERVABLES[name](dataset, **arguments) for name, arguments in observe.items()]
    return xr.merge(found, compat="equals", join="exact") if found else xr.Dataset()
