"""Figure of a table with several temperatures: its master curve and its shift factors."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.material import Creep, Prony, ThermalLaw
from roughvisc.mechanics.materials.superposition import Superposition
from roughvisc.plot import style

#: Measured quantity -> label and marker.
_QUANTITIES = {
    "storage": ("Storage modulus", "o"),
    "loss": ("Loss modulus", "^"),
    "relaxation": ("Relaxation modulus", "o"),
    "creep": ("Creep compliance", "o"),
}
#: Number of points of the line of the material, and colours of the temperatures, cold to warm, without pale ones.
_POINTS = 200
_COLOURS = ListedColormap(mpl.colormaps["plasma"](np.linspace(0.0, 0.85, 256)))


@style.apply
def master_curve(material: Prony | Creep) -> Figure:
    """Draw the master curve of a table with several temperatures, and its shift factors.

    The left panel has the measured rows at the reference temperature, in the kind of the test, and the fitted material
    as lines (not for relaxation). The right panel has ``log10 a_T`` with bars of two standard deviations and half the
    difference between storage and loss.

    Parameters
    ----------
    material : Prony or Creep
        Material of a table with several temperatures, such as ``rv.read_study("study.toml").material``.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the material is not from a table with several temperatures.

    See Also
    --------
    roughvisc.dynamic_table, roughvisc.read_material

    Examples
    --------
    >>> import numpy as np
    >>> import roughvisc as rv
    >>> w = np.tile(np.logspace(-1, 1, 5), 2)
    >>> shifted = w * np.repeat([1.0, 0.1], 5)  # a Maxwell fluid, ten times as fast at the second temperature
    >>> storage, loss = 1e6 * shifted**2 / (1 + shifted**2), 1e6 * shifted / (1 + shifted**2)
    >>> fluid = rv.dynamic_table(
    ...     w, storage, loss, frequency_unit="rad/s", kind="shear", temperatures=[293.15] * 5 + [313.15] * 5,
    ...     temperature="20 degC", vertical="none",
    ... )
    >>> len(rv.plot.master_curve(fluid).axes) >= 2
    True
    """
    law = getattr(material, "thermal", None)
    superposed = getattr(law.shift, "__self__", None) if isinstance(law, ThermalLaw) else None
    if not isinstance(law, ThermalLaw) or not isinstance(superposed, Superposition):
        raise InputError(key="material", found=material, expected="a material of a table with several temperatures")
    figure, (curve, shifts) = style.new_panels(2, 2, (3.2, 2.6), left=0.75, right=style.BAR)
    celsius = superposed.temperatures - 273.15
    at, rows = superposed.reduced()
    is_creep = "creep" in rows
    values = np.concatenate([row[row > 0] for row in rows.values()])
    unit = style.middle_unit(values, "1/Pa" if is_creep else "Pa")
    colours = Normalize(celsius.min(), celsius.max() if celsius.size > 1 else celsius.min() + 1)
    span = np.geomspace(at.min(), at.max(), _POINTS)
    for name, row in rows.items():
        label, marker = _QUANTITIES[name]
        look = {"c": celsius[superposed.group], "cmap": _COLOURS, "norm": colours, "s": 10, "lw": 0}
        points = curve.scatter(at, np.where(row > 0, unit(row), np.nan), marker=marker, label=label, zorder=2, **look)
    fitted = _lines(law.material, span, superposed.factor) if "relaxation" not in rows else {}
    for name, line in fitted.items():
        if name in rows:
            curve.plot(span, unit(line), color="0.2", lw=0.9, zorder=1, label="Fitted material" * (name != "loss"))
    style.log_axis(curve.xaxis, at)
    style.log_axis(curve.yaxis, unit(values))
    over = "frequency [rad/s]" if "storage" in rows else "time [s]"
    curve.set_xlabel(f"Reduced {over} at {superposed.reference_temperature - 273.15:.4g} °C")
    curve.set_ylabel(unit.label("Compliance" if is_creep else "Modulus"))
    bars = np.hypot(2 * np.nan_to_num(superposed.sigma), np.nan_to_num(superposed.split))
    shifts.errorbar(celsius, superposed.log_shift, bars, fmt="-", color="0.45", lw=0.8, zorder=1)
    shifts.scatter(celsius, superposed.log_shift, c=celsius, cmap=_COLOURS, norm=colours, s=18, zorder=2)
    shifts.set(xlabel="Temperature [°C]", ylabel=r"$\log_{10}\, a_T$")
    style.colour_bar(points, [shifts], "Temperature [°C]")
    style.legend_above(figure, style.named_in(curve))
    return figure


def _lines(material: Prony | Creep, at: np.ndarray, factor: float) -> dict[str, np.ndarray]:
    """Return storage and loss modulus [Pa] and creep compliance [1/Pa] of a material, in the kind of the test."""
    modulus = factor / material.laplace(1j * at)
    creep = material.creep_compliance(np.minimum(at, getattr(material, "longest", np.inf))) / factor
    return {"storage": modulus.real, "loss": modulus.imag, "creep": creep}
