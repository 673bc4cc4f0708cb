"""The first guess on a coarser grid: the pressure of Hertz, on cells of any sides."""

import numpy as np
import pytest

from roughvisc.mechanics import closed_forms
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import solver


@pytest.mark.parametrize(("shape", "spacing"), [((258, 291), (1.0, 1.0)), ((293, 259), (0.02, 0.05))])
def test_first_guess__is_the_pressure_of_hertz(shape, spacing):
    apex = 0.45 * shape[0] * spacing[0], 0.55 * shape[1] * spacing[1]
    x, y = ((np.arange(n) + 0.5) * side - at for n, side, at in zip(shape, spacing, apex, strict=True))
    squared = x[:, None] ** 2 + y**2
    width, area = min(n * side for n, side in zip(shape, spacing, strict=True)), spacing[0] * spacing[1]
    radius, wanted = 10 * width, 0.2 * width
    force = 4 / 3 * wanted**3 / radius  # a contact of this radius on a unit modulus
    guess = solver.coarse_guess(Operator(shape, spacing), squared / (2 * radius), force / area)
    assert guess.shape == shape
    exact = closed_forms.hertz(radius, 1.0, force).pressure(np.sqrt(squared))
    assert np.sum(guess) * area == pytest.approx(force, rel=2e-2)
    assert np.abs(guess - exact).sum() * area < 0.2 * force
    centre = [float((guess * across).sum() / guess.sum()) for across in (x[:, None], y[None, :])]
    assert np.abs(centre) == pytest.approx(0, abs=0.01 * width)


def test_contact__asks_for_a_load_or_an_approach():
    operator, gap = Operator((3, 4), (1.0, 1.0)), np.zeros((3, 4))
    for known in ({}, {"load": 1.0, "approach": 1.0}):
        with pytest.raises(ValueError, match="either a load or an approach"):
            solver.solve_contact(operator, gap, **known)


def test_contact__leaves_its_arguments_alone_unless_told():
    operator = Operator((6, 5), (1.0, 1.0))
    gap, start = np.random.default_rng(0).random((6, 5)), np.random.default_rng(1).random((6, 5))
    displacement = operator.displacement(start)
    before = [array.copy() for array in (gap, start, displacement)]
    for known in ({"load": 2.0}, {"approach": 0.5}):
        solver.solve_contact(operator, gap, start=start, start_displacement=displacement, **known)
        assert all(np.array_equal(*pair) for pair in zip((gap, start, displacement), before, strict=True))
