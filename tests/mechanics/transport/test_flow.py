"""Flow through a gap: networks solved by hand, means of the gap cubed, duality, errors that cover."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support import rough_gap

from roughvisc.mechanics import transport as solvers
from roughvisc.mechanics.transport import flow

CELL = (2e-6, 3e-6)
ON_TWO_GRIDS = solvers._ON_TWO_GRIDS


@pytest.fixture(autouse=True, scope="module", params=["factors", "two grids"])
def solver(request):
    """Each of the two solvers, for maps of any size, to rounding."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solvers, "_LARGE", 0 if request.param == "two grids" else np.inf)
        patch.setattr(solvers, "_ON_TWO_GRIDS", (1e-30,) * 4)
        yield request.param


def random_gap(shape, seed=0, open_part=0.7, decades=4.0):
    """Gaps that span decades, and cells without one. [m]"""
    source = np.random.default_rng(seed)
    gap = 1e-6 * 10 ** (-decades / 3 * source.random(shape))
    return np.where(source.random(shape) < open_part, gap, 0.0)


def series(gaps):
    """Conductance of a channel one cell wide, half cells at its ends. [m3]"""
    return CELL[1] / np.sum(CELL[0] / (np.asarray(gaps) ** 3 / 12))


def kirchhoff(gap, cell, wrap):
    """Conductance by a dense matrix written cell by cell; the closed cells carry a leak that no one can see."""
    nx, ny = gap.shape
    mobility = gap**3 / 12
    matrix, source = np.zeros((nx * ny, nx * ny)), np.zeros(nx * ny)

    def join(i, j, conductance):
        for a, b in ((i, j), (j, i)):
            matrix[a, a] += conductance
            matrix[a, b] -= conductance

    def mean(a, b):
        return 2 * a * b / (a + b) if a > 0 and b > 0 else 0.0

    for i in range(nx):
        for j in range(ny):
            here = i * ny + j
            if i + 1 < nx:
                join(here, here + ny, mean(mobility[i, j], mobility[i + 1, j]) * cell[1] / cell[0])
            if j + 1 < ny or (wrap and ny > 1):
                join(here, i * ny + (j + 1) % ny, mean(mobility[i, j], mobility[i, (j + 1) % ny]) * cell[0] / cell[1])
    side = 2 * mobility * cell[1] / cell[0]
    for j in range(ny):
        matrix[j, j] += side[0, j]
        source[j] += side[0, j]
        matrix[(nx - 1) * ny + j, (nx - 1) * ny + j] += side[-1, j]
    pressure = np.linalg.lstsq(matrix, source, rcond=None)[0]
    return float(side[-1] @ pressure[-ny:])


@pytest.mark.parametrize("wrap", [False, True])
@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (6, 1), (5, 2), (7, 6), (9, 11)])
def test_network__equals_one_written_cell_by_cell(shape, wrap):
    for seed in range(3):
        gap = random_gap(shape, seed, open_part=0.85, decades=2.0)
        expected = kirchhoff(gap, CELL, wrap)
        found = flow(gap, CELL, wrap=wrap)
        assert_allclose(found.conductance, expected, rtol=1e-9, atol=1e-30)


def test_channels_side_by_side__add_until_all_are_closed():
    gap = np.zeros((80, 60))
    gap[:, 5] = 1e-7 * (1 + np.arange(80) / 80)
    gap[:, 20:50] = 1e-6
    wide = 30 * CELL[1] / (80 * CELL[0]) * (1e-6) ** 3 / 12
    assert_allclose(flow(gap, CELL).conductance, series(gap[:, 5]) + wide, rtol=1e-10, atol=0)
    gap[40, 20:50] = 0.0
    assert_allclose(flow(gap, CELL).conductance, series(gap[:, 5]), rtol=1e-10, atol=0)
    gap[40] = 0.0
    assert flow(gap, CELL).conductance == 0


def test_faces_across_the_flow__that_are_much_narrower_than_the_sides():
    gap = 1e-6 * (1 + np.arange(50) / 50)[None]
    cell = (1e-9, 1e-3)
    assert_allclose(flow(gap, cell).conductance, np.sum(gap**3 / 12) * cell[1] / cell[0], rtol=1e-12, atol=0)


def test_pools_and_dead_ends__carry_nothing():
    channel = np.zeros((9, 7))
    channel[:, 3] = 1e-6
    beside = channel.copy()
    beside[3, 4] = beside[2:5, 5] = 5e-6  # dead end
    beside[7, 0] = 5e-6  # pool
    alone, found = flow(channel, CELL), flow(beside, CELL)
    assert_allclose(found.conductance, alone.conductance, rtol=1e-12, atol=0)
    assert np.abs(found.along[2:5, 4:6]).max() < 1e-12 * found.along.max()
    assert np.abs(found.across).max() < 1e-12 * found.along.max()
    assert found.along[7, 0] == 0


@pytest.mark.parametrize("wrap", [False, True])
def test_fluxes__carry_the_same_through_every_section(wrap):
    gap = random_gap((25, 22), seed=3, open_part=0.8)
    found = flow(gap, CELL, wrap=wrap)
    assert found.conductance > 0
    assert_allclose(found.along.sum(axis=1) * CELL[1], found.conductance, rtol=1e-9, atol=0)
    assert not found.along[gap == 0].any()
    assert not found.across[gap == 0].any()


def test_fluxes__turn_with_the_channel():
    gap = np.zeros((3, 4))
    gap[0, 0] = gap[1, 0] = gap[1, 1] = gap[1, 2] = gap[2, 2] = 1e-6
    found = flow(gap, CELL)
    expected = np.zeros((3, 4))
    expected[1, :3] = found.conductance / CELL[0] * np.array([0.5, 1.0, 0.5])  # half of a corner's faces carry it
    assert_allclose(found.across, expected, rtol=1e-12, atol=0)
    expected[:] = 0.0
    expected[[0, 2], [0, 2]], expected[1, [0, 2]] = found.conductance / CELL[1], found.conductance / CELL[1] / 2
    assert_allclose(found.along, expected, rtol=1e-12, atol=0)


def unlike_its_inverse(cells):
    """Gap on a unit square whose cube, turned by a right angle, is one over itself; the flow through it is bent."""
    wave = np.cos(2 * np.pi * (np.arange(cells) + 0.5) / cells)
    x, y = wave[:, None], wave[None]
    return np.exp((x - y) * (1 + 0.6 * x * y) / 2)


def test_rate__second_order_on_a_gap_whose_conductance_duality_gives():
    """Of a square with mobilities m along x, and with 1/m along y, the conductances multiply to one (Keller)."""
    errors = []
    for cells in (16, 32, 64):
        found = flow(unlike_its_inverse(cells), (1 / cells, 1 / cells))
        errors.append(abs(12 * found.conductance - 1))
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert errors[-1] < 1e-3
    assert np.all(rates > 1.9)


@pytest.mark.parametrize("decades", [0, 6, 12, 15])
def test_error__is_small_at_any_contrast_and_covers_the_solution_by_elimination(decades):
    gap = random_gap((24, 21), seed=7, open_part=0.75, decades=decades)
    found = flow(gap, CELL)
    assert 0 < found.error <= 1e-9 * found.conductance
    if decades <= 6:  # the dense matrix loses the rest
        assert_allclose(found.conductance, kirchhoff(gap, CELL, wrap=False), rtol=1e-9)


@pytest.mark.parametrize("close", [1e-1, 1e-4])
def test_error__of_an_inexact_solution_is_its_distance(close, monkeypatch):
    gap = random_gap((48, 45), seed=5, open_part=0.9)
    exact = flow(gap, CELL).conductance

    def inexact(matrix, cells, width):
        by_factors = solvers._factors(matrix)
        return lambda enough, source: 0.9 * by_factors(source)

    monkeypatch.setattr(solvers, "_solver_on_two_grids", inexact)
    monkeypatch.setattr(solvers, "_LARGE", 0)
    monkeypatch.setattr(solvers, "_ON_TWO_GRIDS", (0.0,) * 9)
    monkeypatch.setattr(solvers, "_CLOSE", close)
    found = flow(gap, CELL)
    assert found.error == pytest.approx(0.9 * (found.conductance - exact), rel=1e-6, abs=0)
    assert found.error > 1e-9 * exact


@pytest.mark.parametrize("decades", [4.0, 5.5, 9.0])
def test_gaps_in_series__add_their_resistances_over_any_decades(decades, monkeypatch):
    """Long cells: a wide basin behind narrow slits, whose faces a sum of conductances rounds away."""
    gap = np.repeat(1e-6 * 10 ** (-decades * np.random.default_rng(2).random((40, 1))), 25, axis=1)
    cell = (CELL[0], 0.04 * CELL[0])
    exact = 25 * 0.04 / np.sum(12 / gap[:, 0] ** 3)
    found = flow(gap, cell)
    assert_allclose(found.conductance, exact, rtol=2e-9, atol=0)
    assert found.error <= 1e-9 * exact
    if decades > 6:  # eliminated without subtractions
        assert_allclose(found.along, exact / (25 * cell[1]), rtol=1e-9, atol=0)
        monkeypatch.setattr(solvers, "_MOST_PRODUCTS", 0)
        bound = flow(gap, cell)
        assert exact <= bound.conductance == bound.error


def test_slit_between_two_lakes__is_all_the_resistance():
    gap = np.full((41, 30), 1e-6)
    gap[20] = 0.0
    gap[20, 11] = 1e-6 * 1e-7  # 21 decades between the mobilities
    found = flow(gap, CELL)
    assert found.error <= 1e-6 * found.conductance
    assert_allclose(found.conductance, (1e-13) ** 3 / 12 * CELL[1] / CELL[0], rtol=1e-6, atol=0)


@pytest.mark.parametrize("wrap", [False, True])
@pytest.mark.parametrize("part", [0.0, 0.2, 0.35])
def test_large_map__on_two_grids_alone_as_by_factors(part, wrap, monkeypatch):
    whole = rough_gap((90, 97), seed=2)
    gap = 1e-7 * np.maximum(whole - np.quantile(whole, part), 0.0)
    monkeypatch.setattr(solvers, "_LARGE", np.inf)
    expected = flow(gap, CELL, wrap=wrap)
    monkeypatch.setattr(solvers, "_ON_TWO_GRIDS", ON_TWO_GRIDS)
    monkeypatch.setattr(solvers, "_LARGE", 0)
    monkeypatch.setattr(solvers, "_BY_FACTORS", 0)
    found = flow(gap, CELL, wrap=wrap)
    assert found.error <= 1e-9 * found.conductance
    assert_allclose(found.conductance, expected.conductance, rtol=1e-9, atol=0)
    for one, other in ((found.along, expected.along), (found.across, expected.across)):
        assert np.linalg.norm(one - other) < 1e-6 * np.linalg.norm(other)
