"""The accessor ``ds.roughvisc``: steps of a result, observables, and figures.

``ds.roughvisc.clusters()`` is ``rv.observables.clusters(ds)``, ``ds.roughvisc.plot_maps()`` is ``rv.plot.maps(ds)``.
Whatever opens or makes a result registers it. Each function is imported when it is asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import xarray as xr

from roughvisc.labels import require_steps, steps_of, with_steps

#: Before the name of a figure.
_PLOT = "plot_"
#: Module that opens a result.
_NETCDF = "roughvisc.study.storage.netcdf"
#: beginning of a method's name -> module whose public names follow
_ROOMS = {"": "roughvisc.observables", _PLOT: "roughvisc.plot"}


@xr.register_dataset_accessor("roughvisc")
class ResultAccessor:
    """Observables and figures of this result; each is the function of that name with the result given.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result, or several as :func:`roughvisc.open_results` opens them.
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    @property
    def steps(self) -> xr.Dataset:
        """Histories of every accepted step, over ``step``; read from the file if xarray alone has opened it."""
        dataset, source = self._dataset, Path(self._dataset.encoding.get("source", ""))
        if steps_of(dataset) is None and source.is_file():
            steps = steps_of(import_module(_NETCDF).open_result(source))
            dataset = dataset if steps is None else with_steps(dataset, steps)
        return require_steps(dataset)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # what notebooks and copies ask every object for
            raise AttributeError(name)
        start = _PLOT if name.startswith(_PLOT) else ""
        room = import_module(_ROOMS[start])
        if name.removeprefix(start) not in room.__all__:
            raise AttributeError(f"the accessor roughvisc has no {name!r}: expected one of {', '.join(_methods())}")
        return _method(getattr(room, name.removeprefix(start)), self._dataset)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *_methods()]


def _method(function: Callable[..., Any], dataset: xr.Dataset) -> partial[Any]:
    method = partial(function, dataset)
    method.__doc__ = function.__doc__
    return method


def _methods() -> list[str]:
    return [f"{start}{name}" for start, module in _ROOMS.items() for name in import_module(module).__all__]
