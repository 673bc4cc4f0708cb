"""Agreement of the leak rate with an independent program, where it is installed: `pip install .[peers]`."""

import numpy as np
import pytest
from support import rough_gap

from roughvisc.mechanics.transport import flow

transport = pytest.importorskip("reynoldsflow.transport")


def peer_conductance(gap):
    """Flow through a unit square whose sides across the flow meet, of a mobility of the gap cubed; None if closed."""
    filtered, _, flux = transport.solve_fluid_problem(gap, solver="scipy-spsolve")
    return None if flux is None else transport.compute_total_flux(filtered, flux, len(gap))[0]


@pytest.mark.parametrize("part", [0.0, 0.2, 0.35, 0.9])
@pytest.mark.parametrize("cells", [32, 47])
def test_rough_gap__agrees_with_reynoldsflow(cells, part):
    whole = rough_gap((cells, cells), slope=0.7)
    gap = np.maximum(whole - np.quantile(whole, part), 0.0) / np.ptp(whole)
    expected, found = peer_conductance(gap), flow(gap, (1 / cells, 1 / cells), wrap=True)
    assert (found.conductance == 0) == (expected is None) == (part == 0.9)
    if expected is not None:
        assert 12 * found.conductance == pytest.approx(expected, rel=1e-8, abs=0)
