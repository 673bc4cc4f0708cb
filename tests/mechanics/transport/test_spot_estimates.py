"""Estimates for many spots against the punch of the same spots, and against sums by hand."""

import math

import numpy as np
import pytest

from roughvisc.mechanics.transport.spot_estimates import greenwood, holm, lattice_potential, round_spots
from roughvisc.mechanics.transport.spots import frozen_contact

DISC = np.hypot(np.arange(8)[:, None] - 3.5, np.arange(8) - 3.5) < 3.3


def placed(shape, corners):
    spots = np.zeros(shape, dtype=int)
    for number, (i, j) in enumerate(corners, 1):
        spots[i : i + 8, j : j + 8][DISC] = number
    return spots


def test_one_spot__is_a_disc():
    radii, positions = round_spots(placed((10, 10), [(1, 2)]), np.zeros((10, 10), dtype=bool), (2.0, 3.0))
    assert radii == pytest.approx(math.sqrt(6 * DISC.sum() / math.pi))
    assert positions == pytest.approx(np.array([[2.0 * 5, 3.0 * 6]]))
    assert greenwood(radii, positions) == holm(radii, positions) == pytest.approx(2 * radii[0])


def test_spots__are_less_than_their_cells_where_the_gap_opens():
    spots = placed((10, 10), [(1, 1)])
    radius = round_spots(spots, spots == 0, (1.0, 1.0))[0][0]
    across = int(DISC.any(axis=0).sum())
    faces = 4 * across  # a convex outline on cells has the faces of the rectangle around it
    assert radius == pytest.approx(math.sqrt((DISC.sum() - 0.088 * faces) / math.pi))


def test_spots__across_the_border_of_a_period():
    spots = np.roll(placed((20, 16), [(0, 0)]), (-4, -3), axis=(0, 1))
    radii, positions = round_spots(spots, spots == 0, (1.0, 1.0), periodic=True)
    inside = np.roll(spots, (9, 7), axis=(0, 1))
    assert radii == pytest.approx(round_spots(inside, inside == 0, (1.0, 1.0))[0])
    assert positions[0] == pytest.approx([20.0, 1.0]) or positions[0] == pytest.approx([0.0, 1.0], abs=1e-12)


def test_greenwood__is_the_sum_over_pairs():
    rng = np.random.default_rng(1)
    radii, positions = rng.random(7), 20 * rng.random((7, 2))
    pairs = sum(
        radii[i] * radii[j] / math.dist(positions[i], positions[j]) for i in range(7) for j in range(7) if i != j
    )
    exact = 1 / (1 / (2 * radii.sum()) + pairs / math.pi / radii.sum() ** 2)
    assert greenwood(radii, positions) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_greenwood__of_far_spots_is_their_punch(boundary):
    size = (100, 90)
    spots = placed(size, [(6, 10), (60, 20), (30, 70)])
    _, positions = round_spots(spots, np.zeros(size, dtype=bool), (1.0, 1.0), boundary == "periodic")
    radii = np.full(3, frozen_contact(DISC, (1.0, 1.0), present=DISC).stiffness / 2)
    found = greenwood(radii, positions, (100.0, 90.0) if boundary == "periodic" else None)
    exact = frozen_contact(spots > 0, (1.0, 1.0), boundary, present=spots > 0).stiffness
    assert found == pytest.approx(exact, rel=1e-3 if boundary == "free" else 3e-3)
    assert abs(2 * radii.sum() / exact - 1) > 0.04, "interaction matters"


def test_holm__of_many_spots_side_by_side():
    """Evenly in a disc: in series with the disc, whose radius of gyration is its own over sqrt(2)."""
    x = np.arange(-1, 1.001, 0.05)
    places = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)
    places = places[np.hypot(*places.T) < 1]
    radii = np.full(len(places), 1e-4)
    assert holm(radii, places) == pytest.approx(1 / (1 / (2 * radii.sum()) + 1 / 2), rel=1e-3)
    assert holm(radii, places) == pytest.approx(greenwood(radii, places), rel=0.04)
    assert holm(radii, places, period=(2.0, 2.0)) == pytest.approx(2 * radii.sum())


def test_no_spot():
    nothing = round_spots(np.zeros((4, 3), dtype=int), np.ones((4, 3), dtype=bool), (1.0, 1.0))
    assert len(nothing[0]) == 0
    assert greenwood(*nothing) == holm(*nothing) == 0


def test_lattice__is_the_sum_over_images_less_its_mean():
    """By brute force: discs of images, less the integral over them, for a lattice with moments that cancel."""
    period, apart = (1.0, 1.4), np.array([0.31, -0.22])
    i, j = np.meshgrid(np.arange(-600, 601), np.arange(-430, 431), indexing="ij")
    x, y = i * period[0] + apart[0], j * period[1] + apart[1]
    r = np.hypot(x, y)
    # a smooth cutoff, whose integral is known: int exp(-r^2 / s^2) / r dA = pi^(3/2) s
    s = 60.0
    found = np.sum(np.exp(-((r / s) ** 2)) / r) - math.pi**1.5 * s / (period[0] * period[1])
    assert lattice_potential(apart, period) + 1 / np.hypot(*apart) == pytest.approx(found, abs=1e-4)


def test_lattice__of_a_square_is_the_known_constant():
    """Of a square Wigner lattice: 3.900265 (L. Bonsall, A. A. Maradudin, Phys. Rev. B 15 (1977) 1959)."""
    assert lattice_potential(np.zeros(2), (2.0, 2.0)) == pytest.approx(-3.900265 / 2, rel=1e-7)
