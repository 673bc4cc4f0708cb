"""The choice of the next step, told nothing but estimated errors and what is allowed."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roughvisc.mechanics.stepping.state import ControllerState

errors = st.floats(1e-12, 1e3)


@given(errors, st.floats(1e-9, 1e-1), st.floats(1e-9, 1e3))
def test_rejected_step__is_tried_again_at_half_to_a_fifth(error, allowed, length):
    pace = ControllerState().rejected(length, error, allowed)
    assert 0.2 * length <= pace.suggestion <= 0.5 * length
    assert pace.rejected_error == error


def test_rejected_step_of_second_order__meets_half_of_what_is_allowed():
    # an error that falls with the square of the length comes to 0.7 squared of what is allowed
    length, error, allowed = 1.0, 9.0, 1.0
    again = ControllerState().rejected(length, error, allowed).suggestion
    assert error * again**2 == pytest.approx(0.49 * allowed)


def test_rejected_step_without_estimate__is_tried_again_at_a_fifth_and_compared_with_nothing():
    pace = ControllerState(rejected_error=1.0).rejected(3.0, math.nan, 1e-3)
    assert pace.suggestion == pytest.approx(0.6)
    assert not pace.shortening_failed(1e300)


@pytest.mark.parametrize(("gain", "fails"), [(0.5, False), (0.9, False), (0.95, True), (1.0, True), (2.0, True)])
def test_shorter_step__fails_where_its_error_is_hardly_smaller(gain, fails):
    assert ControllerState().rejected(1.0, 0.2, 0.1).shortening_failed(gain * 0.2) == fails


def test_first_attempt__never_counts_as_failed():
    assert not ControllerState().shortening_failed(1e300)


def test_step_accepted_after_a_failed_one__blinds_the_next_estimate_once():
    rejected = ControllerState().rejected(1.0, 0.2, 0.1)
    blinded = rejected.accepted(0.3, 0.199, allowed=0.1, fresh=False)
    assert blinded.ignore_pressure_error
    assert not rejected.accepted(0.3, 0.05, allowed=0.1, fresh=False).ignore_pressure_error  # it is good enough
    assert not rejected.accepted(0.3, 0.11, allowed=0.1, fresh=False).ignore_pressure_error  # it did not fail
    assert not blinded.accepted(0.3, 0.199, allowed=0.1, fresh=False).ignore_pressure_error


def test_accepted_step__is_the_end_of_what_was_rejected_unless_the_second_of_a_pair_judges_it():
    rejected = ControllerState().rejected(1.0, 0.2, 0.1)
    assert rejected.accepted(0.3, 0.05, 0.1, fresh=False).rejected_error == math.inf
    assert rejected.accepted(0.3, 0.05, 0.1, fresh=True).rejected_error == 0.2
    assert rejected.accepted(0.3, 0.05, 0.1, fresh=False).suggestion == 0.3


@given(st.lists(st.floats(0.0, 1e3), min_size=1, max_size=30))
def test_sharpness__stays_between_an_eighth_and_one_in_steps_of_the_root_of_two(told):
    pace, earlier = ControllerState(), 0.0
    for used in told:
        pace, earlier = pace.adapt_sharpness(used, earlier), used
        assert 0.125 <= pace.sharpness <= 1
        assert 2 * math.log2(pace.sharpness) == pytest.approx(round(2 * math.log2(pace.sharpness)))


def test_sharpness__follows_what_is_stated_and_leaves_alone_what_no_step_can_mend():
    assert ControllerState().adapt_sharpness(1.4, 1.0).sharpness == 0.5
    assert ControllerState().adapt_sharpness(1.4, 1.39).sharpness == 1.0  # it has been so before
    assert ControllerState().adapt_sharpness(0.5, 0.1).sharpness == 1.0  # there is room
    assert ControllerState(sharpness=0.25).adapt_sharpness(0.1, 0.1).sharpness == pytest.approx(0.25 * math.sqrt(2))
    assert ControllerState().adapt_sharpness(0.1, 0.1).sharpness == 1.0  # never more than the usual share
