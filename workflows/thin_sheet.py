"""A ball on a thin sheet that is bonded to a rigid base: force against depth.

Forces over that on a half-space at the same depth (Hertz), of an incompressible sheet: computed, by the integral
equation, and by the formula of AFM programs (E. K. Dimitriadis et al., Biophys. J. 82 (2002) 2798).

    python workflows/thin_sheet.py [CELLS] [FIGURE]
"""

import sys

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

import roughvisc as rv
from roughvisc import closed_forms

RADIUS, THICKNESS, MODULUS = 10e-3, 0.1e-3, 1e6  # m, m, Pa
DEPTHS = np.array([0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0])  # x = sqrt(R delta) / h
FORMULA = np.polynomial.Polynomial([1, 1.133, 1.283, 0.769, 0.0975])
BALL = closed_forms.Paraboloid(RADIUS)
ON_SHEET = closed_forms.OnSheet(BALL, closed_forms.Sheet(THICKNESS))


def main(cells=128, figure="thin_sheet.png"):
    x = np.unique([*DEPTHS, *np.geomspace(0.08, 2.4, 60)])
    (_, exact), (contact, at) = by_integral_equation(x), by_integral_equation(DEPTHS)
    found = np.array([computed(*one, cells) for one in zip(DEPTHS, contact, strict=True)])
    fig = Figure(figsize=(8.4, 3.4), layout="constrained")
    ratio, deviation = fig.subplots(1, 2)
    for axes, shown in ((ratio, lambda force, _: force), (deviation, lambda force, of: 100 * (force / of - 1))):
        axes.semilogx(x, shown(exact, exact), "k", lw=1.2, label="integral equation")
        axes.semilogx(x, shown(FORMULA(x), exact), "--", color="#D55E00", label="Dimitriadis et al. (2002)")
        axes.semilogx(x, shown(1, exact) * np.ones_like(x), ":", color="0.4", label="half-space (Hertz)")
        axes.semilogx(DEPTHS, shown(found, at), "o", color="#0072B2", mfc="none", ms=5, label="computed")
        axes.set(xlabel=r"depth, $\sqrt{R\delta}\,/\,h$", xlim=(x[0], x[-1]))
    ratio.set(yscale="log", ylabel="force over that on a half-space, $F / F_\\mathrm{H}$")
    deviation.set(ylim=(-20, 5), ylabel="deviation from the integral equation [%]")
    for axis in (ratio.xaxis, ratio.yaxis, deviation.xaxis):
        axis.set(major_locator=LogLocator(subs=(1, 2, 5)), major_formatter="{x:g}", minor_locator=NullLocator())
    ratio.legend(frameon=False)
    fig.savefig(figure, dpi=200)
    for row in np.transpose([DEPTHS, contact / THICKNESS, at, found / at - 1, FORMULA(DEPTHS) / at - 1, 1 / at - 1]):
        print("| {:g} | {:.2f} | {:.3f} | {:+.2%} | {:+.1%} | {:+.1%} |".format(*row))
    return fig


def by_integral_equation(x):
    radius = ON_SHEET.radius_at_approach(BALL.reduced(x * THICKNESS))
    return radius, ON_SHEET.scaled_force(radius) / BALL.scaled_force(x * THICKNESS)


def computed(x, radius, cells):
    ball, press = rv.sphere(RADIUS, 2.6 * radius, cells), rv.Program().approach(BALL.reduced(x * THICKNESS), over=0)
    ds = rv.simulate(ball, rv.sheet(rv.elastic(MODULUS), THICKNESS), press, tolerance=1e-4, progress=False)
    return float(ds.force[-1]) / (4 * MODULUS * BALL.scaled_force(x * THICKNESS))  # contact modulus 4 G


if __name__ == "__main__":
    main(*(int(a) if a.isdigit() else a for a in sys.argv[1:]))
