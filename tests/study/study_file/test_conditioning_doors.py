"""Arguments of conditioning steps are judged alike by the functions, by surface cards and by study files."""

import json

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.study.case import Case
from roughvisc.topography.conditioning import condition
from roughvisc.topography.scans import raw_height

H = rv.from_array(np.random.default_rng(0).standard_normal((20, 24)), 1e-6)
STATED = {
    "surface": {"generate": "sphere", "radius": 1e-3, "size": 1e-4, "shape": 16},
    "material": {"model": "elastic", "shear_modulus": 1e6},
    "program": [{"load": 1.0, "over": 0.1}],
    "solve": {"boundary": "free"},
}


def case_with(step, value):
    return Case.from_json(json.dumps(STATED | {"surface": STATED["surface"] | {step: value}}))


@pytest.mark.parametrize(
    ("function", "step", "value"),
    [
        (lambda: rv.level(H, 4), "level", 4),
        (lambda: rv.level(H, 1.0), "level", 1.0),
        (lambda: rv.fill(H, "cubic"), "fill", "cubic"),
        (lambda: rv.mask_outliers(H, True), "outliers", {"window": True}),
        (lambda: rv.gaussian_filter(H, 5e-6, "both"), "filter", {"cutoff": 5e-6, "keep": "both"}),
        (lambda: rv.rotate90(H, 0.5), "rotate90", 0.5),
    ],
)
def test_step__is_refused_by_function_card_and_study(function, step, value):
    for door in (function, lambda: condition(H, {step: value}), lambda: case_with(step, value)):
        with pytest.raises(InputError):
            door()


@pytest.mark.parametrize("order", [0, 1, 2, 3, True, False])
def test_level__is_what_a_card_makes_of_it(order):
    case = case_with("level", order)
    raw = raw_height("surface", case.surface)
    expected = raw if order is False else rv.level(raw, int(order))
    np.testing.assert_array_equal(case.height(), expected)
    np.testing.assert_array_equal(condition(raw, {"level": order}), expected)
