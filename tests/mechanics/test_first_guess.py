"""First guess of a step: the combination of known pressures with the least energy."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import rough_gap

import roughvisc as rv
from roughvisc.mechanics.first_guess import Candidate, best_weights, combination
from roughvisc.mechanics.grid import Grid


def candidates(grid, *pressures):
    return [Candidate(pressure, grid.displacement(pressure), math.nan) for pressure in pressures]


def energy_of(grid, pressure, compliance, gap, load=None, approach=0.0):
    displaced = compliance * grid.displacement(pressure)
    return float((pressure * (displaced / 2 + gap - approach)).sum())


@pytest.mark.parametrize("shape", [(16, 9), (15, 21)])
def test_full_contact_of_a_wave__is_solved_exactly(shape):
    """The pressure of a wave in full contact is uniform plus a wave, in proportion to the modulus (Westergaard)."""
    grid = Grid(shape, (1.0, 1.3), "periodic")
    wave = np.cos(2 * np.pi * np.arange(shape[0]) / shape[0])[:, None] * np.ones(shape[1])
    of_wave = float((grid.displacement(wave) / wave)[0, 0])
    compliance, depth, mean = 0.7, 0.2, 3.0
    exact = mean + depth / (compliance * of_wave) * wave
    fields = candidates(grid, np.ones(shape) + 0.1 * wave, np.full(shape, 2.0) - 0.3 * wave)
    weights = best_weights(fields, compliance, -depth * wave, load=mean * wave.size)
    np.testing.assert_allclose(combination(fields, weights), exact, rtol=1e-10)
    displaced = combination(fields, weights, of_displacement=True)
    np.testing.assert_allclose(displaced, grid.displacement(exact), rtol=0, atol=1e-10 * abs(displaced).max())


@given(
    seed=st.integers(0, 999),
    count=st.integers(1, 3),
    boundary=st.sampled_from(["free", "periodic"]),
    is_load=st.booleans(),
    scale=st.floats(-9, 9),
)
def test_energy__is_the_least_of_all_combinations(seed, count, boundary, is_load, scale):
    rng = np.random.default_rng(seed)
    grid = Grid((9, 12), (1.0, 0.8), boundary)
    fields = candidates(grid, *rng.random((count, *grid.shape)))
    compliance = 10.0**scale
    gap = compliance * rough_gap(grid.shape, seed)
    control = {"load": 2.0} if is_load else {"approach": 0.3 * float(gap.max())}

    def energy(weights):
        return energy_of(grid, combination(fields, weights), compliance, gap, **control)

    best = best_weights(fields, compliance, gap, **control)
    if is_load:
        assert combination(fields, best).sum() == pytest.approx(2.0, rel=1e-9)
    for _ in range(5):
        others = np.array(best) + 10.0 ** rng.uniform(-3, 0) * rng.normal(size=count) * (np.abs(best).max() + 1e-3)
        if is_load:  # the same load
            others *= 2.0 / combination(fields, others).sum()
        assert energy(best) <= energy(others) + 1e-9 * abs(energy(others))


def test_nearly_equal_pressures__never_make_the_guess_worse():
    """The energy of their difference is lost in rounding."""
    grid = Grid((9, 12), (1.0, 0.8))
    for seed in range(100):
        rng = np.random.default_rng(seed)
        pressure, change = rng.random((2, *grid.shape))
        fields = candidates(grid, pressure, pressure + 10.0 ** -rng.uniform(5, 12) * change)
        gap = 0.01 * rough_gap(grid.shape, seed)
        for control in ({"load": 2.0}, {"approach": 0.5}):
            alone, both = (
                energy_of(grid, combination(some, best_weights(some, 1.0, gap, **control)), 1.0, gap, **control)
                for some in (fields[:1], fields)
            )
            assert both <= alone + 1e-9 * abs(alone)


@pytest.mark.parametrize("boundary", ["periodic", "mirror"])
@pytest.mark.parametrize("shape", [(7, 9), (12, 10), (15, 11), (21, 16)])
def test_flat_surface__is_pressed(shape, boundary):
    """A uniform pressure displaces such a body by rounding only."""
    flat = rv.from_array(np.zeros(shape), 1e-4)
    press = rv.Program().pressure(1e4, over=0.1).hold(2)
    ds = rv.simulate(flat, rv.zener(1e6, 1e6, 1.0), press, times=[0.1, 1.0, 2.1], boundary=boundary, progress=False)
    np.testing.assert_allclose(ds.force, 1e4 * np.prod(shape) * 1e-8, rtol=1e-9)
    assert (ds.stated_error < 1e-2).all()
