"""Cases from objects of Python: the case of the study file that states the same, its file, its key and its sweep."""

import json
import pickle
from functools import partial

import numpy as np
import pytest
from support import refused

import roughvisc as rv

WAVES = rv.self_affine("100 um", (16, 14), hurst=0.8, rms_slope=0.1, seed=1)
SCAN = rv.from_array(WAVES.values, ("6 um", "7 um"))
RUBBER = rv.zener("3 MPa", "1 MPa", "0.1 MPa s")
PRESS = rv.Program().load("10 uN", over="50 ms").hold("0.2 s")
STUDY = """
surface = { generate = "self_affine", size = "100 um", shape = [16, 14], hurst = 0.8, rms_slope = 0.1, seed = 1 }
material = { model = "zener", shear_modulus = "3 MPa", kelvin_modulus = "1 MPa", kelvin_viscosity = "0.1 MPa s" }
program = [{ load = "10 uN", over = "50 ms" }, { hold = "0.2 s" }]
solve = { tolerance = 1e-2, boundary = "periodic" }
keep = { times = 4 }
"""
CASE = rv.Case(WAVES, RUBBER, PRESS, boundary="periodic", tolerance=1e-2, times=4)
STICKY = rv.adhesion(work="50 mJ/m^2", range="2 um")
PULL = PRESS.load("-1 uN", over="50 ms")
HEIGHTS = rv.Case(SCAN, RUBBER, PRESS, boundary="mirror", tolerance=1e-2, times=4)


def creeping(t):
    return 1e-6 * (1 + 0.2 * np.log1p(np.asarray(t) / 1e-3))


def numbers_of(dataset):
    return {name: one.values for name, one in dataset.variables.items() if name != "wall_time"}


def assert_equal(one, other):
    one, other = numbers_of(one), numbers_of(other)
    assert one.keys() == other.keys()
    for name, values in one.items():
        np.testing.assert_array_equal(values, other[name], name)


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    """Returns the case of a study with some texts replaced."""
    folder = tmp_path_factory.mktemp("studies")

    def read(*changes, text=STUDY):
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (folder / "study.toml").write_text(text)
        return rv.read_study(folder / "study.toml")

    return read


def test_case__is_the_case_of_its_study_file(studies, tmp_path):
    study = studies()
    assert type(CASE) is type(study)
    assert (CASE.key, CASE.body, CASE.program, CASE.settings) == (study.key, study.body, study.program, study.settings)
    assert_equal(rv.run(CASE, tmp_path / "case", progress=False), rv.run(study, tmp_path / "study", progress=False))


@pytest.mark.parametrize("material", [RUBBER, rv.creep(creeping), rv.sheet(RUBBER, "20 um")], ids=lambda one: "")
def test_study_file__of_heights_gives_the_numbers_of_simulate(material, tmp_path):
    case = rv.Case(SCAN, material, PRESS, boundary="mirror", tolerance=1e-2, times=4)
    read = rv.read_study(case.to_toml(tmp_path / "study.toml"))
    assert read.key == case.key == pickle.loads(pickle.dumps(case)).key
    found = rv.run(read, tmp_path, progress=False)
    direct = rv.simulate(SCAN, material, PRESS, boundary="mirror", tolerance=1e-2, times=4, progress=False)
    assert_equal(found, direct)
    assert found.height.attrs == direct.height.attrs
    assert rv.run(case, tmp_path, progress=False).encoding["source"] == found.encoding["source"]
    assert len(list(tmp_path.glob("heights-*.nc"))) == 1
    assert str(tmp_path) not in json.dumps(found.attrs, default=str)


FRICTION = STUDY[STUDY.index("program") : STUDY.index("solve")], 'friction = { load = "10 uN", speeds = [1, 2] }\n'


@pytest.mark.parametrize(
    ("before", "old", "new"),
    [
        ((), '"100 um"', '["100 um", 1e-4]'),
        ((), "seed = 1", 'seed = 1, amplitudes = "fixed", shortcut = "14.2857142857143 um"'),
        ((("seed = 1", "seed = 1, outliers = true"),), "= true", "= { window = 9, threshold = 8.0 }"),
        ((("seed = 1", 'seed = 1, filter = "9 um"'),), '"9 um"', '{ cutoff = 9e-6, keep = "long" }'),
        ((("times = 4", 'times = ["50 ms"]'),), '["50 ms"]', "[0.05]"),
        ((("times = 4", 'fields = ["pressure"]'),), '"pressure"', '"pressure", "pressure"'),
        ((), 'load = "10 uN"', 'pressure = "1 kPa"'),
        ((FRICTION, ("times = 4", "fields = []")), 'load = "10 uN"', 'pressure = "1 kPa"'),
        ((), '{ load = "10 uN", over = "50 ms" }', "{ table = { times = [0, 0.05], values = [0, 1e-5] } }"),
        (
            (),
            'model = "zener", shear_modulus = "3 MPa", kelvin_modulus = "1 MPa", kelvin_viscosity = "0.1 MPa s"',
            'model = "prony", glassy = 3.333333333333333e-7, compliances = ["1 1/MPa"], times = [0.1]',
        ),
    ],
)
def test_key__is_equal_for_two_texts_of_one_case(studies, before, old, new):
    assert studies(*before).key == studies(*before, (old, new)).key


def test_key__of_a_scan_does_not_depend_on_its_card_or_the_name_of_a_unit(studies, tmp_path):
    np.savetxt(tmp_path / "scan.csv", SCAN.values.T * 1e6, delimiter=",")
    (tmp_path / "card.toml").write_text('file = "scan.csv"\nunit = "um"\nspacing = "6 um"\nlevel = 1')
    first = STUDY.replace(STUDY[STUDY.index("{") : STUDY.index("}") + 1], "@")
    scan = f'file = "{tmp_path / "scan.csv"}", spacing = 6e-6'
    texts = [
        f'{{ {scan}, unit = "um", level = 1 }}',
        f'{{ {scan}, unit = "micrometer", level = {{ order = 1 }} }}',
        f'{{ file = "{tmp_path / "card.toml"}" }}',
        f'{{ {scan}, unit = "um", level = 2 }}',
    ]
    keys = [studies(("@", text), text=first).key for text in texts]
    assert keys[0] == keys[1] == keys[2] != keys[3]


def test_key__of_heights_is_equal_for_a_load_and_its_nominal_pressure(tmp_path):
    area = SCAN.sizes["x"] * SCAN.sizes["y"] * 6e-6 * 7e-6
    press = rv.Program().pressure(1e-5 / area, over="50 ms").hold("0.2 s")
    pressed = rv.Case(SCAN, RUBBER, press, boundary="mirror", tolerance=1e-2, times=4)
    assert pressed.key == HEIGHTS.key != rv.vary(HEIGHTS, {"program": PRESS.hold("1 s")}).key
    assert rv.read_study(pressed.to_toml(tmp_path / "study.toml")).key == pressed.key
    by_pressure = rv.run(pressed, tmp_path / "pressure", progress=False)
    assert_equal(by_pressure, rv.run(HEIGHTS, tmp_path / "load", progress=False))


PROGRAMS = {"ramp": PRESS, "cycles": PRESS.cycle("10 uN", "3 uN", "0.1 s", 3), "slide": PRESS.slide("20 um", over=1)}


@pytest.mark.parametrize(
    "material",
    [
        rv.from_relaxation("1 MPa", ["2 MPa"], ["10 ms"], kind="tensile"),
        rv.shift(rv.pair(RUBBER, rv.power_law(0.0, 1e-6, 0.4)), 3.0),
        rv.creep_table([0, 1, 2, 3], [1e-6, 2e-6, 3e-6, 3.5e-6], kind="shear"),
        rv.layer(rv.elastic(1e9, 0.35), "20 um", on=rv.layer(RUBBER, "1 mm", on=rv.elastic(1e6))),
    ],
    ids=lambda one: "",
)
@pytest.mark.parametrize("program", PROGRAMS.values(), ids=PROGRAMS)
def test_objects__come_back_from_the_study_file(material, program, tmp_path):
    case = rv.Case(WAVES, material, program)
    read = rv.read_study(case.to_toml(tmp_path / "study.toml"))
    assert (read.program, read.key) == (program, case.key)
    assert read.body == (material if isinstance(material, rv.Body) else rv.Body(material))


def test_adhesion__comes_back_from_the_study_file_and_counts_in_the_key(tmp_path):
    case = rv.Case(WAVES, RUBBER, PULL, adhesion=STICKY)
    read = rv.read_study(case.to_toml(tmp_path / "study.toml"))
    assert (read.settings.adhesion, read.program, read.key) == (STICKY, PULL, case.key)
    assert rv.vary(case, {"adhesion.work": "60 mJ/m^2"}).key != case.key
    weak, strong = rv.vary(CASE, {"adhesion": {"weak": STICKY, "strong": rv.adhesion(work=0.1, range=2e-6)}})
    assert (weak.varied, strong.settings.adhesion.work) == ({"adhesion": "weak"}, 0.1)
    assert rv.vary(CASE, {"adhesion": {"work": "50 mJ/m^2", "range": 2e-6}}).key == weak.key != strong.key
    for none in (None, rv.adhesion(work=0, range=1)):
        assert rv.vary(weak, {"adhesion": none}).key == CASE.key != weak.key


def test_html__shows_the_case_in_units():
    times = np.arange(9.0)
    material = rv.creep_table(times, 1e-6 * (1 + times), kind="shear")
    case = rv.Case(WAVES, material, PRESS, title="<hold>", observe={"leakage": {"viscosity": "2 mPa s"}})
    text = case._repr_html_()
    for words in ("&lt;hold&gt;", "size 100 µm", "0 s to 8 s (9 values)", "hold 200 ms", "viscosity 2 mPa s", case.key):
        assert words in text, words


def test_vary__makes_the_product_and_pairs_and_names_objects():
    programs = {name: PROGRAMS[name] for name in ("ramp", "cycles")}
    cases = rv.vary(CASE, {"program": programs, "tolerance": ["1 %", 1e-3]})
    assert [dict(one.varied) for one in cases] == [
        {"program": name, "tolerance": tolerance} for name in programs for tolerance in (1e-2, 1e-3)
    ]
    assert [one.program for one in cases[::2]] == list(programs.values())
    pairs = rv.vary(
        CASE, {"material": {"soft": RUBBER, "hard": rv.elastic(1e9)}, "times": {"few": 2, "more": 3}}, zip=True
    )
    assert [(one.varied["material"], one.settings.times) for one in pairs] == [("soft", 2), ("hard", 3)]
    assert rv.vary(CASE, {"surface.shape": [8, 8], "tolerance": 1e-3}).surface["shape"] == [8, 8]
    assert [one.surface["shape"] for one in rv.vary(CASE, {"surface.shape": [(8, 8), (9, 8)]})] == [[8, 8], [9, 8]]
    assert rv.vary(CASE, {"program": rv.SteadySliding(speeds=1, load=1e-5), "times": None}).experiment.axis == "speed"


def test_vary__fits_a_creep_function_to_each_program():
    case = rv.Case(WAVES, rv.creep(creeping), PRESS, times=4)
    longer = rv.vary(case, {"program": PRESS.hold("9 s")})
    assert longer.body == rv.Case(WAVES, rv.creep(creeping), PRESS.hold("9 s"), times=4).body != case.body


def test_sweep__stores_heights_once_and_its_names_are_coordinates(tmp_path):
    cases = rv.vary(HEIGHTS, {"program": {"ramp": PRESS, "long": PRESS.hold("0.1 s")}})
    found = rv.sweep(cases, tmp_path, workers=0, progress=False)
    assert found.program.values.tolist() == ["ramp", "long"]
    assert len(list(tmp_path.glob("heights-*.nc"))) == 1
    rv.sweep(cases, tmp_path, workers=0, progress=False)
    assert "0 of them to compute" in (tmp_path / "sweep.log").read_text()


def test_folder__with_the_sweep_of_another_study_is_refused(tmp_path):
    first = rv.vary(CASE, {"title": "first"})
    rv.sweep([first], tmp_path, workers=0, progress=False)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    other = rv.vary(first, {"title": "second", "tolerance": 2e-2})
    for call in (rv.run, partial(rv.sweep, workers=0)):
        with refused("out", str(tmp_path)):
            call(other if call is rv.run else [other], tmp_path, progress=False)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    changed = rv.vary(first, {"tolerance": 2e-2})
    assert rv.sweep([changed], tmp_path, workers=0, progress=False).sizes["case"] == 1


class OwnKernel(type(rv.Body(RUBBER).kernel)):
    """A kernel that no study file states."""


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (lambda: rv.Case(SCAN, RUBBER, PRESS), "boundary"),
        (lambda: rv.Case(SCAN.to_dataset(), RUBBER, PRESS), "surface"),
        (lambda: rv.Case(WAVES, rv.zener, PRESS), "material"),
        (lambda: rv.Case(WAVES, rv.Body(RUBBER, OwnKernel()), PRESS), "material"),
        (lambda: rv.Case(WAVES, rv.pair(rv.creep(creeping), RUBBER), PRESS), "material"),
        (lambda: rv.Case(WAVES, rv.creep(creeping), rv.SteadySliding(speeds=1, load=1)), "material"),
        (lambda: rv.Case(WAVES, RUBBER, rv.Program), "program"),
        (lambda: rv.Case(WAVES, RUBBER, PRESS, tolerance=2), "tolerance"),
        (lambda: rv.Case(WAVES, RUBBER, PRESS, times=[0, 3]), "times"),
        (lambda: rv.Case(WAVES, RUBBER, PRESS, adhesion=0.05), "adhesion"),
        (lambda: rv.vary(CASE, {"adhesion": 0.05}), "adhesion"),
        (lambda: rv.Case(WAVES, rv.sheet(RUBBER, "20 um"), PRESS, adhesion=STICKY), "adhesion"),
        (lambda: rv.Case(WAVES, RUBBER, PULL), "program.2.load"),
        (lambda: rv.Case(WAVES, RUBBER, PRESS, observe={"leak": {}}), "observe.leak"),
        (lambda: rv.vary(CASE, {"tolerance": [1e-2, 4]}), "tolerance"),
        (lambda: rv.vary(CASE, {"solve.tolerance": 4}), "solve.tolerance"),
        (lambda: rv.vary(CASE, {"tolerence": 1e-2}), "tolerence"),
        (lambda: rv.vary(CASE, {"program": [PRESS, PRESS]}), "program"),
        (lambda: rv.vary(CASE, {"tolerance": [1e-2, 1e-3], "times": {"few": 1}}, zip=True), "changes"),
        (lambda: rv.vary(CASE, {"tolerance": []}), "tolerance"),
        (lambda: rv.run(CASE, __file__, progress=False), "out"),
        (lambda: CASE.to_toml("study.txt"), "path"),
    ],
)
def test_wrong_argument__is_refused_as_the_caller_wrote_it(call, key):
    with refused(key):
        call()


def test_heights__that_were_changed_are_refused(tmp_path):
    study = HEIGHTS.to_toml(tmp_path / "study.toml")
    (file,) = tmp_path.glob("heights-*.nc")
    (2 * SCAN).to_netcdf(file)
    with pytest.raises(rv.RoughviscError, match="was changed"):
        rv.run(study, progress=False)
