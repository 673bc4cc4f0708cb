"""What half the resolution makes of an elastic contact, by ways to have it: python coarser.py [CELLS].

Periodic rough surfaces, by the length of their shortest waves in cells; what is found on cells twice as long against
what is found on the cells themselves. The difference of the pressure is that of means over four cells, summed, over the
load.
"""

import sys

import numpy as np

import roughvisc as rv
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import solve_contact

PRESSURES = (0.003, 0.02)  # over the contact modulus


def filtered(h, shape):
    """Means after a Gaussian filter of two of the new cells."""
    return means(rv.gaussian_filter(h, 4 / h.shape[0], periodic=True), shape)


def means(h, shape):
    """Means over the new cells."""
    return rv.resample(h, shape, periodic=False)


WAYS = {"waves": rv.resample, "means": means, "gaussian_filter, means": filtered}


def contact(h, pressure):
    """Contact fraction, mean gap, pressure."""
    n = h.shape[0]
    gap = float(h.max()) - h.values
    state = solve_contact(Operator((n, n), (1 / n, 1 / n), "periodic"), gap, load=pressure * n * n, tolerance=1e-8)
    left = np.maximum(gap + state.displacement - state.approach, 0)
    return np.mean(state.pressure > 0), np.mean(left), state.pressure


def compared(cells):
    """Rows: shortest waves, contact fraction, way, and the errors that it makes."""
    for shortest in (2, 4, 8, 16):
        h = rv.self_affine(
            1.0, (cells, cells), hurst=0.8, rms_slope=0.1, rolloff=0.25, shortcut=shortest / cells, seed=1
        )
        for pressure in PRESSURES:
            area, gap, carried = contact(h, pressure)
            means = carried.reshape(cells // 2, 2, cells // 2, 2).mean((1, 3))
            for way, coarser in WAYS.items():
                few = contact(coarser(h, (cells // 2, cells // 2)), pressure)
                apart = np.abs(few[2] - means).sum() / means.sum()
                yield shortest, area, way, few[0] / area - 1, few[1] / gap - 1, apart


if __name__ == "__main__":
    for row in compared(int(sys.argv[1]) if len(sys.argv) > 1 else 512):
        print("{:2d} cells, {:5.1%} in contact, {:26s} area {:+6.1%} gap {:+7.2%} pressure {:5.1%}".format(*row))
