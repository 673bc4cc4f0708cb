"""Study files: what they state, what is refused, and what a case is known by."""

import json
import pickle

import pytest
from support import refused

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.program import Program
from roughvisc.study.case import Case, read_study, vary
from roughvisc.study.study_file import unit_of

WAVES = {"generate": "wavy", "amplitude": "1 um", "wavelength": "0.5 mm", "size": "1 mm", "shape": 16}
LEAKAGE = {"leakage": {"viscosity": "2 mPa s", "pressure_drop": "3 bar", "along": "y"}}
PERIODIC = {"boundary": "periodic"}


def test_read_study__units_become_si(read_one):
    case = read_one()
    assert case.title == "A ball"
    assert (case.surface["radius"], case.surface["size"]) == (0.01, [1e-3, 1e-3])
    assert case.material == rv.zener(3e6, 1e6, 1e5)
    assert case.program == Program().load(2.0, over=0.05).hold(5.0)
    assert (case.settings.boundary, case.settings.fields, case.settings.times) == ("free", ("pressure", "gap"), None)


WAVES = {"generate": "wavy", "amplitude": "1 um", "wavelength": "1 mm", "size": "3 mm", "shape": 24}
ROUGH = {"generate": "self_affine", "size": "3 mm", "shape": 24, "hurst": 0.8, "rms_height": "1 um", "seed": 1}


@pytest.mark.parametrize(
    ("changes", "key", "found"),
    [
        ({"material.shear_modulus": "3 MN"}, "material.shear_modulus", "3 MN"),
        ({"material.kelvin_modulus": None}, "material.kelvin_modulus", None),
        ({"material": {"model": "prony", "glassy": 1e-6, "longest": 3}}, "material.longest", 3),
        ({"material.model": "zenner"}, "material.model", "zenner"),
        ({"materials": 1}, "materials", 1),
        ({"material": None}, "material", None),
        ({"surface.generate": "ball"}, "surface.generate", "ball"),
        ({"surface.generate": None}, "surface", None),
        ({"surface": WAVES | {"shape": [24, 0]}}, "surface.shape", [24, 0]),
        ({"surface": WAVES | {"size": "3.5 mm"}}, "surface.size", (3.5e-3, 3.5e-3)),
        ({"surface": ROUGH | {"rms_slope": 0.1}}, "surface.rms_slope", 0.1),
        ({"surface.outliers": {"treshold": 5}}, "surface.outliers.treshold", 5),
        ({"surface.crop": {"y": ["9 mm", "1 um"]}}, "surface.crop.y", ["9 mm", "1 um"]),
        ({"surface.mirror": True}, "surface.mirror", True),
        ({"surface": {"file": "gone.sur"}}, "surface.file", "gone.sur"),
        ({"program.0.load": "2"}, "program.0.load", "2"),
        ({"program.0.over": None}, "program.0.over", None),
        ({"program.0.load": None, "program.0.laod": 1}, "program.0", None),
        ({"program.1.control": "force"}, "program.1.control", "force"),
        ({"keep.fields": ["presure"]}, "keep.fields", ["presure"]),
        ({"keep.times": [1, "7 s"]}, "keep.times", 7.0),
        ({"keep.times": [1, "1,5 s"]}, "keep.times.1", "1,5 s"),
        ({"program.1": {"slide": "1 mm", "speed": "1 mm/s"}, "solve.boundary": "free"}, "solve.boundary", "free"),
    ],
    ids=str,
)
def test_study__is_refused_at_the_key(read, changes, key, found):
    with refused(key, found):
        read(changes)


def test_study__that_cannot_be_read_is_named(tmp_path):
    for name, content in (("bad", b"title = "), ("latin", 'size = "5 µm"'.encode("cp1252")), ("none", None)):
        if content:
            (tmp_path / f"{name}.toml").write_bytes(content)
        with pytest.raises(InputError, match=f"{name}.toml"):
            read_study(tmp_path / f"{name}.toml")


# ----------------------------------------------------------------------------------------------------------------
# friction


@pytest.fixture
def slide(read_one):
    """Reads the case of a table ``[friction]``, on the ball with periodic boundaries."""

    def case(friction, solve=PERIODIC, **tables):
        return read_one(program=None, friction=friction, solve=solve, **tables)

    return case


@pytest.mark.parametrize(
    ("speeds", "found"),
    [
        ("3 mm/s", (3e-3,)),
        (0.5, (0.5,)),
        (["1 m/s", 1e-3, "36 km/h", "1 mm/s"], (1e-3, 1.0, 10.0)),
        ({"from": "1 um/s", "to": "1 m/s", "count": 7}, (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0)),
    ],
)
def test_speeds__are_in_order_and_each_once(slide, speeds, found):
    assert slide({"load": "2 N", "speeds": speeds}).experiment == SteadySliding(speeds=found, load=2.0)


def test_friction__states_a_curve_and_survives_its_text(slide):
    case = slide({"pressure": "0.2 MPa", "speeds": [1, 2], "direction": "-y"})
    assert case.experiment == SteadySliding(speeds=[1, 2], pressure=2e5, direction="-y")
    again = Case.from_json(case.to_json())
    assert (again.key, again.experiment) == (case.key, case.experiment)
    assert case.experiment.progress(1.0, 2.0) == "speed 1 of 2"
    for solve in (None, {"boundary": "auto"}, {"tolerance": 1e-3}):
        assert slide({"pressure": 2e5, "speeds": [2, 1], "direction": "-y"}, solve).key == case.key
    with refused("friction", "steady sliding"):
        _ = case.program
    others = ({"load": 2}, {"load": 3}, {"pressure": 2}, {"load": 2, "direction": "y"}, {"load": 2, "speeds": [1, 3]})
    assert len({slide({"speeds": [1, 2]} | other).key for other in others}) == 5


@pytest.mark.parametrize(
    ("friction", "tables", "key"),
    [
        ({"speeds": None}, {}, "friction.speeds"),
        ({"load": None}, {}, "friction.load"),
        ({"speeds": {"from": 2, "to": 1, "count": 3}}, {}, "friction.speeds.from"),
        ({"speeds": {"from": 1, "to": 2, "count": 1}}, {}, "friction.speeds.count"),
        ({}, {"solve": {"boundary": "free"}}, "solve.boundary"),
        ({}, {"solve": PERIODIC | {"time_step": 1}}, "solve.time_step"),
        ({}, {"solve": PERIODIC | {"edge": "accept"}}, "solve.edge"),
        ({}, {"keep": {"times": 3}}, "keep.times"),
        ({}, {"keep": {"fields": ["displacement"]}}, "keep.fields"),
        ({}, {"surface": WAVES | {"missing": "absent"}}, "surface.missing"),
    ],
)
def test_friction__is_refused_at_the_key(slide, friction, tables, key):
    stated = {name: value for name, value in ({"load": 1, "speeds": 1} | friction).items() if value is not None}
    with refused(key):
        slide(stated, **tables)


def test_friction__next_to_a_program_is_refused(read):
    with refused("program"):
        read(friction={"load": 1, "speeds": 1}, solve=PERIODIC)


# ----------------------------------------------------------------------------------------------------------------
# observables


def test_observe__is_read_in_si_and_does_not_count_in_the_key(read_one):
    plain, case = read_one(surface=WAVES), read_one(surface=WAVES, observe=LEAKAGE)
    assert case.observed == {"leakage": {"viscosity": 2e-3, "pressure_drop": 3e5, "along": "y"}}
    assert Case.from_json(case.to_json()).observed == case.observed
    assert plain.key == case.key
    assert "observe" not in json.loads(plain.to_json())


@pytest.mark.parametrize(
    ("observe", "tables", "key"),
    [
        ({"leakage": {"pressure_drop": 0}}, {}, "observe.leakage.pressure_drop"),
        ({"leakage": {"along": "z"}}, {}, "observe.leakage.along"),
        ({"conductance": {}}, {}, "observe.conductance.resistivity"),
        ({"conductance": {"resistivity": ["1 ohm m", "1 K m/W"]}}, {}, "observe.conductance.resistivity"),
        (LEAKAGE, {"keep": {"fields": ["pressure"]}}, "observe.leakage"),
        ({"leak": {}}, {}, "observe.leak"),
        ({"leakage": 1}, {}, "observe.leakage"),
    ],
)
def test_observe__is_refused_at_the_key(read, observe, tables, key):
    with refused(key):
        read(surface=WAVES, observe=observe, **tables)


# ----------------------------------------------------------------------------------------------------------------
# cases


def test_vary__changes_one_value(read_one):
    case = read_one()
    changed = vary(case, {"program.0.load": "3 N", "keep.times": 5})
    assert changed.program.segments[0].end == 3
    assert changed.varied == {"program.0.load": 3.0, "keep.times": 5}
    assert case.program.segments[0].end == 2
    with refused("program.0.load", -1):
        vary(case, {"program.0.load": -1})


def test_json__gives_the_case_back(read):
    for case in read(sweep={"program.0.load": ["1 N", 2]}):
        for again in (Case.from_json(case.to_json()), pickle.loads(pickle.dumps(case))):
            assert again == case
            assert again.key == case.key
    for wrong in ("nonsense", "{}"):
        with pytest.raises(InputError):
            Case.from_json(wrong)


def test_key__counts_what_determines_the_numbers(read_one):
    same = [
        {"title": "Another title"},
        {"program.0.over": 0.05},
        {"material.shear_modulus": "3e6 N/m^2"},
        {"surface.radius": "1 cm"},
        {"program.1.hold": "5000 ms"},
        {"solve.boundary": "free", "keep.fields": ["gap", "pressure"]},
    ]
    other = [
        {"program.0.over": "51 ms"},
        {"material.shear_modulus": "3.00000000000001 MPa"},
        {"surface.shape": [24, 32]},
        {"solve.boundary": "periodic"},
        {"solve.time_step": 0.01},
        {"keep.times": 3},
        {"keep.fields": ["gap"]},
        {"surface.level": 1, "solve.boundary": "free"},
        {"material.poisson": 0.4},
        {"material.modulus_factor": 2},
    ]
    case = read_one()
    assert len(case.key) == 16
    assert int(case.key, 16)
    assert {read_one(changes).key for changes in same} | {vary(case, {"surface.level": False}).key} == {case.key}
    assert len({read_one(changes).key for changes in other} | {case.key}) == len(other) + 1


def test_key__knows_a_scan_by_its_content(read_one, tmp_path):
    for name, content in (("a.sur", b"one"), ("b.sur", b"one"), ("c.sur", b"two")):
        (tmp_path / name).write_bytes(content)
    (tmp_path / "card.toml").write_text('title = "x"\nfile = "a.sur"\nlevel = 1')
    (tmp_path / "same.toml").write_text('licence = "CC0"\nfile = "b.sur"\nlevel = 1')
    (tmp_path / "other.toml").write_text('file = "a.sur"\nlevel = 2')
    names = ("a.sur", "b.sur", "c.sur", "card.toml", "same.toml", "other.toml")
    case = {name: read_one(surface={"file": name}, solve={"boundary": "free"}) for name in names}
    key = {name: case[name].key for name in names}
    assert key["a.sur"] == key["b.sur"]
    assert key["card.toml"] == key["same.toml"]
    assert len({key[n] for n in ("a.sur", "c.sur", "card.toml", "other.toml")}) == 4
    assert case["a.sur"].surface_sha256 == case["card.toml"].surface_sha256
    assert case["a.sur"].surface_sha256 != case["c.sur"].surface_sha256


# ----------------------------------------------------------------------------------------------------------------
# units of keys


def test_unit_of__other_keys_and_parts_of_values():
    lengths = ("size", "spacing", "crop.x", "crop.x.0", "shortest_wave", "filter", "filter.cutoff")
    assert {unit_of(f"surface.{key}") for key in lengths} == {"m"}
    material = {"times.0": "s", "b.viscosity": "Pa s", "temperature": "K", "on.on.thickness": "m", "poisson": "1"}
    assert {key: unit_of(f"material.{key}") for key in material} == material
    found = [unit_of(key) for key in ("solve.time_step", "friction.load", "friction.speeds")]
    assert found == ["s", "N", "m/s"]
    for kind, name in (("cycle", "mean"), ("table", "values")):
        key = f"program.0.{kind}.{name}"
        stated = [{"program": [{kind: {}} | control]} for control in ({}, {"control": "load"}, {"control": "approach"})]
        assert [unit_of(key), *(unit_of(key, case) for case in stated)] == ["", "N", "N", "m"]


def test_study__of_a_quantity_without_quotes_shows_them(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text('[surface]\nfile = "a.sur"\nfilter = 9.8 um  # noise\n')
    with pytest.raises(rv.InputError, match=r"filter = \"9.8 um\""):
        rv.read_study(path)
    path.write_text("[surface]\nsize = 3 4\n")
    with pytest.raises(rv.InputError) as error:
        rv.read_study(path)
    assert "quotes" not in str(error.value)
