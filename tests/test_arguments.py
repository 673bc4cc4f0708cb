"""Tables of arguments: what a function may be called with, and what a refusal states."""

from typing import Literal

import pytest
from support import refused

import roughvisc as rv
from roughvisc.arguments import call, units_of
from roughvisc.units import Quantity, quantities


@quantities(radius="m")
def area(radius: Quantity, sides: Literal["one", "both"] = "one", times: tuple[float, ...] = ()) -> float:
    if radius <= 0:
        raise rv.InputError(key="radius", found=radius, expected="a positive length")
    return 3.0 * radius**2 * (2 if sides == "both" else 1)


def test_call__gives_what_the_function_gives():
    assert call(area, "disc", {"radius": "2 mm", "sides": "both"}) == area(2e-3, "both")
    assert call(rv.zener, "", {"shear_modulus": 1, "kelvin_modulus": 2, "kelvin_viscosity": 3}) == rv.zener(1, 2, 3)
    assert call(rv.Program.load, "", {"over": 1}, rv.Program(), 2.0) == rv.Program().load(2.0, over=1)
    assert units_of(area) == {"radius": "m", "times": "1"}


@pytest.mark.parametrize(
    ("table", "key", "found"),
    [
        ({}, "disc.radius", None),
        ({"radius": 1, "side": "one"}, "disc.side", "one"),
        ({"radius": True}, "disc.radius", True),
        ({"radius": {"of": 1}}, "disc.radius", {"of": 1}),
        ({"radius": "1 N"}, "disc.radius", "1 N"),
        ({"radius": -1}, "disc.radius", -1),
        ({"radius": 1, "sides": "none"}, "disc.sides", "none"),
        ({"radius": 1, "times": [1, "x"]}, "disc.times", [1, "x"]),
    ],
)
def test_call__refuses_with_key_value_and_expectation(table, key, found):
    with refused(key, found) as caught:
        call(area, "disc", table)
    assert caught.value.expected
    assert str(caught.value).startswith(f"{key}: ")
