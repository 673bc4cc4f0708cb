"""Contact spots as a punch: discs, squares, strips and pairs against closed forms, Hertz, and the solver itself."""

import math

import numpy as np
import pytest
from support import rough_gap

from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.transport import frozen_contact

#: Stiffness of a square of unit side over the contact modulus: pi times the capacity of a square plate, 0.36678742 of
#: its side (F. H. Read, J. Comput. Phys. 133 (1997) 1).
SQUARE = math.pi * 0.36678742
UNIT = (1.0, 1.0)


def disc(radius, centre=(0.0, 0.0), side=1.0):
    """Cells whose centres lie in a disc."""
    n = 2 * math.ceil(radius) + 4
    x, y = ((np.arange(m) + 0.5 - m / 2) * s for m, s in ((n, 1.0), (math.ceil(n / side), side)))
    return np.hypot(x[:, None] - centre[0], y - centre[1]) < radius


def outlined(spots, spacing=UNIT, boundary="free", **settings):
    """The contact is where the material is."""
    return frozen_contact(spots, spacing, boundary, present=spots, **settings)


def within(found, exact):
    """How far off, after checking that the stated error holds."""
    off = abs(found[0] - exact)
    assert off <= found[1]
    return off / exact


@pytest.mark.parametrize("centre", [(0.0, 0.0), (0.3, 0.1), (0.5, 0.2), (0.45, 0.45)])
@pytest.mark.parametrize("radius", [15.7, 24.1])
def test_disc__is_twice_its_radius(radius, centre):
    """The disc of the cells' area: sampling at the centres has it off by more than the punch is."""
    spots = disc(radius, centre)
    assert within(outlined(spots), 2 * math.sqrt(spots.sum() / math.pi)) < 1e-3


@pytest.mark.parametrize(("cells", "off"), [(3, 1e-2), (8, 2e-3), (31, 2e-4), (64, 1e-4)])
def test_square__is_its_capacity(cells, off):
    spots = np.pad(np.ones((cells, cells), dtype=bool), 1)
    assert within(outlined(spots, (1 / cells, 1 / cells)), SQUARE) < off
    assert within(outlined(np.ones((cells, 2 * cells), dtype=bool), (1 / cells, 0.5 / cells)), SQUARE) < off


def test_correction__has_the_order_of_a_corner():
    """Less than 2, which is that of a smooth outline's second term; more than 1, which is that of no correction."""
    off = [abs(outlined(np.ones((n, n), dtype=bool), (1 / n, 1 / n))[0] / SQUARE - 1) for n in (8, 16, 32)]
    assert np.log2(off[0] / off[1]) > 1.5
    assert np.log2(off[1] / off[2]) > 1.5
    raw = [frozen_contact(np.pad(np.ones((n, n), dtype=bool), 1), (1 / n, 1 / n))[0] for n in (16, 32)]
    assert np.log2((SQUARE - raw[0]) / (SQUARE - raw[1])) == pytest.approx(1, abs=0.05)


@pytest.mark.parametrize("part", [0.25, 0.5])
def test_strips__of_a_periodic_surface(part):
    """A strip of width ``2 a`` in a period ``L``: ``delta = -2 F'/(pi E*) ln sin(pi a / L)`` to the mean plane."""
    spots = np.zeros((48, 5), dtype=bool)
    spots[: int(part * 48)] = True
    exact = 5 / 48 * math.pi / (-2 * math.log(math.sin(math.pi * part / 2)))
    assert within(outlined(np.roll(spots, 40, axis=0), (1 / 48, 1 / 48), "periodic"), exact) < 1e-3
    assert within(outlined(spots.T, (1 / 48, 1 / 48), "periodic"), exact) < 1e-3


@pytest.mark.parametrize("apart", [40, 80])
def test_two_far_spots__add_but_for_what_each_displaces_the_other(apart):
    """``1/k = 1/(2 k_1) + 1/(2 pi d)``, and what is left falls as the cube of the distance."""
    spot = disc(5.2)
    both = np.zeros((len(spot) + apart, spot.shape[1]), dtype=bool)
    both[: len(spot)], both[apart:] = spot, spot
    one, found = outlined(spot)[0], outlined(both)[0]
    assert found == pytest.approx(1 / (1 / (2 * one) + 1 / (2 * math.pi * apart)), rel=5e-4 * (40 / apart) ** 3)


def hertz(cells, radius, centre, boundary="free"):
    """Cells in contact of a paraboloid that touches a disc of so many cells' radius."""
    x = np.arange(cells) + 0.5 - cells / 2
    gap = ((x[:, None] - centre[0]) ** 2 + (x - centre[1]) ** 2) / 2e3
    load = 4 * radius**3 / 3e3
    return solve_contact(Grid((cells, cells), UNIT, boundary), gap, load=load, tolerance=1e-9).pressure > 0


def test_hertz__has_the_stiffness_of_its_exact_radius():
    """Where the gap opens nothing is corrected: the count is too large by as much as the punch is too soft."""
    rng, off, stated = np.random.default_rng(4), [], []
    for radius in 14 + 4 * rng.random(10):
        contact = hertz(42, radius, rng.random(2) - 0.5)
        found = frozen_contact(contact, UNIT)
        assert within(found, 2 * radius) < 1e-2
        off.append(found[0] / (2 * radius) - 1)
        stated.append(found[1] / (2 * radius))
    assert abs(np.mean(off)) < 2e-3, "nothing systematic"
    assert np.mean(stated) < 10 * np.mean(np.abs(off))
    assert abs(np.sqrt(contact.sum() / math.pi) / radius - 1) > 5e-3, "which the count is"


@pytest.mark.parametrize("boundary", ["free", "periodic"])
@pytest.mark.parametrize("make", ["ball", "rough"])
def test_stiffness__is_the_slope_of_force_over_approach(boundary, make):
    """Of the whole contact problem, at a load where no cell comes into contact within the increment."""
    x, y = np.arange(24) - 11.3, np.arange(22) - 10.8
    gap = (x[:, None] ** 2 + 1.1 * y**2) / 200 + (0.3 * rough_gap((24, 22), seed=5) if make == "rough" else 0)
    body = Grid(gap.shape, UNIT, boundary)
    load, eps = 3.0, 1e-3
    states = [solve_contact(body, gap, load=load * (1 + part * eps), tolerance=1e-14) for part in (-1, 1)]
    contact = states[0].pressure > 0
    assert np.array_equal(contact, states[1].pressure > 0), "choose another load"
    slope = 2 * eps * load / (states[1].approach - states[0].approach)
    assert frozen_contact(contact, UNIT, boundary, tolerance=1e-10)[0] == pytest.approx(slope, rel=1e-8)


def test_nothing_and_all():
    none, full = np.zeros((5, 4), dtype=bool), np.ones((5, 4), dtype=bool)
    assert frozen_contact(none, UNIT)[0] == 0
    assert frozen_contact(full, UNIT, "periodic")[0] == math.inf


def test_edges__are_told_apart():
    """Two spots alike but for what is beside them: corrected only where the material ends."""
    spot = np.pad(np.ones((8, 8), dtype=bool), 2)
    ended, opened = frozen_contact(spot, UNIT, present=spot), frozen_contact(spot, UNIT)
    at_border = frozen_contact(spot[2:-2, 2:-2], UNIT)
    assert at_border[0] == ended[0] > opened[0]
    half = spot.copy()
    half[6:] = True
    assert opened[0] < frozen_contact(spot, UNIT, present=half)[0] < ended[0]


SPOTS, MATERIAL = rough_gap((14, 15), seed=3) < 2.0, rough_gap((14, 15), seed=3) < 2.5


@pytest.mark.parametrize("boundary", ["free", "periodic", "mirror"])
def test_lengths__scale_and_the_turned_map_conducts_as_much(boundary):
    """Stiffness and error, on cells of 1 : 4, with edges of both kinds."""
    one = frozen_contact(SPOTS, (1.0, 4.0), boundary, present=MATERIAL)
    tiny = frozen_contact(SPOTS.T, (4e-9, 1e-9), boundary, present=MATERIAL.T)
    assert tiny == pytest.approx((1e-9 * one[0], 1e-9 * one[1]), rel=1e-5)


def test_mirrored_spots__conduct_as_the_unfolded_ones():
    """Four images with equal errors."""
    images = [(0, count) for count in SPOTS.shape]
    spots, material = (np.pad(one, images, mode="symmetric") for one in (SPOTS, MATERIAL))
    whole = frozen_contact(spots, (1.0, 4.0), "periodic", present=material)
    part = frozen_contact(SPOTS, (1.0, 4.0), "mirror", present=MATERIAL)
    assert whole == pytest.approx((4 * part[0], 4 * part[1]), rel=1e-5)
