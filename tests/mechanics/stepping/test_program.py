"""Loading programs: values, corners, what is refused."""

import math

import pytest

import roughvisc as rv


def test_chain__adds_segments_in_order():
    program = rv.Program().load(2.0, over=0.5).hold(3.0, control="approach").approach(1e-6, over=0.0)
    assert [s.control for s in program.segments] == ["load", "approach", "approach"]
    assert program.corners == [0.0, 0.5, 3.5, 3.5]
    assert program.segments[0].value(0.25, 0.0) == pytest.approx(1.0)
    assert program.segments[1].value(1.0, 7e-6) == 7e-6
    assert program.largest_load == 2.0


def test_hold__keeps_the_control_it_follows():
    assert rv.Program().approach(1e-6, over=1.0).hold(2.0).segments[1].control == "approach"


def test_table__ramps_between_rows_and_jumps_within_a_time():
    program = rv.Program.table([0, 1, 1, 3], [0.5, 2, 1, 1])
    assert [(s.duration, s.end) for s in program.segments] == [(0, 0.5), (1, 2), (0, 1), (2, 1)]


def test_cycle__is_a_sine_about_its_mean():
    program = rv.Program().load(3.0, over=1.0) + rv.Program.cycle(3.0, 1.0, period=2.0, cycles=2.5)
    wave = program.segments[-1]
    assert program.duration == 6.0
    assert [wave.value(t, 3.0) for t in (0, 0.5, 1.0, 1.5)] == pytest.approx([3, 4, 3, 2])
    assert program.largest_load == 4.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rv.Program().load(-1.0, over=1), r"load reaches -1\.0 N: expected no negative load"),
        (lambda: rv.Program().load(1.0, over=-1), r"duration of a load segment is -1"),
        (lambda: rv.Program().load(math.nan, over=1), r"load is nan: expected a finite number \[N\]"),
        (lambda: rv.Program().hold(1.0, control="force"), r"control is 'force': expected 'load' or 'approach'"),
        (lambda: rv.Program.cycle(1.0, 2.0, 1.0, 3), r"load reaches -1\.0 N"),
        (lambda: rv.Program.table([0, 2, 1], [0, 1, 2]), r"table row 2: time 1 s after 2\.0 s"),
        (lambda: rv.Program.table([1, 2], [0, 1]), r"table starts at time 1 s: expected 0"),
        (lambda: rv.Program.table([0], [0, 1]), r"table has 1 times and 2 values"),
    ],
)
def test_bad_programs__are_named(make, message):
    with pytest.raises(rv.InputError, match=message):
        make()
