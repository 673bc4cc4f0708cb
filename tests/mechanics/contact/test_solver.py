"""The contact of one instant: optimality, closed forms, dense linear algebra, random problems, degenerate cases."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from references.contact_problems import solved
from strategies import boundaries, examples, shapes
from support import rough_gap

import roughvisc as rv
from roughvisc.errors import ConvergenceError
from roughvisc.mechanics.contact import solver
from roughvisc.mechanics.contact.passes import cut_step
from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.grid import Grid

BOUNDARIES = pytest.mark.parametrize("boundary", ["free", "periodic"])


def l1(found, exact):
    return np.abs(found - exact).sum() / exact.sum()


def check_optimal(operator, gap, state, precision, present=None):
    """No tension, no penetration, pressure only in closed gaps."""
    present = np.ones(gap.shape, bool) if present is None else present
    opening = gap + operator.displacement(state.pressure) - state.approach
    scale = np.ptp(gap[present]) or state.approach
    assert (state.pressure >= 0).all()
    assert (state.pressure[~present] == 0).all()
    assert opening[present].min() > -precision * scale
    assert np.abs(opening[state.pressure > 0]).max() < precision * scale
    assert state.displacement == pytest.approx(operator.displacement(state.pressure), abs=1e-12 * scale)
    assert state.load == pytest.approx(state.pressure.sum())


# ------------------------------------------------------------------------------------------------- exact solutions


def full_pressure(operator, gap):
    """Pressure variation in full contact of a periodic surface, exact by Fourier series."""
    qx, qy = (2 * np.pi * np.fft.fftfreq(n, d) for n, d in zip(gap.shape, operator.spacing, strict=True))
    return np.fft.ifft2(np.fft.fft2(gap.mean() - gap) * np.hypot(qx[:, None], qy) / 2).real


@pytest.mark.parametrize("roughness", [0.0, 1e-9, 1e-2, 1.0])
@pytest.mark.parametrize("shape", [(1, 1), (1, 23), (2, 2), (33, 40)])
def test_full_contact__is_the_fourier_series(shape, roughness):
    operator, gap = Grid(shape, (1.0, 0.7), "periodic"), roughness * rough_gap((40, 40))[: shape[0], : shape[1]]
    exact = full_pressure(operator, gap)
    exact += 1.0 - 2 * exact.min()
    state = solve_contact(operator, gap, load=exact.sum(), tolerance=1e-9)
    assert l1(state.pressure, exact) < 1e-9
    assert state.approach == pytest.approx(gap.mean(), rel=1e-12, abs=1e-14)


# ------------------------------------------------------------------------------------------------------ optimality


@pytest.mark.parametrize("boundary", ["free", "periodic", "mirror"])
@pytest.mark.parametrize("mean", [1e-3, 0.05, 0.4])
def test_rough_surface__is_in_equilibrium_under_load_and_approach(boundary, mean):
    operator = Grid((63, 48), (1.0, 1.3), boundary)
    gap = rough_gap(operator.shape)
    state = solve_contact(operator, gap, load=mean * gap.size, tolerance=1e-8)
    check_optimal(operator, gap, state, 1e-6)
    assert np.sum(state.pressure) == pytest.approx(mean * gap.size, rel=1e-12)
    back = solve_contact(operator, gap, approach=state.approach, tolerance=1e-8)
    check_optimal(operator, gap, back, 1e-6)
    assert back.load == pytest.approx(state.load, rel=1e-7)


def test_error__is_honestly_estimated():
    """Against tight solutions: spheres, cones, punches, waves, rough surfaces, with mirror images; cold and warm."""
    found = list(solved(34, (1e-3, 3e-5)))
    assert all(error <= tolerance for _, tolerance, error, _ in found)
    known = [(estimate / error, case) for case, _, error, estimate in found if error > 1e-9]
    ratios = np.array([ratio for ratio, _ in known])
    assert ratios.size > 250
    assert np.mean(ratios >= 0.8) > 0.98
    assert ratios.min() > 0.7, min(known)
    assert np.median(ratios) < 4
    assert np.mean(ratios < 10) > 0.95


@given(
    shape=shapes(3, 24),
    boundary=boundaries,
    seed=st.integers(0, 99),
    load=st.floats(-4, 1),
    tolerance=st.floats(-7, -1),
    present=st.sampled_from([0.5, 1.0, 1.0]),
    is_load=st.booleans(),
    guess=st.sampled_from([None, "cell", "cells"]),
    size=st.floats(-6, 6),
    is_known=st.booleans(),
)
@examples(200)
def test_random_problems__are_solved_to_the_tolerance(
    shape, boundary, seed, load, tolerance, present, is_load, guess, size, is_known
):
    """Cold, and from a guess far from the solution; a step may empty all cells that carry."""
    rng = np.random.default_rng(seed)
    gap, present = rng.random(shape), rng.random(shape) <= present
    assume(present.any())
    operator = Grid(shape, (1.0, rng.choice([0.3, 1.0, 4.0])), boundary)
    exact = solve_contact(operator, gap, load=10**load * gap.size, present=present, tolerance=1e-10)
    is_full = boundary == "periodic" and 1 - exact.approach / gap.mean() < 0.02
    assume(is_load or not is_full)
    known = {"load": exact.load} if is_load else {"approach": exact.approach}
    if guess is not None:
        carries = rng.permutation(gap.size).reshape(shape) < (1 if guess == "cell" else 0.3 * gap.size)
        known["start"] = np.where(carries & present, exact.pressure.max() * 10**size, 0.0)
        known["start_displacement"] = operator.displacement(known["start"]) if is_known else None
    state = solve_contact(operator, gap, present=present, tolerance=10**tolerance, **known)
    assert l1(state.pressure, exact.pressure) < max(10**tolerance, 1e-8)


def test_bound__bounds_the_error_in_the_energy_norm():
    operator = Grid((47, 50), (1.0, 1.0))
    gap = rough_gap(operator.shape, seed=5)
    exact = solve_contact(operator, gap, load=100.0, tolerance=1e-10)
    for control in ({"load": 100.0}, {"approach": exact.approach}):
        for tolerance in (1e-1, 1e-3, 1e-5):
            state = solve_contact(operator, gap, **control, tolerance=tolerance)
            off = state.pressure - exact.pressure
            energy, total = (np.sum(p * operator.displacement(p)) for p in (off, state.pressure))
            assert np.sqrt(energy / total) <= state.bound * (1 + 1e-6)


# ---------------------------------------------------------------------------------------------- guesses and safeguards


@pytest.mark.parametrize("known", [{"load": 30.0}, {"approach": 3.0}], ids=["load", "approach"])
@BOUNDARIES
def test_known_displacement__leaves_its_error_behind(boundary, known):
    """Time steps extrapolate the displacement from the last one: an error that is passed on grows from step to step."""
    operator, gap = Grid((31, 28), (1.0, 1.0), boundary), rough_gap((31, 28))
    start = solve_contact(operator, gap, load=20.0).pressure
    plain = solve_contact(operator, gap, start=start, **known)
    for error in (1e-9, 1e-3):
        noise = error * np.random.default_rng(0).standard_normal(gap.shape)
        displacement = (1 + noise) * operator.displacement(start)
        arguments = [array.copy() for array in (gap, start, displacement)]
        found = solve_contact(operator, gap, start=start, start_displacement=displacement, **known)
        assert l1(found.pressure, plain.pressure) < 2e-4
        off = operator.displacement(found.pressure) - found.displacement
        assert np.abs(off).max() < 1e-12 * found.displacement.max()
        assert all(np.array_equal(*pair) for pair in zip(arguments, (gap, start, displacement), strict=True))


@BOUNDARIES
def test_known_displacement_of_a_single_cell__leaves_its_error_behind(boundary):
    """The residual of one cell under a load vanishes, whatever its displacement is."""
    operator, gap = Grid((15, 12), (1.0, 1.0), boundary), np.full((15, 12), 10.0)
    gap[7, 5] = 0.0
    pressure = np.zeros_like(gap)
    pressure[7, 5] = 2.0
    exact = operator.displacement(pressure)
    found = solve_contact(operator, gap, load=2.0, start=pressure, start_displacement=1.001 * exact)
    assert np.array_equal(found.pressure, pressure)
    assert np.abs(found.displacement - exact).max() < 1e-14 * exact.max()
    assert found.approach == pytest.approx(exact[7, 5], rel=1e-14)


@BOUNDARIES
@pytest.mark.parametrize("mean", [0.02, 0.5])
def test_cold_start__is_guessed_on_half_the_cells(boundary, mean, monkeypatch):
    operator, gap = Grid((257, 301), (1.0, 1.0), boundary), rough_gap((257, 301))
    guessed = solve_contact(operator, gap, load=mean * gap.size, tolerance=1e-3)
    monkeypatch.setattr(solver, "COARSE_FROM", 10**6)
    cold = solve_contact(operator, gap, load=mean * gap.size, tolerance=1e-3)
    assert guessed.iterations < (0.8 if mean < 0.1 else 0.95) * cold.iterations
    assert l1(guessed.pressure, cold.pressure) < 2e-3


@BOUNDARIES
def test_blocks__save_iterations_in_many_spots_and_change_no_result(boundary, monkeypatch):
    surface = rv.self_affine((500.0, 490.0), (500, 490), hurst=0.8, rms_slope=1.0, rolloff=125.0, seed=3)
    operator, gap = Grid((500, 490), (1.0, 1.0), boundary), surface.values.max() - surface.values
    alone = solve_contact(operator, gap, load=0.05 * gap.size, tolerance=1e-4)
    monkeypatch.setattr(solver, "BLOCKS_FROM", 400)
    both = solve_contact(operator, gap, load=0.05 * gap.size, tolerance=1e-4)
    assert 0.05 < np.mean(alone.pressure > 0) < 0.15
    assert both.iterations < 0.85 * alone.iterations
    assert l1(both.pressure, alone.pressure) < 2e-4


def test_projected_gradient__converges_alone(monkeypatch):
    """With a useless preconditioner the safeguard still reaches the solution."""
    operator, gap = Grid((15, 12), (1.0, 1.0)), rough_gap((15, 12), seed=3)
    expected = solve_contact(operator, gap, load=40.0, tolerance=1e-8)
    monkeypatch.setattr(Grid, "inverse", lambda self, field: np.roll(-field, 3))
    state = solve_contact(operator, gap, load=40.0, tolerance=1e-5, max_iterations=20_000)
    assert state.approach == pytest.approx(expected.approach, rel=1e-5)


def test_steps_beyond_their_trial__keep_the_load():
    """Otherwise the rounding error of the load grows with each of them, and the contact of a stiff film fails."""
    random, held = np.random.default_rng(0), np.full(50, 0.02)
    for _ in range(30):
        direction = random.normal(size=held.size)
        _, change, _ = cut_step(held, direction, direction, 1e-6, load=float(held.sum()))
        held += 20 * change
    assert held.sum() == pytest.approx(1, rel=1e-13)


@given(approach=st.floats(1e-9, 0.5), shape=shapes(1, 9), boundary=boundaries, tolerance=st.sampled_from([1e-3, 1e-9]))
@examples(200)
def test_given_approach__is_solved_down_to_rounding(approach, shape, boundary, tolerance):
    """A step that has already arrived has neither slope nor curvature left."""
    gap = rough_gap((9, 9), seed=1)[: shape[0], : shape[1]]
    gap = gap - gap.min()
    assume(boundary == "free" or approach < 0.99 * gap.mean())
    with np.errstate(all="raise", under="ignore"):
        operator = Grid(shape, (1.0, 1.3), boundary)
        state = solve_contact(operator, gap, approach=approach, tolerance=tolerance)
        state = solve_contact(operator, gap, approach=approach, tolerance=1e-9, start=state.pressure)
    check_optimal(operator, gap, state, 1e-6)
    assert state.load > 0


# ------------------------------------------------------------------------------------------------ near full contact


def nearly_full(kind):
    """Half-space and gap with odd and unequal sides, and the load of full contact."""
    shape, spacing = (33, 40), (1.0, 0.7)
    x, y = (np.arange(n) / n for n in shape)
    wave = 2 - np.cos(2 * np.pi * x)[:, None] - np.cos(2 * np.pi * y)
    operator, gap = Grid(shape, spacing, "periodic"), wave if kind == "wave" else rough_gap(shape, seed=4)
    if kind != "mirrored":
        return operator, gap, -full_pressure(operator, gap).min() * gap.size
    unfolded = np.pad(gap, [(0, n) for n in shape], mode="symmetric")
    return Grid(shape, spacing, "mirror"), gap, -full_pressure(operator, unfolded).min() * gap.size


@pytest.mark.parametrize("kind", ["wave", "mirrored"])
@pytest.mark.parametrize("short", [0.3, 0.05, 1e-2, 1e-4])
def test_given_approach__near_full_contact_has_the_load(kind, short):
    """The energy does not depend on a uniform pressure: the load is checked by itself, or the solver raises."""
    operator, gap, full = nearly_full(kind)
    exact = solve_contact(operator, gap, load=(1 - short) * full, tolerance=1e-10, max_iterations=5000)
    solved = 0
    for tolerance in (3e-4, 3e-5):
        for start in (None, exact.pressure + 2 * full / gap.size, 0.5 * exact.pressure):
            try:
                state = solve_contact(operator, gap, approach=exact.approach, tolerance=tolerance, start=start)
            except ConvergenceError:
                continue
            solved += 1
            assert abs(state.load / exact.load - 1) < 10 * tolerance
    assert solved == 6 or short < 1e-2


@pytest.mark.parametrize(("kind", "deeper"), [("rough", 0.0), ("mirrored", 1e-3)])
def test_given_approach__of_full_contact_does_not_determine_the_load(kind, deeper):
    operator, gap, _ = nearly_full(kind)
    with pytest.raises(ConvergenceError, match="full contact"):
        solve_contact(operator, gap, approach=gap.mean() * (1 + deeper))


@pytest.mark.parametrize("absent", [1, 40])
def test_given_approach__has_the_load_if_absent_cells_alone_are_open(absent):
    operator, gap, full = nearly_full("wave")
    present = np.ones(gap.shape, bool)
    present.reshape(-1)[7 : 7 + absent] = False
    for load in (0.6 * full, 1.5 * full):
        exact = solve_contact(operator, gap, load=load, present=present, tolerance=1e-10)
        for start in (None, 3 * exact.pressure):
            state = solve_contact(operator, gap, approach=exact.approach, present=present, start=start)
            assert abs(state.load / load - 1) < 1e-3


@pytest.mark.parametrize("kind", ["wave", "mirrored"])
def test_given_load__near_full_contact_has_the_mean_gap(kind):
    """The approach is that of a loosely solved pressure; what counts is how much is left to full contact."""
    operator, gap, full = nearly_full(kind)
    for short in (1e-2, 1e-3, 1e-4):
        tight = solve_contact(operator, gap, load=(1 - short) * full, tolerance=1e-10, max_iterations=5000)
        loose = solve_contact(operator, gap, load=(1 - short) * full, tolerance=1e-4)
        assert gap.mean() - loose.approach == pytest.approx(gap.mean() - tight.approach, rel=0.05)
    pressed = solve_contact(operator, gap, load=2 * full, tolerance=1e-4)
    assert pressed.approach == pytest.approx(gap.mean(), rel=1e-14)
