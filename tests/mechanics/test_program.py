"""Loading programs: values, corners, what is refused."""

import inspect
import math

import pytest
from support import refused

import roughvisc as rv
from roughvisc.mechanics.program import Slide

PRESSED = rv.Program().load(1.0, over=1.0)


def test_chain__adds_segments_in_order():
    program = rv.Program().load(2.0, over=0.5).hold(3.0, control="approach").approach(1e-6, over=0.0)
    assert [s.control for s in program.segments] == ["load", "approach", "approach"]
    assert program.corners == [0.0, 0.5, 3.5, 3.5]
    assert program.prescribed(0, 0.25, 0.0) == pytest.approx(1.0)
    assert program.prescribed(1, 1.5, 7e-6) == 7e-6
    assert program.largest_load == 2.0


@pytest.mark.parametrize(
    "add",
    [
        lambda chain: chain.load(2.0, over=1.0),
        lambda chain: chain.hold(1.0, "load"),
        lambda chain: chain.table([0, 1], [0.5, 2.0]),
        lambda chain: chain.cycle(1.0, 0.5, 2.0, 5),
    ],
)
def test_chain__is_the_sum_of_its_parts(add):
    assert add(PRESSED.hold(1.0)) == PRESSED.hold(1.0) + add(rv.Program())


def test_chain__has_no_method_of_the_class():
    methods = inspect.getmembers(PRESSED, inspect.ismethod)
    assert {"load", "table", "cycle"} <= {name for name, _ in methods}
    assert [name for name, method in methods if method.__self__ is not PRESSED] == []
    assert rv.Program.table([0, 1], [0.5, 2.0]) == rv.Program().table([0, 1], [0.5, 2.0])


def test_table__that_begins_at_zero_begins_there():
    assert PRESSED.table([0, 1], [0, 2]) == PRESSED.load(0.0, over=0.0).load(2.0, over=1.0)
    assert PRESSED.load(0.0, over=1.0).table([0, 1], [0, 2]) == PRESSED.load(0.0, over=1.0).load(2.0, over=1.0)


def test_slide__keeps_what_is_controlled_and_takes_its_time():
    program = PRESSED.hold(1.0, control="approach").slide("2 mm", speed="1 mm/s").slide(1e-3, over=4.0, direction="-y")
    assert [(s.control, s.duration, s.end) for s in program.segments[1:]] == [
        ("approach", 1.0, None),
        ("approach", 2.0, None),
        ("approach", 4.0, None),
    ]
    assert program.segments[3].slide == Slide(1e-3, "-y")
    assert rv.Program().pressure(1e3, over=0).slide(1e-3, speed=1.0).on_area(2.0).segments[1].slide == Slide(1e-3)


def test_table__ramps_between_rows_and_jumps_within_a_time():
    program = rv.Program.table([0, 1, 1, 3], [0.5, 2, 1, 1])
    assert [(s.duration, s.end) for s in program.segments] == [(0, 0.5), (1, 2), (0, 1), (2, 1)]


def test_cycle__is_a_sine_about_its_mean():
    program = rv.Program().load(3.0, over=1.0).cycle(3.0, 1.0, period=2.0, cycles=2.5)
    assert program.duration == 6.0
    assert [program.prescribed(2, 1 + t, 3.0) for t in (0, 0.5, 1.0, 1.5)] == pytest.approx([3, 4, 3, 2])
    assert program.largest_load == 4.0


@pytest.mark.parametrize(
    ("make", "key", "found"),
    [
        (lambda: rv.Program.cycle(1.0, 0.5, 1e305, 1e6), "cycles", math.inf),
        (lambda: PRESSED.load(1.0, over=-1), "over", -1),
        (lambda: PRESSED.load(math.nan, over=1), "load", math.nan),
        (lambda: PRESSED.hold(1.0, control="force"), "control", "force"),
        (lambda: rv.Program.table([0, 2, 1], [0, 1, 2]), "times.2", 1),
        (lambda: rv.Program.table([1, 2], [0, 1]), "times.0", 1),
        (lambda: rv.Program.table([0], [0, 1]), "values", 2),
        (lambda: PRESSED.slide(0.0, speed=1.0), "slide", 0.0),
        (lambda: PRESSED.slide(1e-3, speed="2 m"), "speed", "2 m"),
        (lambda: PRESSED.slide(1e-300, speed=1e300), "over", 0.0),
        (lambda: PRESSED.slide(1e-3), "speed", None),
        (lambda: PRESSED.slide(1e-3, speed=1, over=1), "speed", 1),
        (lambda: PRESSED.slide(1e-3, speed=1, direction="z"), "direction", "z"),
    ],
)
def test_bad_arguments__are_refused_by_name(make, key, found):
    with refused(key, found):
        make()


def test_quantities__are_numbers_or_strings_with_units():
    said = rv.Program().load("1 mN", over="50 ms").hold("1 min").approach("2 um", over=0).pressure("3 kPa", over="1 s")
    meant = rv.Program().load(1e-3, over=0.05).hold(60.0).approach(2e-6, over=0.0).pressure(3e3, over=1.0)
    assert said == meant
    assert rv.Program.table(["0 ms", "20 ms"], ["0 N", "5 mN"]) == rv.Program.table([0, 0.02], [0, 5e-3])
    assert rv.Program.cycle("2 mN", "1 mN", "4 ms", 3) == rv.Program.cycle(2e-3, 1e-3, 4e-3, 3)


def test_pressure__is_a_load_on_an_area():
    program = rv.Program().pressure(2e5, over=0.5).hold(1.0).hold(2.0, control="approach")
    program += rv.Program.cycle(4e5, 1e5, 0.5, 2, control="pressure")
    on = program.on_area(3e-6)
    assert [s.control for s in on.segments] == ["load", "load", "approach", "load", "load"]
    assert [s.end for s in on.segments] == pytest.approx([0.6, None, None, 1.2, 1.2])
    assert on.segments[4].amplitude == pytest.approx(0.3)
    assert on.corners == program.corners
    assert on.largest_load == pytest.approx(1.5)
    loads = rv.Program().load(1.0, over=1.0)
    assert loads.on_area(3e-6) == loads
