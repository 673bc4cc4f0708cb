"""A ball on a thin sheet that is bonded to a rigid base: force against depth.

Forces on an incompressible sheet over the force on a half-space at the same depth (Hertz): computed, and by the formula
of AFM programs (E. K. Dimitriadis et al., Biophys. J. 82 (2002) 2798).

    python workflows/thin_sheet.py [CELLS] [FIGURE]
"""

import sys

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

import roughvisc as rv

RADIUS, THICKNESS, MODULUS = 10e-3, 0.1e-3, 1e6  # m, m, Pa
DEPTHS = np.array([0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0])  # x = sqrt(R delta) / h
FORMULA = np.polynomial.Polynomial([1, 1.133, 1.283, 0.769, 0.0975])


def main(cells=128, figure="thin_sheet.png"):
    computed = np.array([force_on_sheet(depth, cells) for depth in DEPTHS])
    curve = np.geomspace(0.08, 2.4, 60)
    fig = Figure(figsize=(8.4, 3.4), layout="constrained")
    ratio, deviation = fig.subplots(1, 2)
    ratio.semilogx(curve, FORMULA(curve), "--", color="#D55E00", label="Dimitriadis et al. (2002)")
    ratio.semilogx(curve, np.ones_like(curve), ":", color="0.4", label="half-space (Hertz)")
    ratio.semilogx(DEPTHS, computed, "o", color="#0072B2", mfc="none", ms=5, label="computed")
    deviation.semilogx(DEPTHS, 100 * (FORMULA(DEPTHS) / computed - 1), "o--", color="#D55E00")
    for axes in (ratio, deviation):
        axes.set(xlabel=r"depth, $\sqrt{R\delta}\,/\,h$", xlim=(curve[0], curve[-1]))
    ratio.set(yscale="log", ylabel=r"force over that on a half-space, $F / F_\mathrm{H}$")
    deviation.set(ylim=(-20, 5), ylabel="deviation of the formula [%]")
    for axis in (ratio.xaxis, ratio.yaxis, deviation.xaxis):
        axis.set(major_locator=LogLocator(subs=(1, 2, 5)), major_formatter="{x:g}", minor_locator=NullLocator())
    ratio.legend(frameon=False)
    fig.savefig(figure, dpi=200)
    print("| depth $x$ | force $F/F_\\mathrm{H}$, computed | Dimitriadis | half-space |\n|---|---|---|---|")
    for row in np.transpose([DEPTHS, computed, FORMULA(DEPTHS) / computed - 1, 1 / computed - 1]):
        print("| {:g} | {:.3f} | {:+.1%} | {:+.1%} |".format(*row))
    return fig


def force_on_sheet(x, cells):
    """Return the force relative to a half-space at a depth x = sqrt(R delta) / h."""
    approach = (x * THICKNESS) ** 2 / RADIUS
    widest = 2.6 * np.sqrt(2) * x * THICKNESS  # of a thin sheet the contact radius is sqrt(2 R delta)
    ball, press = rv.sphere(RADIUS, widest, cells), rv.Program().approach(approach, over=0)
    ds = rv.simulate(ball, rv.sheet(rv.elastic(MODULUS), THICKNESS), press, tolerance=1e-4, progress=False)
    hertz = 4 * MODULUS * 4 * (x * THICKNESS) ** 3 / (3 * RADIUS)  # contact modulus 4 G
    return float(ds.force[-1]) / hertz


if __name__ == "__main__":
    main(*(int(a) if a.isdigit() else a for a in sys.argv[1:]))
