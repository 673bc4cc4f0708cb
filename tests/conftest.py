"""What tests of several modules share.

The suite runs with the transforms that everybody has; test_transforms.py compares those of ducc0 with them.
"""

import os

import pytest

os.environ["ROUGHVISC_TRANSFORMS"] = "scipy"

from roughvisc.mechanics.halfspace import HalfSpace


@pytest.fixture
def solved_on(monkeypatch):
    """Shapes of the grids that were solved on, in order."""
    shapes = []
    begin = HalfSpace.__init__

    def noted(self, shape, *rest, **named):
        shapes.append(shape)
        begin(self, shape, *rest, **named)

    monkeypatch.setattr(HalfSpace, "__init__", noted)
    return shapes
