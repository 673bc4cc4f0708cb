"""``[[program]]`` and tables of test machines: segments, columns, decimal marks, time zero, noise, thinning."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples
from support import refused

import roughvisc as rv
from roughvisc.mechanics.program import Program
from roughvisc.study.case import Case
from roughvisc.study.machine_history import thinned

NAMES = {"time": "t", "load": "F"}
#: a trapezium of load: up within 1 s, held to 3 s, down within 0.5 s
TIMES, LOADS = (0, 1, 3, 3.5), (0, 0.2, 0.2, 0)


#: Text export of JPK: the second segment has its columns in another order, and one more.
JPK = """# TEXT EXPORT
# springConstant: 0.5
#
# segment: extend
# columns: height vDeflection seriesTime
# fancyNames: "Deflection" "Deflection (vertical)" "Series Time"
# units: m mN s
#
2e-6 0 0
0 2.0e+2 1

#
# segment: pause
# columns: seriesTime vDeflection height time
# fancyNames: "Series Time" "Deflection (vertical)" "Deflection" "Segment Time"
# units: s mN m s
#
3 200 0 0
3.5 0 0 0.5
"""


def write(folder, text, encoding="utf-8"):
    path = folder / "machine.csv"
    path.write_bytes(text.encode(encoding))
    return path


def test_program__every_segment(read_one):
    cycle, motion = {"mean": 1, "amplitude": 0.5, "period": 2, "cycles": 3}, {"control": "approach"}
    case = read_one(
        program=[
            {"load": "2 N", "over": 0},
            {"hold": 1, **motion},
            {"approach": "3 um", "over": 1},
            {"cycle": cycle},
            {"cycle": cycle | {"mean": "3 um", "amplitude": "1 um"}, **motion},
            {"table": {"times": [0, 1, "2 s"], "values": [0, 1, "500 mN"]}},
            {"table": {"times": [0, 1], "values": ["1 um", "2 um"]}, **motion},
        ]
    )
    assert case.program == (
        Program().load(2.0, over=0.0).hold(1.0, control="approach").approach(3e-6, over=1.0)
        + Program.cycle(1.0, 0.5, 2.0, 3)
        + Program.cycle(3e-6, 1e-6, 2.0, 3, control="approach")
        + Program().load(0.0, over=0.0)  # a table that begins at zero begins there
        + Program.table([0, 1, 2], [0, 1, 0.5])
        + Program.table([0, 1], [1e-6, 2e-6], control="approach")
    )


def test_table__of_a_file_is_kept_in_the_case(read_one, tmp_path):
    path = write(tmp_path, "# by hand\ntime [ms]; load (mN)\n0; 0\n1500; 2000\n2000; 1000\n")
    plain = read_one(program=[{"table": {"file": "machine.csv"}}])
    assert plain.program == Program.table([0, 1.5, 2], [0, 2, 1])
    write(tmp_path, "Zeit [s];Druck [kPa]\n2,5;0\n3,5;20\n4,5;20")
    named = read_one(program=[{"table": {"file": "machine.csv", "time": "Zeit", "pressure": "Druck"}}])
    assert named.program == Program.table([0, 1, 2], [0, 2e4, 2e4], control="pressure")
    assert named.program.note.startswith("machine.csv: 3 rows became 2 segments")
    path.unlink()
    for case in (plain, named):
        again = Case.from_json(case.to_json())
        assert (again.key, again.program, again.program.note) == (case.key, case.program, case.program.note)


def test_thin__is_swept(read, tmp_path):
    write(tmp_path, "Zeit [s];Weg [um]\n2,5;0\n3,5;2\n4,5;1")
    motion = [{"table": {"file": "machine.csv", "time": "Zeit", "approach": "Weg"}}]
    exact, thin = read(program=motion, sweep={"program.0.table.thin": [0, "1 um"]})
    assert exact.program == Program.table([0, 1, 2], [0, 2e-6, 1e-6], control="approach")
    assert thin.varied == {"program.0.table.thin": "1 um"}


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
        ("t [s],F\n0,0\n1,0.2\n3,0.2\n3.5,0", "utf-8", {"time": "t", "load": "F [N]"}),
        (JPK, "utf-8", {"time": "Series Time", "load": "Deflection (vertical)"}),
    ],
    ids=["commas", "semicolons", "german", "unit by hand", "jpk"],
)
def test_columns__by_name_in_their_units(tmp_path, text, encoding, names):
    assert rv.read_program(write(tmp_path, text, encoding), **names) == Program.table(TIMES, LOADS)


@pytest.mark.parametrize(
    ("text", "keys", "at"),
    [
        ("t [s],F [N]\n0,0", {"time": "t", "load": "Force"}, "Force"),
        ("t [s],F [mm]\n0,0\n1,1", NAMES, "load"),
        ("t [s],F [N],F [mN]\n0,0,0", NAMES, "line 1"),
        ("t [s],F [N]\n0,0\n1,?", NAMES, "line 3"),
        ("t [s],F [N]\n0,0\n2,1\n1,1", NAMES, "line 4"),
        ("t [s],F [N]\n0,0\n1,1\n1,2\n1,3", NAMES, "lines 3 to 5"),
        ("t [s],F [N]\n0,0\n1,1\n2,-0.1", NAMES, "load"),
        ("t [s],F [N]\n0,0\n1,-1", NAMES, "factor"),
        ("t [s],F [N]\n0,0\n1,1\n2,1\n3,-0.005\n4,-0.1\n5,-0.2", NAMES, "adhesion.* line 6"),
        (JPK + "4 100", {"time": "Series Time", "load": "Deflection (vertical)"}, "line 20"),
        (JPK, {"time": "Segment Time", "load": "Deflection (vertical)"}, "Series Time"),
        (JPK.replace("s mN m s", "s N m s"), {"time": "Series Time", "load": "Deflection (vertical)"}, "line 18"),
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
    assert program == Program.table([0, 1, 2, 3], [0, 0.5e-3, 1e-3, 1e-3], control="approach")
    assert "11 s in the file is time zero" in program.note


def test_noise_below_zero__counts_as_zero_up_to_its_limit(tmp_path):
    path = write(tmp_path, "t [s],F [mN]\n0,-1\n1,100\n2,-0.5\n3,0")
    program = rv.read_program(path, time="t", load="F", thin=0)
    assert program == Program.table([0, 1, 2, 3], [0, 0.1, 0, 0])
    assert "2 rows below zero count as zero, the lowest -0.001 N" in program.note
    write(tmp_path, "t [s],F [mN]\n0,-1.1\n1,100")
    with pytest.raises(rv.InputError, match=r"machine\.csv: load falls to -0\.0011 N"):
        rv.read_program(path, time="t", load="F", thin=0)


def test_thinned__keeps_the_ends_of_straight_lines():
    times = np.arange(60.0)
    assert thinned(times, np.minimum(times, 30.0), 1e-9).tolist() == [0, 30, 59]


@examples(60)
@given(
    st.lists(st.tuples(st.sampled_from([0.0, 0.5, 1.0, 3.0]), st.floats(0, 10)), min_size=3, max_size=40),
    st.floats(0.01, 3),
)
def test_thinned__goes_as_far_as_every_row_is_within_the_tolerance(rows, tolerance):
    """And no farther: a line to any later row would miss a row between, or pass a jump, both rows of which are kept."""
    steps, values = map(np.array, zip(*rows, strict=True))
    steps[1:][(steps[1:] == 0) & (steps[:-1] == 0)] = 1.0  # at most two rows at one time
    times = np.cumsum(steps)
    kept = thinned(times, values, tolerance)
    assert (kept[0], kept[-1]) == (0, len(times) - 1)
    assert (np.diff(kept) > 0).all()

    def missed(first, last):
        inside = slice(first, last + 1)
        line = np.interp(times[inside], times[[first, last]], values[[first, last]])
        return np.abs(line - values[inside]).max() / tolerance

    for first, last in itertools.pairwise(kept):
        if times[last] == times[first]:  # a jump
            assert last == first + 1
            continue
        assert missed(first, last) <= 1 + 1e-9
        for row in range(last + 1, len(times)):
            if times[row] == times[row - 1]:
                break
            assert missed(first, row) >= 1 - 1e-9


@pytest.mark.parametrize(
    ("program", "key"),
    [
        ({"load": 1}, "program"),
        (None, "program"),
        ([{"cycle": {"mean": 1, "amplitude": 2, "period": 1, "cycles": 1}}], "program.0.cycle.amplitude"),
        ([{"table": {"times": [0, 2, 1], "values": [0, 1, 2]}}], "program.0.table.times.2"),
        ([{"table": {"file": "length.csv"}}], "program.0.table"),
        ([{"table": {"file": "named.csv"}}], "program.0.table"),
        ([{"table": {"file": "back.csv"}}], "program.0.table"),
        ([{"table": {"file": "gone.csv"}}], "program.0.table.file"),
        ([{"table": "machine.csv"}], "program.0.table"),
        ([{"table": {"file": "machine.csv", "time": "t", "load": "F"}, "control": "load"}], "program.0.table.control"),
        ([{"table": {"file": "machine.csv", "zero": "1 mm"}}], "program.0.table.zero"),
        ([{"table": {"file": "machine.csv", "time": "t"}}], "program.0.table"),
    ],
)
def test_program__is_refused_at_the_key(read, tmp_path, program, key):
    rows = {"length": "time [ms], load [mm]\n0, 0", "named": "time [s], force [N]\n0, 0"}
    rows["back"] = "time [s], load [N]\n0, 0\n2, 1\n1, 3"
    for name, text in (rows | {"machine": "t [s];F [N]\n0;0\n1;1"}).items():
        (tmp_path / f"{name}.csv").write_text(text)
    with refused(key):
        read(program=program)
