"""Spectra of surfaces: power spectrum, resampling to other grids, removal of short waves.

Heights belong to cell centres; the centres of the cells of two grids over the same domain differ.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Literal

import numpy as np
import scipy.fft
import xarray as xr
from scipy import sparse

from roughvisc.arguments import one_of
from roughvisc.topography.borders import is_periodic, period_of
from roughvisc.topography.filters import membrane
from roughvisc.topography.grid import checked, counts, like, noted, require_complete, spacing, with_coordinates
from roughvisc.units import Quantity, number, quantities

#: Share of the mean square slope in the waves down to the shortest wave of a surface.
_OF_SLOPE = 0.99
#: Largest bandwidth of waves of nearly one length, of their heights and of their slopes, and fewest cells along a side.
_OF_HEIGHTS = 1.15
_OF_SLOPES = 1.1
_FEWEST = 8
#: Largest change by rounding of an overlap, relative to a cell, and of a wavevector, relative to the width of a ring.
_ROUNDING = 1e-9
_ON_RING = 1e-9


def hann(z: np.ndarray) -> np.ndarray:
    """Return heights under a Hann window with a mean square of one. [m]"""
    weights = [1 - np.cos(2 * np.pi * (np.arange(n) + 0.5) / n) for n in z.shape]
    along_x, along_y = (weight / np.sqrt(np.mean(weight**2)) for weight in weights)
    return z * along_x[:, None] * along_y


def wavevectors(shape: tuple[int, ...], cells: tuple[float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the wavevectors along x and, from zero on, along y [rad/m], and the number of modes of each column."""
    nx, ny = shape
    dx, dy = cells
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
    q = np.hypot(q_x[:, None], q_y)
    power = count * np.abs(scipy.fft.rfft2(z, norm="forward")) ** 2
    order = np.argsort(q, axis=None)
    summed = np.cumsum((q**2 * power).ravel()[order])
    end = q.ravel()[order][np.searchsorted(summed, _OF_SLOPE * summed[-1])] if summed[-1] > 0 else 0.0
    return q, power, 0.5 * float(end) * (1 + _ON_RING)  # a wave twice as long lies before it in any unit


def is_narrow_band(h: xr.DataArray) -> bool:
    r"""Return whether the slopes of a surface belong to waves of nearly one length, longer than four cells.

    Nayak's bandwidth :math:`m_0 m_4 / m_2^2` is 1 for waves of one length, 4/3 for waves of equal power up to a limit,
    and 2 for such waves under a Gaussian filter. With :math:`m_2 m_6 / m_4^2` it is the bandwidth of the slopes, which
    form and tilt do not enter: 1, 9/8 and 3/2. The moments are mean squares of heights, slopes, Laplacians, and slopes
    of Laplacians, by differences inside the map.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights without missing points. [m]

    References
    ----------
    .. [1] P. R. Nayak, J. Lubr. Technol. 93 (1971) 398.
    """
    z = h.values - h.values.mean()
    cells = spacing(h)
    moments = list[float]()
    axes = [axis for axis in (0, 1) if h.shape[axis] > 1]  # heights do not vary across a strip
    if min((h.shape[axis] for axis in axes), default=0) < _FEWEST:
        return False
    for _ in range(2):
        moments += [np.mean(z**2), sum(np.mean((np.diff(z, axis=axis) / cells[axis]) ** 2) for axis in axes)]
        inside = tuple(slice(1, -1) if axis in axes else slice(None) for axis in (0, 1))
        around = {axis: tuple(slice(None) if other == axis else inside[other] for other in (0, 1)) for axis in axes}
        z = sum(np.diff(z, 2, axis)[around[axis]] / cells[axis] ** 2 for axis in axes)
    m0, m2, m4, m6 = moments
    is_long = m4 * (2 * max(cells) / np.pi) ** 2 < m2  # four cells or more
    return bool(is_long and (m0 * m4 < _OF_HEIGHTS * m2**2 or m2 * m6 < _OF_SLOPES * m4**2))


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

    See Also
    --------
    roughvisc.psd_table, roughvisc.join_psd, roughvisc.parameters, roughvisc.plot.surface

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

    Examples
    --------
    >>> import roughvisc as rv
    >>> rough = rv.self_affine("1 mm", 32, hurst=0.8, rms_height="1 um", seed=1)
    >>> spectrum = rv.psd(rough)
    >>> round(float((spectrum.psd * spectrum.modes).sum() / 1e-3**2) ** 0.5, 9)  # the rms height
    1e-06
    """
    h = checked(h, "psd", least=1)
    require_complete(h, "psd")
    one_of("window", window, (None, "hann"))
    cells = spacing(h)
    shape = h.shape
    q_x, q_y, stands_for = wavevectors(shape, cells)
    step = 2 * np.pi / min((n * d for n, d in zip(shape, cells, strict=True) if n > 1), default=1.0)
    z = h.values - h.values.mean()
    density = np.abs(scipy.fft.rfft2(z if window is None else hann(z))) ** 2 * (cells[0] * cells[1] / h.size)
    q = np.hypot(q_x[:, None], q_y)
    ring = ring_numbers(q, step)
    ring[q == 0] = 0  # the mean
    count = np.broadcast_to(stands_for, q.shape)
    counted, mean_wave, total = (
        np.bincount(ring.ravel(), weights.ravel())[1:] for weights in (count, count * q, count * density)
    )
    ring = np.flatnonzero(counted)
    density_attrs = {"units": "m^4", "long_name": "power spectral density of height, radial average"}
    variables = {
        "psd": ("wavevector", total[ring] / counted[ring], density_attrs),
        "modes": ("wavevector", counted[ring].astype(int), {"units": "1", "long_name": "waves in the ring"}),
        "wavevector": ("wavevector", mean_wave[ring] / counted[ring], {"units": "rad/m", "long_name": "wavevector"}),
    }
    return xr.Dataset(variables, attrs={"area": h.size * cells[0] * cells[1]})


def ring_numbers(q: np.ndarray, step: float) -> np.ndarray:
    """Return the number of the ring of each wavevector, from 1; the width of a ring is `step`. [rad/m]

    On cells 1 : 2 many wavevectors lie on the border of two rings. They belong to the outer one, in any unit of length.
    """
    return np.maximum((q / step + (0.5 + _ON_RING)).astype(int), 1)


def resample(h: xr.DataArray, shape: int | tuple[int, int], periodic: bool | None = None) -> xr.DataArray:
    r"""Resample to another number of cells over the same domain, with exactly the wavelengths that both grids resolve.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    shape : int or pair of int
        New number of cells ``(nx, ny)``.
    periodic : bool, optional
        Whether the surface is periodic in x and in y. Default: whether :func:`self_affine`, :func:`wavy` or
        :func:`mirror` made it periodic and it is still one period (attribute ``period``).

    Returns
    -------
    xarray.DataArray
        Height at the centres of the new cells, with the same mean. A cell is missing if less than half of its area is
        present. [m]

    Raises
    ------
    InputError
        If `shape` is not a pair of whole numbers of at least 2.

    See Also
    --------
    roughvisc.without_short_waves, roughvisc.gaussian_filter, roughvisc.crop

    Notes
    -----
    A periodic surface is expanded in a Fourier series. Any other surface and its mirror images are expanded in cosines.
    Missing points are filled as by :func:`fill` first. A coarser grid keeps the wavelengths longer than two of its
    cells, and their slopes. Means over its cells would damp wavelengths of up to ten cells and alias shorter
    wavelengths: on cells twice as long, the error of the contact area would be 1.2 to 1.8 times as large, and the
    errors of mean gap and approach 2 to 100 times.

    Along each axis of :math:`n` cells the Fourier transform :math:`h_k` gives, at the centres of :math:`m` cells,

    .. math:: h(X_j) = \frac{1}{n} \sum_{|k| < \min(n, m) / 2} h_k \, e^{2 \pi i k j / m} e^{i \pi k (1/m - 1/n)},

    where the last factor accounts for the distance between the first centres of both grids. A wavelength of exactly two
    old cells is kept on a finer grid, as the sine that is largest at the old centres.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rough = rv.self_affine("1 mm", 64, hurst=0.8, rms_height="1 um", seed=1)
    >>> coarse = rv.resample(rough, 32)
    >>> coarse.shape, bool(abs(coarse.mean()) < 1e-18)
    ((32, 32), True)
    """
    shape = counts("shape", shape)
    h = checked(h, "resample")
    missing = np.isnan(h.values)
    period = _period(h, periodic)
    values = membrane(h.values)
    if period:
        heights = resample_periodic(values, shape)
        way = "by Fourier interpolation"
    else:
        heights = _cosines(_cosines(values, shape[0], 0), shape[1], 1)
        way = "by cosines"
    if missing.any():
        cells = zip(h.shape, shape, strict=True)
        along_x, along_y = (shares(np.arange(old + 1) / old, np.arange(new + 1) / new) for old, new in cells)
        heights[along_x @ missing @ along_y.T > 0.5 + _ROUNDING] = np.nan
    axes = []
    for axis, d, old, new in zip(("x", "y"), spacing(h), h.shape, shape, strict=True):
        axes.append(float(h[axis][0]) - d / 2 + (np.arange(new) + 0.5) * (d * old / new))
    line = f"resampled: {h.shape[0]} x {h.shape[1]} to {shape[0]} x {shape[1]} cells, {way}"
    return noted(with_coordinates(heights, axes[0], axes[1], h.attrs), line, period=period)


@quantities(shortest="m > 0")
def without_short_waves(h: xr.DataArray, shortest: Quantity, periodic: bool | None = None) -> xr.DataArray:
    """Remove all wavelengths below a limit, on the same cells.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), without missing points. [m]
    shortest : float or str
        Shortest wavelength to keep; at least two cells, and shorter than the sides. [m]
    periodic : bool, optional
        Whether the surface repeats in x and in y; default as in :func:`resample`.

    Returns
    -------
    xarray.DataArray
        Height with the same mean. A periodic surface is expanded in a Fourier series, any other surface and its mirror
        images in cosines. The cut-off is sharp: see :func:`gaussian_filter` for a smooth one. [m]

    Raises
    ------
    InputError
        If points are missing or the length is out of its range.

    See Also
    --------
    roughvisc.gaussian_filter, roughvisc.resample

    Examples
    --------
    >>> import roughvisc as rv
    >>> rough = rv.self_affine("1 mm", 64, hurst=0.8, rms_height="1 um", seed=1)
    >>> smooth = rv.without_short_waves(rough, "0.2 mm")
    >>> bool(rv.parameters(smooth).Sdq < rv.parameters(rough).Sdq)
    True
    """
    h = checked(h, "without_short_waves")
    sides = spacing(h)
    lengths = period_of(h)
    period = _period(h, periodic)
    shortest = number(shortest, "m", "shortest", least=2 * max(sides) * (1 - _ROUNDING), below=min(lengths))
    require_complete(h, "without_short_waves")
    limit = (2 * np.pi / shortest) * (1 + _ROUNDING)
    if period:
        q_x, q_y, _ = wavevectors(h.shape, sides)
        heights_q = scipy.fft.rfft2(h.values)
        inverse = partial(scipy.fft.irfft2, s=h.shape)
    else:
        q_x, q_y = (np.pi * np.arange(n) / length for n, length in zip(h.shape, lengths, strict=True))
        heights_q = scipy.fft.dctn(h.values, norm="ortho")
        inverse = partial(scipy.fft.idctn, norm="ortho")
    heights = inverse(np.where(np.hypot(q_x[:, None], q_y) <= limit, heights_q, 0.0))
    return noted(like(h, heights), f"waves shorter than {shortest:.6g} m left out", period=period)


def resample_periodic(values: np.ndarray, shape: tuple[int, int], *, first_kept: bool = False) -> np.ndarray:
    """Return one period of a field at the centres of other cells, by Fourier interpolation.

    Parameters
    ----------
    values : ndarray, shape (nx, ny)
        Finite, at the cell centres.
    shape : tuple of int
        New number of cells.
    first_kept : bool
        Whether the new grid is shifted so that the first centres coincide, which suffices if the position of the waves
        does not matter. Otherwise both grids cover the same domain.

    Returns
    -------
    ndarray
        Field of the new shape, with the same mean; see :func:`resample`.
    """
    for axis, count in enumerate(shape):
        before = values.shape[axis]
        if count == before:
            continue
        values_q = scipy.fft.rfft(values, axis=axis)
        moved = 0.0 if first_kept else 0.5 / count - 0.5 / before  # from the first old centre to the first new one
        turned = np.exp(2j * np.pi * np.arange(values_q.shape[axis]) * moved)
        fewer = min(count, before)
        if fewer % 2 == 0:  # a wave of two cells: a coarser grid drops it, a finer grid splits it in two halves
            turned[fewer // 2] *= 0.0 if count < before else 0.5
        values_q *= turned[:, None] if axis == 0 else turned
        values = scipy.fft.irfft(values_q, n=count, axis=axis) * (count / before)
    return values


def _period(h: xr.DataArray, periodic: bool | None) -> list[float] | None:
    """Return the sides of a surface that is periodic, or is taken as periodic; None for any other. [m]"""
    repeats = is_periodic(h) if one_of("periodic", periodic, (None, True, False)) is None else periodic
    return period_of(h) if repeats else None


def _cosines(values: np.ndarray, count: int, axis: int) -> np.ndarray:
    """Interpolate onto `count` cells along an axis by the cosines that both grids resolve."""
    values_q = scipy.fft.dct(values, axis=axis, norm="ortho")
    return scipy.fft.idct(values_q, n=count, axis=axis, norm="ortho") * math.sqrt(count / values.shape[axis])


def shares(cells: np.ndarray, onto: np.ndarray) -> sparse.csr_array:
    """Return the fraction of each new cell (rows) that lies in each old cell (columns), from the edges of both."""
    common = np.minimum(onto[1:, None], cells[1:]) - np.maximum(onto[:-1, None], cells[:-1])
    return sparse.csr_array(np.maximum(common, 0.0) / np.diff(onto)[:, None])
