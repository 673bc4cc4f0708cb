"""What the tests of the trade share."""

import pytest


@pytest.fixture(autouse=True)
def timed_once(monkeypatch):
    """Runs are timed once and not three times: no test asserts a time."""
    monkeypatch.setattr("roughvisc.study.trade.bench._REPEATS", 1)
