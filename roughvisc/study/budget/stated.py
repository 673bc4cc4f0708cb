"""What a result of the case states of its own errors already, so that a budget need not solve it again."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.study.execution.run import unconverged
from roughvisc.study.quantities import Observable
from roughvisc.study.storage.store import whole_result

log = logging.getLogger("roughvisc")
Array = NDArray[np.float64]
#: Places of a result that differ by less are the same.
_ALIKE = 1e-9


@dataclass(frozen=True)
class Stated:
    """Errors that a result states, by the name of the quantity; what not all quantities asked for have is left out.

    Attributes
    ----------
    result : xarray.Dataset or None
        The whole result, with the rows that are asked for; None where there is none that would do.
    grid : mapping
        Half-width of the logarithm that the grid leaves, at each row. [-]
    octave : mapping
        Logarithm of the value over that without the shortest octave of waves, at each row. [-]
    """

    result: xr.Dataset | None = None
    grid: Mapping[str, Array] = field(default_factory=dict)
    octave: Mapping[str, Array] = field(default_factory=dict)


def stated_by(path: Path, quantities: Sequence[Observable], axis: str, places: Any) -> Stated:
    """What the file of a result states, if it is there and has these places of its axis; all rows where None."""
    if not path.is_file():
        return Stated()
    try:
        with whole_result(path) as opened:  # without the fields that no quantity is derived from
            needed = {one for quantity in quantities for one in quantity.fields}
            whole = opened.drop_vars([name for name in opened if opened[name].ndim > 2 and name not in needed]).load()
    except (InputError, OSError) as error:
        log.info("budget: %s: %s: the case is solved again", path, error)
        return Stated()
    rows = np.arange(whole.sizes[axis])
    if places is not None:
        wanted = np.atleast_1d(np.asarray(places, dtype=float))
        apart = np.abs(whole[axis].values[:, None] - wanted)
        rows = apart.argmin(axis=0)
        if not (apart.min(axis=0) <= _ALIKE * np.abs(wanted)).all():
            return Stated()
    if any(one not in whole for quantity in quantities for one in quantity.fields) or unconverged(whole):
        return Stated()
    grid = {one.name: one.stated_grid(whole, axis) for one in quantities}
    octave = {one.name: one.stated_octave(whole) for one in quantities}
    known: list[dict[str, Array]] = [
        {name: one[rows] for name, one in found.items() if one is not None and np.isfinite(one[rows]).all()}
        for found in (grid, octave)
    ]
    grid_of, octave_of = (one if len(one) == len(quantities) else {} for one in known)
    return Stated(whole.isel({axis: rows}), grid_of, octave_of)
