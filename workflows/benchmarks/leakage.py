"""Leak rates a second, and the direct solver against algebraic multigrid.

    python workflows/benchmarks/leakage.py [CELLS ...]

The gap of a rough surface on an elastic body, out of contact and with a few parts of the area in contact, on 512
squared cells unless other numbers are given. In processor time of one thread: a frame from gap to certified leak rate;
the equations alone by SciPy's direct solver; and by conjugate gradients on a multigrid hierarchy, Ruge-Stueben and
smoothed aggregation, to the same residual, where pyamg is installed (`pip install pyamg`).
"""

import sys
import time
from functools import partial

import numpy as np
from scipy import sparse

import roughvisc as rv
from roughvisc.mechanics.transport import flow as solver
from roughvisc.mechanics.transport.network import faces_of, network_of

try:
    import pyamg
except ImportError:
    pyamg = None

SIDE, SLOPE, SHEAR_MODULUS = 1e-3, 0.1, 1e6
#: Nominal pressure over contact modulus and slope -> about twice the part of the area in contact.
PRESSURES = (0.0, 0.05, 0.12, 0.2)
RESIDUAL, MOST = 1e-12, 300


def gaps(cells):
    """Part of the area in contact, and the gap. [m]"""
    shape = {"hurst": 0.8, "rms_slope": SLOPE, "rolloff": SIDE / 4, "shortcut": 8 * SIDE / cells, "seed": 1}
    height = rv.self_affine(SIDE, cells, **shape)
    yield 0.0, height.values.max() + 1e-7 - height.values
    modulus = 4 * SHEAR_MODULUS
    for pressure in PRESSURES[1:]:
        program = rv.Program().pressure(pressure * modulus * SLOPE, over=0)
        settings = {"boundary": "periodic", "tolerance": 1e-3, "fields": ("gap",), "progress": False}
        ds = rv.simulate(height, rv.elastic(SHEAR_MODULUS), program, **settings)
        yield float(ds.contact_fraction[-1]), ds.gap[-1].values


def seconds(work):
    """Processor time of a piece of work, and what it gives."""
    began = time.process_time()
    found = work()
    return time.process_time() - began, found


def multigrid(hierarchy, matrix, source):
    """Iterations to the residual; as many as were allowed where it was not reached."""
    residuals = []
    hierarchy(matrix).solve(source, tol=RESIDUAL, accel="cg", maxiter=MOST, residuals=residuals)
    return len(residuals) - 1


def solvers(network):
    """Name -> processor time [s] and iterations of the equations alone."""
    scale, _ = solver._factorised(network)
    matrix = sparse.csr_matrix(equations(network, scale))
    source = scale * network.entrance
    took, _ = seconds(lambda: solver._factorised(network)[1].solve(source))
    yield "direct", took, 0
    if pyamg is not None:
        near = (1 / scale)[:, None]
        kinds = {
            "Ruge-Stueben": pyamg.ruge_stuben_solver,
            "smoothed aggregation": partial(pyamg.smoothed_aggregation_solver, B=near),
        }
        for name, hierarchy in kinds.items():
            took, iterations = seconds(partial(multigrid, hierarchy, matrix, source))
            yield name, took, iterations


def equations(network, scale):
    """The matrix that is factorised."""
    between = -network.conductance * scale[network.first] * scale[network.second]
    places = (np.r_[network.first, network.second], np.r_[network.second, network.first])
    size = (len(scale), len(scale))
    return sparse.coo_array((np.r_[between, between], places), shape=size) + sparse.eye_array(len(scale))


def main(*sizes):
    rows = []
    for cells in sizes or (512,):
        for fraction, gap in gaps(cells):
            spacing = (SIDE / cells, SIDE / cells)
            took, found = seconds(partial(solver.flow, gap, spacing, wrap=True))
            row = {"cells": cells, "contact": fraction, "frame": took, "closed": found.is_closed}
            if not found.is_closed:
                row["closes"] = found.upper / found.lower - 1
                network = network_of(faces_of(gap, spacing, True))
                row["decades"] = float(np.ptp(np.log10(network.conductance)))
                row |= {name: (took, iterations) for name, took, iterations in solvers(network)}
            print(row, flush=True)
            rows.append(row)
    return rows


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
