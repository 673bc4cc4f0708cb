"""Closed forms of an indenter that stays where it is refuse a program that slides."""

import pytest

import roughvisc as rv
from roughvisc.mechanics import closed_forms

RUBBER = rv.zener(3e6, 1e6, 1e5)
SLIDING = rv.Program().load(1.0, over=1.0).slide(1e-3, speed=1e-3)
BALL = closed_forms.Paraboloid(1e-3)


@pytest.mark.parametrize(
    "solve",
    [
        lambda: closed_forms.lee_radok(BALL, RUBBER, SLIDING),
        lambda: closed_forms.ting(BALL, RUBBER, SLIDING).radius(1.0),
        lambda: closed_forms.reduced_contact(BALL, RUBBER, SLIDING, [1.0]),
        lambda: closed_forms.punch_approach(1e-3, RUBBER, SLIDING, [1.0]),
    ],
    ids=["lee_radok", "ting", "reduced_contact", "punch_approach"],
)
def test_slide__is_refused(solve):
    with pytest.raises(rv.InputError, match=r"expected no slide|does not slide|ramps, holds and jumps"):
        solve()
