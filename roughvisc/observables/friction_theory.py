"""Rubber friction by Persson's theory, from the spectrum of a surface: without a grid, over any number of decades."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.labels import label
from roughvisc.mechanics.body import HALF_SPACE, Body
from roughvisc.mechanics.friction_integrals import FrictionIntegrals
from roughvisc.mechanics.heating import Heating
from roughvisc.mechanics.materials.material import Material, check_material
from roughvisc.topography.radial_spectrum import evenly, spectrum_of
from roughvisc.units import Quantity, format_quantity, listed, number, quantities

Array = NDArray[np.float64]

# Share of a decade below which a rest at the ends of a spectrum belongs to the neighbouring decade.
_REST = 1e-6


@quantities(pressure="Pa > 0", shortest="m > 0", slope="1 > 0")
def friction_theory(
    spectrum: xr.Dataset | xr.DataArray | Sequence[xr.Dataset | xr.DataArray],
    material: Material | Body,
    *,
    speeds: Sequence[Quantity] | Quantity,
    pressure: Quantity,
    shortest: Quantity | None = None,
    slope: float | None = None,
    dissipation_factor: float = 0.5,
    heating: Heating | None = None,
) -> xr.Dataset:
    r"""Compute rubber friction over speed by Persson's theory, from the radial spectrum of a rough surface.

    Parameters
    ----------
    spectrum : xarray.Dataset or xarray.DataArray, or sequence of these
        Spectrum from :func:`roughvisc.psd_table` or :func:`roughvisc.psd`, or a map of heights; several are joined, see
        :func:`roughvisc.join_psd`.
    material : Material
        Material of a half-space, measured over all frequencies ``V / wavelength``. With `heating` at the temperature at
        which the shift factor is one, otherwise at the temperature of the contact (:func:`roughvisc.shift`).
    speeds : float or str, or sequence of float or str
        Sliding speeds. [m/s]
    pressure : float or str
        Nominal pressure :math:`\sigma_0`. [Pa]
    shortest : float or str, optional
        Shortest wavelength that counts. [m] Default: the shortest of the spectrum.
    slope : float, optional
        Instead of `shortest`: the waves count up to this rms slope, such as 1.3 for tread compounds on asphalt. [-]
    dissipation_factor : float
        The number ``g``, from 0 to 1, in :math:`S = g + (1 - g) P^2`, by which the waves dissipate less in partial
        contact. Default: 0.5, from the literature [3]_. With 1 it is the theory of [1]_. [-]
    heating : Heating, optional
        Heat of sliding, with a radius of spots. Default: the temperature of the material does not change.

    Returns
    -------
    xarray.Dataset
        Over ``speed``, in the given order: ``friction_coefficient``, ``contact_fraction`` and ``heat_flux``; over
        ``speed`` and ``wavelength``, the decades of the waves: ``friction_of_waves``, whose sum is the friction
        coefficient. With `heating` also ``temperature``, of the shortest waves, and ``temperature_of_waves``.

    Raises
    ------
    InputError
        If the input is invalid, the body is not a half-space, `heating` has no radius of spots, or the material is not
        known at the frequencies or its shift factor at the temperatures.
    ConvergenceError
        If the temperatures at a speed are not found.

    See Also
    --------
    roughvisc.friction, roughvisc.psd_table, roughvisc.Heating, roughvisc.observables.persson, roughvisc.plot.waves

    Notes
    -----
    With the density :math:`C(q)` of :func:`roughvisc.psd` and means over the directions of the waves,

    .. math::

        G(q) = \frac{1}{16 \pi \sigma_0^2} \int_{q_0}^q q'^3 C\, \langle |E^*|^2 \rangle \,\mathrm dq', \quad
        P = \operatorname{erf} \frac{1}{2 \sqrt G}, \quad
        \mu = \frac{1}{4 \pi \sigma_0} \int q^3 C P S\, \langle \cos \varphi \operatorname{Im} E^* \rangle \,\mathrm dq

    with the plane-strain modulus :math:`E^*` at the frequency :math:`a_T q V \cos \varphi`. The contact fraction is
    :math:`P` with all waves. On 12 random surfaces of 512 x 512 cells :func:`roughvisc.friction` is compared with it in
    the `how-to <../howto/tyre.html>`_.

    With `heating` the heat of all waves flows into round spots of the given radius, whose area is the contact at the
    magnification of twice this radius. The waves of ``q`` heat the depth ``1/2q``, and have the mean temperature of
    this depth in a spot that moves over the body at the speed [2]_, see :mod:`roughvisc.mechanics.heating`. The
    temperatures agree with the heat to 1e-9. Earlier contacts of the same rubber do not count.

    References
    ----------
    .. [1] B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840.
    .. [2] B. N. J. Persson, J. Phys.: Condens. Matter 18 (2006) 7789.
    .. [3] M. Scaraggi, B. N. J. Persson, J. Phys.: Condens. Matter 27 (2015) 105102.

    Examples
    --------
    >>> import roughvisc as rv
    >>> road = rv.psd_table([1e3, 1e4, 1e6], [1e-17, 1e-17, 1e-24], convention="persson")
    >>> rubber = rv.zener(shear_modulus=1e8, kelvin_modulus=1e6, kelvin_viscosity=10.0)
    >>> ds = rv.friction_theory(road, rubber, speeds=[1e-3, 0.1, 10.0], pressure="0.3 MPa")
    >>> ds.friction_of_waves.dims
    ('speed', 'wavelength')
    """
    body = material if isinstance(material, Body) else Body(check_material(material))
    if body.kernel != HALF_SPACE:
        raise InputError(key="material", found=body, expected="a material of a half-space")
    speeds = _speeds(speeds)
    factor = number(dissipation_factor, "1", "dissipation_factor", least=0, most=1)
    if heating is not None and not isinstance(heating, Heating):
        raise InputError(key="heating", found=heating, expected="rv.Heating(...)")
    if heating is not None and heating.spot_radius is None:
        raise InputError(key="heating.spot_radius", found=None, expected="the radius of the spots in contact [m]")
    q, density = evenly(spectrum_of(spectrum), shortest, slope)
    integrals = FrictionIntegrals(q, density, body.material, float(pressure), factor, heating)
    edges = _decades(q)
    middles = np.sqrt(edges[1:] * edges[:-1])
    rows: dict[str, list[Any]] = {}
    for speed in speeds:
        try:
            waves = integrals.at(speed)
        except ConvergenceError as error:
            advice = "try other properties of the heating, or a lower speed"
            raise ConvergenceError(f"at {format_quantity(speed, 'm/s')}: {error}; {advice}") from error
        summed = np.interp(np.log(edges), np.log(q), np.append(0.0, np.cumsum(waves.friction)))
        row = {
            "friction_coefficient": summed[-1],
            "contact_fraction": waves.contact[-1],
            "heat_flux": waves.heat,
            "friction_of_waves": np.diff(summed),
        }
        if heating is not None:
            row["temperature"] = heating.temperature + waves.rise[-1]
            row["temperature_of_waves"] = heating.temperature + np.interp(np.log(middles), np.log(q), waves.rise)
        for name, value in row.items():
            rows.setdefault(name, []).append(value)
    over = {name: ("speed", "wavelength") if name.endswith("of_waves") else ("speed",) for name in rows}
    variables: dict[str, Any] = {name: (over[name], np.array(column)) for name, column in rows.items()}
    variables["nominal_pressure"] = "speed", np.full(len(speeds), float(pressure))
    ends = {"shortest_wavelength": edges[1:], "longest_wavelength": edges[:-1]}
    lengths = {name: ("wavelength", 2 * np.pi / values) for name, values in ends.items()}
    coordinates = {"speed": np.array(speeds), "wavelength": 2 * np.pi / middles, **lengths}
    step = math.log(q[1] / q[0])
    squares = q**4 * density / (2 * math.pi)
    attributes = {
        "title": "Rubber friction by Persson's theory",
        "material": repr(body.material),
        "dissipation_factor": factor,
        "rms_slope": math.sqrt(float((squares[1:] + squares[:-1]).sum()) / 2 * step),
    }
    return label(xr.Dataset(variables, coordinates, attributes))


def _speeds(speeds: Any) -> list[float]:
    """Return speeds as positive numbers, in the given order. [m/s]"""
    if isinstance(speeds, int | float | np.number) and not isinstance(speeds, bool):
        speeds = [speeds]
    values = listed(speeds, "m/s", "speeds").tolist()
    if not values:
        raise InputError(key="speeds", found=speeds, expected="at least one speed [m/s]")
    return [number(speed, "m/s", "speeds", above=0) for speed in values]


def _decades(q: Array) -> Array:
    """Return the wave numbers at the borders of the decades of wavelength, powers of ten, and at both ends. [rad/m]"""
    low = math.log10(q[0] / (2 * math.pi))
    high = math.log10(q[-1] / (2 * math.pi))
    inner = np.arange(math.floor(low) + 1, math.ceil(high))
    inner = inner[(inner > low + _REST) & (inner < high - _REST)]
    return np.concatenate([q[:1], 2 * math.pi * 10.0**inner, q[-1:]])
