"""How variables are laid out in a result's file: filters, rounding, fill values."""

from __future__ import annotations

import math
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np

from roughvisc.variables.axes import AXES
from roughvisc.variables.chunks import chunks

if TYPE_CHECKING:
    import xarray as xr

#: A field is compressed if it then takes less than this part: exact, and rounded to a precision. At 512 squared a step
#: takes 90 to 160 ms, and its frame 1.2 ms as it is. Compressed, a pressure on 2, 9 and 18 % of the cells comes down
#: to 0.03, 0.10 and 0.19 in 3.6, 6.2 and 9.7 ms (shuffling its bytes first makes it larger and takes longer); a gap
#: rounded to 1e-4 to 0.23 in 15 ms; an exact gap to 0.66 in 34 ms.
_WORTHWHILE, _WORTHWHILE_ROUNDED = 0.04, 0.5
_SMALL = 1 << 16  # compressed in any case [bytes]
_TINY = 1 << 12  # neither chunked nor compressed: the chunk's own entry in the file would outweigh it [bytes]


def is_field(variable: xr.Variable) -> bool:
    """Whether a variable is one of fields over the rows of a result."""
    return variable.ndim == 3 and variable.dims[0] in AXES and variable.dims[1:] == ("x", "y")


def may_be_missing(name: str) -> bool:
    """Whether a value of a variable may be missing, and NaN says so; any other has no fill value.

    The seed paper's algorithm states no accuracy, the direct history no energies; of steps between kept times the mean
    gap is not known over a grid that has grown since.
    """
    return any(name in axis.variables and axis.variables[name].may_be_missing for axis in AXES.values())


def bits_kept(variable: xr.Variable, precision: float | None) -> int | None:
    """Bits of a double's fraction to keep of a field, so that rounding changes it by less than that part; None: all."""
    if precision is None or not is_field(variable):
        return None
    return min(max(math.ceil(-math.log2(precision)) - 1, 1), 52)


def encoding_of(name: str, variable: xr.Variable, precision: float | None) -> dict[str, Any]:
    """What netCDF4 is told of a variable."""
    encoding: dict[str, Any] = {"fill_value": False}
    if variable.dtype.kind == "f" and may_be_missing(name):
        encoding["fill_value"] = variable.dtype.type(np.nan)
    bits = bits_kept(variable, precision)
    if bits is not None:
        encoding |= {"significant_digits": bits, "quantize_mode": "BitRound"}
    if variable.nbytes > _TINY:
        encoding["chunksizes"] = chunks(variable.shape)
        encoding |= _filters(variable, bits)
    return encoding


def _filters(variable: xr.Variable, bits: int | None) -> dict[str, Any]:
    """The filters that suit a variable, tried on some rows of the middle frame; none where they save too little."""
    middle = variable[tuple(n // 2 for n in variable.shape[:-2])]
    sample = np.ascontiguousarray(middle[:: max(1, middle.shape[0] // 16)].values)
    if bits is not None:
        sample = (sample.view(np.int64) & -(1 << (52 - bits))).view(float)  # cut off compresses as rounded
    shuffled = sample.view(np.uint8).reshape(-1, sample.itemsize).T
    size, shuffle = min(
        (len(zlib.compress(text.tobytes(), 1)), shuffle) for shuffle, text in enumerate((sample, shuffled))
    )
    if variable.nbytes > _SMALL and size > sample.nbytes * (_WORTHWHILE if bits is None else _WORTHWHILE_ROUNDED):
        return {}
    return {"zlib": True, "complevel": 1, "shuffle": bool(shuffle)}
