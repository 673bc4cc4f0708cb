"""The functions of ``scipy.fft`` that :mod:`~roughvisc.mechanics.bodies.transforms` needs, computed by ducc0.

Same arguments, same results to rounding. ducc0 is an optional dependency, the extra ``fast``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

try:
    import ducc0
except ImportError:
    ducc0 = None

Field = NDArray[Any]


def rfft(x: Field, n: int, axis: int, workers: int | None = None, out: Field | None = None) -> Field:
    return ducc0.fft.r2c(_lengthened(x, n, axis), axes=(axis,), out=out, nthreads=workers or fft.get_workers())


def irfft(
    x: Field, n: int, axis: int, overwrite_x: bool = False, workers: int | None = None, out: Field | None = None
) -> Field:
    given = {"forward": False, "inorm": 2, "allow_overwriting_input": overwrite_x}
    return ducc0.fft.c2r(x, axes=(axis,), lastsize=n, out=out, nthreads=workers or fft.get_workers(), **given)


def cfft(x: Field, axis: int, n: int | None = None, overwrite_x: bool = False, workers: int | None = None) -> Field:
    x = _lengthened(x, n, axis)
    out = x if overwrite_x else None
    return ducc0.fft.c2c(x, axes=(axis,), out=out, nthreads=workers or fft.get_workers())


def cifft(x: Field, axis: int, overwrite_x: bool = False, workers: int | None = None) -> Field:
    out = x if overwrite_x else None
    return ducc0.fft.c2c(x, axes=(axis,), forward=False, inorm=2, out=out, nthreads=workers or fft.get_workers())


def rfft2(x: Field, workers: int | None = None) -> Field:
    return ducc0.fft.r2c(x, axes=(0, 1), nthreads=workers or fft.get_workers())


def irfft2(x: Field, s: tuple[int, int], overwrite_x: bool = False, workers: int | None = None) -> Field:
    given = {"forward": False, "inorm": 2, "allow_overwriting_input": overwrite_x}
    return ducc0.fft.c2r(x, axes=(0, 1), lastsize=s[1], nthreads=workers or fft.get_workers(), **given)


def dct(
    x: Field,
    axis: int,
    n: int | None = None,
    overwrite_x: bool = False,
    workers: int | None = None,
    out: Field | None = None,
) -> Field:
    x = _lengthened(x, n, axis)
    out = x if overwrite_x else out
    return ducc0.fft.dct(x, type=2, axes=(axis,), out=out, nthreads=workers or fft.get_workers())


def idct(
    x: Field,
    axis: int,
    n: int | None = None,
    overwrite_x: bool = False,
    workers: int | None = None,
    out: Field | None = None,
) -> Field:
    x = _lengthened(x, n, axis)
    out = x if overwrite_x else out
    return ducc0.fft.dct(x, type=3, axes=(axis,), inorm=2, out=out, nthreads=workers or fft.get_workers())


def dctn(x: Field, workers: int | None = None) -> Field:
    return ducc0.fft.dct(x, type=2, axes=(0, 1), nthreads=workers or fft.get_workers())


def idctn(x: Field, s: tuple[int, int], overwrite_x: bool = False, workers: int | None = None) -> Field:
    assert x.shape == s
    out = x if overwrite_x else None
    return ducc0.fft.dct(x, type=3, axes=(0, 1), inorm=2, out=out, nthreads=workers or fft.get_workers())


def _lengthened(x: Field, n: int | None, axis: int) -> Field:
    """The field with zeros behind it."""
    if n is None or x.shape[axis] == n:
        return x
    shape = list(x.shape)
    shape[axis] = n
    longer = np.zeros(shape, x.dtype)
    longer[tuple(slice(length) for length in x.shape)] = x
    return longer
