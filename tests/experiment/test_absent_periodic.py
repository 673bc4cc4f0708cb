"""Absent cells under periodic boundaries: what the approach is, against a dense solve that shares no code."""

import numpy as np
import pytest
from samples import UNIT
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

import roughvisc as rv

SHAPE, SIDE = (10, 9), 0.1


def rough():
    height = rv.self_affine((1.0, 0.9), SHAPE, hurst=0.8, rms_slope=0.1, seed=2)
    height.values[np.random.default_rng(0).random(SHAPE) < 0.2] = np.nan
    return height


def dense_kernel():
    """Displacement of each cell under unit pressure on each other one: waves of transform 2 / |q|, none at q = 0."""
    i, j = (axis.ravel() for axis in np.meshgrid(*map(np.arange, SHAPE), indexing="ij"))
    kernel = np.zeros((i.size, i.size))
    for k in range(SHAPE[0]):
        for m in range(SHAPE[1]):
            # the alias nearest to zero
            wave = [2 * np.pi * min(a, n - a) / n / SIDE for a, n in ((k, SHAPE[0]), (m, SHAPE[1]))]
            if k or m:
                phase = 2 * np.pi * (k * np.subtract.outer(i, i) / SHAPE[0] + m * np.subtract.outer(j, j) / SHAPE[1])
                kernel += 2 / np.hypot(*wave) * np.cos(phase) / i.size
    return kernel


def dense_solution(height, approach):
    """Pressure with ``g + K p - approach >= 0`` where it is zero, as a problem of non-negative least squares."""
    present = np.isfinite(height.values).ravel()
    gap = (np.nanmax(height.values) - height.values).ravel()[present]
    kernel = dense_kernel()[np.ix_(present, present)]
    upper = cholesky(kernel)
    found, _ = nnls(upper, solve_triangular(upper, approach - gap, trans="T"), maxiter=10_000)
    pressure = np.zeros(present.size)
    pressure[present] = found
    displacement = dense_kernel() @ pressure
    return pressure.reshape(SHAPE), displacement.reshape(SHAPE)


# in part, all but in full, and twice as far as the mean undeformed gap, where the half-space bulges between the cells
@pytest.mark.parametrize("part", [0.6, 0.95, 2.0])
def test_approach__is_that_to_the_mean_plane_of_the_half_space(part):
    height = rough()
    undeformed = float(np.nanmax(height)) - height
    approach = part * float(undeformed.mean())
    pressure, displacement = dense_solution(height, approach)
    force = pressure.sum() * SIDE**2
    assert abs(displacement.mean()) < 1e-12
    settings = {"boundary": "periodic", "missing": "absent", "tolerance": 1e-6, "progress": False}
    for program in (rv.Program().approach(approach, over=0), rv.Program().load(force, over=0)):
        ds = rv.simulate(height, UNIT, program, **settings)
        assert float(ds.force[0]) == pytest.approx(force, rel=1e-4)
        assert float(ds.approach[0]) == pytest.approx(approach, rel=1e-4)
        assert ds.pressure[0].values == pytest.approx(pressure, abs=1e-3 * pressure.max())
        bulge = float(np.mean(displacement[np.isfinite(height.values)]))
        stated = float(undeformed.mean()) - float(ds.mean_gap[0]) + bulge
        assert float(ds.approach[0]) == pytest.approx(stated, rel=1e-4)
        assert bulge > 2e-3 * approach, "without it the approach would be another"
