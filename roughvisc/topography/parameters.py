"""Areal parameters of ISO 25178-2 and power spectral density."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import scipy.fft
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.grid import checked, spacing, valid_values

#: name -> (units, long name)
PARAMETERS = {
    "Sa": ("m", "arithmetical mean height"),
    "Sq": ("m", "root mean square height"),
    "Ssk": ("1", "skewness"),
    "Sku": ("1", "kurtosis"),
    "Sz": ("m", "maximum height, highest peak to lowest valley"),
    "Sdq": ("1", "root mean square gradient"),
    "Sdr": ("1", "developed interfacial area ratio, excess of the surface over its projection"),
    "rms_slope": ("1", "root mean square slope, both directions together: the same as Sdq"),
    "rms_slope_x": ("1", "root mean square slope along x"),
    "rms_slope_y": ("1", "root mean square slope along y"),
    "rms_curvature": ("m-1", "root mean square of the mean curvature, half the Laplacian"),
    "missing_fraction": ("1", "share of the points that are missing"),
}


def parameters(h: xr.DataArray, periodic: bool = False) -> xr.Dataset:
    r"""Areal parameters about the mean height.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), NaN where missing; level it first where it is tilted. [m]
    periodic : bool, default False
        Whether the differences reach across the border.

    Returns
    -------
    xarray.Dataset
        Scalars Sa, Sq, Sz [m], Ssk, Sku, Sdq, Sdr, rms_slope, rms_slope_x, rms_slope_y [-], rms_curvature [1/m] and
        missing_fraction [-], each with units and a name. Missing points take no part, nor do differences that would
        need them; a parameter that no point is left for is NaN. Across a strip, one cell wide, heights do not vary.

    Raises
    ------
    InputError
        If all points are missing.

    Notes
    -----
    Slopes are first differences to the next point, curvatures second differences about a point, as
    SurfaceTopography has them. They see waves of a few cells weakened: a wave of length :math:`n` cells by
    :math:`\mathrm{sinc}(1/n)`. Sdr is a ratio, not in per cent.

    References
    ----------
    .. [1] ISO 25178-2:2021, Surface texture: Areal, terms, definitions and parameters.
    """
    h = checked(h, "parameters", least=1)
    z = valid_values(h, "parameters")
    z = z - z.mean()
    square = np.mean(z**2)
    slope_x, slope_y = _slopes(h, periodic)
    gradient = slope_x**2 + slope_y**2
    with np.errstate(invalid="ignore", divide="ignore"):
        values = {
            "Sa": np.mean(np.abs(z)),
            "Sq": np.sqrt(square),
            "Ssk": np.mean(z**3) / square**1.5,
            "Sku": np.mean(z**4) / square**2,
            "Sz": z.max() - z.min(),
            "Sdq": np.sqrt(_mean(gradient)),
            "Sdr": _mean(gradient / (1 + np.sqrt(1 + gradient))),
            "rms_slope": np.sqrt(_mean(gradient)),
            "rms_slope_x": np.sqrt(_mean(slope_x**2)),
            "rms_slope_y": np.sqrt(_mean(slope_y**2)),
            "rms_curvature": np.sqrt(_mean((_laplacian(h, periodic) / 2) ** 2)),
            "missing_fraction": np.mean(np.isnan(h.values)),
        }
    declared = {name: {"units": units, "long_name": prose} for name, (units, prose) in PARAMETERS.items()}
    return xr.Dataset({name: ((), float(value), declared[name]) for name, value in values.items()})


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
    if window:
        weight = np.multiply.outer(*(1 - np.cos(2 * np.pi * (np.arange(n) + 0.5) / n) for n in shape))
        z = z * weight / np.sqrt(np.mean(weight**2))
    density = np.abs(scipy.fft.rfft2(z)) ** 2 * (cells[0] * cells[1] / (shape[0] * shape[1]))
    q_x = 2 * np.pi * scipy.fft.fftfreq(shape[0], cells[0])
    q_y = 2 * np.pi * scipy.fft.rfftfreq(shape[1], cells[1])
    q = np.hypot(q_x[:, None], q_y)
    twice = np.full(q_y.size, 2)  # waves of the half that is not stored
    twice[0] = 1
    if shape[1] % 2 == 0:
        twice[-1] = 1
    twice = np.broadcast_to(twice, q.shape).ravel()
    step = 2 * np.pi / min((n * d for n, d in zip(shape, cells, strict=True) if n > 1), default=1.0)
    ring = np.maximum(np.round(q.ravel() / step).astype(int), 1) - 1
    ring[0] = -1  # the mean
    counted, at, total = (
        np.bincount(ring + 1, weight)[1:] for weight in (twice, twice * q.ravel(), twice * density.ravel())
    )
    ring = np.flatnonzero(counted)
    density_attrs = {"units": "m4", "long_name": "power spectral density of height, radial average"}
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


def _slopes(h: xr.DataArray, periodic: bool) -> tuple[np.ndarray, np.ndarray]:
    """First differences along x and y where both are there, in the corner of the points (i, j), (i+1, j), (i, j+1)."""
    dx, dy = spacing(h)
    z = np.pad(h.values, [(0, int(periodic or n == 1)) for n in h.shape], mode="wrap")
    slope_x, slope_y = (z[1:, :-1] - z[:-1, :-1]) / dx, (z[:-1, 1:] - z[:-1, :-1]) / dy
    both = np.isfinite(slope_x) & np.isfinite(slope_y)
    return slope_x[both], slope_y[both]


def _laplacian(h: xr.DataArray, periodic: bool) -> np.ndarray:
    """Sum of the second differences along x and y where all five points are there."""
    dx, dy = spacing(h)
    z = np.pad(h.values, [(w := int(periodic or n == 1), w) for n in h.shape], mode="wrap")
    middle = z[1:-1, 1:-1]
    laplacian = (z[2:, 1:-1] - 2 * middle + z[:-2, 1:-1]) / dx**2 + (z[1:-1, 2:] - 2 * middle + z[1:-1, :-2]) / dy**2
    return laplacian[np.isfinite(laplacian)]


def _mean(values: np.ndarray) -> Any:
    return values.mean() if values.size else np.nan
