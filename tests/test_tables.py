"""Tables of numbers in text: written in any way they are read back as the same numbers, or refused by name."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import ENCODINGS

from roughvisc.errors import InputError
from roughvisc.tables import Wanted, read_table

TIME, LOAD = {"time": Wanted("time", "s")}, {"load": Wanted("load", "N")}
PULL = {"time": Wanted("time", "s"), "züge": Wanted("Züge", "N")}
#: separator, what stands around each cell, decimal mark
STYLES = [(",", "", "."), (",", '"', "."), (",", '"', ",")]
STYLES += [(separator, quote, mark) for separator in (";", "\t") for quote in ("", '"') for mark in ".,"]
BLANKS = [(" ", "", "."), ("   ", "", ",")]
HEADINGS = ("{}[{}]", "{} [{}]", "{} ({})", "{}  [ {} ]")
UNITS = {"time": {"s": 1.0, "ms": 1e-3, "h": 3600.0}, "züge": {"N": 1.0, "mN": 1e-3, "kN": 1e3}}


@st.composite
def cells(draw, mark):
    """A number as it is written, and its value. Three digits behind a comma might be thousands."""
    value = draw(st.integers(-(10**14), 10**14)) / 10 ** draw(st.sampled_from([0, 1, 2, 4]))
    text = f"{value:{draw(st.sampled_from(['.9e', '.0f', '.1f', '.2f', '.4f']))}}"
    return text.replace(".", mark), float(text)


@st.composite
def tables(draw):
    """A table as text, and the numbers that are in it."""
    separator, quote, mark = draw(st.sampled_from(STYLES + BLANKS))
    rows = draw(st.lists(st.tuples(cells(mark), cells(mark)), min_size=1, max_size=8))
    lines = [{"time": time, "züge": pull, "n": "7"} for (time, _), (pull, _) in rows]
    heading = draw(st.sampled_from(HEADINGS))
    units = {key: draw(st.sampled_from([*known])) for key, known in UNITS.items()}
    case = draw(st.sampled_from([str.lower, str.title, str.upper]))
    lines.insert(0, {key: heading.format(case(key), unit) for key, unit in units.items()} | {"n": "n"})
    names = draw(st.permutations(["time", "züge", "n"]))
    text = [separator.join(f"{quote}{line[name]}{quote}" for name in names) for line in lines]
    above = st.lists(st.sampled_from(["Prüfbericht", "", "# 5", "Rate;1,5", "a, b"]), max_size=3)
    end = draw(st.sampled_from(["\n", "\r\n"]))
    text = end.join([*draw(above), *text, *[""] * draw(st.integers(0, 2))])
    values = {key: [row[at][1] * UNITS[key][units[key]] for row in rows] for at, key in enumerate(UNITS)}
    return text, values


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("tables") / "table.csv"


@given(table=tables(), encoding=st.sampled_from([*ENCODINGS]))
def test_table__written_in_any_way_is_read_back(path, table, encoding):
    text, values = table
    path.write_bytes(ENCODINGS[encoding](text))
    read, lines = read_table(path, PULL)
    assert {*read} == {*values}
    for key, column in values.items():
        np.testing.assert_allclose(read[key], column, rtol=1e-14, err_msg=f"{key} of {text!r}")
    last = max(number for number, line in enumerate(text.splitlines(), 1) if line)
    assert lines == [*range(last + 1 - len(lines), last + 1)]


@pytest.mark.parametrize("heading", ["# made by hand\ntime [s];load [N]", "time [ms],load [mN]\r\n\r\n"])
def test_heading_without_rows__is_refused(heading, tmp_path):
    path = tmp_path / "empty.csv"
    path.write_text(heading)
    with pytest.raises(InputError, match=r"empty\.csv"):
        read_table(path, TIME | LOAD)
    path.write_text("# nothing but a comment\n")
    with pytest.raises(InputError, match=r"empty\.csv"):
        read_table(path, TIME | LOAD)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("0,0\n1,5,2,5\n", "line 3"),
        ('"1,250","2,000"\n"3,125","1,500"\n', "1,250"),
        ("0;1,5\n1;2.25\n", "decimal"),
        ("0;1e999\n1;2\n", "line 2"),
        ('0;0\n1;"2\n2;"3\n', "line 3"),
        ("0;1.250,5\n1;2,0\n", "line 2.*1.250,5"),
        ("0;1'250.5\n1;2.0\n", "line 2.*1'250.5"),
    ],
)
def test_columns__that_could_be_other_numbers_are_refused(text, found, tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(f"time [s]{text[1]}load [N]\n{text}" if text[1] in ",;" else f'"time [s]","load [N]"\n{text}')
    with pytest.raises(InputError, match=rf"table\.csv.*{found}"):
        read_table(path, TIME | LOAD)


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("0;0\n1;2\n", "time [s]; load [N]"),
        ("0 0\n1 2\n", "time [s] load [N]"),
        ("time in s,load in N\n0,0\n1,2\n", "time [s], load [N]"),
        ("time/s;load/N\n0;0\n1;2\n", "time [s]; load [N]"),
        ("time_s;load_N\n0;0\n1;2\n", "time [s]; load [N]"),
        ("time [s];load\n0;0\n1;2\n", "load [N]"),
        ("time;load\ns;N\n0;0\n1;2\n", "time [s]"),
    ],
)
def test_other_headings__are_refused_with_the_heading_to_write(text, written, tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=r"table\.csv") as caught:
        read_table(path, TIME | LOAD)
    assert caught.value.expected == written
    assert repr(written) in str(caught.value)


def test_heading__stated_units_stand_in_for_absent_ones_and_must_agree(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("time,load [mN],ratio\n1,2,3\n")
    ratio = {"ratio": Wanted("ratio", "1"), "rest": Wanted("rest", "Pa", optional=True)}
    read, _ = read_table(path, {"time": Wanted("time [min]", "s")} | LOAD | ratio)
    assert {key: column.tolist() for key, column in read.items()} == {"time": [60.0], "load": [2e-3], "ratio": [3.0]}
    with pytest.raises(InputError, match=r"'mN'.*'N'"):
        read_table(path, {"load": Wanted("load [N]", "N")})


@pytest.mark.parametrize(("unit", "rise"), [("degC", 1.0), ("°C", 1.0), ("degF", 5 / 9), ("K", 1.0)])
def test_temperatures__count_from_the_zero_of_their_unit_and_differences_do_not(unit, rise, tmp_path):
    """20 degrees Celsius are 293.15 K, and a rise by 20 degrees per minute is a third of a kelvin per second."""
    zero = {"K": 0.0, "degF": 459.67 * 5 / 9}.get(unit, 273.15)
    path = tmp_path / "table.csv"
    path.write_text(f"temperature [{unit}];heating [{unit}/min]\n20;20\n-1.5;0\n68.25;1\n")
    read, _ = read_table(path, {"temperature": Wanted("temperature", "K"), "heating": Wanted("heating", "K/s")})
    np.testing.assert_allclose(read["temperature"], zero + rise * np.array([20, -1.5, 68.25]), rtol=1e-14)
    np.testing.assert_allclose(read["heating"], rise * np.array([20, 0, 1]) / 60, rtol=1e-14)


def test_frequencies__are_not_converted_to_angular_ones(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("frequency [rad/s]\n1\n")
    with pytest.raises(InputError, match="frequency"):
        read_table(path, {"frequency": Wanted("frequency", "Hz")})
