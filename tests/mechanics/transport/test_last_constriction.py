"""How the last constriction closes, against the published exponent."""

import numpy as np
import pytest

from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.transport import flow

CELLS, AMPLITUDE = 128, 0.01
FULL = np.sqrt(2) * np.pi * AMPLITUDE  # pressure of full contact over the contact modulus


WAVE = np.cos(2 * np.pi * (np.arange(CELLS) + 0.5) / CELLS)
CELL = (1 / CELLS, 1 / CELLS)


def conductance(load):
    """Of the gap of a square lattice of bumps, at a load in parts of that of full contact. [-]"""
    undeformed = AMPLITUDE * (1 - WAVE[:, None] * WAVE)
    operator = Grid(undeformed.shape, CELL, "periodic")
    state = solve_contact(operator, undeformed, load=load * FULL * CELLS**2, tolerance=1e-10)
    gap = np.maximum(undeformed + state.displacement - state.approach, 0.0)
    return flow(np.where(state.pressure > 0, 0.0, gap), CELL, wrap=True).conductance


@pytest.mark.long
def test_last_constriction__closes_with_the_exponent_of_dapp_and_mueser():
    """Resistance as ``(L_c - L)^-3.45`` over a decade (W. B. Dapp, M. H. Müser, EPL 109 (2015) 44001)."""
    open_, closed = 0.2, 0.25
    while closed - open_ > 1e-5:
        middle = (open_ + closed) / 2
        open_, closed = (middle, closed) if conductance(middle) > 0 else (open_, middle)
    distance = open_ * np.geomspace(0.01, 0.1, 8)
    found = [conductance(open_ - one) for one in distance]
    exponent = np.polyfit(np.log(distance), np.log(found), 1)[0]
    assert exponent == pytest.approx(3.45, abs=0.1)
