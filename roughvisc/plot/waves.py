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
    friction : Draw friction and contact fraction over speed.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rough = rv.self_affine("1 mm", 32, hurst=0.8, rms_slope=0.2, seed=1)
    >>> settings = {"pressure": "0.1 MPa", "speeds": ["1 mm/s", "0.1 m/s"]}
    >>> ds = rv.friction_theory(rough, rv.zener(3e6, 1e6, 1e3), **settings)
    >>> len(rv.plot.waves(ds).axes)
    1
    """
    if "friction_of_waves" not in dataset:
        raise InputError(key="dataset", found=list(dataset), expected="a result of rv.friction_theory")
    panels = 1 + ("temperature_of_waves" in dataset)
    figure, axes = style.new_panels(panels, panels, (3.2, 2.6), left=0.75)
    chosen = np.unique(np.linspace(0, dataset.sizes["speed"] - 1, _SPEEDS).round().astype(int))
    colours = colormaps[_COLOURS](np.linspace(0, 0.9, chosen.size))
    for row, colour, look in zip(chosen, colours, style.distinct(chosen.size), strict=True):
        result = dataset.isel(speed=row)
        label = format_quantity(float(f"{float(result['speed']):.3g}"), "m/s")
        lengths = result["wavelength"]
        axes[0].plot(lengths, result["friction_of_waves"], color=colour, label=label, **look)
        if panels == 2:
            axes[1].plot(lengths, result["temperature_of_waves"] - 273.15, color=colour, **look)
    axes[0].set_ylabel("friction of a decade of waves")
    axes[0].set_ylim(bottom=0)
    axes[0].legend(title="speed")
    for panel in axes:
        panel.set(xscale="log", xlabel="wavelength [m]")
        panel.invert_xaxis()
    if panels == 2:
        axes[1].set_ylabel("temperature [°C]")
    return figure
