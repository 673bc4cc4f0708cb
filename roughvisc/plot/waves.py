"""Figure of the theory of rubber friction: contribution and temperature of each decade of waves."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.plot import style
from roughvisc.units import format_quantity

#: Largest number of speeds, and their colours from slow to fast.
_SPEEDS = 5
_COLOURS = "viridis"


@style.apply
def waves(dataset: xr.Dataset) -> Figure:
    """Draw the friction and the temperature of each decade of waves, for up to five speeds.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.friction_theory`.

    Returns
    -------
    matplotlib.figure.Figure
        The left panel shows the contribution of each decade of waves to the friction coefficient, over the wavelength.
        With the heat of sliding the right panel shows the temperature of the rubber at the depth of each decade.

    Raises
    ------
    InputError
        If the result has no contributions of waves.

    See Also
    --------
    roughvisc.friction_theory, roughvisc.Heating

    Examples
    --------
    >>> import roughvisc as rv
    >>> road = rv.psd_table([1e3, 1e4, 1e6], [1e-17, 1e-17, 1e-24], convention="persson")
    >>> rubber = rv.zener(shear_modulus=1e8, kelvin_modulus=1e6, kelvin_viscosity=10.0)
    >>> ds = rv.friction_theory(road, rubber, speeds=[1e-3, 0.1, 10.0], pressure="0.3 MPa")
    >>> len(rv.plot.waves(ds).axes)
    1
    """
    if "friction_of_waves" not in dataset:
        raise InputError(key="dataset", found=list(dataset), expected="a result of rv.friction_theory")
    panels = 1 + ("temperature_of_waves" in dataset)
    figure, axes = style.new_panels(panels, panels, (3.2, 2.6), left=0.75)
    chosen = np.unique(np.linspace(0, dataset.sizes["speed"] - 1, _SPEEDS).round().astype(int))
    colours = colormaps[_COLOURS](np.linspace(0, 0.9, chosen.size))
    for row, colour in zip(chosen, colours, strict=True):
        result = dataset.isel(speed=row)
        label = format_quantity(float(f"{float(result['speed']):.3g}"), "m/s")
        lengths = result["wavelength"]
        axes[0].plot(lengths, result["friction_of_waves"], "o-", color=colour, label=label)
        if panels == 2:
            axes[1].plot(lengths, result["temperature_of_waves"] - 273.15, "o-", color=colour)
    axes[0].set_ylabel("friction of a decade of waves")
    axes[0].set_ylim(bottom=0)
    axes[0].legend(title="speed")
    for panel in axes:
        panel.set(xscale="log", xlabel="wavelength [m]")
        panel.invert_xaxis()
    if panels == 2:
        axes[1].set_ylabel("temperature [°C]")
    return figure
