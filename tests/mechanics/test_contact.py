"""The instantaneous contact problem: optimality, oracles, an independent program, degenerate cases."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from references.contact_problems import rows
from scipy import optimize
from strategies import boundaries, examples, shapes
from support import direct, rough_gap

import roughvisc as rv
from roughvisc.mechanics import closed_forms
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import solve_contact, solver
from roughvisc.mechanics.contact import solver as descent
from roughvisc.mechanics.contact import solver as iteration


def check_optimal(operator, gap, state, precision, present=None):
    """Complementarity: no tension, no penetration, pressure only where the gap is closed."""
    present = np.ones(gap.shape, bool) if present is None else present
    opening = gap + operator.displacement(state.pressure) - state.approach
    scale = np.abs(gap[present]).max()
    assert state.converged
    assert (state.pressure >= 0).all()
    assert (state.pressure[~present] == 0).all()
    assert opening[present].min() > -precision * scale
    assert np.abs(opening[state.pressure > 0]).max() < precision * scale


def dense_solution(gap, spacing, load):
    """Active-set solution of the same quadratic programme with a dense matrix, independent of the solver."""
    cells = np.eye(gap.size).reshape(gap.size, *gap.shape)
    matrix = np.array([direct(cell, spacing).ravel() for cell in cells])
    active = np.ones(gap.size, bool)
    while True:  # remove tension; cells that would penetrate are checked by the caller
        m = int(active.sum())
        system = np.zeros((m + 1, m + 1))
        system[:m, :m] = matrix[np.ix_(active, active)]
        system[:m, m], system[m, :m] = -1, 1
        solution = np.linalg.solve(system, np.append(-gap.ravel()[active], load))
        if (solution[:m] >= 0).all():
            break
        active[np.flatnonzero(active)[solution[:m] < 0]] = False
    pressure = np.zeros(gap.size)
    pressure[active] = solution[:m]
    return pressure.reshape(gap.shape), solution[m]


def test_given_load__agrees_with_dense_linear_algebra():
    shape, spacing = (11, 9), (1.0, 0.8)
    x, y = np.indices(shape)
    gap = ((x - 4.7) ** 2 + (0.8 * (y - 4.2)) ** 2) / 30
    expected, approach = dense_solution(gap, spacing, 12.0)
    state = solve_contact(Operator(shape, spacing), gap, load=12.0, tolerance=1e-14)
    assert state.pressure == pytest.approx(expected, abs=1e-6 * expected.max())
    assert state.approach == pytest.approx(approach, rel=1e-10)


@pytest.mark.parametrize("boundary", ["free", "periodic"])
@pytest.mark.parametrize("mean", [1e-3, 0.05, 0.4])
def test_given_load__is_optimal_on_rough_surfaces(boundary, mean):
    operator = Operator((63, 48), (1.0, 1.0), boundary)
    gap = rough_gap(operator.shape)
    state = solve_contact(operator, gap, load=mean * gap.size, tolerance=1e-12)
    check_optimal(operator, gap, state, 1e-5)
    assert np.sum(state.pressure) == pytest.approx(mean * gap.size, rel=1e-12)


@pytest.mark.parametrize("boundary", ["free", "periodic"])
@pytest.mark.parametrize("mean", [1e-3, 0.1, 0.6])
def test_given_approach__returns_to_the_load(boundary, mean):
    operator = Operator((45, 54), (1.0, 1.0), boundary)
    gap = rough_gap(operator.shape, seed=2)
    under_load = solve_contact(operator, gap, load=mean * gap.size, tolerance=1e-12)
    state = solve_contact(operator, gap, approach=under_load.approach, tolerance=1e-12)
    check_optimal(operator, gap, state, 1e-5)
    assert state.load == pytest.approx(under_load.load, rel=1e-6)


def test_bound__bounds_the_error_in_the_energy_norm():
    operator = Operator((47, 50), (1.0, 1.0))
    gap = rough_gap(operator.shape, seed=5)
    exact = solve_contact(operator, gap, load=100.0, tolerance=1e-14)
    for control in ({"load": 100.0}, {"approach": exact.approach}):
        for tolerance in (1e-2, 1e-4, 1e-6):
            state = solve_contact(operator, gap, **control, tolerance=tolerance)
            error = state.pressure - exact.pressure
            energy = np.sum(error * operator.displacement(error))
            total = np.sum(state.pressure * operator.displacement(state.pressure))
            assert np.sqrt(energy / total) <= state.bound * (1 + 1e-6)


def test_warm_start__saves_iterations():
    operator = Operator((63, 64), (1.0, 1.0), "periodic")
    gap = rough_gap(operator.shape)
    cold = solve_contact(operator, gap, load=300.0)
    warm = solve_contact(operator, gap, load=303.0, start=cold.pressure)
    assert warm.iterations < 0.7 * cold.iterations


@pytest.mark.parametrize("known", [{"load": 30.0}, {"approach": 3.0}], ids=["load", "approach"])
@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_known_displacement_of_the_start__saves_one_convolution(boundary, known):
    operator, gap = Operator((31, 28), (1.0, 1.0), boundary), rough_gap((31, 28))
    start = solve_contact(operator, gap, load=20.0, tolerance=1e-6).pressure
    plain = solve_contact(operator, gap, start=start, tolerance=1e-8, **known)
    told = solve_contact(
        operator, gap, start=start, start_displacement=operator.displacement(start), tolerance=1e-8, **known
    )
    assert told.convolutions == plain.convolutions - 1
    assert told.iterations == plain.iterations > 0
    # a cell that a step brings to the border of the contact may be in or out by rounding: equal to the tolerance only
    assert np.abs(told.pressure - plain.pressure).sum() < 10 * 1e-8 * plain.pressure.sum()


def test_known_displacement_of_a_solution__is_computed_anew():
    """What an extrapolation adds to its rounding must not pile up from step to step."""
    operator, gap = Operator((31, 28), (1.0, 1.0)), rough_gap((31, 28))
    solved = solve_contact(operator, gap, load=20.0, tolerance=1e-6)
    off = solved.displacement * (1 + 1e-9)
    again = solve_contact(operator, gap, load=20.0, tolerance=1e-4, start=solved.pressure, start_displacement=off)
    assert (again.iterations, again.convolutions) == (0, 1)
    assert again.displacement == pytest.approx(solved.displacement, rel=1e-13)


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_cold_start__is_guessed_on_a_coarser_grid(boundary, monkeypatch):
    shape = (257, 301)
    operator = Operator(shape, (1.0, 1.0), boundary)
    gap = rough_gap(shape)
    sparse, dense = 0.02 * gap.size, 0.5 * gap.size
    guessed = [solve_contact(operator, gap, load=load, tolerance=1e-3) for load in (sparse, dense)]
    monkeypatch.setattr(solver, "_COARSE_FROM", 10**6)
    cold = [solve_contact(operator, gap, load=load, tolerance=1e-3) for load in (sparse, dense)]
    assert np.mean(cold[0].pressure > 0) < 0.1 < 0.5 < np.mean(cold[1].pressure > 0)
    for found, alone in zip(guessed, cold, strict=True):
        assert found.iterations < 0.8 * alone.iterations
        bound = np.hypot(found.bound, alone.bound)
        difference = found.pressure - alone.pressure
        energy = [np.sum(p * operator.displacement(p)) for p in (difference, alone.pressure)]
        assert energy[0] < bound**2 * energy[1]


@given(exponent=st.integers(-290, 12), boundary=boundaries)
@examples(30)
def test_loads__of_any_size_are_balanced(exponent, boundary):
    gap = rough_gap((15, 17))
    load = 10.0**exponent
    state = solve_contact(Operator(gap.shape, (1.0, 1.0), boundary), gap, load=load)
    assert np.isfinite(state.pressure).all()
    assert np.sum(state.pressure) == pytest.approx(load, rel=1e-12)
    assert state.converged


@given(scale=st.floats(1e-12, 1e6))
@examples(20)
def test_lengths__are_neutral(scale):
    gap = rough_gap((21, 16))
    unit = solve_contact(Operator(gap.shape, (1.0, 0.5)), gap, load=5.0, tolerance=1e-12)
    scaled = solve_contact(Operator(gap.shape, (scale, 0.5 * scale)), gap * scale, load=5.0, tolerance=1e-12)
    assert scaled.approach == pytest.approx(scale * unit.approach, rel=1e-9)
    assert scaled.pressure == pytest.approx(unit.pressure, abs=1e-9 * unit.pressure.max())


@pytest.mark.parametrize("boundary", ["free", "periodic"])
@pytest.mark.parametrize("shape", [(1, 1), (1, 23), (2, 2), (16, 15)])
def test_flat_surface__is_in_full_contact(shape, boundary):
    state = solve_contact(Operator(shape, (1.0, 2.0), boundary), np.zeros(shape), load=3.0)
    assert state.converged
    assert (state.pressure > 0).all()
    if boundary == "periodic":
        assert state.pressure == pytest.approx(3.0 / np.prod(shape))


def test_absent_cells__carry_nothing():
    shape = (41, 40)
    x, y = np.indices(shape)
    present = np.hypot(x - 20, y - 19.5) < 12
    operator = Operator(shape, (0.5, 0.5))
    gap = np.where(present, 0.0, 7.0)
    by_load = solve_contact(operator, gap, load=20.0, present=present, tolerance=1e-12)
    check_optimal(operator, np.zeros(shape) + 1e-300, by_load, np.inf, present)
    opening = operator.displacement(by_load.pressure) - by_load.approach
    assert np.abs(opening[present]).max() < 1e-5 * by_load.approach
    by_approach = solve_contact(operator, gap, approach=by_load.approach, present=present, tolerance=1e-12)
    assert by_approach.load == pytest.approx(20.0, rel=1e-6)


def test_spacer_steps__converge_alone(monkeypatch):
    """With a useless preconditioner the projected-gradient safeguard still reaches the solution."""
    operator = Operator((15, 12), (1.0, 1.0))
    gap = rough_gap(operator.shape, seed=3)
    expected = solve_contact(operator, gap, load=40.0, tolerance=1e-10)
    monkeypatch.setattr(Operator, "approximate_inverse_within", lambda self, r: np.roll(-r.values, 3))
    state = solve_contact(operator, gap, load=40.0, tolerance=1e-6, max_iterations=20_000)
    assert state.converged
    assert state.approach == pytest.approx(expected.approach, rel=1e-5)


def test_not_converged__says_so():
    operator = Operator((33, 30), (1.0, 1.0))
    state = solve_contact(operator, rough_gap(operator.shape), load=10.0, tolerance=1e-12, max_iterations=3)
    assert not state.converged
    assert state.bound > 1e-6


def test_simplex_projection__keeps_the_sum_and_is_nearest():
    values = np.random.default_rng(0).standard_normal((4, 5))
    found = descent.onto_simplex(values, 1.5)
    expected = optimize.minimize(
        lambda p: np.sum((p - values.ravel()) ** 2),
        np.full(20, 1.5 / 20),
        bounds=[(0, None)] * 20,
        constraints={"type": "eq", "fun": lambda p: np.sum(p) - 1.5},
        tol=1e-12,
    )
    assert np.sum(found) == pytest.approx(1.5)
    assert found.ravel() == pytest.approx(expected.x, abs=1e-5)


def hertz_errors(n, ny):
    """Relative errors of approach and L1 pressure on a grid with the sphere at an arbitrary place in a cell."""
    radius, modulus, force, size = 2.0, 3.0, 0.05, 1.0
    spacing = (size / n, size / ny)
    x = (np.arange(n) + 0.5) * spacing[0] - 0.5037 * size
    y = (np.arange(ny) + 0.5) * spacing[1] - 0.4951 * size
    squared = x[:, None] ** 2 + y[None, :] ** 2
    exact = closed_forms.hertz(radius, modulus, force)
    area = spacing[0] * spacing[1]
    operator = Operator((n, ny), spacing)
    state = solve_contact(operator, squared / (2 * radius), load=force / modulus / area, tolerance=1e-13)
    l1 = np.sum(np.abs(modulus * state.pressure - exact.pressure(np.sqrt(squared)))) * area / force
    return abs(state.approach / exact.approach - 1), l1


def test_hertz__converges_at_order_two_in_approach_and_three_halves_in_pressure():
    grids = [(31, 34), (61, 68), (123, 134), (245, 270)]
    errors = np.array([hertz_errors(*grid) for grid in grids])
    orders = -np.polyfit(np.log([g[0] for g in grids]), np.log(errors), 1)[0]
    assert 1.8 < orders[0] < 2.4, f"approach: {orders[0]:.2f}, errors {errors[:, 0]}"
    assert 1.35 < orders[1] < 1.8, f"L1 pressure: {orders[1]:.2f}, errors {errors[:, 1]}"
    assert errors[-1, 0] < 1e-4
    assert errors[-1, 1] < 2e-3


@given(
    approach=st.floats(1e-9, 0.5),
    shape=shapes(1, 9),
    boundary=boundaries,
    tolerance=st.sampled_from([1e-3, 1e-14]),
)
@examples(200)
def test_given_approach__is_finite_down_to_rounding(approach, shape, boundary, tolerance):
    """A step that has already arrived has neither slope nor curvature left."""
    gap = rough_gap((9, 9), seed=1)[: shape[0], : shape[1]]
    gap = gap - gap.min()
    if boundary == "periodic" and approach >= gap.mean():
        return
    with np.errstate(all="raise", under="ignore"):
        operator = Operator(shape, (1.0, 1.3), boundary)
        state = solve_contact(operator, gap, approach=approach, tolerance=tolerance)
        state = solve_contact(operator, gap, approach=approach, tolerance=tolerance / 1e6, start=state.pressure)
    assert np.isfinite(state.pressure).all()
    assert state.load > 0


@pytest.mark.thorough
@pytest.mark.filterwarnings("error")
def test_given_approach__near_full_contact_is_finite_where_the_kernel_is_singular():
    """A uniform step displaces nothing with periodic boundaries: its curvature is that of rounding, or none."""
    rng = np.random.default_rng(0)
    for _ in range(150):
        shape = tuple(int(n) for n in rng.integers(1, 12, 2))
        gap = rng.random(shape) * 10 ** rng.uniform(-3, 3)
        gap -= gap.min()
        if not gap.any():
            continue
        operator = Operator(shape, (1.0, rng.choice([0.3, 1.0, 4.0])), "periodic")
        approach = float(gap.mean() * (1 - 10 ** rng.uniform(-13, -2)))
        start = rng.random(shape) * 10 if rng.random() < 0.5 else None
        state = solve_contact(operator, gap, approach=approach, tolerance=1e-14, start=start, max_iterations=300)
        assert np.isfinite(state.pressure).all()
        assert np.isfinite([state.load, state.bound]).all()


def full_load(operator, gap):
    """Least load that closes all of a periodic surface: that of its full-contact pressure, exact by Fourier series."""
    nx, ny = gap.shape
    qx = 2 * np.pi * np.fft.fftfreq(nx, operator.spacing[0])[:, None]
    qy = 2 * np.pi * np.fft.fftfreq(ny, operator.spacing[1])[None, :]
    wanted = np.fft.ifft2(np.fft.fft2(gap.mean() - gap) * np.hypot(qx, qy) / 2).real
    return -wanted.min() * gap.size


def nearly_full(kind):
    """Half-space and gap, with odd and unequal sides."""
    shape, spacing = (33, 40), (1.0, 0.7)
    x, y = (np.arange(n) / n for n in shape)
    wave = 2 - np.cos(2 * np.pi * x)[:, None] - np.cos(2 * np.pi * y)
    return Operator(shape, spacing, "periodic"), wave if kind == "wave" else rough_gap(shape, seed=4)


@pytest.mark.parametrize("kind", ["wave", "rough"])
@pytest.mark.parametrize("short", [0.3, 0.05, 1e-2, 1e-4, 1e-6])
def test_given_approach__near_full_contact_is_certain_of_the_load(kind, short):
    """The energy does not see a uniform pressure: twice the load once passed for converged."""
    operator, gap = nearly_full(kind)
    full = full_load(operator, gap)
    exact = solve_contact(operator, gap, load=(1 - short) * full, tolerance=1e-14, max_iterations=5000)
    touching = exact.pressure > 0
    approach = np.mean((gap + operator.displacement(exact.pressure))[touching])
    starts = [None, exact.pressure + 2 * full / gap.size, 0.5 * exact.pressure]
    for tolerance in (3e-4, 3e-5, 3e-6):
        for start in starts:
            state = solve_contact(operator, gap, approach=approach, tolerance=tolerance, start=start)
            assert state.converged
            assert abs(state.load / exact.load - 1) < 10 * tolerance
            assert state.iterations < 500


@pytest.mark.parametrize("absent", [1, 40])
def test_given_approach__is_certain_of_the_load_where_absent_cells_alone_are_open(absent):
    operator, gap = nearly_full("wave")
    present = np.ones(gap.shape, bool)
    present.reshape(-1)[7 : 7 + absent] = False
    for mean in (0.6, 1.5):
        load = mean * full_load(operator, gap)
        exact = solve_contact(operator, gap, load=load, present=present, tolerance=1e-14)
        approach = np.mean((gap + operator.displacement(exact.pressure))[exact.pressure > 0])
        for tolerance in (3e-4, 3e-6):
            for start in (None, 3 * exact.pressure):
                state = solve_contact(
                    operator, gap, approach=approach, present=present, tolerance=tolerance, start=start
                )
                assert state.converged
                assert abs(state.load / load - 1) < 10 * tolerance


@pytest.mark.parametrize("deeper", [0.0, 1e-12, 1e-3])
def test_given_approach__of_full_contact_does_not_determine_the_load(deeper):
    """Every load above that of full contact has this approach: said at once, and not searched for."""
    operator, gap = nearly_full("rough")
    pressed = solve_contact(operator, gap, load=2 * full_load(operator, gap), tolerance=1e-12)
    approach = gap.mean() * (1 + deeper)
    for start in (None, pressed.pressure):
        state = solve_contact(operator, gap, approach=approach, tolerance=1e-6, start=start)
        assert not state.converged
        assert state.iterations < 300
    assert state.load == pytest.approx(pressed.load)


@pytest.mark.parametrize("kind", ["wave", "rough"])
def test_given_load__near_full_contact_knows_the_mean_gap(kind):
    """The approach is taken from loosely solved pressures; what counts is how much is left to full contact."""
    operator, gap = nearly_full(kind)
    for short in (1e-2, 1e-3, 1e-4):
        load = (1 - short) * full_load(operator, gap)
        tight = solve_contact(operator, gap, load=load, tolerance=1e-14, max_iterations=5000)
        total = gap + operator.displacement(tight.pressure)
        expected = gap.mean() - np.mean(total[tight.pressure > 0])
        loose = solve_contact(operator, gap, load=load, tolerance=3e-5)
        assert gap.mean() - loose.approach == pytest.approx(expected, rel=0.05)
    pressed = solve_contact(operator, gap, load=2 * full_load(operator, gap), tolerance=1e-4)
    assert pressed.approach == pytest.approx(gap.mean(), rel=1e-14)


@pytest.mark.parametrize("short", [0.1, 1e-2, 1e-4])
def test_held_approach__after_a_load_near_full_contact_relaxes(short):
    """Held from a jump on, every pressure relaxes as the material does: exact for any surface."""
    surface = rv.wavy(0.02, 1.0, 1.0, (24, 24))
    gap = surface.values.max() - surface.values
    operator = Operator(gap.shape, (1 / 24, 1 / 24), "periodic")
    force = (1 - short) * full_load(operator, gap) * 4 / gap.size  # contact modulus 4 Pa on 1 m2
    program = rv.Program().load(force, over=0).hold(2.0, control="approach")
    material = rv.zener(1.0, 1.0, 1.0)
    result = rv.simulate(surface, material, program, boundary="periodic", tolerance=1e-2, times=[0.5, 2.0])
    assert (result.status == 0).all()
    time = result.time.values
    assert result.force.values == pytest.approx(force * (0.5 + 0.5 * np.exp(-2 * time)), rel=1e-2)


def test_error__is_honestly_estimated():
    """Against solutions at a tolerance of 1e-14: spheres, cones, punches, waves, rough surfaces, quarters of them."""
    found = rows((34,), (1e-3, 3e-5))
    known = [row for row in found if row["error"] > 1e-9]
    ratios = np.array([row["estimate"] / row["error"] for row in known])
    assert ratios.size > 350
    assert np.mean(ratios >= 0.8) > 0.98
    assert ratios.min() > 0.7, known[np.argmin(ratios)]["case"]
    assert np.median(ratios) < 3.3
    assert np.mean(ratios < 10) > 0.95


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_error__has_no_unit(boundary):
    errors = []
    for size in (1.0, 1e-9, 1e6):
        operator, gap = Operator((31, 28), (size, 0.7 * size), boundary), size * rough_gap((31, 28))
        by_load = solve_contact(operator, gap, load=20.0, tolerance=1e-3, estimate_error=True)
        approach = solve_contact(operator, gap, load=20.0, tolerance=1e-12).approach
        by_approach = solve_contact(operator, gap, approach=approach, tolerance=1e-3, estimate_error=True)
        errors.append([by_load.error, by_approach.error])
    assert errors[1] == pytest.approx(errors[0], rel=1e-4)
    assert errors[2] == pytest.approx(errors[0], rel=1e-4)


def test_error__is_unbounded_where_the_approach_does_not_determine_the_load():
    operator, gap = nearly_full("rough")
    pressed = solve_contact(operator, gap, load=2 * full_load(operator, gap), tolerance=1e-12)
    state = solve_contact(
        operator, gap, approach=gap.mean(), start=pressed.pressure, tolerance=1e-6, estimate_error=True
    )
    assert state.error == np.inf


@pytest.fixture
def convolved(monkeypatch):
    """Kinds of the numbers that displacements were computed in, in order."""
    kinds = []

    def noted(kind, sound):
        return lambda self, *given: kinds.append(kind) or sound(self, *given)

    monkeypatch.setattr(Operator, "displacement", noted("double", Operator.displacement))
    monkeypatch.setattr(Operator, "displacement_single", noted("single", Operator.displacement_single))
    return kinds


@pytest.mark.parametrize("known", [{"load": 3000.0}, {"approach": 5.0}], ids=["load", "approach"])
@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_single_precision__is_for_steps_far_from_the_solution(boundary, known, convolved, monkeypatch):
    """What is returned is a solution in double precision, however tight the tolerance."""
    operator, gap = Operator((101, 96), (1.0, 1.0), boundary), rough_gap((101, 96))
    quick = solve_contact(operator, gap, **known, tolerance=1e-4)
    assert convolved.count("single") >= 4
    assert convolved[-1] == "double"
    found = solve_contact(operator, gap, **known, tolerance=1e-14)
    assert found.converged
    monkeypatch.setattr(iteration, "_SINGLE_FROM", np.inf)
    convolved.clear()
    exact = solve_contact(operator, gap, **known, tolerance=1e-14)
    assert set(convolved) == {"double"}
    slow = solve_contact(operator, gap, **known, tolerance=1e-4)
    assert abs(quick.iterations - slow.iterations) <= 1
    assert np.abs(found.pressure - exact.pressure).sum() < 1e-11 * exact.pressure.sum()
    expected = operator.displacement(found.pressure)
    assert np.abs(found.displacement - expected).max() < 1e-13 * expected.max()
    convolved.clear()
    solve_contact(operator, gap, **known, tolerance=1e-4, start=exact.pressure)
    assert set(convolved) == {"double"}, "near the solution it does not pay"


def test_single_precision__meets_loads_and_lengths_of_any_size():
    for scale, load in ((1e-9, 1e-20), (1e30, 1e-200), (1.0, 1e200)):
        operator = Operator((97, 98), (scale, scale))
        gap = 1e-3 * scale * rough_gap(operator.shape)
        state = solve_contact(operator, gap, load=load, tolerance=1e-6)
        assert state.converged
        assert np.sum(state.pressure) == pytest.approx(load, rel=1e-12)


def test_unconverged_state__has_its_own_displacement():
    operator, gap = Operator((101, 96), (1.0, 1.0)), rough_gap((101, 96))
    state = solve_contact(operator, gap, load=3000.0, tolerance=1e-12, max_iterations=3)
    assert not state.converged
    expected = operator.displacement(state.pressure)
    assert np.abs(state.displacement - expected).max() < 1e-13 * expected.max()


def test_first_guess__of_a_quarter_knows_its_mirror_images():
    x, y = (np.arange(512) - 255.5) / 512, (np.arange(544) - 271.5) / 512
    gap = x[:, None] ** 2 + y**2
    surface = solver.coarse_guess(Operator(gap.shape, (1.0, 1.0)), gap, 1.0)
    quarter = solver.coarse_guess(Operator((256, 272), (1.0, 1.0), mirrored=True), gap[256:, 272:], 0.25)
    assert np.sum(quarter) == pytest.approx(0.25 * np.sum(surface), rel=0.05)
    assert np.abs(quarter - surface[256:, 272:]).sum() < 0.1 * quarter.sum()
