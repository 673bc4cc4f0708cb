"""Cases from study files, which are stated as changes of one study."""

import pytest

from roughvisc.study.case import read_cases
from roughvisc.study.case_text import study_text
from roughvisc.study.sweep_table import place

#: A ball on rubber.
BALL = {
    "title": "A ball",
    "surface": {"generate": "sphere", "radius": "10 mm", "size": ["1 mm", 1e-3], "shape": [32, 24]},
    "material": {
        "model": "zener",
        "shear_modulus": "3 MPa",
        "kelvin_modulus": "1 MPa",
        "kelvin_viscosity": "0.1 MPa s",
    },
    "program": [{"load": "2 N", "over": "50 ms"}, {"hold": "5 s"}],
}


@pytest.fixture
def read(tmp_path):
    """Writes a study with other values at some dotted keys, where None removes the key, and reads its cases."""

    def cases(changes=None, **tables):
        stated = BALL | tables
        for key, value in (changes or {}).items():
            stated = place(stated, key, value)
        (tmp_path / "study.toml").write_text(study_text({k: v for k, v in stated.items() if v is not None}))
        return read_cases(tmp_path / "study.toml")

    return cases


@pytest.fixture
def read_one(read):
    """As `read`, of a study with one case."""

    def case(changes=None, **tables):
        (found,) = read(changes, **tables)
        return found

    return case
