"""Recipes of surfaces: indenters, waves, self-affine roughness, and random surfaces with the spectrum of a surface.

Heights are taken at the cell centres ``((i + 1/2) dx, (j + 1/2) dy)``. The recipe stays in the attributes. The profile
of an indenter is defined beyond its grid, so that the grid can grow (:func:`grown`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from numbers import Integral
from typing import Any, Literal, cast

import numpy as np
import scipy.fft
import xarray as xr

from roughvisc.arguments import DataNeeded, NoData, call, check_keys, one_of, split
from roughvisc.errors import InputError
from roughvisc.topography.borders import is_mirrored, is_periodic, period_of
from roughvisc.topography.framing import mirror
from roughvisc.topography.grid import checked, counts, labelled, noted, pair, spacing, with_coordinates
from roughvisc.topography.radial_spectrum import Convention, density_at, psd_table
from roughvisc.topography.spectrum import psd, ring_numbers
from roughvisc.topography.spectrum import wavevectors as waves_of_grid
from roughvisc.units import Quantity, format_quantity, number, quantities

#: Largest number of cells of an indenter on a larger grid.
_MOST_GROWN = 4096**2

# ------------------------------------------------------------------------------------------------------------- recipes


@quantities(radius="m > 0", size="m")
def sphere(radius: Quantity, size: Any, shape: Any) -> xr.DataArray:
    r"""Return a spherical indenter, the paraboloid :math:`-r^2 / 2R` of Hertz theory, centred, with its apex at zero.

    Parameters
    ----------
    radius : float or str
        Radius of curvature. [m]
    size : float or str, or a pair
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``; one along an axis is a strip, which begins at zero.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), not above zero. [m] The apex is at ``size / 2``, which lies between the cells if their
        number is even.

    Raises
    ------
    InputError
        If a parameter is not positive and finite.

    See Also
    --------
    roughvisc.cone, roughvisc.flat_punch, roughvisc.closed_forms.hertz

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius="1 mm", size="200 um", shape=45)
    >>> ball.shape
    (45, 45)
    """
    return _indenter("sphere", {"radius": radius}, size, shape)


@quantities(slope="1 > 0", size="m")
def cone(slope: float, size: Any, shape: Any) -> xr.DataArray:
    """Return a conical indenter of height ``-slope * r``, centred, with its apex at height zero.

    Parameters
    ----------
    slope : float
        Tangent of the angle between the flank and the plane. [-]
    size : float or str, or a pair
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``; one along an axis is a strip, which begins at zero.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), not above zero. [m]

    Raises
    ------
    InputError
        If a parameter is not positive and finite.

    See Also
    --------
    roughvisc.sphere, roughvisc.flat_punch, roughvisc.closed_forms.cone

    Examples
    --------
    >>> import roughvisc as rv
    >>> rv.cone(slope=0.1, size="200 um", shape=(41, 41)).shape
    (41, 41)
    """
    return _indenter("cone", {"slope": slope}, size, shape)


@quantities(radius="m > 0", size="m")
def flat_punch(radius: Quantity, size: Any, shape: Any) -> xr.DataArray:
    """Return a flat-ended cylindrical punch, centred: height zero inside the radius, absent (NaN) outside.

    Parameters
    ----------
    radius : float or str
        Radius of the punch. [m]
    size : float or str, or a pair
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``; one along an axis is a strip, which begins at zero.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), NaN where material is absent (``attrs["missing"] == "absent"``). [m]

    Raises
    ------
    InputError
        If a parameter is not positive and finite, or no cell centre lies within the radius.

    See Also
    --------
    roughvisc.sphere, roughvisc.cone, roughvisc.closed_forms.flat_punch

    Examples
    --------
    >>> import roughvisc as rv
    >>> punch = rv.flat_punch(radius="50 um", size="200 um", shape=41)
    >>> punch.attrs["missing"]
    'absent'
    """
    return _indenter("flat_punch", {"radius": radius}, size, shape)


@quantities(amplitude="m > 0", wavelength="m > 0", size="m")
def wavy(amplitude: Quantity, wavelength: Quantity, size: Any, shape: Any, waves: Literal[1, 2] = 2) -> xr.DataArray:
    r"""Return regular waves, periodic over the domain, with a crest at the corner ``x = y = 0``.

    Parameters
    ----------
    amplitude : float or str
        Amplitude :math:`a`. [m]
    wavelength : float or str
        Wavelength :math:`2 \pi / k`; each side must be a whole number of wavelengths. [m]
    size : float or str, or a pair
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``; with one cell along y the crests run along y.
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

    See Also
    --------
    roughvisc.self_affine, roughvisc.closed_forms.westergaard, roughvisc.closed_forms.johnson_greenwood_higginson

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy(amplitude="1 um", wavelength="1 mm", size="1 mm", shape=64)
    >>> round(float(rv.parameters(wave, periodic=True).Sq), 9)
    5e-07
    """
    size = pair("size", size)
    one_of("waves", waves, (1, 2))
    for side in size[:waves]:
        periods = side / wavelength
        if round(periods) < 1 or abs(periods - round(periods)) > 1e-9 * periods:
            message = f"{format_quantity(side, 'm')} holds {periods:.6g}"
            expected = f"a whole number of wavelengths, so that the waves repeat; {message}"
            raise InputError(key="size", found=size, expected=expected)
    shape = cells(shape)
    repeats = (round(size[0] / wavelength), round(size[1] / wavelength) * (waves == 2))
    along_x, along_y = (np.cos(2 * np.pi * k * (np.arange(n) + 0.5) / n) for k, n in zip(repeats, shape, strict=True))
    parameters = {"amplitude": amplitude, "wavelength": wavelength, "waves": int(waves)}
    return generated(amplitude * along_x[:, None] * along_y, "wavy", parameters, size, period=list(size))


@quantities(size="m", rms_slope="1 > 0", rms_height="m > 0", rolloff="m > 0", shortcut="m > 0", anisotropy="1 > 0")
def self_affine(
    size: Any,
    shape: Any,
    *,
    hurst: float,
    rms_slope: Quantity | None = None,
    rms_height: Quantity | None = None,
    rolloff: Quantity | None = None,
    shortcut: Quantity | None = None,
    anisotropy: float = 1.0,
    amplitudes: Literal["fixed", "gaussian"] = "fixed",
    seed: int | np.random.Generator,
) -> xr.DataArray:
    r"""Generate periodic self-affine roughness by Fourier synthesis with random phases.

    Each seed defines one surface: a finer grid of the same size keeps the wavelengths of a coarser one and adds shorter
    ones.

    Parameters
    ----------
    size : float or str, or a pair
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``.
    hurst : float
        Hurst exponent :math:`H`, in (0, 1]. [-]
    rms_slope, rms_height : float or str
        Exactly one: the root mean square of the gradient [-], or of the height about its mean [m], of all wavelengths
        that the grid resolves down to `shortcut`; with Gaussian amplitudes the root mean square over all seeds. The
        band-limited function has this value to rounding; finite differences on the grid give a slightly smaller slope.
    rolloff : float or str, optional
        Wavelength above which the spectrum is constant. [m] Default: none, the power law reaches the size of the
        domain.
    shortcut : float or str, optional
        Shortest wavelength. [m] Default: two cells (the longer of the two sides). With it, the heights are the same on
        every grid that resolves it. Without it, a finer grid has more wavelengths, and one factor reduces the common
        wavelengths so that the whole surface has the given `rms_slope` or `rms_height`.
    anisotropy : float, default 1
        Length of the texture along x over that along y. [-] Wavelengths then refer to the geometric mean of both
        directions.
    amplitudes : {"fixed", "gaussian"}, default "fixed"
        "fixed": each mode has the amplitude of the spectrum, and only phases are random. The rms height and the rms
        slope are then the same for every seed, and quantities that depend on them scatter too little: the mean gap 3 to
        10 times less than over samples of a random surface. "gaussian": amplitudes are random too, as in samples of a
        random surface. Use it if the scatter over realisations matters.
    seed : int or numpy.random.Generator
        Source of random phases and amplitudes. With a generator the recipe cannot be repeated.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), with zero mean. [m]

    Raises
    ------
    InputError
        If a parameter is out of range, `amplitudes` is unknown, both or none of `rms_slope` and `rms_height` are given,
        or no wavelength of the domain lies between roll-off and short cut-off.

    See Also
    --------
    roughvisc.from_spectrum, roughvisc.surrogates, roughvisc.wavy

    Notes
    -----
    The spectrum is :math:`C \propto \max(q, q_r)^{-2 - 2H}` for :math:`q < q_s`. Phases are uniform and independent.
    Fixed amplitudes follow the spectrum exactly. Gaussian amplitudes are these times the modulus of a complex normal
    number of mean square one, so the height is a Gaussian random field.

    Random numbers belong to wavevectors :math:`2 \pi (k_x / L_x, k_y / L_y)`: each :math:`k_x` has its own stream,
    spawned from the seed [2]_ and drawn from :math:`k_y = 0` upwards. The grid only determines the number of streams
    and the length drawn from each. Phases refer to the corner :math:`x = y = 0`.

    References
    ----------
    .. [1] T. D. B. Jacobs, T. Junge, L. Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001.
    .. [2] NumPy reference, "Parallel random number generation", SeedSequence spawning.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rough = rv.self_affine("1 mm", 64, hurst=0.8, rms_height="1 um", seed=1)
    >>> round(float(rv.parameters(rough).Sq), 9)
    1e-06
    """
    size = pair("size", size)
    stated_seed = None if isinstance(seed, np.random.Generator) else whole("seed", seed)
    one_of("amplitudes", amplitudes, ("fixed", "gaussian"))
    hurst = number(hurst, "1", "hurst", above=0, most=1.0)
    if (rms_slope is None) == (rms_height is None):
        raise InputError(key="rms_slope", found=rms_slope, expected="exactly one of rms_slope and rms_height")
    shape = cells(shape, least=2)
    stretch = (math.sqrt(anisotropy), 1 / math.sqrt(anisotropy))
    sides = size[0] / shape[0], size[1] / shape[1]
    finest = finest_wave(size, shape, anisotropy)
    shortcut = number(finest if shortcut is None else shortcut, "m", "shortcut", least=finest * (1 - 1e-12))
    if rolloff is not None:
        rolloff = number(rolloff, "m", "rolloff", least=shortcut)
    band = (0.0 if rolloff is None else 2 * np.pi / rolloff, 2 * np.pi / shortcut)
    entropy = np.random.default_rng(seed).integers(1 << 32, size=4).tolist()
    q_x, q_y, weight = waves_of_grid(shape, sides)
    q = np.hypot(q_x[:, None] * stretch[0], q_y * stretch[1]) / band[1]
    inside = (q > 0) & (q < 1 - 1e-12)  # the Nyquist rows, which have no sine, are outside
    amplitude = np.zeros(q.shape)
    np.power(np.maximum(q, band[0] / band[1]), -1 - hurst, out=amplitude, where=inside)
    power = weight * amplitude**2  # Parseval
    power = power if rms_slope is None else power * (q_x[:, None] ** 2 + q_y**2)
    square = float(sum(power[start : start + 64].sum() for start in range(0, shape[0], 64)))
    if not square:
        raise InputError(
            f"no wave of the domain is longer than shortcut = {format_quantity(shortcut, 'm')}: expected a larger size"
        )
    heights = random_heights(amplitude, shape[1], entropy, normal=amplitudes == "gaussian")
    rms = rms_height if rms_slope is None else rms_slope
    heights *= cast(float, rms) / math.sqrt(square)
    parameters = {"hurst": hurst, "rms_slope": rms_slope, "rms_height": rms_height, "rolloff": rolloff}
    parameters |= {"shortcut": shortcut, "anisotropy": anisotropy, "amplitudes": amplitudes, "seed": stated_seed}
    return generated(heights, "self_affine", parameters, size, period=list(size))


@quantities(size="m", wavevectors="1/m ...", densities="m^4 ...")
def from_spectrum(
    size: Any,
    shape: Any,
    *,
    wavevectors: Sequence[Quantity],
    densities: Sequence[Quantity],
    convention: Convention,
    amplitudes: Literal["fixed", "gaussian"] = "fixed",
    seed: int,
) -> xr.DataArray:
    r"""Generate a periodic surface with a radial spectrum, such as a part of the spectrum of a road.

    Parameters
    ----------
    size : float or str, or a pair
        Sides of the domain. [m]
    shape : int or pair of int
        Number of cells ``(nx, ny)``.
    wavevectors : sequence of float or str
        Wave numbers :math:`q = 2 \pi / \lambda`, ascending. [rad/m]
    densities : sequence of float or str
        Two-dimensional isotropic density ``C(q)``, a power law between rows and zero outside. [m4]
    convention : {"psd", "persson"}
        Convention of the densities, see :func:`roughvisc.psd_table`.
    amplitudes : {"fixed", "gaussian"}, default "fixed"
        As in :func:`roughvisc.self_affine`.
    seed : int
        Source of random phases. A seed defines one surface: a finer grid of the same size adds shorter waves.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), with zero mean, with the waves of the spectrum that are longer than two cells. [m]

    Raises
    ------
    InputError
        If a parameter is out of range, or no wave of the domain is in the spectrum.

    See Also
    --------
    roughvisc.psd_table, roughvisc.self_affine

    Notes
    -----
    A wave has the mean square amplitude :math:`C(q) / A` on the area :math:`A`, in the convention of
    :func:`roughvisc.psd`.

    Examples
    --------
    >>> import roughvisc as rv
    >>> road = rv.from_spectrum(1e-3, 64, wavevectors=[1e4, 1e5], densities=[1e-19, 1e-23], convention="psd", seed=1)
    >>> road.shape
    (64, 64)
    """
    size = pair("size", size)
    stated_seed = whole("seed", seed)
    one_of("amplitudes", amplitudes, ("fixed", "gaussian"))
    spectrum = psd_table(wavevectors, densities, convention=convention)
    shape = cells(shape, least=2)
    sides = size[0] / shape[0], size[1] / shape[1]
    q_x, q_y, _ = waves_of_grid(shape, sides)
    q = np.hypot(q_x[:, None], q_y)
    inside = (q > 0) & (q < np.pi / max(sides) * (1 - 1e-12))  # the waves of two cells have no sine
    amplitude = np.zeros(q.shape)
    amplitude[inside] = np.sqrt(density_at(spectrum, q[inside]) / math.prod(size))
    if not amplitude.any():
        ends = (format_quantity(float(2 * np.pi / q), "m") for q in spectrum["wavevector"].values[[-1, 0]])
        expected = f"a grid with waves of the spectrum, {' to '.join(ends)}"
        raise InputError(key="size", found=size, expected=expected)
    entropy = np.random.default_rng(stated_seed).integers(1 << 32, size=4).tolist()
    heights = random_heights(amplitude, shape[1], entropy, normal=amplitudes == "gaussian")
    stated: dict[str, Any] = {"wavevectors": list(map(float, wavevectors)), "densities": list(map(float, densities))}
    stated |= {"convention": convention, "amplitudes": amplitudes, "seed": stated_seed}
    return generated(heights, "spectrum", stated, size, period=list(size))


def finest_wave(size: tuple[float, float], shape: tuple[int, int], anisotropy: float = 1.0) -> float:
    """Return the shortest wavelength of self-affine roughness that a grid resolves: two cells. [m]"""
    stretch = math.sqrt(anisotropy)
    return 2 * max(size[0] / shape[0] / stretch, size[1] / shape[1] / (1 / stretch))


# ------------------------------------------------------------------------------------------------------------ indenters


def _indenter(name: str, parameters: dict[str, Any], size: Any, shape: Any) -> xr.DataArray:
    size = pair("size", size)
    shape = cells(shape)
    x = (np.arange(shape[0]) + 0.5) * (size[0] / shape[0]) - size[0] / 2
    y = (np.arange(shape[1]) + 0.5) * (size[1] / shape[1]) - size[1] / 2
    heights = _INDENTERS[name](x[:, None], y, **parameters)
    absent = np.isnan(heights)
    if absent.all():
        expected = f"one that contains a cell centre, for {shape[0]} x {shape[1]} cells"
        raise InputError(key="radius", found=parameters["radius"], expected=expected)
    return generated(heights, name, parameters, size, **({"missing": "absent"} if absent.any() else {}))


#: Profiles, defined beyond their grid: (x, y from the centre, parameters) -> height.
_INDENTERS: dict[str, Callable[..., np.ndarray]] = {
    "sphere": lambda x, y, radius: (x**2 + y**2) / (-2 * radius),
    "cone": lambda x, y, slope: -slope * np.hypot(x, y),
    "flat_punch": lambda x, y, radius: np.where(np.hypot(x, y) <= radius, 0.0, np.nan),
}


def indenter_of(h: xr.DataArray) -> tuple[Callable[..., np.ndarray], tuple[float, float], tuple[float, float]] | None:
    """Return the profile of a sphere, cone or flat punch: height as a function of x and y from the apex. [m]

    With it, the cell sides and the position of the apex. [m] None if the recipe does not reproduce the heights on cells
    of its grid. xarray keeps attributes through arithmetic, so that the recipe alone does not count.
    """
    try:
        recipe = json.loads(h.attrs["recipe"])
        evaluate = partial(_INDENTERS[recipe["name"]], **recipe["parameters"])
        width, depth = recipe["size"]
        nx, ny = recipe["shape"]
        cell = (width / nx, depth / ny)
        centre = (width / 2, depth / 2)
        expected = evaluate(h["x"].values[:, None] - centre[0], h["y"].values - centre[1])
    except (KeyError, TypeError, ValueError, IndexError, ZeroDivisionError, AttributeError):
        return None
    for axis, side in zip("xy", cell, strict=True):
        place = h[axis].values / side - 0.5
        if np.abs(place - round(place[0]) - np.arange(place.size)).max() > 1e-6:
            return None
    near = 1e-9 * np.nanmax(np.abs(expected), initial=0.0)
    if not np.allclose(h.transpose("x", "y").values, expected, rtol=0, atol=near, equal_nan=True):
        return None
    return evaluate, cell, centre


def grown(h: xr.DataArray, factor: float = 1.5) -> xr.DataArray | None:
    """Return the same indenter on a larger grid: new cells on all sides, existing cells unchanged.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    factor : float, default 1.5
        Least ratio of each new side to the old one; every side gains at least one cell at each end.

    Returns
    -------
    xarray.DataArray or None
        None if `h` is not a sphere, cone or flat punch, see :func:`indenter_of`, or if the larger grid has more than
        4096 x 4096 cells.
    """
    known = indenter_of(h)
    if known is None:
        return None
    evaluate, cell, centre = known
    wider = []
    for axis, side in zip("xy", cell, strict=True):
        margin = max(1, math.ceil(h.sizes[axis] * (factor - 1) / 2 - 1e-6))
        first = round(float(h[axis][0]) / side - 0.5)
        wider.append((np.arange(first - margin, first + h.sizes[axis] + margin) + 0.5) * side)
    if wider[0].size * wider[1].size > _MOST_GROWN:
        return None
    heights = evaluate(wider[0][:, None] - centre[0], wider[1] - centre[1])
    line = f"grown from {h.sizes['x']} x {h.sizes['y']} to {heights.shape[0]} x {heights.shape[1]} cells"
    return noted(with_coordinates(heights, wider[0], wider[1], h.attrs), line)


def remade(h: xr.DataArray, shape: tuple[int, int]) -> xr.DataArray | None:
    """Return the same indenter on another number of cells over its domain; None if `h` is not an indenter. [m]"""
    if indenter_of(h) is None:
        return None
    recipe = json.loads(h.attrs["recipe"])
    return _indenter(recipe["name"], recipe["parameters"], recipe["size"], shape)


# ------------------------------------------------------------------------------------------------------ random surfaces


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

    See Also
    --------
    roughvisc.self_affine, roughvisc.over_realisations

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
    numbers = range(1, whole("count", count, 1) + 1)
    surfaces = [surrogate(h, number, seed=seed) for number in numbers]
    return xr.concat(surfaces, xr.DataArray(np.array(numbers), dims="realisation", name="realisation"))


def surrogate(h: xr.DataArray, number: int, *, seed: int = 0) -> xr.DataArray:
    """Return one surface of :func:`surrogates`, by its number. [m]"""
    entropy = [whole("seed", seed), whole("number", number, 1)]
    h = checked(h, "surrogates")
    if is_mirrored(h):
        h = h[: h.shape[0] // 2, : h.shape[1] // 2]  # the part that was measured
    repeating = h if is_periodic(h) else mirror(h)
    spectrum = psd(repeating)
    step = 2 * np.pi / min(period_of(repeating))  # the width of its rings
    sides = spacing(h)
    q_x, q_y, _ = waves_of_grid(h.shape, sides)
    q = np.hypot(q_x[:, None], q_y)
    rings = ring_numbers(spectrum["wavevector"].values, step)
    density = np.zeros(rings[-1] + 1)
    density[rings] = spectrum["psd"].values
    ring = ring_numbers(q, step)
    inside = (q > 0) & (q < np.pi / max(sides) * (1 - 1e-12))
    variance = np.where(inside, density[np.where(inside, ring, 0)], 0.0) / (h.size * math.prod(sides))
    heights = random_heights(np.sqrt(variance), h.shape[1], entropy, normal=True)
    line = f"surrogate {number} of seed {seed}: random phases, gaussian amplitudes"
    return noted(with_coordinates(heights, h["x"].values, h["y"].values), line, period=period_of(h))


def random_heights(amplitude: np.ndarray, ny: int, entropy: list[int], *, normal: bool) -> np.ndarray:
    """Return periodic heights at the cell centres from amplitudes and random phases.

    Each wave number along x has its own stream of random numbers, independent of the grid.

    Parameters
    ----------
    amplitude : ndarray, shape (nx, ny // 2 + 1)
        Amplitude of each mode of a real transform, zero for the mean and the Nyquist modes. [m]
    ny : int
        Number of cells along y.
    entropy : list of int
        Random integers from the seed.
    normal : bool
        Whether amplitudes are multiplied by moduli of complex normal numbers of mean square one.

    Returns
    -------
    ndarray, shape (nx, ny)
        Heights. [m]
    """
    nx, drawn = amplitude.shape
    centres = np.exp(1j * np.pi * np.arange(drawn) / ny)  # from the corner to the first centre, half a cell
    spectrum = np.zeros((nx, drawn), dtype=complex)
    for row, row_of_amplitudes in enumerate(amplitude):
        count = int(np.flatnonzero(row_of_amplitudes).max(initial=-1)) + 1
        k_x = row if 2 * row < nx else row - nx
        key = 2 * k_x if k_x >= 0 else -2 * k_x - 1
        seeds = (np.random.SeedSequence(entropy, spawn_key=(key, i)) for i in (0, 1))
        phases, powers = map(np.random.default_rng, seeds)
        waves = np.exp(2j * np.pi * phases.random(count))
        waves = waves * np.sqrt(powers.standard_exponential(count)) if normal else waves
        spectrum[row, :count] = row_of_amplitudes[:count] * (np.exp(1j * np.pi * k_x / nx) * centres[:count]) * waves
    half = (nx - 1) // 2  # the first column holds both halves: make it Hermitian
    spectrum[nx - half :, 0] = spectrum[1 : half + 1, 0][::-1].conj()
    return scipy.fft.irfft(scipy.fft.ifft(spectrum, axis=0, norm="forward"), ny, axis=1, norm="forward")


# ---------------------------------------------------------------------------------------------- the recipe of a surface


def generated(heights: np.ndarray, name: str, parameters: dict[str, Any], size: Any, **attrs: Any) -> xr.DataArray:
    """Return heights over their domain, with a recipe from which they can be generated again. [m]"""
    recipe = {"name": name, "parameters": parameters, "size": list(size), "shape": list(heights.shape)}
    stated = {"recipe": json.dumps(recipe), "history": f"generated: {name}"} | attrs
    return labelled(heights, (size[0] / heights.shape[0], size[1] / heights.shape[1]), stated)


def recipe_name(h: xr.DataArray) -> str:
    """Return the name of the recipe of a surface; empty if its grid differs from the recipe."""
    try:
        recipe = json.loads(h.attrs["recipe"])
        fits = list(h.shape) == recipe["shape"] and np.allclose(period_of(h), recipe["size"], rtol=1e-6, atol=0)
        return str(recipe["name"]) if fits else ""
    except (KeyError, TypeError, ValueError):
        return ""


def is_analytic(h: xr.DataArray) -> bool:
    """Return whether a surface is an indenter or a regular wave.

    Examples
    --------
    >>> ball = sphere(1e-2, 1e-3, 8)
    >>> is_analytic(ball), is_analytic(ball + 1e-6), is_analytic(wavy(1e-6, 1e-3, 1e-3, 8))
    (True, False, True)
    """
    return indenter_of(h) is not None or recipe_name(h) == "wavy"


def cells(shape: Any, least: int = 1) -> tuple[int, int]:
    """Return the number of cells of a recipe along x and y.

    Recipes call this function after the checks of all other arguments.

    Raises
    ------
    InputError
        If `shape` is neither a whole number of at least `least` nor a pair of such numbers.
    DataNeeded
        If `shape` is a placeholder: the recipe has checked its other arguments.
    """
    if isinstance(shape, NoData):
        raise DataNeeded("shape")
    return counts("shape", shape, low=least)


def whole(key: str, value: Any, least: int = 0) -> int:
    """Return a whole number of at least `least`; refuse any other value."""
    if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
        raise InputError(key=key, found=value, expected=f"a whole number of at least {least}")
    return int(value)


#: Function of each recipe, by its name in surface cards and studies.
RECIPES: dict[str, Callable[..., xr.DataArray]] = {
    recipe.__name__: recipe for recipe in (sphere, cone, flat_punch, wavy, self_affine)
} | {"spectrum": from_spectrum}
#: Boundary for which the surfaces of each recipe are made.
BOUNDARIES: dict[str, str] = {name: "free" if name in _INDENTERS else "periodic" for name in RECIPES}


def check_recipe(where: str, table: Mapping[str, Any]) -> None:
    """Check the arguments of a recipe without making its heights.

    Parameters
    ----------
    where : str
        Dotted name of the table, for messages.
    table : mapping
        ``generate``, the name of the recipe, and its arguments in SI.

    Raises
    ------
    InputError
        If the recipe or a key is unknown, an argument is missing, or a value is wrong.
    """
    recipe = RECIPES[one_of(f"{where}.generate", table["generate"], RECIPES)]
    _, stated = split(table, "generate")
    check_keys(recipe, where, stated)
    counts(f"{where}.shape", stated["shape"], low=2 if recipe in (self_affine, from_spectrum) else 1)
    with suppress(DataNeeded):
        call(recipe, where, stated | {"shape": NoData()})
