"""What the advice on a scan says of heights that are not Gaussian."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.topography.inspection import inspect_scan
from roughvisc.views.console.scan_advice import advice


def told(height):
    found = inspect_scan(height)
    return found, next((seen, do) for what, seen, do in advice(found) if what == "Heights")


def test_advice__heights_with_another_kurtosis_ask_for_surrogates():
    """Of the product of two cosines the kurtosis is (3/8)^2 / (1/4)^2 = 2.25; of Gaussian heights 3."""
    found, (seen, do) = told(rv.wavy(1e-6, 2e-4, 1e-3, (60, 50)))
    assert found.kurtosis == pytest.approx(2.25)
    assert "plateaus, or few long waves" in seen
    assert "realisations = 24" in do
    rough = rv.self_affine(1e-3, (90, 80), hurst=0.8, rms_slope=0.1, rolloff=5e-5, amplitudes="gaussian", seed=1)
    assert told(rough)[1][1] == "no action needed"
    found, (seen, _) = told(rough.copy(data=np.exp(rough.values / float(rough.std()))))
    assert found.kurtosis > 4
    assert "summits or pits that stand out" in seen
