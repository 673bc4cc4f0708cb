"""Conditioning of scans: one function for each step, and the order of the steps.

Every function takes a grid and returns a new one. The attribute ``history`` records the steps. Missing points are NaN
until :func:`fill`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

import xarray as xr

from roughvisc.arguments import DataNeeded, a_table, call, dotted, refuse_unknown
from roughvisc.errors import InputError
from roughvisc.topography.filters import fill, gaussian_filter, level, mask_outliers
from roughvisc.topography.framing import crop, invert, rotate90
from roughvisc.topography.recipes import surrogate
from roughvisc.topography.spectrum import resample, without_short_waves


class ConditioningStep(NamedTuple):
    """Conditioning step.

    Attributes
    ----------
    function : callable
        Takes heights and arguments, and returns heights.
    argument : str
        Name of the argument after the heights if a plain value (no truth value, no table) sets it, else empty.
    """

    function: Callable[..., xr.DataArray]
    argument: str = ""


#: Conditioning steps in the order in which they are applied. A value is true (the function with its defaults), false
#: (the step is skipped), the value of one argument, or a table of arguments.
STEPS: dict[str, ConditioningStep] = {
    "crop": ConditioningStep(crop),
    "rotate90": ConditioningStep(rotate90, "turns"),
    "invert": ConditioningStep(invert),
    "level": ConditioningStep(level, "order"),
    "outliers": ConditioningStep(mask_outliers),
    "fill": ConditioningStep(fill),
    "filter": ConditioningStep(gaussian_filter, "cutoff"),
    "shortest_wave": ConditioningStep(without_short_waves, "shortest"),
    "realisation": ConditioningStep(surrogate, "number"),
    "resample": ConditioningStep(resample, "shape"),
}
#: Steps allowed for each face before two faces are combined.
FACE_STEPS = ("crop", "rotate90", "invert", "level", "outliers", "fill", "filter")
#: Steps that leave a periodic surface periodic.
_KEEP_PERIOD = ("rotate90", "invert", "shortest_wave", "resample")


def condition(h: xr.DataArray, steps: Mapping[str, Any], where: str = "") -> xr.DataArray:
    """Apply conditioning steps to heights.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y) [m]; with :class:`~roughvisc.arguments.NoData`, the steps are only checked.
    steps : mapping
        Any of :data:`STEPS` with their values, in any order; they are applied in the order of :data:`STEPS`.
    where : str
        Dotted name of the table, for messages.

    Returns
    -------
    xarray.DataArray
        Conditioned height. [m]

    Raises
    ------
    InputError
        If a step or an option is unknown, or a value is wrong.
    """
    refuse_unknown(where, a_table(where or "conditioning", steps), STEPS)
    for name, step in STEPS.items():
        value = steps.get(name, False)
        key = dotted(where, name)
        if value is False:
            continue
        table = value if isinstance(value, Mapping) else {}
        plain = [] if isinstance(value, Mapping | bool) else [value]
        if plain and not step.argument:
            raise InputError(key=key, found=value, expected="true, false or a table")
        with suppress(DataNeeded):
            h = call(step.function, key, table, h, *plain)
    return h


def boundary_after(steps: Mapping[str, Any], made: str | None) -> str | None:
    """Return the boundary of a surface after conditioning steps; None if the user has to state it.

    Parameters
    ----------
    steps : mapping
        As for :func:`condition`. ``realisation`` makes any surface periodic. Rotation, inversion, removal of short
        waves and resampling keep a periodic surface periodic. After any other step the boundary is unknown.
    made : {"free", "periodic"} or None
        Boundary for which the surface was made.

    Examples
    --------
    >>> boundary_after({"level": 1, "realisation": 1}, None), boundary_after({"level": 1}, "free")
    ('periodic', None)
    """
    for step in STEPS:
        if steps.get(step, False) is not False:
            kept = made == "periodic" and step in _KEEP_PERIOD
            made = "periodic" if kept or step == "realisation" else None
    return made
