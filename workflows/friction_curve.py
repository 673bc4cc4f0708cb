"""Rubber friction of a rough surface: friction and contact area from creeping to fast sliding.

Thirteen speeds over six decades. The rubber is a generalised Maxwell solid with a modulus that rises eightyfold
over five decades of time; the surface is self-affine and stands for a ground or blasted counterface. The line of
Persson's theory and what the last octave of the roughness adds stand beside the solution.

    python workflows/friction_curve.py [CELLS] [FIGURE] [RESULT]
"""

import sys
import time

import numpy as np

import roughvisc as rv

#: Shear moduli [Pa] and relaxation times [s] of the rubber, and what is left in the end.
RUBBER = rv.from_relaxation(1e6, [4e7, 2e7, 1e7, 4e6, 2e6], [1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
PRESSURE = 2e5  # Pa
COLUMNS = [
    "friction_coefficient",
    "persson_friction_coefficient",
    "last_octave_friction",
    "contact_fraction",
    "loss_tangent",
    "outer_iterations",
    "iterations",
]


def main(cells=512, figure="friction_curve.png", result=None):
    side = 2e-3
    rough = rv.self_affine(side, cells, hurst=0.8, rms_slope=0.15, rolloff=side / 4, shortcut=8 * side / cells, seed=1)
    began = time.perf_counter()
    curve = rv.friction(rough, RUBBER, pressure=PRESSURE, speeds=np.logspace(-4, 2, 13), last_octave=True)
    print(f"{cells} x {cells}, {curve.sizes['speed']} speeds: {time.perf_counter() - began:.1f} s")
    print(curve[COLUMNS].to_dataframe().to_string(float_format="{:.4g}".format))
    if result is not None:
        curve.to_netcdf(result)
    rv.plot.friction(curve, persson=True).savefig(figure, dpi=200)
    return curve


if __name__ == "__main__":
    main(*(int(a) if a.isdigit() else a for a in sys.argv[1:]))
