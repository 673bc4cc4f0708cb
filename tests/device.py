"""A stand-in for CuPy and its device: NumPy's arrays behind a class that refuses what CuPy refuses.

Plain arrays do not mix with arrays of the device, in no operation. Only :meth:`DeviceArray.get` and ``tolist`` copy an
array to the host, and only :func:`asarray` copies one to the device; a single value becomes a number by ``float``,
``int`` or ``bool``. What CuPy lacks is refused too: other methods of ufuncs than the call, ``initial`` and ``where``.
"""

import sys
from functools import wraps
from types import SimpleNamespace

import numpy as np
import scipy

#: What CuPy has not got, of reductions.
LACKING = {"initial", "where"}


def to_host(value):
    """Return an argument with NumPy's arrays in place of the device's; plain arrays are refused."""
    if isinstance(value, DeviceArray):
        return value.behind
    if isinstance(value, np.ndarray):
        raise TypeError("a plain array meets the device: expected an array of the device, or a number")
    return type(value)(map(to_host, value)) if isinstance(value, tuple | list) else value


def to_device(value):
    """Return a result on the device; single values stay there too."""
    if isinstance(value, np.ndarray | np.generic):
        return DeviceArray(value)
    return type(value)(map(to_device, value)) if isinstance(value, tuple | list) else value


def on_device(function):
    """Return a function of NumPy's arrays as one of the device's arrays."""

    @wraps(function)
    def call(*arguments, **settings):
        if lacking := LACKING & settings.keys():
            raise TypeError(f"CuPy has no {', '.join(lacking)}")
        return to_device(function(*to_host(arguments), **{key: to_host(value) for key, value in settings.items()}))

    return call


class DeviceArray(np.lib.mixins.NDArrayOperatorsMixin):
    """An array on the device."""

    def __init__(self, values):
        self.behind = np.asarray(values)

    def get(self):
        """Return a copy on the host."""
        return self.behind.copy()

    def __array__(self, *arguments, **settings):
        raise TypeError("an array of the device does not become a plain one silently: expected get()")

    def __array_ufunc__(self, ufunc, method, *inputs, **settings):
        if method != "__call__":
            raise TypeError(f"CuPy has no {ufunc.__name__}.{method}")
        return on_device(ufunc)(*inputs, **settings)

    def __array_function__(self, function, types, arguments, settings):
        return globals()[function.__name__](*arguments, **settings) if function.__name__ in NAMES else NotImplemented

    def __getitem__(self, key):
        return to_device(self.behind[to_host(key)])

    def __setitem__(self, key, value):
        self.behind[to_host(key)] = to_host(value)

    def __len__(self):
        return len(self.behind)

    def __iter__(self):
        return map(DeviceArray, self.behind)

    def __float__(self):
        return float(self.behind.item())

    def __int__(self):
        return int(self.behind.item())

    def __bool__(self):
        return bool(self.behind.item())

    shape, size, ndim, dtype, itemsize, T, real, imag = (
        property(lambda self, name=name: to_device(getattr(self.behind, name)))
        for name in ("shape", "size", "ndim", "dtype", "itemsize", "T", "real", "imag")
    )


METHODS = (
    "all",
    "any",
    "astype",
    "conj",
    "copy",
    "max",
    "mean",
    "min",
    "nonzero",
    "reshape",
    "sum",
    "take",
    "tolist",
    "view",
)
for name in METHODS:
    setattr(DeviceArray, name, on_device(getattr(np.ndarray, name)))
    getattr(DeviceArray, name).__doc__ = None  # with examples that are not ours

#: Functions of the device.
NAMES = [
    *(
        "abs",
        "arange",
        "ascontiguousarray",
        "bincount",
        "concatenate",
        "cos",
        "count_nonzero",
        "cumsum",
        "einsum",
        "empty",
    ),
    *("empty_like", "exp", "flatnonzero", "full", "ix_", "maximum", "minimum", "multiply", "ones", "ones_like"),
    *("pad", "ptp", "roll", "sin", "sort", "sqrt", "stack", "take", "where", "zeros", "zeros_like"),
]
globals().update({name: on_device(getattr(np, name)) for name in NAMES})
fft = SimpleNamespace()
for name in ("rfftn", "irfftn", "rfft", "irfft", "fft", "ifft", "dctn", "idctn"):
    setattr(fft, name, on_device(getattr(scipy.fft, name)))


#: One device with 8 GiB, all of it free; it stands in for the libraries of CUDA too.
runtime = SimpleNamespace(getDeviceCount=lambda: 1, memGetInfo=lambda: (8 << 30, 8 << 30), getVersion=lambda: 13000)
cuda = SimpleNamespace(runtime=runtime, nvrtc=runtime, cufft=runtime)


def get_default_memory_pool():
    """Return the pool of memory that is kept for later arrays: empty."""
    return SimpleNamespace(free_bytes=lambda: 0)


def asarray(values):
    """Return an array on the device."""
    return values if isinstance(values, DeviceArray) else DeviceArray(np.array(values))


def install(monkeypatch):
    """Put the device in CuPy's place, and return its namespace."""
    xp = sys.modules[__name__]
    monkeypatch.setitem(sys.modules, "cupy", xp)
    monkeypatch.setitem(sys.modules, "cupyx.scipy", SimpleNamespace(fft=fft))
    return xp
