"""``[friction]`` in a study: what it takes, what it refuses, and what identifies its case."""

import pytest
from support import BALL, refused

from roughvisc.experiment.sliding import SteadySliding
from roughvisc.study.case import Case, read_study
from roughvisc.study.si_tables import unit_of

SURFACE = BALL[BALL.index("[surface]") : BALL.index("[[program]]")]
FREE = '[solve]\nboundary = "free"\n'
PERIODIC = '[solve]\nboundary = "periodic"\n'


@pytest.fixture
def read(tmp_path):
    def one(friction, rest=PERIODIC):
        (tmp_path / "slide.toml").write_text(f"{SURFACE}\n[friction]\n{friction}\n{rest}")
        return read_study(tmp_path / "slide.toml")

    return one


@pytest.mark.parametrize(
    ("speeds", "found"),
    [
        ('"3 mm/s"', (3e-3,)),
        ("0.5", (0.5,)),
        ('["1 m/s", 1e-3, "36 km/h", "1 mm/s"]', (1e-3, 1.0, 10.0)),
        ('{ from = "1 um/s", to = "1 m/s", count = 7 }', (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0)),
    ],
)
def test_speeds__are_in_order_and_each_once(read, speeds, found):
    assert read(f'load = "2 N"\nspeeds = {speeds}').experiment == SteadySliding(speeds=found, load=2.0)


def test_case__states_a_curve_and_survives_its_text(read):
    case = read('pressure = "0.2 MPa"\nspeeds = [1, 2]\ndirection = "-y"')
    assert case.experiment == SteadySliding(speeds=[1, 2], pressure=2e5, direction="-y")
    again = Case.from_json(case.to_json())
    assert (again.key, again.experiment) == (case.key, case.experiment)
    assert (unit_of("friction.load"), unit_of("friction.speeds")) == ("N", "m/s")
    assert case.experiment.progress(1.0, 2.0) == "speed 1 of 2"
    with refused("friction", "steady sliding"):
        _ = case.program


@pytest.mark.parametrize(
    ("friction", "rest", "key"),
    [
        ("load = 1", PERIODIC, "friction.speeds"),
        ("speeds = 1", PERIODIC, "friction.load"),
        ('load = 1\nspeeds = "1 m"', PERIODIC, "friction.speeds"),
        ("load = 1\nspeeds = { from = 2, to = 1, count = 3 }", PERIODIC, "friction.speeds.from"),
        ("load = 1\nspeeds = { from = 1, to = 2, count = 1 }", PERIODIC, "friction.speeds.count"),
        ("load = 1\nspeeds = 1\ntime = 1", PERIODIC, "friction.time"),
        ("load = 1\nspeeds = 1", FREE, "solve.boundary"),
        ("load = 1\nspeeds = 1", PERIODIC + "time_step = 1", "solve.time_step"),
        ("load = 1\nspeeds = 1", PERIODIC + 'edge = "accept"', "solve.edge"),
        ("load = 1\nspeeds = 1", PERIODIC + "[keep]\ntimes = 3", "keep.times"),
        ("load = 1\nspeeds = 1", PERIODIC + '[keep]\nfields = ["displacement"]', "keep.fields"),
        ("load = 1\nspeeds = 1", PERIODIC + "[[program]]\nload = 1\nover = 0", "program"),
    ],
)
def test_friction__is_refused_at_the_key(read, friction, rest, key):
    with refused(key):
        read(friction, rest)


def test_missing__is_refused_with_friction(tmp_path):
    text = SURFACE.replace("[material]", 'missing = "absent"\n[material]')
    (tmp_path / "slide.toml").write_text(f"{text}\n[friction]\nload = 1\nspeeds = 1\n{PERIODIC}")
    with refused("surface.missing"):
        read_study(tmp_path / "slide.toml")


def test_key__of_a_curve_is_that_of_what_is_asked(read):
    keys = [
        read(text).key
        for text in (
            "load = 2\nspeeds = [10, 1]",
            "load = 2\nspeeds = [1, 10]",
            "load = 3\nspeeds = [1, 10]",
            "load = 2\nspeeds = [1, 11]",
            'load = 2\nspeeds = [1, 10]\ndirection = "y"',
            "pressure = 2\nspeeds = [1, 10]",
        )
    ]
    assert keys[0] == keys[1]
    assert len(set(keys)) == 5


@pytest.mark.parametrize("said", ["", '[solve]\nboundary = "auto"\n', "[solve]\ntolerance = 1e-3\n"])
def test_boundary__is_periodic_unless_said_otherwise(read, said):
    unsaid, stated = read("load = 2\nspeeds = 1", said), read("load = 2\nspeeds = 1")
    assert unsaid.settings.boundary == "periodic"
    assert unsaid.key == stated.key
