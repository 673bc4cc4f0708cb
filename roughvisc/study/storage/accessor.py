"""The accessor ``ds.roughvisc``: groups of a result, what is derived from it, and its figures.

``ds.roughvisc.clusters()`` is ``rv.observables.clusters(ds)``, ``ds.roughvisc.plot_maps()`` is ``rv.plot.maps(ds)``,
and ``ds.roughvisc.plot()`` draws maps without a choice of the figure.
Whatever opens or makes a result registers it. Each function is imported when it is asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import xarray as xr

from roughvisc.groups import attributes_of, group_of, groups_of, with_groups_of

#: Before the name of a figure.
_PLOT = "plot_"
#: Module that gives a result of a former version the names of today.
_FORMATS = "roughvisc.study.storage.formats"
#: Module that opens a result.
_STORE = "roughvisc.study.storage.store"
#: beginning of a method's name -> module whose public names follow
_ROOMS = {"": "roughvisc.observables", _PLOT: "roughvisc.views.plot"}
#: Module of the figure that needs no choice.
_QUICK = "roughvisc.views.figures.quick_plot"


@xr.register_dataset_accessor("roughvisc")
class ResultAccessor:
    """Observables and figures of this result; each is the function of that name with the result given.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result, or several as :func:`roughvisc.open_results` opens them; one of a former version, opened by xarray
        alone, is taken under the names of today.
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    @property
    def steps(self) -> xr.Dataset:
        """Histories of every accepted step, over ``step``."""
        return self._group("steps")

    @property
    def energy(self) -> xr.Dataset:
        """Work of the force, and what the material has stored and dissipated."""
        return self._group("energy")

    @property
    def attributes(self) -> dict[str, Any]:
        """All that the result says of itself, each attribute under its own name: those in ``details``, too."""
        return attributes_of(self._dataset.attrs)

    @property
    def accuracy(self) -> xr.Dataset:
        """Stated errors of the rows, the parts of them, and bounds of the contact area."""
        return self._group("accuracy")

    @property
    def cost(self) -> xr.Dataset:
        """Iterations and convolutions since the row before, and the time since the start."""
        return self._group("cost")

    def _group(self, name: str) -> xr.Dataset:
        """A group, from the file where xarray alone has opened it."""
        dataset, source = self._dataset, Path(self._dataset.encoding.get("source", ""))
        if not groups_of(dataset) and source.is_file():
            dataset = with_groups_of(import_module(_STORE).open_result(source), dataset)
        return group_of(dataset, name)

    def __getattr__(self, name: str) -> Any:
        if name == "plot":
            return _method(import_module(_QUICK).quick_plot, self._dataset)
        if name.startswith("_"):  # what notebooks and copies ask every object for
            raise AttributeError(name)
        start = _PLOT if name.startswith(_PLOT) else ""
        room = import_module(_ROOMS[start])
        if name.removeprefix(start) not in room.__all__:
            raise AttributeError(f"the accessor roughvisc has no {name!r}: expected one of {', '.join(_methods())}")
        return _method(getattr(room, name.removeprefix(start)), import_module(_FORMATS).to_current(self._dataset))

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *_methods()]


def _method(function: Callable[..., Any], dataset: xr.Dataset) -> partial[Any]:
    method = partial(function, dataset)
    method.__doc__ = function.__doc__
    return method


def _methods() -> list[str]:
    return ["plot"] + [f"{start}{name}" for start, module in _ROOMS.items() for name in import_module(module).__all__]
