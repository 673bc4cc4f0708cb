"""Loading programs from tables of test machines: columns, decimal marks, time zero, noise, thinning."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import refused

import roughvisc as rv
from roughvisc.study.case import Case, read_cases, read_study
from roughvisc.study.machine_history import thinned

STUDY = """
[surface]
generate = "sphere"
radius = "1 mm"
size = "0.2 mm"
shape = [8, 7]
[material]
model = "elastic"
shear_modulus = "1 MPa"
[[program]]
"""
NAMES = {"time": "t", "load": "F"}
#: a trapezium of load: up within 1 s, held to 3 s, down within 0.5 s
TIMES, LOADS = (0, 1, 3, 3.5), (0, 0.2, 0.2, 0)


def write(folder, text, encoding="utf-8"):
    path = folder / "machine.csv"
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(
    ("text", "encoding", "names"),
    [
        ("Time [s],Load [mN]\n0,0\n1,200\n3,200\n3.5,0", "utf-8", {"time": "Time", "load": "Load"}),
        ("Kraft [mN];Zeit [ms]\n0;0\n200;1000\n200;3000\n0;3500", "utf-8-sig", {"time": "zeit", "load": "Kraft [mN]"}),
        (
            '"Prüfung";"Gummi 3"\r\n"Rate";"1,5"\r\n\r\n"Prüfzeit (s)";"Kraft (N)"\r\n'
            "0,0;0,0\r\n1,0;0,2\r\n3,0;0,2\r\n3,5;0,0",
            "cp1252",
            {"time": "Prüfzeit", "load": "Kraft"},
        ),
        ("t (s)\tF (mN)\n0\t0\n1,000\t200\n3,000\t200\n3,500\t0", "utf-16", NAMES),
        ("Time (s)  Force (N)\n0 0\n1 2e-1\n3 2E-1\n3.5 0", "utf-8", {"time": "Time", "load": "Force"}),
        ("t [s],F\n0,0\n1,0.2\n3,0.2\n3.5,0", "utf-8", {"time": "t", "load": "F [N]"}),
        ("t [ms];F [uN]\n0;0\n1.000,0;200.000,0\n3.000,0;200.000,0\n3.500,0;0", "utf-8", NAMES),
        (
            '"t [ms]","F [mN]"\n"0","0"\n"1,000.0","200"\n"3,000.0","200"\n"3,500.0","0"',
            "utf-8",
            NAMES,
        ),
    ],
    ids=["commas", "semicolons", "german", "tabs", "blanks", "unit by hand", "points group", "commas group"],
)
def test_columns__by_name_in_their_units(tmp_path, text, encoding, names):
    assert rv.read_program(write(tmp_path, text, encoding), **names) == rv.Program.table(TIMES, LOADS)


@pytest.mark.parametrize(
    ("text", "keys", "at"),
    [
        ("t [s],F [N]\n0,0", {"time": "t", "load": "Force"}, "Force"),
        ("t/s,F/N\n0,0\n1,1", NAMES, r"t \[s\], F \[N\]"),
        ("t [s],F\n0,0\n1,1", NAMES, "unit"),
        ("t [s],F [mm]\n0,0\n1,1", NAMES, "load"),
        ("t [s],F [N],F [mN]\n0,0,0", NAMES, "line 1"),
        ("t [s],F [N]\n0,0\n1,?", NAMES, "line 3"),
        ("t [s];F [N]\n0;0,5\n1;0.5", NAMES, "decimal"),
        ("t [s],F [N]\n0,0\n2,1\n1,1", NAMES, "line 4"),
        ("t [s],F [N]\n0,0\n1,1\n1,2\n1,3", NAMES, "lines 3 to 5"),
        ("t [s],F [N]\n0,0\n1,1\n2,-0.1", NAMES, "load"),
        ("t [s],F [N]\n0,0\n1,-1", NAMES, "factor"),
        ("t [s],F [N]", NAMES, "line 1"),
        ("t [s],F [N]\nx0,y0\n1,0.2\n2,0.3", NAMES, "line 2"),
    ],
)
def test_bad_tables__are_named_with_the_line(tmp_path, text, keys, at):
    path = write(tmp_path, text)
    with pytest.raises(rv.InputError, match=rf"machine\.csv.*{at}"):
        rv.read_program(path, **keys)


def test_zero_and_factor__choose_the_origin_and_the_sign(tmp_path):
    path = write(tmp_path, "t [s],x [mm]\n11,4\n12,3.5\n13,3\n14,3")  # downward motion, touch at 4 mm
    program = rv.read_program(path, time="t", approach="x", zero="4 mm", factor=-1, thin=0)
    assert program == rv.Program.table([0, 1, 2, 3], [0, 0.5e-3, 1e-3, 1e-3], control="approach")
    assert "11 s in the file is time zero" in program.note


def test_noise_below_zero__counts_as_zero_up_to_its_limit(tmp_path):
    path = write(tmp_path, "t [s],F [mN]\n0,-1\n1,100\n2,-0.5\n3,0")
    program = rv.read_program(path, time="t", load="F", thin=0)
    assert program == rv.Program.table([0, 1, 2, 3], [0, 0.1, 0, 0])
    assert "2 rows below zero count as zero, the lowest -0.001 N" in program.note
    write(tmp_path, "t [s],F [mN]\n0,-1.1\n1,100")
    with pytest.raises(rv.InputError, match=r"machine\.csv: load falls to -0\.0011 N"):
        rv.read_program(path, time="t", load="F", thin=0)


def distance(times, values, kept):
    """Largest distance of the rows from the straight lines between those kept, which include both rows of a jump."""
    worst = 0.0
    for first, last in itertools.pairwise(kept):
        if times[last] > times[first]:
            inside = slice(first, last + 1)
            worst = max(
                worst,
                np.abs(np.interp(times[inside], times[[first, last]], values[[first, last]]) - values[inside]).max(),
            )
        else:
            assert last == first + 1
    return worst


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.sampled_from([0.0, 0.5, 1.0, 3.0]), st.floats(0, 10)), min_size=3, max_size=80),
    st.floats(0.01, 3),
)
def test_thinned__passes_every_row_within_the_tolerance(rows, tolerance):
    steps, values = map(np.array, zip(*rows, strict=True))
    steps[1:][(steps[1:] == 0) & (steps[:-1] == 0)] = 1.0  # at most two rows at one time
    times = np.cumsum(steps)
    kept = thinned(times, values, tolerance)
    assert kept[0] == 0
    assert kept[-1] == len(times) - 1
    assert (np.diff(kept) > 0).all()
    assert distance(times, values, kept) <= tolerance * (1 + 1e-9)


def test_study__takes_columns_by_key_and_keeps_the_case_whole(tmp_path):
    path = write(tmp_path, "Zeit [s];Druck [kPa];Weg [um]\n2,5;0;0\n3,5;20;2\n4,5;20;1")
    study = tmp_path / "study.toml"
    study.write_text(STUDY + 'table = { file = "machine.csv", time = "Zeit", pressure = "Druck" }')
    case = read_study(study)
    assert case.program == rv.Program.table([0, 1, 2], [0, 2e4, 2e4], control="pressure")
    assert case.program.note.startswith("machine.csv: 3 rows became 2 segments")
    motion = STUDY + 'table = { file = "machine.csv", time = "Zeit", approach = "Weg" }'
    study.write_text(motion + '\n[sweep]\n"program.0.table.thin" = [0, "1 um"]')
    exact, thin = read_cases(study)
    assert exact.program == rv.Program.table([0, 1, 2], [0, 2e-6, 1e-6], control="approach")
    assert thin.varied == {"program.0.table.thin": "1 um"}
    path.unlink()
    again = Case.from_json(case.to_json())
    assert again.key == case.key
    assert again.program.note == case.program.note


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ('{ file = "machine.csv", laod = "F" }', "program.0.table.laod"),
        ('{ file = "gone.csv" }', "program.0.table.file"),
        ('{ file = "machine.csv", zero = "1 mm" }', "program.0.table.zero"),
        ('{ file = "machine.csv", thin = "1 s" }', "program.0.table.thin"),
        ('{ file = "machine.csv", time = "t" }', "program.0.table"),
    ],
)
def test_table__is_refused_at_the_key(tmp_path, table, key):
    write(tmp_path, "t [s];F [N]\n0;0\n1;1")
    study = tmp_path / "study.toml"
    study.write_text(STUDY + f"table = {table}")
    with refused(key):
        read_study(study)
