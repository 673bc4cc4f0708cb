"""The accessor ``h.roughvisc``: conditioning and numbers of a height grid as methods, so that steps can be chained.

``h.roughvisc.level().roughvisc.fill()`` is ``rv.fill(rv.level(h))``; ``h.roughvisc.plot()`` draws the heights, and
``ds.pressure.isel(time=-1).roughvisc.plot()`` a field of a result. ``import roughvisc.topography`` registers it, and
with it whatever gives heights: ``rv.open_scan``, ``rv.sphere``, the xarray engine. It imports nothing but xarray.
"""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import Any

import xarray as xr

#: method -> module of the function that it is
METHODS = {
    name: f"roughvisc.topography.{module}"
    for module, names in {
        "conditioning": "level mask_outliers fill gaussian_filter resample band_limit crop rotate90 invert combine "
        "taper mirror without_short_waves",
        "parameters": "parameters",
        "spectrum": "psd",
        "fitting": "fit_self_affine",
        "surrogates": "surrogates",
    }.items()
    for name in names.split()
}
#: The figure of heights, or of a field of a result: method -> module and function.
_PLOT = ("roughvisc.views.figures.quick_plot", "quick_plot")


@xr.register_dataarray_accessor("roughvisc")
class HeightAccessor:
    """Steps of conditioning and numbers of this height grid; each is the function of that name with the grid given.

    Parameters
    ----------
    height : xarray.DataArray
        Height over (x, y); for ``plot`` a field of a result, too. [m]
    """

    def __init__(self, height: xr.DataArray) -> None:
        self._height = height

    def __getattr__(self, name: str) -> Any:
        known = {method: (module, method) for method, module in METHODS.items()} | {"plot": _PLOT}
        if name not in known:
            raise AttributeError(f"the accessor roughvisc has no {name!r}: expected one of {', '.join(known)}")
        module, called = known[name]
        function = getattr(import_module(module), called)
        method = partial(function, self._height)
        method.__doc__ = function.__doc__
        return method

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *METHODS, "plot"]
