"""Power spectrum of heights: its modes, and their radial average."""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy.fft
import xarray as xr

from roughvisc.arguments import one_of
from roughvisc.topography.grid import checked, require_complete, spacing

# Share of the mean square slope in the waves down to the shortest wave of a surface.
_OF_SLOPE = 0.99


def hann(z: np.ndarray) -> np.ndarray:
    """Return heights under a Hann window with a mean square of one. [m]"""
    weights = [1 - np.cos(2 * np.pi * (np.arange(n) + 0.5) / n) for n in z.shape]
    along_x, along_y = (weight / np.sqrt(np.mean(weight**2)) for weight in weights)
    return z * along_x[:, None] * along_y


def wavevectors(shape: tuple[int, ...], cells: tuple[float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the wavevectors along x and, from zero on, along y [rad/m], and the number of modes of each column."""
    (nx, ny), (dx, dy) = shape, cells
    count = np.where(2 * np.arange(ny // 2 + 1) % ny == 0, 1.0, 2.0)  # two if the conjugate is not stored
    return 2 * np.pi * scipy.fft.fftfreq(nx, dx), 2 * np.pi * scipy.fft.rfftfreq(ny, dy), count


def last_octave(z: np.ndarray, cells: tuple[float, float]) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the waves of periodic heights, and where their shortest octave begins.

    Parameters
    ----------
    z : ndarray, shape (nx, ny)
        Heights. [m]
    cells : tuple of float
        Cell sides. [m]

    Returns
    -------
    q, power : ndarray, shape (nx, ny // 2 + 1)
        Length of each wavevector [rad/m], and the variance of its waves [m2].
    begins : float
        Half the wave number below which 99 % of the mean square slope lie; zero for a flat surface. [rad/m]
    """
    q_x, q_y, count = wavevectors(z.shape, cells)
    q, power = np.hypot(q_x[:, None], q_y), count * np.abs(scipy.fft.rfft2(z, norm="forward")) ** 2
    order = np.argsort(q, axis=None)
    summed = np.cumsum((q**2 * power).ravel()[order])
    end = q.ravel()[order][np.searchsorted(summed, _OF_SLOPE * summed[-1])] if summed[-1] > 0 else 0.0
    return q, power, 0.5 * float(end)


def psd(h: xr.DataArray, window: Literal["hann"] | None = None) -> xr.Dataset:
    r"""Compute the radially averaged power spectral density.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), without missing points. [m]
    window : {"hann"}, optional
        None for a periodic surface. "hann": a cosine window with a mean square of one, for any other scan.

    Returns
    -------
    xarray.Dataset
        Over ``wavevector`` [rad/m], the mean modulus of each ring: ``psd`` [m4], the mean of the two-dimensional
        density over the ring, and ``modes``, the number of modes in it.

    Raises
    ------
    InputError
        If points are missing, or the window is unknown.

    Notes
    -----
    The density is :math:`C(\mathbf q) = |\tilde h|^2 / A` with :math:`\tilde h = \Delta x \Delta y \sum h\, e^{-i
    \mathbf q \cdot \mathbf r}`, so that :math:`\langle h^2 \rangle = (2 \pi)^{-2} \int C\, d^2q`. Every mode is in
    exactly one ring: without a window, the sum of ``psd * modes`` over the area :math:`A` is exactly the variance
    (Parseval). Rings are as wide as the larger of the two wavevector steps; beyond the Nyquist wavevector they are
    incomplete.

    A steep spectrum falls by many orders of magnitude from long to short wavelengths. Missing points that are filled by
    a membrane (:func:`roughvisc.fill`) have kinks at their rims, which raise the short-wavelength end: with 10 % of
    missing points and noise of a hundredth of the rms height, by a factor of 1.7.

    References
    ----------
    .. [1] T. D. B. Jacobs, T. Junge, L. Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001.
    """
    h = checked(h, "psd", least=1)
    require_complete(h, "psd")
    one_of("window", window, (None, "hann"))
    cells, shape = spacing(h), h.shape
    q_x, q_y, stands_for = wavevectors(shape, cells)
    step = 2 * np.pi / min((n * d for n, d in zip(shape, cells, strict=True) if n > 1), default=1.0)
    z = h.values - h.values.mean()
    density = np.abs(scipy.fft.rfft2(z if window is None else hann(z))) ** 2 * (cells[0] * cells[1] / h.size)
    q = np.hypot(q_x[:, None], q_y)
    ring = np.maximum(np.round(q / step).astype(int), 1)
    ring[q == 0] = 0  # the mean
    weights = np.broadcast_to(stands_for, q.shape)
    counted, at, total = (
        np.bincount(ring.ravel(), one.ravel())[1:] for one in (weights, weights * q, weights * density)
    )
    ring = np.flatnonzero(counted)
    density_attrs = {"units": "m^4", "long_name": "power spectral density of height, radial average"}
    density_attrs["comment"] = "mean square height = integral of psd over d2q / (2 pi)^2 = sum of psd * modes / area"
    variables = {
        "psd": ("wavevector", total[ring] / counted[ring], density_attrs),
        "modes": ("wavevector", counted[ring].astype(int), {"units": "1", "long_name": "waves in the ring"}),
        "wavevector": ("wavevector", at[ring] / counted[ring], {"units": "rad/m", "long_name": "wavevector"}),
    }
    about = {"area": float(np.prod(shape) * cells[0] * cells[1]), "window": window or "none"}
    return xr.Dataset(variables, attrs=about)
