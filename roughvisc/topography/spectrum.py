"""Power spectrum of heights: its modes, and their radial average."""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy.fft
import scipy.ndimage
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.blocks import column_blocks, mean_of, row_blocks
from roughvisc.topography.bridging import bridged
from roughvisc.topography.grid import checked, filled_points, like, require_complete, spacing
from roughvisc.topography.missing_points import in_large_holes

#: Share of the points that may be bridged.
MOST_MISSING = 0.5
# Of the mean square slope, what tells the shortest wave of a surface.
_OF_SLOPE = 0.99


def hann(z: np.ndarray) -> np.ndarray:
    """Heights under a Hann window whose mean square is one. [m]"""
    along_x, along_y = _hann_weights(z.shape)
    return z * along_x[:, None] * along_y


def _hann_weights(shape: tuple[int, ...]) -> list[np.ndarray]:
    """Weights along each axis, of mean square one. [-]"""
    weights = [1 - np.cos(2 * np.pi * (np.arange(n) + 0.5) / n) for n in shape]
    return [weight / np.sqrt(np.mean(weight**2)) for weight in weights]


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
    q_x, q_y, count = _wavevectors(z.shape, cells)
    power = np.abs(scipy.fft.rfft2(z, norm=norm)) ** 2
    return q_x[:, None], q_y[None], power, np.broadcast_to(count, power.shape)


def _wavevectors(shape: tuple[int, ...], cells: tuple[float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Wavevectors along x and, from zero on, along y [rad/m]; how many modes a column stands for."""
    (nx, ny), (dx, dy) = shape, cells
    q_x, q_y = 2 * np.pi * scipy.fft.fftfreq(nx, dx), 2 * np.pi * scipy.fft.rfftfreq(ny, dy)
    count = np.full(q_y.size, 2.0)
    count[0] = 1.0
    if ny % 2 == 0:
        count[-1] = 1.0
    return q_x, q_y, count


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
    q_x, q_y, count = _wavevectors(z.shape, cells)
    waves, q = scipy.fft.rfft2(z), np.hypot(q_x[:, None], q_y)
    begins = last_octave(q, count * q**2 * np.abs(waves) ** 2)
    if not begins:
        return z, 0.0
    return scipy.fft.irfft2(np.where(q <= begins, waves, 0.0), s=z.shape), 2 * np.pi / begins


def last_octave(q: np.ndarray, slope: np.ndarray) -> float:
    """Wave number beyond which the shortest octave of waves lies; zero of a surface without slopes. [rad/m]

    Parameters
    ----------
    q, slope : ndarray
        Length of each wavevector [rad/m], and its share in the mean square slope, on any scale.
    """
    order = np.argsort(q, axis=None)
    summed = np.cumsum(slope.ravel()[order])
    if not summed[-1] > 0:
        return 0.0
    return 0.5 * float(q.ravel()[order][np.searchsorted(summed, _OF_SLOPE * summed[-1])])


def psd(h: xr.DataArray, window: Literal["hann"] | None = None, *, bridge: bool = False) -> xr.Dataset:
    r"""Radially averaged power spectral density.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), without missing points unless they are bridged. [m]
    window : {"hann"}, optional
        None for a periodic surface. "hann": a cosine window with a mean square of one, for any other scan.
    bridge : bool
        Whether to use measured points only. Missing and filled points are bridged smoothly, and so are isolated points
        inside a large hole or on its rim, which are mostly wrong.

    Returns
    -------
    xarray.Dataset
        Over ``wavevector`` [rad/m], the mean modulus of each ring: ``psd`` [m4], the mean of the two-dimensional
        density over the ring, and ``modes``, the number of modes in it.

    Raises
    ------
    InputError
        If points are missing and not bridged, more than half of them are missing, or the window is unknown.

    Notes
    -----
    The density is :math:`C(\mathbf q) = |\tilde h|^2 / A` with :math:`\tilde h = \Delta x \Delta y \sum h\, e^{-i
    \mathbf q \cdot \mathbf r}`, so that :math:`\langle h^2 \rangle = (2 \pi)^{-2} \int C\, d^2q`. Every mode is in
    exactly one ring: without a window, the sum of ``psd * modes`` over the area :math:`A` is exactly the variance
    (Parseval). Rings are as wide as the larger of the two wavevector steps; beyond the Nyquist wavevector they are
    incomplete.

    A steep spectrum falls by many orders of magnitude from long to short wavelengths. Missing points that are set to
    the mean or filled by a membrane (:func:`roughvisc.fill`) have steps or kinks at their rims, which raise its
    short-wavelength end: with 10 % of missing points and noise of a hundredth of the rms height, by a factor of 100 and
    1.7. Bridges continue the curvature beyond the rim: the error of the end is then up to a quarter at 10 % of missing
    points, and 1 % at 0.4 %. A large hole contains no wavelengths shorter than its width: the end is too low by the
    share of such holes in the square of the window.

    References
    ----------
    .. [1] T. D. B. Jacobs, T. Junge, L. Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001.
    """
    h = _bridged(checked(h, "psd", least=1)) if bridge else checked(h, "psd", least=1)
    require_complete(h, "psd", "none (bridge=True goes by the others)")
    if window not in (None, "hann"):
        raise InputError(f"psd: window is {window!r}: expected 'hann' or None")
    cells, shape = spacing(h), h.shape
    q_x, q_y, stands_for = _wavevectors(shape, cells)
    step = 2 * np.pi / min((n * d for n, d in zip(shape, cells, strict=True) if n > 1), default=1.0)
    most = max(round(float(np.hypot(np.abs(q_x).max(), q_y[-1])) / step), 1)
    counted, at, total = np.zeros((3, most))
    z_q = _transformed(h.values, window is not None)
    for rows in row_blocks(z_q.shape):
        density = (np.abs(z_q[rows]) ** 2 * (cells[0] * cells[1] / (shape[0] * shape[1]))).ravel()
        q = np.hypot(q_x[rows, None], q_y)
        count = np.broadcast_to(stands_for, q.shape).ravel()
        ring = np.maximum(np.round(q.ravel() / step).astype(int), 1)
        ring[q.ravel() == 0] = 0  # the mean
        for found, weight in ((counted, count), (at, count * q.ravel()), (total, count * density)):
            found += np.bincount(ring, weight, most + 1)[1:]
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


def _bridged(h: xr.DataArray) -> xr.DataArray:
    """Heights with the points bridged that are not to go by. [m]"""
    missing = unmeasured(h)
    if (count := np.count_nonzero(missing)) > MOST_MISSING * h.size:
        raise InputError(f"psd: {count} of {h.size} points were not measured: expected half at most")
    return like(h, bridged(h.values, missing)) if count else h


def unmeasured(h: xr.DataArray) -> np.ndarray:
    """Mask of the points that were not measured: missing, filled in, or left over in a large hole or on its rim.

    What instruments give inside a large hole and on its rim is wrong more often than not.
    """
    missing, filled = np.isnan(h.values), filled_points(h)
    if filled is not None:
        missing |= filled
    return missing | scipy.ndimage.binary_dilation(in_large_holes(missing)) if missing.any() else missing


def _transformed(heights: np.ndarray, window: bool) -> np.ndarray:
    """Transform of heights less their mean, in blocks along each axis: no copy of the heights beside it. [m]"""
    along_x, along_y = _hann_weights(heights.shape)
    mean = mean_of(heights)
    z_q = np.empty((heights.shape[0], heights.shape[1] // 2 + 1), dtype=complex)
    for rows in row_blocks(heights.shape):
        z = heights[rows] - mean
        z_q[rows] = scipy.fft.rfft(z * along_x[rows, None] * along_y if window else z, axis=1)
    for columns in column_blocks(z_q.shape, z_q.itemsize):
        z_q[columns] = scipy.fft.fft(z_q[columns], axis=0)
    return z_q
