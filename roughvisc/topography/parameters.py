"""Areal parameters of ISO 25178-2."""

from __future__ import annotations

import numpy as np
import xarray as xr

from roughvisc.topography.grid import checked, require_heights, squared_slopes

#: name -> (units, long name)
PARAMETERS = {
    "Sa": ("m", "arithmetical mean height"),
    "Sq": ("m", "root mean square height"),
    "Ssk": ("1", "skewness"),
    "Sku": ("1", "kurtosis"),
    "Sz": ("m", "maximum height, highest peak to lowest valley"),
    "Sdq": ("1", "root mean square gradient, the rms slope"),
    "Sdr": ("1", "developed interfacial area ratio, excess of the surface over its projection"),
    "missing_fraction": ("1", "share of the points that are missing"),
}


def parameters(h: xr.DataArray, periodic: bool = False) -> xr.Dataset:
    r"""Compute areal surface parameters about the mean height.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), NaN where missing; level a tilted surface first. [m]
    periodic : bool, default False
        Whether differences are also taken across the border.

    Returns
    -------
    xarray.Dataset
        Scalars Sa, Sq, Sz [m], Ssk, Sku, Sdq, Sdr and missing_fraction [-], each with units and a name. Missing points
        and differences with them are ignored; a parameter without any valid point is NaN. On a strip one cell wide,
        heights do not vary across it.

    Raises
    ------
    InputError
        If all points are missing.

    See Also
    --------
    roughvisc.inspect, roughvisc.psd, roughvisc.level

    Notes
    -----
    Slopes are first differences between neighbouring points. They underestimate short wavelengths: a wavelength of
    :math:`n` cells by the factor :math:`\mathrm{sinc}(1/n)`. Sdq and Sdr are means over corners of three points, four
    in each square of points, so that mirror images of a map have the same parameters. SurfaceTopography takes one
    corner of each square; for a periodic surface Sdq is the same. Sdr is a ratio, not in per cent.

    References
    ----------
    .. [1] ISO 25178-2:2021, Surface texture: Areal, terms, definitions and parameters.

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy("1 um", "1 mm", "1 mm", 64, waves=1)
    >>> round(float(rv.parameters(wave, periodic=True).Sq), 12)  # the amplitude over the root of two
    7.07107e-07
    """
    h = checked(h, "parameters", least=1)
    require_heights(h, "parameters")
    known = h.values[np.isfinite(h.values)]
    z = known - known.mean()
    gradient = squared_slopes(h, periodic)
    square = (z**2).mean()
    with np.errstate(invalid="ignore", divide="ignore"):
        values = {
            "Sa": np.abs(z).mean(),
            "Sq": np.sqrt(square),
            "Ssk": (z**3).mean() / square**1.5,
            "Sku": (z**4).mean() / square**2,
            "Sz": z.max() - z.min(),
            "Sdq": np.sqrt(gradient.mean()),
            "Sdr": (gradient / (1 + np.sqrt(1 + gradient))).mean(),
            "missing_fraction": (h.size - known.size) / h.size,
        }
    declared = {name: {"units": units, "long_name": prose} for name, (units, prose) in PARAMETERS.items()}
    return xr.Dataset({name: ((), float(value), declared[name]) for name, value in values.items()})
