"""The paper's second case: a sphere on a Zener half-space under a step load.

The Kelvin modulus equals the spring's modulus, or a quarter. The paper's equation (20) holds for the first only, the
closed form used here for any.

    python workflows/zener_step.py [CELLS] [FIGURE]
"""

import sys

import numpy as np
from matplotlib.figure import Figure
from maxwell_step import compare

import roughvisc as rv

MODULUS, RETARDATION_TIME = 1e6, 1.0  # Pa, s


def main(cells=128, figure="zener_step.png"):
    fig = Figure(figsize=(8.4, 3.6), layout="constrained")
    for axes, ratio, name in zip(fig.subplots(1, 2), (1.0, 0.25), ("G_K = G", "G_K = G/4"), strict=True):
        kelvin = ratio * MODULUS
        rubber = rv.zener(MODULUS, kelvin, kelvin * RETARDATION_TIME)
        compare(axes, rubber, RETARDATION_TIME * np.array([0.0, 0.5, 1.0, 4.0]), cells, RETARDATION_TIME)
        axes.set_title(f"Zener half-space, ${name}$")
    fig.savefig(figure, dpi=200)
    return fig


if __name__ == "__main__":
    main(*(int(a) if a.isdigit() else a for a in sys.argv[1:]))
