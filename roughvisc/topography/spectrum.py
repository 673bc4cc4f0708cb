"""Power spectrum of heights: its modes, and their radial average."""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy.fft
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.grid import checked, spacing

# Of the mean square slope, what tells the shortest wave of a surface.
_OF_SLOPE = 0.99


def hann(z: np.ndarray) -> np.ndarray:
    """Heights under a Hann window whose mean square is one. [m]"""
    weight = np.multiply.outer(*(1 - np.cos(2 * np.pi * (np.arange(n) + 0.5) / n) for n in z.shape))
    return z * weight / np.sqrt(np.mean(weight**2))


def modes(
    z: np.ndarray, cells: tuple[float, float], norm: Literal["backward", "forward"] = "backward"
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Modes of heights that repeat.

    Parameters
    ----------
    z : ndarray, shape (nx, ny)
        Heights. [m]
    cells : tuple of float
        Cell sides. [m]
    norm : {"backward", "forward"}
        Of the transform: the squares of sums over the points, or of means (the variances). [m2]

    Returns
    -------
    q_x, q_y : ndarray, shapes (nx, 1) and (1, ny // 2 + 1)
        Wavevectors. [rad/m]
    power, count : ndarray, shape (nx, ny // 2 + 1)
        Squared moduli [m2], and how many modes each stands for: two where its conjugate is not stored.
    """
    (nx, ny), (dx, dy) = z.shape, cells
    power = np.abs(scipy.fft.rfft2(z, norm=norm)) ** 2
    q_x, q_y = 2 * np.pi * scipy.fft.fftfreq(nx, dx), 2 * np.pi * scipy.fft.rfftfreq(ny, dy)
    count = np.full(q_y.size, 2.0)
    count[0] = 1.0
    if ny % 2 == 0:
        count[-1] = 1.0
    return q_x[:, None], q_y[None], power, np.broadcast_to(count, power.shape)


def without_last_octave(z: np.ndarray, cells: tuple[float, float]) -> tuple[np.ndarray, float]:
    """Heights that repeat, without the shortest octave of their waves.

    Parameters
    ----------
    z : ndarray, shape (nx, ny)
        Heights. [m]
    cells : tuple of float
        Cell sides. [m]

    Returns
    -------
    heights : ndarray, shape (nx, ny)
        Without the waves shorter than the length below. [m]
    shortest : float
        Twice the wavelength above which 99 % of the mean square slope lie: what is below that one counts as none. [m]
    """
    q_x, q_y, power, count = modes(z, cells)
    q = np.hypot(q_x, q_y)
    order = np.argsort(q, axis=None)
    slope = np.cumsum((count * q**2 * power).ravel()[order])
    if not slope[-1] > 0:
        return z, 0.0
    most = 0.5 * float(q.ravel()[order][np.searchsorted(slope, _OF_SLOPE * slope[-1])])
    kept = scipy.fft.irfft2(np.where(q <= most, scipy.fft.rfft2(z), 0.0), s=z.shape)
    return kept, 2 * np.pi / most


def psd(h: xr.DataArray, window: Literal["hann"] | None = None) -> xr.Dataset:
    r"""Radially averaged power spectral density.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), without missing points. [m]
    window : {"hann"}, optional
        None for a surface that repeats. "hann": a cosine window, for a scan that does not (its mean square is one).

    Returns
    -------
    xarray.Dataset
        Over ``wavevector`` [rad/m], the mean modulus of each ring: ``psd`` [m4], the mean of the two-dimensional
        density over the ring, and ``modes``, the number of waves in it.

    Raises
    ------
    InputError
        If points are missing, or the window is another.

    Notes
    -----
    The density is :math:`C(\mathbf q) = |\tilde h|^2 / A` with :math:`\tilde h = \Delta x \Delta y \sum h\,
    e^{-i \mathbf q \cdot \mathbf r}`, so that :math:`\langle h^2 \rangle = (2 \pi)^{-2} \int C\, d^2q`. Every wave is
    in one ring: the sum of ``psd * modes`` over the area :math:`A` is the variance exactly (Parseval) where there is no
    window. Rings are as wide as the coarser of the two wavevector steps; beyond the Nyquist wavevector they are parts.

    References
    ----------
    .. [1] T. D. B. Jacobs, T. Junge, L. Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001.
    """
    h = checked(h, "psd", least=1)
    if np.isnan(h.values).any():
        raise InputError(f"psd: {int(np.isnan(h.values).sum())} points are missing: expected none (fill them first)")
    if window not in (None, "hann"):
        raise InputError(f"psd: window is {window!r}: expected 'hann' or None")
    cells, shape = spacing(h), h.shape
    z = h.values - h.values.mean()
    q_x, q_y, power, count = modes(hann(z) if window else z, cells)
    density = power * (cells[0] * cells[1] / (shape[0] * shape[1]))
    q, count = np.hypot(q_x, q_y), count.ravel()
    step = 2 * np.pi / min((n * d for n, d in zip(shape, cells, strict=True) if n > 1), default=1.0)
    ring = np.maximum(np.round(q.ravel() / step).astype(int), 1) - 1
    ring[0] = -1  # the mean
    counted, at, total = (
        np.bincount(ring + 1, weight)[1:] for weight in (count, count * q.ravel(), count * density.ravel())
    )
    ring = np.flatnonzero(counted)
    density_attrs = {"units": "m^4", "long_name": "power spectral density of height, radial average"}
    density_attrs["comment"] = "mean square height = integral of psd over d2q / (2 pi)^2 = sum of psd * modes / area"
    return xr.Dataset(
        {
            "psd": ("wavevector", total[ring] / counted[ring], density_attrs),
            "modes": (
                "wavevector",
                counted[ring].astype(int),
                {"units": "1", "long_name": "waves in the ring"},
            ),
        },
        coords={"wavevector": ("wavevector", at[ring] / counted[ring], {"units": "rad/m", "long_name": "wavevector"})},
        attrs={"area": float(np.prod(shape) * cells[0] * cells[1]), "window": window or "none"},
    )
