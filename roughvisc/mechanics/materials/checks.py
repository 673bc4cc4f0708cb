"""Checks of material parameters."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.arguments import one_of
from roughvisc.errors import InputError

Array = NDArray[np.float64]
#: Kind of test in which a modulus or a compliance was measured.
Kind = Literal["shear", "tensile"]


def check_poisson(poisson: float) -> None:
    if not -1 < poisson <= 0.5:
        raise InputError(key="poisson", found=poisson, expected="a number above -1 and up to 0.5")


def tensile_to_shear(kind: Kind, poisson: float) -> float:
    """Return the shear compliance over the measured compliance: ``2 (1 + nu)`` in tension, one in shear."""
    check_poisson(poisson)
    return 2 * (1 + poisson) if one_of("kind", kind, get_args(Kind)) == "tensile" else 1.0


def checked_rows(names: tuple[str, ...], *columns: ArrayLike, ascending: bool = True) -> tuple[Array, ...]:
    """Return the columns of a table of measurements as arrays.

    Parameters
    ----------
    names : tuple of str
        Names of the columns, for the messages; the first is the time or the frequency.
    columns : array_like
        Columns of equal length.
    ascending : bool
        Whether the first column must ascend.

    Returns
    -------
    tuple of ndarray

    Raises
    ------
    InputError
        If the lengths differ, there are fewer than two rows, a number is negative or not finite, or the first
        column does not ascend; the message names the row, counted from 0.
    """
    arrays = tuple(np.asarray(column, dtype=float) for column in columns)
    sizes = [array.size for array in arrays]
    if any(array.ndim != 1 for array in arrays) or len(set(sizes)) > 1 or sizes[0] < 2:
        found = ", ".join(f"{size} of {name}" for size, name in zip(sizes, names, strict=True))
        raise InputError(f"table has {found}: expected as many, at least two")
    for name, array in zip(names, arrays, strict=True):
        for row in np.flatnonzero(~(np.isfinite(array) & (array >= 0)))[:1]:
            raise InputError(f"table row {row}: {name} is {array[row]:g}: expected a finite number, not negative")
    steps = np.diff(arrays[0]) <= 0
    for row in np.flatnonzero(steps)[:1] + 1 if ascending else ():
        begins_again = np.count_nonzero(steps) < steps.size / 2 and not steps[row : row + 1].all()
        expected = f"expected ascending {names[0]}"
        if begins_again:
            expected = "several temperatures? expected the rows of one temperature, or a master curve"
        again = f"{names[0]} {arrays[0][row]:g} after {arrays[0][row - 1]:g}"
        raise InputError(f"table row {row}: {again}: {expected}")
    return arrays
