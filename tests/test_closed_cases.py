"""The solver compared with closed forms; the comparison fails on a solver that is broken in any of its parts."""

from dataclasses import replace

import pytest
from references.closed_cases import CASES

from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.memory import Memory


def compared(name, cells):
    return list(CASES[name][1](cells))


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("cells", [33, pytest.param(52, marks=pytest.mark.thorough)])
def test_error__is_at_most_what_the_method_explains(name, cells):
    for what, error, expected in compared(name, cells):
        assert error <= expected, what


def test_expected_errors__shrink_with_the_grid_down_to_the_tolerance():
    """No case passes by an allowance that hides everything."""
    for name in ("Hertz", "Sneddon", "Maxwell"):
        coarse, fine = ([expected for *_, expected in compared(name, cells)] for cells in (33, 99))
        assert all(after < min(before, 0.02) for before, after in zip(coarse, fine, strict=True))


def scaled_displacement(monkeypatch):
    """A kernel one per cent too soft."""
    sound = Grid.displacement
    monkeypatch.setattr(Grid, "displacement", lambda self, *given: 1.01 * sound(self, *given))


def forgetful_recursion(monkeypatch):
    """A memory that loses two per cent of what it carries."""
    sound = Memory.predict

    def predict(self, *arguments):
        found = sound(self, *arguments)
        return replace(found, carried=0.98 * found.carried)

    monkeypatch.setattr(Memory, "predict", predict)


def stiff_step(monkeypatch):
    """The compliance of a step one per cent too small."""
    sound = Memory.predict

    def predict(self, *arguments):
        found = sound(self, *arguments)
        return replace(found, compliance=0.99 * found.compliance)

    monkeypatch.setattr(Memory, "predict", predict)


@pytest.mark.parametrize(
    ("fault", "cases"),
    [
        (scaled_displacement, ["Hertz", "Johnson", "Zener"]),
        (forgetful_recursion, ["Maxwell", "punch"]),
        (stiff_step, ["Hertz", "Zener", "punch"]),
    ],
)
def test_broken_solver__exceeds_the_expected_error(fault, cases, monkeypatch):
    fault(monkeypatch)
    for name in cases:
        assert any(not error <= expected for _, error, expected in compared(name, 65)), name
