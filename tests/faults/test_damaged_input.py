"""Random edits of studies and of tables: each gives values, or a RoughviscError that names the file."""

import contextlib
import re
import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st
from strategies import examples
from support import BALL, FRICTION, LOADS, ROUGH

import roughvisc as rv

MACHINE = '"Time [s]","Force [mN]"\n0,0\n0.1,4\n0.2,7\n0.4,5.5\n'
#: Values of the wrong kind, size, sign or unit, and signs that mean something to TOML or a table.
TOKENS = (
    *("1e400", "-1e308", "1e-320", "nan", "-inf", "0", "-1", "1_0", "99999999999999999999", "true", '""', '"\\u0000"'),
    *('"1 parsec"', '"-3 mm"', '"5 %"', '"1 MPa^-2 s"', "[]", "[[]]", "{}", "[1, 2, 3]", '["a"]', "{a = 1}", "#", ";"),
    *(
        "1979-05-27T07:32:00Z",
        "'/dev/zero'",
        "'/'",
        "'.'",
        '"$$"',
        '"\\u001b[2J"',
        "\t",
        "\r",
        "\n",
        '"',
        "\ufeff",
        "µ",
    ),
)
HUNDRED = examples(100, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])


@st.composite
def edited_texts(draw, texts):
    """Texts in which some words, numbers or signs are lost, exchanged, doubled or moved."""
    parts = re.findall(r"\s+|[\w.+-]+|.", draw(st.sampled_from(texts)), re.S)
    places = st.integers(0, len(parts) - 1)
    for _ in range(draw(st.integers(1, 2))):
        at, lost, other = draw(places), draw(st.integers(0, 3)), draw(places)
        new = draw(st.sampled_from(TOKENS) | st.text(max_size=4) | st.just("".join(parts[other : other + 3])))
        parts[at : at + lost] = [new]
    return "".join(parts)


@contextlib.contextmanager
def read_or_refused(path):
    """Allow a RoughviscError that names the file, and warnings to the user."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            yield
        except rv.RoughviscError as error:
            if path.name not in str(error):
                raise


@pytest.mark.thorough
@HUNDRED
@given(text=edited_texts([BALL, ROUGH + LOADS, FRICTION]))
def test_edited_study__gives_a_case_or_names_the_file(text, tmp_path):
    path = tmp_path / "edited.toml"
    path.write_text(text, encoding="utf-8", errors="replace", newline="")
    cases = []
    with read_or_refused(path):
        cases = rv.read_cases(path)
    for case in cases[:2]:
        with read_or_refused(path):
            assert np.isfinite(case.height().values).any()
        assert case.material.contact_compliance(1.0) > 0


@HUNDRED
@given(text=edited_texts([MACHINE]))
def test_edited_load_table__gives_a_program_or_names_the_file(text, tmp_path):
    path = tmp_path / "edited.csv"
    path.write_text(text, encoding="utf-8", errors="replace", newline="")
    with read_or_refused(path):
        assert 0 < rv.read_program(path, load="Force").duration < np.inf
