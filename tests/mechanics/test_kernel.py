"""Influence of one cell: full precision at any distance, positive symbols."""

import mpmath
import numpy as np
import pytest

from roughvisc.mechanics.body import HALF_SPACE
from roughvisc.mechanics.grid import Grid


def love_exact(x, y, dx, dy):
    """Love's closed form in 50 digits."""
    with mpmath.workdps(50):
        total = mpmath.mpf(0)
        for sx in (1, -1):
            for sy in (1, -1):
                a, b = mpmath.mpf(x) + sx * mpmath.mpf(dx) / 2, mpmath.mpf(y) + sy * mpmath.mpf(dy) / 2
                total += sx * sy * (a * mpmath.asinh(b / abs(a)) + b * mpmath.asinh(a / abs(b)))
        return float(total / mpmath.pi)


@pytest.mark.parametrize(
    ("spacing", "error"), [((1.0, 1.0), 1e-14), ((3.0, 0.75), 2e-14), ((1.0, 16.0), 2e-13)], ids=["1", "4", "16"]
)
def test_influence_of_half_space__is_exact_at_any_distance(spacing, error):
    kernel = HALF_SPACE.influence((801, 801), spacing)
    rng = np.random.default_rng(3)
    cells = [(0, 0), (0, 1), (1, 0), (4, 0), (0, 5), (17, 1), (41, 3), (200, 1), (300, 800)]
    cells += [(int(i), int(j)) for i, j in rng.integers(0, 801, (30, 2))]
    for i, j in cells:
        exact = love_exact(i * spacing[0], j * spacing[1], *spacing)
        assert kernel[i, j] == pytest.approx(exact, rel=error)


@pytest.mark.parametrize("aspect", [1, 4, 16])
def test_free_space_symbol__is_positive(aspect):
    symbol = Grid((32, 24), (1.0, float(aspect))).symbol
    assert symbol.min() > 0.5  # of the short side; zero at the middle offset would make it negative
