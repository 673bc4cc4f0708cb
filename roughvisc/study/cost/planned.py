"""A plan as a notebook shows it: a Dataset like any other, whose table says what each case will take."""

from __future__ import annotations

import numpy as np
import xarray as xr

from roughvisc.notebook import table
from roughvisc.units import unit_for

#: Cases that a notebook shows.
_SHOWN = 8
#: heading -> variable and its unit
_COLUMNS = {
    "steps": ("steps", ""),
    "convolutions": ("convolutions", ""),
    "wall time": ("wall_time", "s"),
    "memory": ("memory", "byte"),
    "disk": ("disk", "byte"),
}


class Plan(xr.Dataset):
    """What :func:`roughvisc.plan` gives."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        known = {"cells_x", "cells_y", "refusal", *(name for name, _ in _COLUMNS.values())}
        if not known <= set(self.data_vars) or self["refusal"].dims != ("case",) or "processes" not in self.attrs:
            return super()._repr_html_()  # a part of a plan, or something made from one
        varied = [str(name) for name in self.coords if name not in ("case", "case_key")]
        whole = [
            f"{self.sizes['case']} cases, {self.attrs['processes']} side by side",
            *(f"{word} {_text(self.attrs[name], unit)}" for word, (name, unit) in list(_COLUMNS.items())[2:]),
        ]
        rows = [("", *varied, "cells", *_COLUMNS, "refused" if self["refusal"].any() else "")]
        for number in range(min(self.sizes["case"], _SHOWN)):
            one = self.isel(case=number)
            values = (_text(float(one[name]), unit) for name, unit in _COLUMNS.values())
            given = (_varied(one[name]) for name in varied)
            rows.append(
                (str(number + 1), *given, f"{int(one.cells_x)} x {int(one.cells_y)}", *values, str(one.refusal.values))
            )
        if (more := self.sizes["case"] - _SHOWN) > 0:
            rows.append(("...", f"{more} more"))
        return table(f"{self.attrs.get('title') or 'Plan'}: {', '.join(whole)}", rows)


def _varied(value: xr.DataArray) -> str:
    number = value.values[()]
    if not isinstance(number, np.number):
        return str(number)
    unit = str(value.attrs.get("units", ""))
    return unit_for([number], unit).text(float(number), 6) if unit else f"{number:.6g}"


def _text(value: float, unit: str) -> str:
    if not np.isfinite(value):
        return "not known"
    if unit == "byte":
        return unit_for([value], "B").text(value)
    return unit_for([value], unit).text(value) if unit else f"{value:.0f}"
