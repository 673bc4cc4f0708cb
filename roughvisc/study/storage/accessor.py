"""The accessor ``ds.roughvisc``: steps of a result, observables, and figures.

``ds.roughvisc.clusters()`` is ``rv.observables.clusters(ds)``, ``ds.roughvisc.plot_maps()`` is ``rv.plot.maps(ds)``.
Every module that opens or computes a result registers the accessor. Each function is imported at its first use.
"""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import Any

import xarray as xr

from roughvisc.labels import require_steps

#: Prefix of a method -> module of its function, which lies in a higher layer and is imported at its first use.
_ROOMS = {"": "roughvisc.observables", "plot_": "roughvisc.plot"}


@xr.register_dataset_accessor("roughvisc")
class ResultAccessor:
    """Observables and figures of a result; each method calls the function of its name with this result.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result, or several as :func:`roughvisc.open_results` opens them.
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    @property
    def steps(self) -> xr.Dataset:
        """Histories of every accepted step, over ``step``."""
        return require_steps(self._dataset)

    def __getattr__(self, name: str) -> Any:
        start = "plot_" if name.startswith("plot_") else ""
        room, function = import_module(_ROOMS[start]), name.removeprefix(start)
        if function not in room.__all__:
            raise AttributeError(f"the accessor roughvisc has no {name!r}")
        method = partial(getattr(room, function), self._dataset)
        method.__doc__ = method.func.__doc__
        return method

    def __dir__(self) -> list[str]:
        known = (start + name for start, module in _ROOMS.items() for name in import_module(module).__all__)
        return [*super().__dir__(), *known]
