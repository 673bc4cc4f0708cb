"""Surfaces from recipes: indenters, waves and self-affine roughness.

Heights are the analytic functions at the cell centres ``((i + 1/2) dx, (j + 1/2) dy)``. The recipe stays in the
attributes, so that the grid of an indenter can grow (:func:`grown`).
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import scipy.fft
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.grid import counts, labelled, noted, number, pair, spacing, with_coordinates


def sphere(radius: float, size: Any, shape: Any, exact: bool = False) -> xr.DataArray:
    r"""Spherical indenter, centred, apex at height zero.

    Parameters
    ----------
    radius : float
        Radius of curvature. [m]
    size : float or pair of float
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``.
    exact : bool, default False
        False: the paraboloid :math:`-r^2 / 2R` of Hertz theory. True: the circular cap
        :math:`\sqrt{R^2 - r^2} - R`; cells beyond the equator are absent.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), not above zero. [m] The apex is at ``size / 2``, which lies between the cells where
        their number is even.

    Raises
    ------
    InputError
        If a parameter is not positive and finite.
    """
    return _indenter("sphere", {"radius": number("radius", radius, "m"), "exact": bool(exact)}, size, shape)


def cone(slope: float, size: Any, shape: Any) -> xr.DataArray:
    """Conical indenter of height ``-slope * r``, centred, apex at height zero.

    Parameters
    ----------
    slope : float
        Tangent of the angle between the flank and the plane. [-]
    size : float or pair of float
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), not above zero. [m]

    Raises
    ------
    InputError
        If a parameter is not positive and finite.
    """
    return _indenter("cone", {"slope": number("slope", slope, "-")}, size, shape)


def flat_punch(radius: float, size: Any, shape: Any) -> xr.DataArray:
    """Flat-ended cylindrical punch, centred: height zero inside the radius, absent (NaN) outside.

    Parameters
    ----------
    radius : float
        Radius of the punch. [m]
    size : float or pair of float
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``.

    Returns
    -------
    xarray.DataArray
        Height over (x, y) with ``attrs["missing"] == "absent"``: there is no material where it is NaN. [m]

    Raises
    ------
    InputError
        If a parameter is not positive and finite, or no cell centre lies within the radius.
    """
    return _indenter("flat_punch", {"radius": number("radius", radius, "m")}, size, shape)


def wavy(amplitude: float, wavelength: float, size: Any, shape: Any, waves: int = 2) -> xr.DataArray:
    r"""Regular waves, periodic over the domain, with a crest at the corner ``x = y = 0``.

    Parameters
    ----------
    amplitude : float
        Amplitude :math:`a`. [m]
    wavelength : float
        Wavelength :math:`2 \pi / k`; the domain must hold a whole number of them. [m]
    size : float or pair of float
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``.
    waves : {1, 2}, default 2
        1: :math:`a \cos kx` (Westergaard). 2: :math:`a \cos kx \cos ky` (Johnson, Greenwood and Higginson).

    Returns
    -------
    xarray.DataArray
        Height over (x, y). [m]

    Raises
    ------
    InputError
        If a parameter is not positive and finite, `waves` is neither 1 nor 2, or the waves do not fit the domain.
    """
    amplitude, wavelength = number("amplitude", amplitude, "m"), number("wavelength", wavelength, "m")
    size, shape = pair("size", size), counts("shape", shape)
    if waves not in (1, 2):
        raise InputError(f"waves is {waves!r}: expected 1 (along x) or 2 (along x and y)")
    for side in size[:waves]:
        periods = side / wavelength
        if round(periods) < 1 or abs(periods - round(periods)) > 1e-9 * periods:
            raise InputError(f"size holds {periods:.6g} wavelengths: expected a whole number, so that the waves repeat")
    along = [
        np.cos(2 * np.pi * round(s / wavelength) * (np.arange(n) + 0.5) / n) for s, n in zip(size, shape, strict=True)
    ]
    heights = amplitude * along[0][:, None] * (along[1] if waves == 2 else np.ones(shape[1]))
    parameters = {"amplitude": amplitude, "wavelength": wavelength, "waves": int(waves)}
    return labelled(heights, _cell(size, shape), _recipe("wavy", parameters, size, shape))


def self_affine(
    size: Any,
    shape: Any,
    *,
    hurst: float,
    rms_slope: float | None = None,
    rms_height: float | None = None,
    rolloff: float | None = None,
    shortcut: float | None = None,
    anisotropy: float = 1.0,
    seed: int | np.random.Generator,
) -> xr.DataArray:
    r"""Periodic self-affine roughness by Fourier synthesis with random phases.

    Parameters
    ----------
    size : float or pair of float
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``.
    hurst : float
        Hurst exponent :math:`H`, in (0, 1]. [-]
    rms_slope, rms_height : float
        Exactly one: the root mean square of the gradient [-], or of the height about its mean [m]. It is met to
        rounding, as the band-limited function has it: finite differences on the grid see a little less slope.
    rolloff : float, optional
        Wavelength above which the spectrum is constant. [m] Default: none, the power law reaches the domain's size.
    shortcut : float, optional
        Wavelength below which there is nothing. [m] Default: two cells (the longer of the two sides).
    anisotropy : float, default 1
        How many times longer the texture is along x than along y. [-] Wavelengths then refer to the geometric mean
        of both directions.
    seed : int or numpy.random.Generator
        Source of the phases.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), of zero mean. [m]

    Raises
    ------
    InputError
        If a parameter is out of its range, both or none of `rms_slope` and `rms_height` are given, or no
        wave of the domain lies between roll-off and short cut-off.

    Notes
    -----
    The amplitudes follow the spectrum :math:`C \propto \max(q, q_r)^{-2 - 2H}` for :math:`q < q_s` exactly; only
    the phases are random, uniform and independent. The transform is real and done in place: the peak is about twice
    the memory of the result.

    References
    ----------
    .. [1] T. D. B. Jacobs, T. Junge, L. Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001.
    """
    size, shape = pair("size", size), counts("shape", shape)
    hurst = number("hurst", hurst, "-", high=1.0)
    if (rms_slope is None) == (rms_height is None):
        raise InputError(
            f"rms_slope is {rms_slope!r} and rms_height is {rms_height!r}: expected exactly one of the two"
        )
    target = number("rms_slope", rms_slope, "-") if rms_height is None else number("rms_height", rms_height, "m")
    anisotropy = number("anisotropy", anisotropy, "-")
    stretch = (math.sqrt(anisotropy), 1 / math.sqrt(anisotropy))
    finest = 2 * max(d / s for d, s in zip(_cell(size, shape), stretch, strict=True))
    shortcut = finest if shortcut is None else number("shortcut", shortcut, "m")
    if shortcut < finest * (1 - 1e-12):
        raise InputError(f"shortcut is {shortcut!r}: expected at least two cells, {finest:.6g} [m]")
    if rolloff is not None and number("rolloff", rolloff, "m") < shortcut:
        raise InputError(f"rolloff is {rolloff!r}: expected at least the short cut-off, {shortcut:.6g} [m]")
    band = (0.0 if rolloff is None else 2 * np.pi / rolloff, 2 * np.pi / shortcut)
    try:
        phases = np.random.default_rng(seed)
    except (TypeError, ValueError) as error:
        raise InputError(f"seed is {seed!r}: expected a whole number >= 0 or a numpy.random.Generator") from error
    spectrum, variance, slope2 = _spectrum(size, shape, hurst, band, stretch, phases)
    if not variance:
        raise InputError(f"no wave of the domain is longer than shortcut = {shortcut:.6g} [m]: expected a larger size")
    heights = scipy.fft.irfft2(spectrum, s=shape, norm="forward", overwrite_x=True)
    heights *= target / math.sqrt(slope2 if rms_height is None else variance)
    parameters = {"hurst": hurst, "rms_slope": rms_slope, "rms_height": rms_height, "rolloff": rolloff}
    parameters |= {"shortcut": shortcut, "anisotropy": anisotropy, "seed": _plain_seed(seed)}
    return labelled(heights, _cell(size, shape), _recipe("self_affine", parameters, size, shape))


def grown(h: xr.DataArray, factor: float = 1.5) -> xr.DataArray | None:
    """The same indenter on a larger grid: further cells all around, those that exist unchanged.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    factor : float, default 1.5
        How many times larger each side becomes, at least; never less than one cell more on each side.

    Returns
    -------
    xarray.DataArray or None
        None if `h` is no sphere, cone or flat punch. xarray keeps attributes through arithmetic, so the recipe is
        believed only if it reproduces the heights given.
    """
    try:
        recipe = json.loads(h.attrs["recipe"])
        evaluate, parameters = _INDENTERS[recipe["name"]], recipe["parameters"]
        cell, centre = _cell(recipe["size"], recipe["shape"]), [side / 2 for side in recipe["size"]]
        axes = [h[axis].values for axis in ("x", "y")]
        first = [round(at[0] / d - 0.5) for at, d in zip(axes, cell, strict=True)]
        expected = evaluate(axes[0][:, None] - centre[0], axes[1] - centre[1], **parameters)
    except (KeyError, TypeError, ValueError, IndexError, ZeroDivisionError, AttributeError):
        return None
    h = h.transpose("x", "y")
    near = 1e-9 * np.nanmax(np.abs(expected), initial=0.0)
    if not np.allclose(h.values, expected, rtol=0, atol=near, equal_nan=True):
        return None
    margin = [max(1, math.ceil(n * (factor - 1) / 2 - 1e-6)) for n in h.shape]
    wider = []
    for at, d, i, m in zip(axes, cell, first, margin, strict=True):
        there = (np.arange(i - m, i + at.size + m) + 0.5) * d
        if np.abs(there[m:-m] - at).max() > 1e-6 * d:
            return None
        there[m:-m] = at
        wider.append(there)
    heights = evaluate(wider[0][:, None] - centre[0], wider[1] - centre[1], **parameters)
    heights[margin[0] : -margin[0], margin[1] : -margin[1]] = h.values
    larger = with_coordinates(heights, *wider, h.attrs)
    return noted(
        larger, f"grown from {h.sizes['x']} x {h.sizes['y']} to {larger.sizes['x']} x {larger.sizes['y']} cells"
    )


def _sphere(x: np.ndarray, y: np.ndarray, radius: float, exact: bool) -> np.ndarray:
    r2 = x**2 + y**2
    if not exact:
        return r2 / (-2 * radius)
    # not sqrt(R^2 - r^2) - R, which loses the digits of a shallow cap
    cap = -r2 / (radius + np.sqrt(np.maximum(radius**2 - r2, 0)))
    return np.where(r2 <= radius**2, cap, np.nan)


def _cone(x: np.ndarray, y: np.ndarray, slope: float) -> np.ndarray:
    return -slope * np.hypot(x, y)


def _flat_punch(x: np.ndarray, y: np.ndarray, radius: float) -> np.ndarray:
    return np.where(np.hypot(x, y) <= radius, 0.0, np.nan)


#: Profiles that are known outside their grid too: (x, y from the centre, parameters) -> height.
_INDENTERS = {"sphere": _sphere, "cone": _cone, "flat_punch": _flat_punch}


def _indenter(name: str, parameters: dict[str, Any], size: Any, shape: Any) -> xr.DataArray:
    size, shape = pair("size", size), counts("shape", shape)
    h = labelled(np.empty(shape), _cell(size, shape), _recipe(name, parameters, size, shape))
    x, y = h["x"].values[:, None] - size[0] / 2, h["y"].values - size[1] / 2
    h.values = _INDENTERS[name](x, y, **parameters)
    absent = np.isnan(h.values)
    if absent.all():
        raise InputError(f"radius is {parameters['radius']!r}: expected one that holds a cell of {spacing(h)} m")
    if absent.any():
        h.attrs["missing"] = "absent"
    return h


def _cell(size: Any, shape: Any) -> tuple[float, float]:
    return size[0] / shape[0], size[1] / shape[1]


def _recipe(name: str, parameters: dict[str, Any], size: Any, shape: Any) -> dict[str, str]:
    recipe = {"name": name, "parameters": parameters, "size": list(size), "shape": list(shape)}
    return {"recipe": json.dumps(recipe), "history": f"generated: {name}"}


def _plain_seed(seed: Any) -> int | None:
    return int(seed) if isinstance(seed, int | np.integer) else None


def _spectrum(
    size: Any, shape: Any, hurst: float, band: tuple[float, float], stretch: Any, phases: np.random.Generator
) -> tuple[np.ndarray, float, float]:
    """Half spectrum of unit scale, with its variance and its mean square slope (Parseval)."""
    nx, ny = shape
    q_x = 2 * np.pi * scipy.fft.fftfreq(nx, size[0] / nx)
    q_y = 2 * np.pi * scipy.fft.rfftfreq(ny, size[1] / ny)
    weight = np.full(q_y.size, 2.0)  # the half that is not stored
    weight[0] = 1.0
    spectrum = np.empty((nx, q_y.size), dtype=complex)
    variance = slope2 = 0.0
    for start in range(0, nx, 64):  # in blocks of rows, so that the temporaries stay small
        rows = slice(start, start + 64)
        q = np.hypot(q_x[rows, None] * stretch[0], q_y * stretch[1]) / band[1]
        inside = (q > 0) & (q < 1 - 1e-12)  # the Nyquist rows, which have no sine, fall outside
        amplitude = np.zeros(q.shape)
        np.power(np.maximum(q, band[0] / band[1]), -1 - hurst, out=amplitude, where=inside)
        spectrum[rows] = amplitude * np.exp(2j * np.pi * phases.random(q.shape))
        power = weight * amplitude**2
        variance += power.sum()
        slope2 += (power * (q_x[rows, None] ** 2 + q_y**2)).sum()
    # the first column holds both halves: it must be Hermitian for the amplitudes to survive the real transform
    column = spectrum[:, 0]
    half = (nx - 1) // 2
    column[nx - half :] = column[1 : half + 1][::-1].conj()
    return spectrum, float(variance), float(slope2)
