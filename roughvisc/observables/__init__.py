"""Quantities derived from a result: contact spots, distributions, leakage, conductance, theories.

Every function takes a result and returns a Dataset that contains only the new variables; ``xarray.merge`` or
``Dataset.update`` adds them to the result. Leading dimensions other than time, such as ``case``, are kept. Fields on
Dask or in a file are processed frame by frame, lazily unless a docstring states otherwise. :mod:`roughvisc.variables`
declares names and units.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.observables.conductance import conductance
from roughvisc.observables.contact import clusters, contact, distribution
from roughvisc.observables.histories import cycle_work, history
from roughvisc.observables.leakage import leakage
from roughvisc.observables.theory import area_by_theory, persson

__all__ = [
    "area_by_theory",
    "clusters",
    "conductance",
    "contact",
    "cycle_work",
    "distribution",
    "history",
    "leakage",
    "persson",
]


def __dir__() -> list[str]:
    return __all__


#: Table of ``[observe]`` -> function that computes its variables; the keys of the table are its keyword arguments.
OBSERVABLES: dict[str, Callable[..., xr.Dataset]] = {"leakage": leakage, "conductance": conductance}


def study_observables(dataset: xr.Dataset, observe: Mapping[str, Mapping[str, Any]] | None = None) -> xr.Dataset:
    """Compute the observables that the study of a result requests.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.
    observe : mapping, optional
        Name of each observable -> its keyword arguments. Default: the table ``[observe]`` of the study, from the
        attribute ``case``.

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
        raise InputError(f"observe: unknown observable {min(unknown)!r}: expected some of {', '.join(OBSERVABLES)}")
    found = [OBSERVABLES[name](dataset, **arguments) for name, arguments in observe.items()]
    return xr.merge(found, compat="equals", join="exact") if found else xr.Dataset()
