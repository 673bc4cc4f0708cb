"""The seed paper's algorithm: where its printed equations fail, and agreement with the fast method."""

import numpy as np
import pytest
from support import MATERIALS, STEP_LOAD, scene

import roughvisc as rv
from roughvisc.mechanics import closed_forms
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.stepping import seed
from roughvisc.mechanics.stepping.march import march


def hertz_run(sign, max_iterations=600):
    n, size = 65, 1.6
    x = (np.arange(n) - n // 2) * size / n
    gap = (x[:, None] ** 2 + x[None, :] ** 2) / 2
    operator = Operator((n, n), (size / n, size / n))
    return seed.conjugate_gradients(operator, gap, 0.25, 0.1, epsilon=1e-10, sign=sign, max_iterations=max_iterations)


def test_printed_sign_of_equation_9__stalls_where_the_coded_one_converges():
    coded, printed = hertz_run(+1.0), hertz_run(-1.0)
    assert coded.stagnated
    assert coded.iterations < 100
    assert not printed.stagnated
    assert printed.iterations == 600


def test_coded_gradients__reach_hertz():
    found = hertz_run(+1.0)
    exact = closed_forms.hertz(1.0, 4.0, 0.1)
    assert found.level == pytest.approx(exact.approach, rel=1e-3)


@pytest.mark.parametrize("name", ["zener", pytest.param("maxwell", marks=pytest.mark.thorough)])
def test_seed_and_fast__agree_as_both_are_refined(name):
    material = MATERIALS[name]

    def run(method, step):
        *_, last = method(scene(material, STEP_LOAD, time_step=step, tolerance=1e-6))
        return last.shown.pressure

    steps = np.array([1 / 5, 1 / 10, 1 / 20, 1 / 40])
    fast = run(march, 1 / 80)
    errors = [np.abs(run(seed.march_seed, h) - fast).sum() / fast.sum() for h in steps]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 0.8 < order < 1.3, f"order {order:.2f}, errors {errors}"
    assert errors[-1] < 0.02


def test_unstable_steps__are_refused_with_the_bound():
    soft = rv.zener(1.0, 0.1, 0.1)
    with pytest.raises(rv.InputError, match=r"unstable with a time step of 1 s: .* is 4\.62 1/Pa, expected less"):
        list(seed.march_seed(scene(soft, STEP_LOAD, time_step=1.0)))


@pytest.mark.parametrize(
    ("material", "program", "message"),
    [
        (rv.kelvin_voigt(1.0, 1.0), STEP_LOAD, "instantaneous compliance"),
        (rv.elastic(1.0), rv.Program().approach(0.01, over=1), "given loads"),
    ],
)
def test_seed__refuses_what_the_paper_does_not_treat(material, program, message):
    with pytest.raises(rv.InputError, match=message):
        list(seed.march_seed(scene(material, program)))
