"""Random surfaces with the spectrum of a surface."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from roughvisc.topography.borders import is_mirrored, is_periodic, period_of
from roughvisc.topography.framing import mirror
from roughvisc.topography.grid import checked, labelled, noted, require_complete, spacing
from roughvisc.topography.spectrum import psd, wavevectors
from roughvisc.topography.synthesis import random_heights, whole


def surrogates(h: xr.DataArray, count: int, *, seed: int) -> xr.DataArray:
    r"""Generate random surfaces with the spectrum of a surface, as models of other samples of the same roughness.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights without missing points. [m]
    count : int
        Number of surfaces.
    seed : int
        Source of random phases and amplitudes. A seed and a number define one surface, on any grid of this size.

    Returns
    -------
    xarray.DataArray, dims (realisation, x, y)
        Periodic surfaces with zero mean over the same cells, numbered from 1. [m]

    Raises
    ------
    InputError
        If points are missing, `count` is not a positive whole number, or `seed` is not valid.

    Notes
    -----
    The surrogate is a Gaussian random field, as in :func:`self_affine` with Gaussian amplitudes. The
    spectrum is the radial average of :func:`psd`, up to the largest wave number with a complete ring. Direction and
    shape (skewness, kurtosis, ridges) of the surface are lost. A surface that is not periodic is used with its mirror
    images. A surface made by :func:`mirror` gives surfaces as large as the original part, because only that part was
    measured.

    References
    ----------
    .. [1] B. N. J. Persson et al., J. Phys.: Condens. Matter 17 (2005) R1, appendix D.

    Examples
    --------
    >>> import roughvisc as rv
    >>> scan = rv.self_affine(1e-3, (31, 33), hurst=0.8, rms_height=1e-6, seed=1)
    >>> rv.surrogates(scan, 3, seed=7).sizes["realisation"]
    3
    """
    numbers = np.arange(1, whole("count", count, 1) + 1)
    found = [surrogate(h, number, seed=seed) for number in numbers]
    return xr.concat(found, xr.DataArray(numbers, dims="realisation", name="realisation"))


def surrogate(h: xr.DataArray, number: int, *, seed: int = 0) -> xr.DataArray:
    """Return one surface of :func:`surrogates`, by its number. [m]"""
    entropy = [whole("seed", seed), whole("number", number, 1)]
    h = checked(h, "surrogates")
    require_complete(h, "surrogates")
    if is_mirrored(h):
        h = h[: h.shape[0] // 2, : h.shape[1] // 2]  # the part that was measured
    repeating = h if is_periodic(h) else mirror(h)
    spectrum, step = psd(repeating), 2 * np.pi / min(period_of(repeating))  # the width of its rings
    sides = spacing(h)
    q_x, q_y, _ = wavevectors(h.shape, sides)
    q = np.hypot(q_x[:, None], q_y)
    rings = np.round(spectrum["wavevector"].values / step).astype(int)
    density = np.zeros(rings[-1] + 1)
    density[rings] = spectrum["psd"].values
    ring = np.maximum(np.round(q / step).astype(int), 1)
    inside = (q > 0) & (q < np.pi / max(sides) * (1 - 1e-12))
    variance = np.where(inside, density[np.where(inside, ring, 0)], 0.0) / (h.size * math.prod(sides))
    heights = random_heights(np.sqrt(variance), h.shape[1], entropy, normal=True)
    grid = labelled(heights, sides).assign_coords(x=h["x"], y=h["y"])
    line = f"surrogate {number} of seed {seed}: random phases, gaussian amplitudes"
    return noted(grid, line, period=period_of(grid))
