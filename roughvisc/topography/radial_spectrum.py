"""Radial spectra of surfaces, beyond one grid: from tables, from scans, and from several scans of different resolution.

All have the convention of :func:`roughvisc.psd`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.topography.borders import is_periodic
from roughvisc.topography.grid import checked, spacing
from roughvisc.topography.spectrum import psd
from roughvisc.units import Quantity, format_quantity, quantities

Array = NDArray[np.float64]
Convention = Literal["psd", "persson"]

#: Convention of a spectral density -> its factor to the convention of this package.
_FACTORS = {"psd": 1.0, "persson": (2 * math.pi) ** 2}
# Rings of a scan are averaged over bins, with this number in a decade.
_BINS = 40
# Values per decade of a spectrum for integrals, and fewest values.
_PER_DECADE = 60
_FEWEST = 240
# Density that counts as zero, over the largest one.
_NOTHING = 1e-60
# Ratio of the densities of two overlapping scans, from which a warning is given.
_DIFFERENT = 2.0


@quantities(wavevectors="1/m ...", densities="m^4 ...")
def psd_table(wavevectors: Sequence[Quantity], densities: Sequence[Quantity], *, convention: Convention) -> xr.Dataset:
    r"""Return a radial power spectral density from a table, such as the spectrum of a road.

    Parameters
    ----------
    wavevectors : sequence of float or str
        Wave numbers :math:`q = 2 \pi / \lambda`, ascending. [rad/m]
    densities : sequence of float or str
        Two-dimensional isotropic density ``C(q)``. [m4]
    convention : {"psd", "persson"}
        ``psd``: as :func:`roughvisc.psd` and contact.engineering, :math:`\langle h^2 \rangle = (2 \pi)^{-2} \int C\,
        d^2q`. ``persson``: as in the papers of Persson, :math:`\langle h^2 \rangle = \int C\, d^2q`, smaller by
        :math:`(2 \pi)^2`. It has no default, because nothing in a table shows a wrong one. The density of a profile
        [m3] is not accepted.

    Returns
    -------
    xarray.Dataset
        ``psd`` [m4] over ``wavevector`` [rad/m], in the convention of :func:`roughvisc.psd`. Between its rows a
        density is a power law, outside it is zero.

    Raises
    ------
    InputError
        If the columns differ in length, a wave number is not positive or not ascending, a density is negative or not
        finite, or the convention is unknown.

    See Also
    --------
    roughvisc.psd, roughvisc.join_psd, roughvisc.from_spectrum, roughvisc.friction_theory

    Examples
    --------
    >>> import roughvisc as rv
    >>> road = rv.psd_table([1e3, 1e4, 1e6], [1e-17, 1e-17, 1e-24], convention="persson")
    >>> f"{float(road.psd[0]):.4g}"
    '3.948e-16'
    """
    factor = _FACTORS[one_of("convention", convention, _FACTORS)]
    q, density = _checked_columns(wavevectors, densities)
    return _labelled(q, density * factor)


def join_psd(*spectra: xr.Dataset | xr.DataArray) -> xr.Dataset:
    """Join radial spectra of different ranges, such as spectra of scans of different resolution.

    Parameters
    ----------
    *spectra : xarray.Dataset or xarray.DataArray
        Spectra, from :func:`roughvisc.psd` or :func:`roughvisc.psd_table`, or maps of heights. The range of a map ends
        at the wavelength of two cells. It has a cosine window unless the map is periodic, and begins then at half of
        its shorter side, because the window smears longer waves.

    Returns
    -------
    xarray.Dataset
        ``psd`` [m4] over ``wavevector`` [rad/m]. The rings of a map are averaged over 40 bins per decade. Where spectra
        overlap, the logarithm of the density is their mean with weights that fall to zero at the end of each, so that
        the density has no steps. The attribute ``mismatch`` is the largest mean ratio of two overlapping densities.

    Raises
    ------
    InputError
        If a spectrum is invalid, a map has missing points, or there is a gap between the spectra.

    Warns
    -----
    UserWarning
        If two densities differ by more than a factor of two in the mean over their overlap.

    See Also
    --------
    roughvisc.psd, roughvisc.psd_table, roughvisc.friction_theory

    Examples
    --------
    >>> import roughvisc as rv
    >>> long_waves = rv.psd_table([1e3, 1e5], [1e-15, 1e-22], convention="psd")
    >>> short_waves = rv.psd_table([1e4, 1e6], [3.2e-19, 3.2e-26], convention="psd")
    >>> q = rv.join_psd(long_waves, short_waves).wavevector
    >>> round(float(q.min())), round(float(q.max()))
    (1000, 1000000)
    """
    if not spectra:
        raise InputError(key="spectra", found=spectra, expected="at least one spectrum or map of heights")
    columns = sorted((_columns(spectrum) for spectrum in spectra), key=lambda pair: (pair[0][0], pair[0][-1]))
    reached = columns[0][0][-1]
    for q, _ in columns[1:]:
        if q[0] > reached:
            gap = f"a gap from {_wavelength(reached)} to {_wavelength(q[0])}"
            expected = "spectra that overlap; a table can state what lies in the gap"
            raise InputError(f"spectra: found {gap}: expected {expected}", key="spectra", found=gap, expected=expected)
        reached = max(reached, q[-1])
    if len(columns) == 1:
        return _labelled(*columns[0])
    joined = np.unique(np.concatenate([q for q, _ in columns]))
    total = np.zeros(joined.size)
    weights = np.zeros(joined.size)
    for q, density in columns:
        inside = np.log(joined / q[0]), np.log(q[-1] / joined)
        weight = np.maximum(np.minimum(*inside), 0.0)
        weight[(joined == q[0]) | (joined == q[-1])] = 1e-9  # an end that no other spectrum covers
        total += weight * np.interp(np.log(joined), np.log(q), np.log(density))
        weights += weight
    mismatch = _mismatch(columns)
    if mismatch > _DIFFERENT:
        differ = f"spectra differ by a factor of {mismatch:.2g} where they overlap"
        warnings.warn(f"{differ}; a tip or a filter may have removed short waves of one of them", UserWarning, 2)
    return _labelled(joined, np.exp(total / weights)).assign_attrs(mismatch=mismatch)


def spectrum_of(source: Any) -> xr.Dataset:
    """Return a radial spectrum of a spectrum, a map, or several of either. [m4] over [rad/m]"""
    if isinstance(source, xr.Dataset | xr.DataArray):
        return join_psd(source)
    if isinstance(source, Sequence) and not isinstance(source, str):
        return join_psd(*source)
    expected = "a spectrum of rv.psd or rv.psd_table, a map of heights, or a list of these"
    raise InputError(key="spectrum", found=source, expected=expected)


def density_at(spectrum: xr.Dataset, wave_numbers: ArrayLike) -> Array:
    """Return the density of a spectrum at some wave numbers [rad/m]: a power law between rows, zero outside. [m4]"""
    q, density = _columns(spectrum)
    wanted = np.asarray(wave_numbers, dtype=float)
    with np.errstate(divide="ignore"):
        logarithm = np.interp(np.log(wanted), np.log(q), np.log(density), left=-math.inf, right=-math.inf)
    return np.exp(logarithm)


def evenly(spectrum: xr.Dataset, shortest: float | None = None, slope: float | None = None) -> tuple[Array, Array]:
    """Return wave numbers evenly spaced in the logarithm [rad/m], and the density there [m4], up to a cut-off.

    Parameters
    ----------
    spectrum : xarray.Dataset
        As :func:`join_psd` returns it.
    shortest : float, optional
        Shortest wavelength. [m]
    slope : float, optional
        Root mean square slope of the waves up to the cut-off.

    Raises
    ------
    InputError
        If the spectrum does not reach the cut-off, or both are given.
    """
    if shortest is not None and slope is not None:
        raise InputError(key="slope", found=slope, expected="either a slope or the shortest wavelength")
    ends = spectrum["wavevector"].values[[0, -1]]
    if shortest is not None:
        cut = 2 * math.pi / shortest
        if not ends[0] < cut <= ends[1] * (1 + 1e-9):
            expected = f"from {_wavelength(ends[1])} to {_wavelength(ends[0])}, the waves of the spectrum"
            raise InputError(key="shortest", found=shortest, expected=expected)
        ends = np.array([ends[0], min(cut, ends[1])])
    q = _grid(*ends)
    density = density_at(spectrum, q)
    if slope is None:
        return q, density
    squares = q**4 * density / (2 * math.pi)
    summed = np.append(0.0, np.cumsum((squares[1:] + squares[:-1]) / 2 * math.log(q[1] / q[0])))
    if not 0 < slope**2 <= summed[-1]:
        expected = f"above 0 and up to {math.sqrt(summed[-1]):.3g}, the rms slope of all waves of the spectrum"
        raise InputError(key="slope", found=slope, expected=expected)
    q = _grid(ends[0], float(np.exp(np.interp(slope**2, summed, np.log(q)))))
    return q, density_at(spectrum, q)


def _grid(low: float, high: float) -> Array:
    """Return wave numbers evenly spaced in the logarithm, with exact ends."""
    q = np.geomspace(low, high, 1 + max(_FEWEST, int(_PER_DECADE * math.log10(high / low))))
    q[[0, -1]] = low, high
    return q


def _columns(source: Any) -> tuple[Array, Array]:
    """Return wave numbers [rad/m] and densities [m4] of a spectrum or of a map of heights."""
    if isinstance(source, xr.DataArray):
        height = checked(source, "join_psd")
        window: Literal["hann"] | None = None if is_periodic(height) else "hann"
        source = psd(height, window)
        longest = min(n * d for n, d in zip(height.shape, spacing(height), strict=True)) / (2.0 if window else 1.0)
        q = source["wavevector"].values
        complete = (q <= np.pi / max(spacing(height))) & (q > 2 * np.pi / longest * (1 - 1e-6))
        source = source.isel(wavevector=complete)
    if not isinstance(source, xr.Dataset) or not {"wavevector", "psd"} <= set(source.variables):
        raise InputError(key="spectrum", found=source, expected="a spectrum of rv.psd or rv.psd_table, or heights")
    q, density = _checked_columns(source["wavevector"].values, source["psd"].values)
    if "modes" in source:
        modes = source["modes"].values
        place = np.unique((np.log(q / q[0]) / math.log(10) * _BINS).astype(int), return_inverse=True)[1]
        counted = np.bincount(place, modes)
        q = np.exp(np.bincount(place, modes * np.log(q)) / counted)
        density = np.bincount(place, modes * density) / counted
    return q, np.maximum(density, _NOTHING * density.max())


def _checked_columns(wavevectors: ArrayLike, densities: ArrayLike) -> tuple[Array, Array]:
    """Return two columns of a spectrum as arrays; refuse anything else."""
    q = np.asarray(wavevectors, dtype=float)
    density = np.asarray(densities, dtype=float)
    if q.ndim != 1 or q.shape != density.shape or q.size < 2:
        found = f"{q.size} wave numbers and {density.size} densities"
        raise InputError(key="densities", found=found, expected="one for each wave number, at least two")
    is_wrong = ~(np.isfinite(q) & (q > 0)) | (np.diff(q, prepend=0.0) <= 0)
    if is_wrong.any():
        row = is_wrong.argmax()
        expected = "a positive number above the last one [rad/m]"
        raise InputError(key=f"wavevectors[{row}]", found=q[row], expected=expected)
    is_wrong = ~(np.isfinite(density) & (density >= 0))
    if is_wrong.any():
        row = is_wrong.argmax()
        raise InputError(key=f"densities[{row}]", found=float(density[row]), expected="a number, not negative [m4]")
    if not density.any():
        raise InputError(key="densities", found=0.0, expected="a positive density [m4]")
    return q, density


def _mismatch(columns: Sequence[tuple[Array, Array]]) -> float:
    """Return the largest ratio of the geometric means of two densities over their overlap, at least 1."""
    worst = 0.0
    for place, (q, density) in enumerate(columns):
        for other, others in columns[place + 1 :]:
            if (low := max(q[0], other[0])) < (high := min(q[-1], other[-1])):
                common = np.log(np.geomspace(low, high, 32)[1:-1])
                first = np.interp(common, np.log(q), np.log(density))
                worst = max(worst, abs(float(np.mean(np.interp(common, np.log(other), np.log(others)) - first))))
    return math.exp(worst)


def _labelled(q: Array, density: Array) -> xr.Dataset:
    """Return a spectrum as a Dataset."""
    attributes = {"units": "m^4", "long_name": "power spectral density of height, radial average"}
    wavevector = ("wavevector", q, {"units": "rad/m", "long_name": "wavevector"})
    return xr.Dataset({"psd": ("wavevector", density, attributes), "wavevector": wavevector})


def _wavelength(wave_number: float) -> str:
    return format_quantity(float(f"{2 * math.pi / wave_number:.4g}"), "m")
