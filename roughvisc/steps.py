"""History of all accepted steps of a result.

A result holds rows at its kept times. The history of every accepted step is a Dataset of its own, the group ``steps``
of the file. A Dataset carries it in ``encoding``: xarray keeps that through selections and copies and writes it to no
file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roughvisc.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

#: Group of a result's file, and what it holds.
STEPS, TITLE = "steps", "histories of every accepted step"
_CARRIED = "roughvisc_steps"


def with_steps(result: xr.Dataset, steps: xr.Dataset) -> xr.Dataset:
    """Return a result that carries the history of its accepted steps."""
    found = result.copy(deep=False)
    found.encoding = {**result.encoding, _CARRIED: steps}
    return found


def steps_of(result: xr.Dataset) -> xr.Dataset | None:
    """Return the history of the accepted steps that a result carries; None if it carries none of its own.

    xarray keeps the encoding of the first of several Datasets that it combines. Therefore the rows are compared with
    the steps.
    """
    steps = result.encoding.get(_CARRIED)
    return steps if steps is not None and _are_rows_of(result, steps) else None


def _are_rows_of(result: xr.Dataset, steps: xr.Dataset) -> bool:
    """Whether time and force of every row are those of a step."""
    if not {"time", "force"} <= result.variables.keys() or result["force"].dims not in ((), ("time",)):
        return False
    rows, known = (
        set(zip(np.ravel(one["time"]).tolist(), np.ravel(one["force"]).tolist(), strict=True))
        for one in (result, steps)
    )
    return rows <= known


def require_steps(result: xr.Dataset) -> xr.Dataset:
    """Return the history of the accepted steps of a result.

    Raises
    ------
    InputError
        If the Dataset carries none.
    """
    steps = steps_of(result)
    if steps is None:
        raise InputError(
            key=STEPS,
            found=f"a Dataset over {', '.join(map(str, result.dims)) or 'nothing'}",
            expected="a result over time from rv.simulate, rv.run or rv.open_result, or a selection of its rows",
        )
    return steps
