"""The solver compared with closed forms; the comparison fails on a solver that is broken in any of its parts."""

from dataclasses import replace

import pytest
from references.closed_cases import CASES

from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.memory import Memory


def compared(name, cells):
    return list(CASES[name][1](cells))


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.thorough if name == "Kelvin-Voigt" else ()) for name in CASES]
)
@pytest.mark.parametrize("cells", [33, pytest.param(52, marks=pytest.mark.thorough)])
def test_error__is_at_most_what_the_method_explains(name, cells):
    for what, error, expected in compared(name, cells):
        assert error <= expected, what


def test_expected_errors__shrink_with_the_grid_down_to_the_tolerance():
    """No case passes by an allowance that hides everything."""
    for name in ("Hertz", "Sneddon", "Maxwell"):
        coarse, fine = ([expected for *_, expected in compared(name, cells)] for cells in (33, 99))
        assert all(after < min(before, 0.02) for before, after in zip(coarse, fine, strict=True))


def scaled(method, field, factor):
    """A method of a memory whose result has another value in one field."""
    return lambda self, *given: replace(found := method(self, *given), **{field: factor * getattr(found, field)})


@pytest.mark.parametrize(
    ("owner", "method", "broken", "cases"),
    [
        (Grid, "displacement", lambda sound: lambda *given: 1.01 * sound(*given), ["Hertz", "Johnson", "Zener"]),
        (Memory, "predict", lambda sound: scaled(sound, "carried", 0.98), ["Maxwell", "punch"]),
        (Memory, "predict", lambda sound: scaled(sound, "compliance", 0.99), ["Hertz", "Zener", "punch"]),
    ],
    ids=["kernel too soft", "memory that forgets", "step too stiff"],
)
def test_broken_solver__exceeds_the_expected_error(owner, method, broken, cases, monkeypatch):
    monkeypatch.setattr(owner, method, broken(getattr(owner, method)))
    for name in cases:
        assert any(not error <= expected for _, error, expected in compared(name, 65)), name
