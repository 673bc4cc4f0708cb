"""Every study that ships runs, and ends with an honest result."""

import pathlib

import numpy as np
import pytest

from roughvisc.study.case import read_cases
from roughvisc.study.run import run

FOLDER = pathlib.Path(__file__).parents[1] / "workflows"
STUDIES = sorted(FOLDER.glob("*.toml"))


@pytest.mark.parametrize("path", STUDIES, ids=lambda p: p.stem)
def test_study__runs(path, tmp_path):
    for case in read_cases(path):
        ds = run(case, tmp_path, progress=False)
        assert float(ds.force[-1]) > 0
        assert (np.diff(ds.contact_area) >= 0).all(), "under a load that is held, the contact grows"
        assert float(ds.time_error.max()) <= case.settings.solve.tolerance
        assert 0.01 < float(ds.contact_fraction[-1]) < 0.6
