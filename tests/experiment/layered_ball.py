"""Elastic balls on layers, from the surface to the result, against the Fredholm equation.

``python tests/experiment/layered_ball.py 129`` prints the table of docs/verification.md.
"""

import math
import sys

from references.half_space import Paraboloid
from references.layered import ElasticLayer, OnSheet

import roughvisc as rv

THICKNESS, MODULUS = 1e-5, 1e6
RATIOS = (0.01, 0.1, 0.5, 2.0, 10.0, 100.0)
WIDTHS = (0.1, 0.3, 1.0, 3.0, 10.0)
POISSONS = ((0.5, 0.3), (0.3, 0.5))


def errors(ratio, wide, poissons, cells):
    """Of the approach and of the contact radius, relative. In a contact of so many thicknesses."""
    a, (poisson, base_poisson) = wide * THICKNESS, poissons
    exact = OnSheet(Paraboloid(20 * a), ElasticLayer(THICKNESS, poisson, base_poisson, ratio))
    force = float(exact.scaled_force(a)) * 2 * MODULUS / (1 - poisson)
    body = rv.layer(rv.elastic(MODULUS, poisson), THICKNESS, on=rv.elastic(MODULUS / ratio, base_poisson))
    program, ball = rv.Program().load(force, over=0), rv.sphere(20 * a, 2.6 * a, cells)
    ds = rv.simulate(ball, body, program, progress=False, fields=())
    radius = math.sqrt(float(ds.contact_area[0]) / math.pi)
    return abs(float(ds.approach[0]) / float(exact.reduced(a)) - 1), abs(radius / a - 1)


def main():
    print("| cells | shear modulus, layer over base | " + " | ".join(f"a/h = {wide:g}" for wide in WIDTHS) + " |")
    print("|---|---" + "|---" * len(WIDTHS) + "|")
    for cells in map(int, sys.argv[1:]):
        for ratio in RATIOS:
            row = []
            for wide in WIDTHS:
                approach, radius = map(max, zip(*(errors(ratio, wide, one, cells) for one in POISSONS), strict=True))
                row.append(f"{approach:.1e}, {radius:.1e}")
            print(f"| {cells} | {ratio:g} | " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
