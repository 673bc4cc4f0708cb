"""Quantities derived from a result: contact spots, distributions, leakage, conductance, theories.

Every function takes a result and returns a Dataset that contains only the new variables; ``xarray.merge`` or
``Dataset.update`` adds them to the result. Leading dimensions other than time, such as ``case``, are kept. Fields on
Dask or in a file are processed frame by frame, lazily unless a docstring states otherwise. :mod:`roughvisc.variables`
declares names and units.
"""

from __future__ import annotations

from collections.abc import Callable

import xarray as xr

from roughvisc.observables.contact import closure, clusters, conductance, contact, distribution, leakage
from roughvisc.observables.history import cycle_work, history
from roughvisc.observables.sticking import pull_off
from roughvisc.observables.theory import area_by_theory, persson

__all__ = [
    "area_by_theory",
    "closure",
    "clusters",
    "conductance",
    "contact",
    "cycle_work",
    "distribution",
    "history",
    "leakage",
    "persson",
    "pull_off",
]


def __dir__() -> list[str]:
    return __all__


#: Table of ``[observe]`` -> function that computes its variables; the keys of the table are its keyword arguments.
OBSERVABLES: dict[str, Callable[..., xr.Dataset]] = {"leakage": leakage, "conductance": conductance}
