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
    return ducc0.fft.r2c(_lengthened(x, n, axis), axes=(axis,), out=out, nthreads=_threads(workers))


def irfft(
    x: Field, n: int, axis: int, overwrite_x: bool = False, workers: int | None = None, out: Field | None = None
) -> Field:
    return _real(x, (axis,), n, overwrite_x, workers, out)


def cfft(x: Field, axis: int, n: int | None = None, overwrite_x: bool = False, workers: int | None = None) -> Field:
    return _complex(_lengthened(x, n, axis), axis, True, overwrite_x, workers)


def cifft(x: Field, axis: int, overwrite_x: bool = False, workers: int | None = None) -> Field:
    return _complex(x, axis, False, overwrite_x, workers)


def rfft2(x: Field, workers: int | None = None) -> Field:
    return ducc0.fft.r2c(x, axes=(0, 1), nthreads=_threads(workers))


def irfft2(x: Field, s: tuple[int, int], overwrite_x: bool = False, workers: int | None = None) -> Field:
    return _real(x, (0, 1), s[1], overwrite_x, workers)


def dct(
    x: Field,
    axis: int,
    n: int | None = None,
    overwrite_x: bool = False,
    workers: int | None = None,
    out: Field | None = None,
) -> Field:
    return _cosine(_lengthened(x, n, axis), (axis,), 2, overwrite_x, workers, out)


def idct(
    x: Field,
    axis: int,
    n: int | None = None,
    overwrite_x: bool = False,
    workers: int | None = None,
    out: Field | None = None,
) -> Field:
    return _cosine(_lengthened(x, n, axis), (axis,), 3, overwrite_x, workers, out)


def dctn(x: Field, workers: int | None = None) -> Field:
    return _cosine(x, (0, 1), 2, False, workers)


def idctn(x: Field, s: tuple[int, int], overwrite_x: bool = False, workers: int | None = None) -> Field:
    assert x.shape == s
    return _cosine(x, (0, 1), 3, overwrite_x, workers)


def _complex(x: Field, axis: int, forward: bool, overwrite: bool, workers: int | None) -> Field:
    norm = 0 if forward else 2
    out = x if overwrite else None
    return ducc0.fft.c2c(x, axes=(axis,), forward=forward, inorm=norm, out=out, nthreads=_threads(workers))


def _real(
    x: Field, axes: tuple[int, ...], n: int, overwrite: bool, workers: int | None, out: Field | None = None
) -> Field:
    given = {"forward": False, "inorm": 2, "allow_overwriting_input": overwrite, "nthreads": _threads(workers)}
    return ducc0.fft.c2r(x, axes=axes, lastsize=n, out=out, **given)


def _cosine(
    x: Field, axes: tuple[int, ...], kind: int, overwrite: bool, workers: int | None, out: Field | None = None
) -> Field:
    norm = 0 if kind == 2 else 2
    out = x if overwrite else out
    return ducc0.fft.dct(x, type=kind, axes=axes, inorm=norm, out=out, nthreads=_threads(workers))


def _lengthened(x: Field, n: int | None, axis: int) -> Field:
    """The field with zeros behind it."""
    if n is None or x.shape[axis] == n:
        return x
    shape = list(x.shape)
    shape[axis] = n
    longer = np.zeros(shape, x.dtype)
    longer[tuple(slice(length) for length in x.shape)] = x
    return longer


def _threads(workers: int | None) -> int:
    return fft.get_workers() if workers is None else workers
