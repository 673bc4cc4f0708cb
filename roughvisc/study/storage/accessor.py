"""The accessor ``ds.roughvisc``: steps of a result, observables, and figures.

``ds.roughvisc.clusters()`` is ``rv.observables.clusters(ds)``, ``ds.roughvisc.plot_maps()`` is ``rv.plot.maps(ds)``.
Every module that opens or computes a result registers the accessor. Each function is imported at its first use.
"""

from __future__ import annotations

from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import xarray as xr

from roughvisc.labels import require_steps, steps_of, with_steps

#: Prefix of the methods that draw figures.
_PLOT = "plot_"
#: Module that opens a result.
_NETCDF = "roughvisc.study.storage.netcdf"
#: Prefix of a method -> module of its function.
_ROOMS = {"": "roughvisc.observables", _PLOT: "roughvisc.plot"}


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
        """Histories of every accepted step, over ``step``; read from the file if xarray's own functions opened it."""
        dataset, source = self._dataset, Path(self._dataset.encoding.get("source", ""))
        if steps_of(dataset) is None and source.is_file():
            steps = steps_of(import_module(_NETCDF).open_result(source))
            dataset = dataset if steps is None else with_steps(dataset, steps)
        return require_steps(dataset)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # special methods that notebooks and copies look up
            raise AttributeError(name)
        start = _PLOT if name.startswith(_PLOT) else ""
        room = import_module(_ROOMS[start])
        if name.removeprefix(start) not in room.__all__:
            raise AttributeError(f"the accessor roughvisc has no {name!r}: expected one of {', '.join(_methods())}")
        function = getattr(room, name.removeprefix(start))
        method = partial(function, self._dataset)
        method.__doc__ = function.__doc__
        return method

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *_methods()]


def _methods() -> list[str]:
    return [f"{start}{name}" for start, module in _ROOMS.items() for name in import_module(module).__all__]
