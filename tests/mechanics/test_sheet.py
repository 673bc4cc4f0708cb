"""The kernel of a sheet on a rigid base: against plane-strain elasticity, and at its limits."""

import math

import numpy as np
import pytest
from references.layered import elastic_factor
from support import refused

from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.sheet import Sheet, factors

BODIES = [("bonded", 0.0), ("bonded", 0.3), ("bonded", 0.45), ("bonded", 0.5), ("slipping", 0.3), ("slipping", 0.5)]


@pytest.mark.parametrize(("base", "poisson"), [*BODIES, ("bonded", 0.4999999)])
@pytest.mark.parametrize("x", [1e-5, 1e-3, 0.0999, 0.499, 0.501, 1.0, 4.0, 15.0])
def test_factors__are_those_of_plane_strain(base, poisson, x):
    exact = elastic_factor([x], [poisson], [1], base)
    found, complement = factors(x, poisson, base)
    assert float(found) == pytest.approx(float(exact), rel=2e-13)
    assert float(complement) == pytest.approx(float(1 - exact), rel=2e-13)


@pytest.mark.parametrize(("base", "poisson"), BODIES)
def test_transfer__of_long_waves_tends_to_uniform_pressure(base, poisson):
    sheet = Sheet(2e-3, poisson, base)
    uniform = float(sheet.transfer(0.0, 0.0))
    # in one dimension: M = 2 G (1 - nu) / (1 - 2 nu) between plates that hold the sheet; plane strain if it may slip
    expected = 2e-3 * ((1 - 2 * poisson) / (1 - poisson) ** 2 if base == "bonded" else 1.0)
    assert uniform == pytest.approx(expected, abs=1e-18)
    assert float(sheet.transfer(1e-3, 0.0)) == pytest.approx(expected, rel=1e-5, abs=1e-12)
    short = 40 / 2e-3
    assert float(sheet.transfer(0.0, short)) == pytest.approx(2 / short, rel=1e-14)


@pytest.mark.parametrize(("base", "poisson"), BODIES)
@pytest.mark.parametrize("sides", [(0.03, 0.05), (0.14, 0.1), (0.5, 0.3)], ids=str)
def test_influence__of_a_short_cell_is_that_of_its_parts(base, poisson, sides):
    """The mean over a cell is taken with enough points, up to half of the thickness."""
    sheet, (dx, dy) = Sheet(1.0, poisson, base), sides
    whole = sheet.influence((4, 3), sides)
    parts = sheet.influence((14, 11), (dx / 3, dy / 3))
    for i, j in ((0, 0), (1, 0), (2, 1), (3, 2)):
        of_parts = sum(parts[abs(3 * i + a), abs(3 * j + b)] for a in (-1, 0, 1) for b in (-1, 0, 1))
        assert whole[i, j] == pytest.approx(of_parts, abs=1e-12 * whole[0, 0] + 1e-13)


@pytest.mark.parametrize(("base", "poisson"), BODIES)
@pytest.mark.parametrize(
    "sides",
    [
        (0.4, 1.6),
        (1.0, 0.25),
        (50.0, 40.0),
        *(pytest.param((n, 0.8 * n), marks=pytest.mark.thorough) for n in (0.4, 0.51, 0.8, 2.0, 4.0, 16.0, 400.0)),
    ],
    ids=str,
)
def test_influence__answers_long_waves_as_plane_strain_does(base, poisson, sides):
    """On cells of any length, also where the wave is thousands of thicknesses long and the sheet almost rigid to it."""
    q = 2 * math.pi / (24 * sides[0])
    reach = [math.ceil(50 / length) + 3 for length in sides]
    influence = Sheet(1.0, poisson, base).influence(tuple(reach), sides)
    influence[1:] *= 2
    influence[:, 1:] *= 2
    answer = float(influence.sum(axis=1) @ np.cos(q * sides[0] * np.arange(reach[0])))
    assert answer == pytest.approx(2 / q * float(elastic_factor([q], [poisson], [1], base)), rel=5e-3)


@pytest.mark.parametrize(("base", "poisson"), BODIES)
@pytest.mark.parametrize("side", [0.03, 0.5, 3.0, 50.0])
def test_symbols__are_positive(base, poisson, side):
    sheet = Sheet(1.0, poisson, base)
    free = Grid((30, 27), (side, 0.9 * side), kernel=sheet).symbol
    assert free.min() >= -1e-12 * free.max()
    symbol = Grid((31, 24), (side, 0.9 * side), "periodic", kernel=sheet).symbol
    assert (symbol.ravel()[1:] > 0).all()


@pytest.mark.parametrize(
    ("arguments", "key", "found"),
    [
        ((0.0,), "thickness", 0.0),
        ((math.nan,), "thickness", math.nan),
        ((math.inf,), "thickness", math.inf),
        (("1 s",), "thickness", "1 s"),
        ((1.0, -0.1), "poisson", -0.1),
        ((1.0, 0.5, "glued"), "base", "glued"),
    ],
)
def test_sheet__refuses(arguments, key, found):
    with refused(key, found):
        Sheet(*arguments)
