"""How thick must a soft coating be? A measured surface slides on rubber that is bonded to a stiffer rubber.

Draws the effective compliance of a coating against wavelength and frequency, and friction and contact area of the scan
against speed for coatings from 2 um to a half-space.

    python workflows/coating.py [CELLS] [FIGURE]
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import roughvisc as rv

SCAN = Path(__file__).parent.parent / "surfaces" / "focus_variation.toml"
SOFT = rv.from_relaxation(1e6, [4e6, 3e6, 2e6], [1e-5, 1e-4, 1e-3])  # Pa, s
BASE = rv.from_relaxation(20e6, [100e6, 100e6], [1e-4, 1e-2], poisson=0.45)
THICKNESSES = (2e-6, 5e-6, 10e-6, 20e-6, np.inf)  # m
SPEEDS = np.geomspace(1e-3, 10, 13)  # m/s
PRESSURE = 1e5  # Pa
#: Colour, and marker and dash of a thickness.
LOOKS = (("#D55E00", "o-"), ("#E69F00", "s--"), ("#009E73", "^-."), ("#0072B2", "D:"), ("k", "v-"))


def main(cells=80, figure="coating.png", speeds=SPEEDS):
    height = rv.resample(rv.open_scan(SCAN), (cells, 8 * cells // 5))
    curves = {
        one: rv.friction(height, body(one), pressure=PRESSURE, speeds=speeds, boundary="mirror") for one in THICKNESSES
    }
    fig = Figure(figsize=(11, 3.4), layout="constrained")
    compliance, friction, area = fig.subplots(1, 3)
    draw_compliance(fig, compliance)
    for (thickness, ds), (colour, look) in zip(curves.items(), LOOKS, strict=True):
        label = f"{1e6 * thickness:g} µm" if np.isfinite(thickness) else "half-space"
        for axes, name, unit in ((friction, "friction_coefficient", 1), (area, "contact_fraction", 100)):
            axes.semilogx(ds["speed"], unit * ds[name], look, color=colour, ms=4, lw=1.2, mfc="w", label=label)
    friction.set(xlabel="speed [m/s]", ylabel="friction coefficient", ylim=(0, None))
    area.set(xlabel="speed [m/s]", ylabel="contact fraction [%]", ylim=(0, None))
    area.legend(frameon=False, title="thickness")
    fig.savefig(figure, dpi=200)
    thick = curves[np.inf]
    for thickness, ds in curves.items():
        off = [(ds[name] / thick[name] - 1).values[[0, -1]] for name in ("friction_coefficient", "contact_fraction")]
        print("| {:g} | {:+.1%} | {:+.1%} | {:+.1%} | {:+.1%} |".format(1e6 * thickness, *off[0], *off[1]))
    return fig


def body(thickness):
    return rv.layer(SOFT, thickness, on=BASE)


def draw_compliance(fig, axes):
    """Draw the effective compliance of a coating of 10 um, relative to the coating alone."""
    wavelength, frequency = np.geomspace(1e-6, 1e-3, 121), np.geomspace(1, 1e7, 101)
    q, omega = 2 * np.pi / wavelength[None, :], frequency[:, None]
    found = [np.abs(one.waves(q, 0 * q, omega)[1]) for one in (body(10e-6), body(np.inf))]
    filled = axes.contourf(1e6 * wavelength, frequency, found[0] / found[1], np.linspace(0, 1, 11), cmap="cividis")
    axes.set(xscale="log", yscale="log", xlabel="wavelength [µm]", ylabel="angular frequency [1/s]")
    axes.axvline(10, color="k", lw=1, ls="--")
    axes.set_title("coating of 10 µm", fontsize="medium")
    fig.colorbar(filled, ax=axes, label="compliance over the coating alone")


if __name__ == "__main__":
    main(*(int(a) if a.isdigit() else a for a in sys.argv[1:]))
