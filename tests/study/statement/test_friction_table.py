"""``[friction]`` in a study: what it takes, what it refuses, and what identifies its case."""

from types import SimpleNamespace

import pytest
from support import BALL

import roughvisc as rv
from roughvisc.experiment.steady_sliding import SteadySliding
from roughvisc.study.statement import identity as identity_module
from roughvisc.study.statement.case import Case, read_cases, read_study
from roughvisc.study.statement.schema.keys import unit_of

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
    assert read(f'load = "2 N"\nspeeds = {speeds}').experiment() == SteadySliding(speeds=found, load=2.0)


def test_case__states_a_curve_and_survives_its_text(read):
    case = read('pressure = "0.2 MPa"\nspeeds = [1, 2]\ndirection = "-y"')
    assert case.experiment() == SteadySliding(speeds=[1, 2], pressure=2e5, direction="-y")
    again = Case.from_json(case.to_json())
    assert (again.key, again.experiment()) == (case.key, case.experiment())
    assert "2 speeds from 1 m/s to 2 m/s along -y, under 200 kPa" in case._repr_html_()
    assert (unit_of("friction.load"), unit_of("friction.speeds")) == ("N", "m/s")
    assert case.at(1.0, 2.0) == "speed 1 of 2"
    with pytest.raises(rv.InputError, match=r"slide\.toml: friction: found steady sliding, which has no program"):
        case.program()


@pytest.mark.parametrize(
    ("friction", "rest", "message"),
    [
        ("load = 1", PERIODIC, r"friction\.speeds: missing: expected a speed in m/s, a list of them, or a table"),
        ("speeds = 1", PERIODIC, r"friction\.load: missing: expected a load in N, or a nominal pressure in Pa"),
        (
            "load = 1\npressure = 1\nspeeds = 1",
            PERIODIC,
            r"friction\.pressure: found beside load: expected one of them",
        ),
        ("load = 0\nspeeds = 1", PERIODIC, r"friction\.load: found 0: expected a number in N"),
        ('load = "1 Pa"\nspeeds = 1', PERIODIC, r"friction\.load: found '1 Pa'.*did you mean pressure = '1 Pa'"),
        ("load = 1\nspeeds = []", PERIODIC, r"friction\.speeds: found 0 speeds: expected 1 to 1000"),
        ("load = 1\nspeeds = [1, -1]", PERIODIC, r"friction\.speeds: found -1: expected a number in m/s"),
        ('load = 1\nspeeds = "1 m"', PERIODIC, r"friction\.speeds: found '1 m', which is in meter"),
        ("load = 1\nspeeds = { from = 2, to = 1, count = 3 }", PERIODIC, "expected the lower end first"),
        ("load = 1\nspeeds = { from = 1, to = 2, count = 1 }", PERIODIC, r"friction\.speeds\.count: found 1"),
        ("load = 1\nspeeds = { from = 1, to = 2 }", PERIODIC, r"friction\.speeds\.count: missing"),
        ('load = 1\nspeeds = 1\ndirection = "z"', PERIODIC, r"friction\.direction: found 'z': expected 'x' or '-x'"),
        ("load = 1\nspeeds = 1\ntime = 1", PERIODIC, r"friction\.time: unknown key"),
        ("load = 1\nspeeds = 1", FREE, r"solve\.boundary: found 'free': steady sliding repeats: expected 'periodic'"),
        ("load = 1\nspeeds = 1", PERIODIC + "time_step = 1", r"solve\.time_step: found 1\.0: steady sliding has none"),
        ("load = 1\nspeeds = 1", PERIODIC + 'edge = "accept"', r"solve\.edge: found 'accept'"),
        ("load = 1\nspeeds = 1", PERIODIC + "[keep]\ntimes = 3", r"keep\.times: found 3: steady sliding has none"),
        ("load = 1\nspeeds = 1", PERIODIC + '[keep]\nfields = ["displacement"]', r"keep\.fields: found 'displacement'"),
        (
            "load = 1\nspeeds = 1",
            PERIODIC + "[[program]]\nload = 1\nover = 0",
            r"program: found together with \[friction\]",
        ),
    ],
)
def test_study__refuses_in_one_sentence(read, friction, rest, message):
    with pytest.raises(rv.InputError, match=message):
        read(friction, rest)


def test_missing__is_refused_with_friction(tmp_path):
    text = SURFACE.replace("[material]", 'missing = "absent"\n[material]')
    (tmp_path / "slide.toml").write_text(f"{text}\n[friction]\nload = 1\nspeeds = 1\n{PERIODIC}")
    with pytest.raises(rv.InputError, match=r"surface\.missing: found 'absent': a surface that slides has no holes"):
        read_study(tmp_path / "slide.toml")


def test_study__without_program_and_friction_is_told_of_both(tmp_path):
    (tmp_path / "none.toml").write_text(SURFACE + "[x]\n")
    with pytest.raises(rv.InputError) as refused:
        read_cases(tmp_path / "none.toml")
    assert "program: missing: expected a list of [[program]] tables, at least one, or a table [friction]" in str(
        refused.value
    )
    assert "x: unknown key" in str(refused.value), "the other problems are told as well"


def digested(monkeypatch, case):
    """What the key of a case is a digest of."""
    seen, digest = [], identity_module._digest
    monkeypatch.setattr(identity_module, "_digest", lambda stated: seen.append(stated) or digest(stated))
    identity_module.identity(case.settings)
    return next(one for one in seen if "numerics" in one)


@pytest.mark.parametrize("table", ["solve", "keep"])
def test_key__does_not_change_by_a_new_setting_at_its_default(table, tmp_path):
    (tmp_path / "ball.toml").write_text(BALL)
    settings = read_study(tmp_path / "ball.toml").settings
    former, _ = identity_module.identity(settings)

    class WithNewKey(type(getattr(settings, table))):
        added: int = 3

    def key(**stated):
        section = WithNewKey(**dict(getattr(settings, table)), **stated)
        return identity_module.identity(settings.model_copy(update={table: section}))[0]

    assert key() == former
    assert key(added=4) != former


def test_key__counts_the_first_keys_of_what_is_kept_at_their_defaults_too(tmp_path, monkeypatch):
    (tmp_path / "ball.toml").write_text(BALL)
    settings = read_study(tmp_path / "ball.toml").settings
    usual = settings.model_copy(update={"keep": type(settings.keep)()})
    stated = digested(monkeypatch, SimpleNamespace(settings=usual))
    assert stated["keep"] == {"fields": ["pressure", "gap"], "times": "all", "precision": None}


def test_key__of_a_program_knows_nothing_of_friction(tmp_path, monkeypatch):
    (tmp_path / "ball.toml").write_text(BALL)
    stated = digested(monkeypatch, read_study(tmp_path / "ball.toml"))
    assert set(stated) == {"solve", "keep", "program", "material", "surface", "numerics"}


def test_key__of_a_curve_is_that_of_what_is_asked(read, monkeypatch):
    stated = digested(monkeypatch, read('load = "2 N"\nspeeds = { from = 1, to = 10, count = 2 }'))
    assert set(stated) == {"solve", "keep", "friction", "material", "surface", "numerics"}
    assert stated["friction"] == {"load": 2.0, "speeds": [1.0, 10.0]}
    keys = [
        read(text).key
        for text in (
            "load = 2\nspeeds = [10, 1]",
            'load = 2\nspeeds = [1, 10]\ndirection = "x"',
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
    assert unsaid.solving().boundary == "periodic"
    assert unsaid.key == stated.key
