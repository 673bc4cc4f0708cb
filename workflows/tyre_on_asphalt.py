"""A tyre compound on asphalt: friction against speed at five temperatures, with the heat of sliding.

Fits a master curve to dynamic moduli at 12 temperatures, and draws friction with and without heat, the temperature of
the rubber, and the contribution of each decade of waves.

    python workflows/tyre_on_asphalt.py [FIGURE]
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

import roughvisc as rv

HERE = Path(__file__).parent
REFERENCE, C1, C2 = 293.15, 8.86, 101.6  # K, WLF
PRESSURE, SLOPE = 3e5, 1.3  # Pa, rms slope at which the spectrum ends
TEMPERATURES = (0, 20, 40, 60, 80)  # degrees Celsius
SPEEDS = np.geomspace(1e-6, 10, 30)  # m/s


def shift_factor(temperature):
    """Return the shift factor of the compound at a temperature. [K]"""
    return rv.wlf(temperature, REFERENCE, C1, C2)


def compound():
    """Return the compound at the reference temperature, from dynamic moduli at several temperatures."""
    table = np.loadtxt(HERE / "tread_compound.csv", delimiter=",", skiprows=1)
    temperature, frequency, storage, loss = table.T
    factors = [shift_factor(one + 273.15) for one in temperature]
    moduli = 1e6 * storage, 1e6 * loss
    return rv.dynamic_table(frequency, *moduli, frequency_unit="Hz", shift_factors=factors, kind="tensile")


def road():
    """Return the spectrum of the road."""
    wavevectors, densities = np.loadtxt(HERE / "asphalt.csv", delimiter=",", skiprows=1).T
    return rv.psd_table(wavevectors, densities, convention="persson")


TREAD = rv.Heating(
    shift_factor,
    temperature=REFERENCE,
    density=1.2e3,
    heat_capacity=1.5e3,
    heat_conductivity=0.3,
    spot_radius="1 mm",
)


def curves(speeds=SPEEDS):
    """Return friction over speed with and without heat, by temperature in degrees Celsius."""
    rubber, spectrum = compound(), road()
    settings = {"speeds": speeds, "pressure": PRESSURE, "slope": SLOPE}
    warm, cold = {}, {}
    for celsius in TEMPERATURES:
        kelvin = celsius + 273.15
        warm[celsius] = rv.friction_theory(spectrum, rubber, heating=replace(TREAD, temperature=kelvin), **settings)
        cold[celsius] = rv.friction_theory(spectrum, rv.shift(rubber, shift_factor(kelvin)), **settings)
    return warm, cold


def main(figure="tyre_on_asphalt.png", speeds=SPEEDS):
    warm, cold = curves(speeds)
    fig = Figure(figsize=(11, 3.6), layout="constrained")
    friction, temperature, waves = fig.subplots(1, 3)
    for place, (celsius, marker) in enumerate(zip(TEMPERATURES, "os^Dv", strict=True)):
        every = (place, 6)  # first and next point with a marker
        colour = colormaps["plasma"](0.9 * place / len(TEMPERATURES))
        ds = warm[celsius]
        friction.semilogx(speeds, ds.friction_coefficient, marker + "-", color=colour, ms=4, markevery=every)
        friction.semilogx(speeds, cold[celsius].friction_coefficient, "--", lw=0.9, color=colour)
        warmed = ds.temperature - 273.15
        temperature.semilogx(speeds, warmed, marker + "-", color=colour, ms=4, markevery=every, label=f"{celsius} °C")
    friction.set(xlabel="speed [m/s]", ylabel="friction coefficient", ylim=(0, None))
    friction.set_title("dashed: without heat", fontsize="medium")
    temperature.set(xlabel="speed [m/s]", ylabel="temperature of the contact [°C]")
    temperature.legend(frameon=False, fontsize="small", loc="upper left")
    ds = warm[20]
    parts = ds.friction_of_waves.transpose("wavelength", "speed").values
    ends = zip(ds.shortest_wavelength.values, ds.longest_wavelength.values, strict=True)
    names = [range_text(low, high) for low, high in ends]
    shades = colormaps["cividis"](np.linspace(0, 1, len(names)))
    waves.stackplot(speeds, parts, labels=names, colors=shades)
    waves.set(xscale="log", xlabel="speed [m/s]", ylabel="contribution to friction", xlim=(speeds[0], speeds[-1]))
    waves.set_title("decades of waves, 20 °C", fontsize="medium")
    waves.legend(frameon=False, fontsize="x-small", loc="upper left")
    fig.savefig(figure, dpi=200)
    print("| temperature [°C] | friction, 1 mm/s | 1 m/s | 10 m/s | without heat, 10 m/s | contact at 10 m/s [°C] |")
    print("|---|---|---|---|---|---|")
    for celsius in TEMPERATURES:
        ds = warm[celsius]
        near = [float(ds.friction_coefficient.interp(speed=one)) for one in (1e-3, 1.0, 10.0)]
        hot = float(ds.temperature[-1]) - 273.15
        bare = float(cold[celsius].friction_coefficient[-1])
        print(f"| {celsius} | {near[0]:.2f} | {near[1]:.2f} | {near[2]:.2f} | {bare:.2f} | {hot:.0f} |")
    return fig


def range_text(low, high):
    """Return two lengths [m] with two digits, as text."""
    factor, unit = (1e3, "mm") if high > 1e-3 else (1e6, "µm")
    return "{:g} to {:g} {}".format(*(float(f"{factor * length:.2g}") for length in (low, high)), unit)


if __name__ == "__main__":
    main(*sys.argv[1:])
