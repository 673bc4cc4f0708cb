"""The validation that users run: it passes on a sound solver, and fails on one that is broken in any of its parts."""

import math

import pytest
from click.testing import CliRunner

import roughvisc as rv
from roughvisc.cli import main
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.hereditary.direct import History
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.study.validation.closed_cases import CASES
from roughvisc.study.validation.validate import Comparison

SLOW = {"Ting", "histories"}


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.long if n in SLOW else ()) for n in CASES])
@pytest.mark.parametrize("cells", [33, pytest.param(52, marks=pytest.mark.thorough)])
def test_case__is_within_what_is_expected(name, cells):
    found = rv.validate(cells, cases=[name])
    assert found
    for one in found:
        assert one.passed, one


def test_expected_errors__shrink_with_the_grid_down_to_the_tolerance():
    """What is expected of a finer grid is less; no case is passed by an allowance that hides everything."""
    coarse, fine = (rv.validate(cells, cases=["Hertz", "Sneddon", "Maxwell"]) for cells in (33, 99))
    for before, after in zip(coarse, fine, strict=True):
        assert after.expected < before.expected
        assert after.expected < 0.02


def scaled_displacement(monkeypatch):
    """A kernel one per cent too soft."""
    sound = Operator.displacement
    monkeypatch.setattr(Operator, "displacement", lambda self, *given: 1.01 * sound(self, *given))


def forgetful_recursion(monkeypatch):
    """A memory that loses two per cent of what it carries."""
    sound = Modes.predict

    def predict(self, *arguments):
        alpha, carried = sound(self, *arguments)
        return alpha, 0.98 * carried

    monkeypatch.setattr(Modes, "predict", predict)


def stiff_step(monkeypatch):
    """The compliance of a step one per cent too small."""
    sound = Modes.predict

    def predict(self, *arguments):
        alpha, carried = sound(self, *arguments)
        return 0.99 * alpha, carried

    monkeypatch.setattr(Modes, "predict", predict)


def wrong_direct_history(monkeypatch):
    sound = History.predict

    def predict(self, *arguments):
        alpha, carried = sound(self, *arguments)
        return alpha, 0.98 * carried

    monkeypatch.setattr(History, "predict", predict)


@pytest.mark.parametrize(
    ("fault", "cases"),
    [
        (scaled_displacement, ["Hertz", "Johnson", "Zener", "full wave"]),
        (forgetful_recursion, ["Maxwell", "power law", "relaxation", "full wave"]),
        (stiff_step, ["Hertz", "Zener", "punch"]),
        pytest.param(wrong_direct_history, ["histories"], marks=pytest.mark.long),
    ],
)
def test_broken_solver__fails(fault, cases, monkeypatch):
    fault(monkeypatch)
    for name in cases:
        assert not all(one.passed for one in rv.validate(65, cases=[name])), name


def test_refusal__is_a_comparison_that_fails(monkeypatch):
    def refuse(self, pressure, out=None):
        raise rv.ConvergenceError("it does not converge")

    monkeypatch.setattr(Operator, "displacement", refuse)
    (found,) = rv.validate(33, cases=["Hertz"])
    assert found.compared == "refused: it does not converge"
    assert not found.passed


def test_not_a_number__does_not_pass():
    assert not Comparison("", "", math.nan, 1.0).passed


@pytest.mark.parametrize(
    ("settings", "message"), [({"cells": 8}, "cells is 8"), ({"cases": ["Bessel"]}, "cases holds 'Bessel'")]
)
def test_bad_input__is_refused(settings, message):
    with pytest.raises(rv.InputError, match=message):
        rv.validate(**settings)


def test_command__prints_a_table_and_ends_by_what_it_found(monkeypatch):
    few = {name: CASES[name] for name in ("Hertz", "punch")}
    monkeypatch.setattr("roughvisc.study.validation.validate.CASES", few)
    done = CliRunner().invoke(main, ["validate", "--cells", "33"])
    assert done.exit_code == 0
    lines = done.stdout.splitlines()
    assert lines[0].split() == ["case", "compared", "error", "expected", "verdict"]
    assert len(lines) == 1 + 10  # the sphere on an odd and on an even grid
    assert all(line.endswith("ok") for line in lines[1:])
    scaled_displacement(monkeypatch)
    done = CliRunner().invoke(main, ["validate", "--cells", "65"])
    assert done.exit_code == 1
    assert "FAILED" in done.stdout
    assert "of 10 comparisons failed" in done.stderr
