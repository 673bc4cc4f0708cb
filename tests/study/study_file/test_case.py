"""Study files: what they state, what is refused, and what a case is known by."""

import json
import math
import pickle
import textwrap

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples
from support import refused

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.mechanics.program import Program
from roughvisc.study.case import Case, read_cases, read_study, vary

BALL = """
title = "A ball"
[surface]
generate = "sphere"
radius = "10 mm"
size = ["1 mm", 1e-3]
shape = [32, 24]
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
load = "2 N"
over = "50 ms"
[[program]]
hold = "5 s"
"""


@pytest.fixture
def study(tmp_path):
    """Writes a study file, with replacements, and gives its path."""

    def write(text=BALL, *replacements, name="ball.toml"):
        for old, new in replacements:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / name
        path.write_text(textwrap.dedent(text))
        return path

    return write


def test_read_study__units_become_si(study):
    case = read_study(study())
    assert case.title == "A ball"
    assert case.surface["radius"] == 0.01
    assert case.surface["size"] == [1e-3, 1e-3]
    assert case.material == rv.zener(3e6, 1e6, 1e5)
    assert case.program == Program().load(2.0, over=0.05).hold(5.0)
    assert case.settings.boundary == "free"
    assert case.settings.fields == ("pressure", "gap")
    assert case.settings.times is None


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        ('model = "elastic"\nshear_modulus = 1e6', rv.elastic(1e6)),
        (
            'model = "maxwell"\nshear_modulus = 1e6\nviscosity = "2 kPa s"\npoisson = 0.3',
            rv.maxwell(1e6, 2e3, 0.3),
        ),
        ('model = "kelvin_voigt"\nshear_modulus = 1e6\nviscosity = 1', rv.kelvin_voigt(1e6, 1.0)),
        (
            'model = "from_relaxation"\nequilibrium = 0\nmoduli = ["1 MPa", 2e6]\ntimes = ["1 ms", 1]',
            rv.from_relaxation(0.0, [1e6, 2e6], [1e-3, 1.0]),
        ),
        (
            'model = "prony"\nglassy = "1 GPa^-1"\ncompliances = [1e-6]\ntimes = [1]',
            rv.Prony(1e-9, 0.0, (1e-6,), (1.0,)),
        ),
        ('model = "prony"\nglassy = 1e-9', rv.Prony(1e-9)),
        (
            'model = "from_relaxation"\ninstantaneous = "3 kPa"\nratios = [0.5]\ntimes = [1]\nbulk_modulus = "2 kPa"',
            rv.from_relaxation(instantaneous=3e3, ratios=[0.5], times=[1.0], bulk_modulus=2e3),
        ),
        (
            'model = "power_law"\nglassy = 0\ncoefficient = "1 MPa^-1"\nexponent = 0.4\ntime_scale = "2 h"',
            rv.power_law(0.0, 1e-6, 0.4, 7200.0),
        ),
        (
            'model = "creep_table"\ntimes = [0, "2 min"]\ncompliances = [1, 2]\nnoise = 0.01\nkind = "tensile"',
            rv.creep_table((0, 120), (1, 2), "tensile", 0.01),
        ),
        (
            'model = "relaxation_table"\ntimes = [0, 1, 2]\nmoduli = ["3 MPa", 2e6, 1.5e6]\npoisson = 0.3',
            rv.relaxation_table((0, 1, 2), (3e6, 2e6, 1.5e6), poisson=0.3),
        ),
        (
            'model = "dynamic_table"\nfrequency_unit = "Hz"\n'
            'frequencies = [1, 10]\nstorage = [2, 3]\nloss = [1, "1 Pa"]',
            rv.dynamic_table((1, 10), (2, 3), (1, 1), frequency_unit="Hz"),
        ),
        (
            'model = "pair"\na = { model = "elastic", shear_modulus = "80 GPa", poisson = 0.3 }\n'
            '[material.b]\nmodel = "power_law"\nglassy = 1e-9\ncoefficient = 1e-6\nexponent = 0.5',
            rv.pair(rv.elastic(8e10, 0.3), rv.power_law(1e-9, 1e-6, 0.5)),
        ),
    ],
)
def test_material__every_model(study, table, expected):
    head, rest = BALL.split("[material]")
    case = read_study(study(f"{head}[material]\n{table}\n[[program]]" + rest.split("[[program]]", 1)[1]))
    assert case.material == expected


def with_material(table):
    """BALL of another material."""
    return f"{BALL.split('[material]')[0]}[material]\n{table}\n[[program]]{BALL.split('[[program]]', 1)[1]}"


#: Heading of a file of a creep test.
HEADING = "time [s], compliance [1/Pa]\n"
CREEP = rv.creep_table((0.0, 60.0, 3600.0), (1e-7, 2e-7, 5e-7))


def test_read_cases__takes_a_pattern_for_the_files_that_match_it(study, tmp_path):
    for name in ("b.csv", "a.csv", "c.txt", "d[1].csv", "deep/e.csv"):
        (tmp_path / "creep" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "creep" / name).write_text(f"{HEADING}0, 1\n1, {2 + len(name)}")
    (tmp_path / "creep" / "folder.csv").mkdir()
    text = with_material('model = "creep_table"\nfile = "creep/a.csv"')

    def files(sweep):
        return [case.varied["material.file"] for case in read_cases(study(text + sweep))]

    every = ["creep/a.csv", "creep/b.csv", "creep/d[1].csv"]
    assert files('\n[sweep]\nmaterial.file = "creep/*.csv"') == every
    assert files('\n[[sweep]]\n"material.file" = "creep/*.csv"\nmaterial.noise = [0.1, 0.2, 0.3]') == every
    assert files('\n[sweep]\n"material.file" = ["creep/c.txt", "creep/[ab].csv"]') == ["creep/c.txt", *every[:2]]
    assert files('\n[sweep]\n"material.file" = ["creep/d[1].csv"]') == every[2:], "a name as it stands is no pattern"
    assert files('\n[sweep]\n"material.file" = "**/e.csv"') == ["creep/deep/e.csv"]
    assert files(f'\n[sweep]\n"material.file" = "{tmp_path}/creep/*.txt"') == [str(tmp_path / "creep" / "c.txt")]
    with pytest.raises(InputError, match=r"sweep\.material\.file"):
        read_cases(study(text + '\n[sweep]\n"material.file" = "creep/*.sur"'))


@pytest.mark.parametrize(
    ("rows", "keys"),
    [
        (f"{HEADING}0, 1e-7\n60, 2e-7\n3600, 5e-7\n", ""),
        ("time, compliance\n0, 0.1\n1, 0.2\n60, 0.5", 'time_unit = "min"\ncompliance_unit = "1/MPa"'),
        ("time (s); compliance (MPa^-1)\n0; 0.1\n60; 0.2\n3600; 0.5", ""),
        ("# rheometer\ncompliance [1/MPa],time\n0.1,0\n0.2,1\n0.5,60", 'time_unit = "min"'),
        ("time [min], compliance [1/MPa]\n0, 0.1\n1, 0.2\n60, 0.5", 'time_unit = "min"'),
    ],
)
def test_material__table_from_csv(study, tmp_path, rows, keys):
    (tmp_path / "creep.csv").write_text(rows)
    case = read_study(study(with_material(f'model = "creep_table"\nfile = "creep.csv"\n{keys}')))
    assert case.material == CREEP
    listed = 'model = "creep_table"\ntimes = [0, 60, 3600]\ncompliances = [1e-7, 2e-7, 5e-7]'
    assert case.key == read_study(study(with_material(listed))).key, "the content counts, not the path or the units"
    (tmp_path / "creep.csv").unlink()
    again = Case.from_json(case.to_json())
    assert again == case, "a stored case needs its CSV file no longer"
    assert again.material == CREEP
    assert vary(again, {"material.noise": 0.1}).tables["material"]["noise"] == 0.1


@pytest.mark.parametrize(
    ("rows", "keys"),
    [
        ("frequency [Hz], storage [Pa], loss [Pa]\n1, 3e6, 1e6\n10, 5e6, 2e6", ""),
        ("frequency [Hz], storage [MPa], loss [MPa]\n1, 3, 1\n10, 5, 2", ""),
        ("storage, frequency, loss\n3, 1, 1\n5, 10, 2", 'modulus_unit = "MPa"'),
        ("frequency, storage, loss, shift_factor\n2, 3, 1, 0.5\n2, 5, 2, 5", 'modulus_unit = "MPa"'),
    ],
)
def test_material__dynamic_from_csv(study, tmp_path, rows, keys):
    (tmp_path / "dma.csv").write_text(rows)
    table = f'model = "dynamic_table"\nfile = "dma.csv"\nfrequency_unit = "Hz"\n{keys}'
    material = read_study(study(with_material(table))).material
    assert material == rv.dynamic_table((1, 10), (3e6, 5e6), (1e6, 2e6), frequency_unit="Hz")
    other = read_study(study(with_material(table.replace('"Hz"', '"rad/s"')))) if "[Hz]" not in rows else None
    assert other is None or other.material != material


def test_pair__is_varied_within(study):
    bodies = 'a = { model = "elastic", shear_modulus = 1 }\nb = { model = "creep_table", file = "creep.csv" }'
    path = study(with_material(f'model = "pair"\n{bodies}'))
    (path.parent / "creep.csv").write_text(f"{HEADING}0, 1\n1, 2")
    case = read_study(path)
    assert Case.from_json(case.to_json()).key == case.key
    changed = vary(case, {"material.a.shear_modulus": "2 Pa"})
    assert changed.key != case.key
    assert changed.material == rv.pair(rv.elastic(2.0), rv.creep_table((0, 1), (1, 2)))


def test_program__every_segment(study):
    text = (
        BALL.split("[[program]]")[0]
        + """
        [[program]]
        load = "2 N"
        over = 0
        [[program]]
        hold = 1
        control = "approach"
        [[program]]
        approach = "3 um"
        over = 1
        [[program]]
        cycle = { mean = 1, amplitude = 0.5, period = 2, cycles = 3 }
        [[program]]
        cycle = { mean = "3 um", amplitude = "1 um", period = 2, cycles = 3 }
        control = "approach"
        [[program]]
        table = { times = [0, 1, "2 s"], values = [0, 1, "500 mN"] }
        [[program]]
        table = { times = [0, 1], values = ["1 um", "2 um"] }
        control = "approach"
    """
    )
    expected = (
        Program().load(2.0, over=0.0).hold(1.0, control="approach").approach(3e-6, over=1.0)
        + Program.cycle(1.0, 0.5, 2.0, 3)
        + Program.cycle(3e-6, 1e-6, 2.0, 3, control="approach")
        + Program().load(0.0, over=0.0)  # a table that begins at zero begins there
        + Program.table([0, 1, 2], [0, 1, 0.5])
        + Program.table([0, 1], [1e-6, 2e-6], control="approach")
    )
    assert read_study(study(textwrap.dedent(text))).program == expected


@pytest.mark.parametrize(
    "rows",
    [
        "time [s], load [N]\n0, 0\n1.5, 2\n2, 1\n",
        "# by hand\ntime [ms]; load (mN)\n0; 0\n1500; 2000\n2000; 1000\n",
        "load [N],time [s]\n0,0\n2,1.5\n1,2",
    ],
)
def test_program__table_from_csv(study, tmp_path, rows):
    (tmp_path / "history.csv").write_text(rows)
    case = read_study(study(BALL.split("[[program]]")[0] + '[[program]]\ntable = "history.csv"'))
    assert case.program == Program.table([0, 1.5, 2], [0, 2, 1])
    (tmp_path / "history.csv").unlink()
    assert Case.from_json(case.to_json()).program == case.program, "a stored case needs its CSV file no longer"


@pytest.mark.parametrize(
    ("old", "new", "key", "found"),
    [
        ('"3 MPa"', '"3 MN"', "material.shear_modulus", "3 MN"),
        ('"3 MPa"', '"-3 MPa"', "material.shear_modulus", "-3 MPa"),
        ("kelvin_modulus", "kelvin_modlus", "material.kelvin_modlus", None),
        ('kelvin_modulus = "1 MPa"', "", "material.kelvin_modulus", None),
        ('shear_modulus = "3 MPa"', "young_modulus = 9", "material.young_modulus", None),
        ("[[program]]\nload", "poisson = 0.6\n[[program]]\nload", "material.poisson", 0.6),
        ('"zener"', '"zenner"', "material.model", None),
        ("[material]", "[materials]", "materials", None),
        ('"sphere"', '"ball"', "surface.generate", None),
        ('generate = "sphere"', "", "surface", None),
        ("[32, 24]", "[0, 24]", "surface.shape", [0, 24]),
        ("[32, 24]", "[32]", "surface.shape", [32]),
        ("[material]", "level = 4\n[material]", "surface.level", 4),
        ("[material]", 'fill = "cubic"\n[material]', "surface.fill", "cubic"),
        ("[material]", "outliers = { treshold = 5 }\n[material]", "surface.outliers.treshold", 5),
        ("[material]", "outliers = { window = 4 }\n[material]", "surface.outliers.window", 4),
        ("[material]", 'filter = "5 N"\n[material]', "surface.filter", "5 N"),
        ("[material]", 'crop = { y = ["9 mm", "1 um"] }\n[material]', "surface.crop.y", ["9 mm", "1 um"]),
        ("[material]", "resample = [1, 9]\n[material]", "surface.resample", [1, 9]),
        ("[material]", "mirror = true\n[material]", "surface.mirror", True),
        ('"2 N"', '"2"', "program.0.load", "2"),
        ('"2 N"', "true", "program.0.load", True),
        ('over = "50 ms"', "", "program.0.over", None),
        ('load = "2 N"', 'laod = "2 N"', "program.0", None),
        ('hold = "5 s"', 'hold = "5 s"\ncontrol = "force"', "program.1.control", "force"),
        ("[surface]", "[solve]\nboundary = 'periodc'\n[surface]", "solve.boundary", "periodc"),
        ("[surface]", "[solve]\ntolerance = 0\n[surface]", "solve.tolerance", 0),
        ("[surface]", "[keep]\nfields = ['presure']\n[surface]", "keep.fields", ["presure"]),
        ("[surface]", "[keep]\ntimes = [6, '7 s']\n[surface]", "keep.times", None),
        ("[surface]", "[sweep]\n'program.0.load' = [1, -2]\n[surface]", "program.0.load", -2),
    ],
)
def test_study__is_refused_at_the_key(study, old, new, key, found):
    with refused(key, found):
        read_cases(study(BALL, (old, new)))


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ('model = "creep_table"\nfile = "gone.csv"', "material.file"),
        ('model = "creep_table"\nfile = "creep.csv"\ntimes = [0, 1]', "material.file"),
        ('model = "creep_table"\ntimes = [0, 1]', "material.compliances"),
        ('model = "creep_table"\nfile = "creep.csv"\ntime_unit = "mm"', "material.file"),
        ('model = "creep_table"\nfile = "falling.csv"\nnoise = "1 %"', "material"),
        ('model = "dynamic_table"\nfile = "creep.csv"', "material.frequency_unit"),
        ('model = "power_law"\nglassy = 0\ncoefficient = 1\nexponent = 1', "material.exponent"),
        (
            'model = "pair"\na = { model = "elastic", shear_modulus = -1 }\nb = { model = "pair" }',
            "material.a.shear_modulus",
        ),
    ],
)
def test_material__is_refused_at_the_key(study, tmp_path, table, key):
    (tmp_path / "creep.csv").write_text(f"{HEADING}0, 1\n1, 2")
    (tmp_path / "falling.csv").write_text(f"{HEADING}0, 2\n1, 1")
    with refused(key):
        read_study(study(with_material(table)))


@pytest.mark.parametrize(
    ("program", "key"),
    [
        ("[program]\nload = 1", "program"),
        ("", "program"),
        ("[[program]]\ncycle = { mean = 1, amplitude = 2, period = 1, cycles = 1 }", "program.0.cycle"),
        ("[[program]]\ntable = { times = [0, 2, 1], values = [0, 1, 2] }", "program.0.table.times.2"),
        *(
            (f'[[program]]\ntable = "{name}.csv"', "program.0.table")
            for name in ("length", "named", "nan", "none", "back")
        ),
    ],
)
def test_program__is_refused_at_the_key(study, tmp_path, program, key):
    heading = "time [s], load [N]\n"
    rows = {"length": "time [ms], load [mm]\n0, 0", "named": "time [s], force [N]\n0, 0", "none": heading}
    for name, text in (rows | {"nan": f"{heading}0, 0\n1, nan", "back": f"{heading}0, 0\n2, 1\n1, 3"}).items():
        (tmp_path / f"{name}.csv").write_text(text)
    with refused(key):
        read_study(study(BALL.split("[[program]]")[0] + program))


def test_study__that_cannot_be_read_is_named(study, tmp_path):
    table = BALL[BALL.index("[surface]") : BALL.index("[material]")]
    with refused("surface.file", "gone.sur"):
        read_study(study(BALL, (table, '[surface]\nfile = "gone.sur"\n')))
    for name, content in (("bad", b"title = "), ("latin", 'size = "5 µm"'.encode("cp1252")), ("none", None)):
        if content:
            (tmp_path / f"{name}.toml").write_bytes(content)
        with pytest.raises(InputError, match=f"{name}.toml"):
            read_study(tmp_path / f"{name}.toml")


@pytest.mark.parametrize(
    ("sweep", "key"),
    [
        ('[sweep]\n"program.0.load" = 3', "sweep.program.0.load"),
        ('[sweep]\n"program.7.load" = [3]', "program.7.load"),
        ('[sweep]\n"program.0.lod" = [1, 2]', "program.0.lod"),
        ('[sweep]\n"title.x" = [1]', "title.x"),
        ('[[sweep]]\n"program.0.load" = [1, 2]\n"solve.tolerance" = [1e-3]', "sweep.0"),
    ],
)
def test_sweep__is_refused_at_the_key(study, sweep, key):
    with pytest.raises(InputError, match=key.replace(".", r"\.")):
        read_cases(study(BALL + "\n" + sweep))


def test_read_cases__product(study):
    sweep = '\n[sweep]\n"program.0.load" = ["1 N", 2]\nmaterial.poisson = [0.4, 0.5]'
    cases = read_cases(study(BALL + sweep))
    assert [dict(case.varied) for case in cases] == [
        {"program.0.load": load, "material.poisson": nu} for load in (1.0, 2.0) for nu in (0.4, 0.5)
    ]
    assert [case.program.segments[0].end for case in cases] == [1, 1, 2, 2]
    assert len({case.key for case in cases}) == 4
    with pytest.raises(InputError, match="sweep"):
        read_study(study(BALL + sweep))


def test_read_cases__zipped(study):
    text = BALL + (
        '\n[[sweep]]\n"program.0.load" = [1, 2]\n"solve.tolerance" = [1e-3, 1e-4]\n[[sweep]]\n"program.0.load" = 3'
    )
    cases = read_cases(study(text))
    assert [(c.program.segments[0].end, c.settings.tolerance) for c in cases] == [
        (1, 1e-3),
        (2, 1e-4),
        (3, 1e-3),
    ]


def test_vary__changes_one_value(study):
    case = read_study(study())
    changed = vary(case, {"program.0.load": "3 N", "keep.times": 5})
    assert changed.program.segments[0].end == 3
    assert changed.varied == {"program.0.load": 3.0, "keep.times": 5}
    assert case.program.segments[0].end == 2
    with refused("program.0.load", -1):
        vary(case, {"program.0.load": -1})


def test_json__gives_the_case_back(study):
    for case in read_cases(study(BALL + '\n[sweep]\n"program.0.load" = ["1 N", 2]')):
        for again in (Case.from_json(case.to_json()), pickle.loads(pickle.dumps(case))):
            assert again == case
            assert again.key == case.key
    for wrong in ("nonsense", "{}"):
        with pytest.raises(InputError):
            Case.from_json(wrong)


def test_key__counts_what_determines_the_numbers(study):
    same = [
        ("A ball", "Another title"),
        ('"50 ms"', "0.05"),
        ('"3 MPa"', '"3e6 N/m^2"'),
        ('"10 mm"', '"1 cm"'),
        ('hold = "5 s"', 'hold = "5000 ms"'),
        ("[surface]", "[solve]\nboundary = 'free'\n[keep]\nfields = ['gap', 'pressure']\n[surface]"),
        ("[material]", "level = false\n[material]"),
    ]
    other = [
        ('"50 ms"', '"51 ms"'),
        ('"3 MPa"', '"3.00000000000001 MPa"'),
        ("[32, 24]", "[24, 32]"),
        ("[surface]", "[solve]\nboundary = 'periodic'\n[surface]"),
        ("[surface]", "[solve]\ntime_step = 0.01\n[surface]"),
        ("[surface]", "[keep]\ntimes = 3\n[surface]"),
        ("[surface]", "[keep]\nfields = ['gap']\n[surface]"),
        ("[material]", "level = 1\n[solve]\nboundary = 'free'\n[material]"),
        ('model = "zener"', 'model = "zener"\npoisson = 0.4'),
        ('model = "zener"', 'model = "zener"\nmodulus_factor = 2'),
    ]
    key = read_study(study()).key
    assert len(key) == 16
    assert int(key, 16)
    assert {read_study(study(BALL, pair)).key for pair in same} == {key}
    others = {read_study(study(BALL, pair)).key for pair in other}
    assert len(others) == len(other)
    assert key not in others


def test_key__knows_a_scan_by_its_content(study, tmp_path):
    table = BALL[BALL.index("[surface]") : BALL.index("[material]")]
    for name, content in (("a.sur", b"one"), ("b.sur", b"one"), ("c.sur", b"two")):
        (tmp_path / name).write_bytes(content)
    (tmp_path / "card.toml").write_text('title = "x"\nfile = "a.sur"\nlevel = 1')
    (tmp_path / "same.toml").write_text('licence = "CC0"\nfile = "b.sur"\nlevel = 1')
    (tmp_path / "other.toml").write_text('file = "a.sur"\nlevel = 2')
    names = ("a.sur", "b.sur", "c.sur", "card.toml", "same.toml", "other.toml")
    case = {n: read_study(study(BALL, (table, f'solve.boundary = "free"\n[surface]\nfile = "{n}"\n'))) for n in names}
    key = {name: case[name].key for name in names}
    assert key["a.sur"] == key["b.sur"]
    assert key["card.toml"] == key["same.toml"]
    assert len({key[n] for n in ("a.sur", "c.sur", "card.toml", "other.toml")}) == 4
    assert case["a.sur"].surface_sha256 == case["card.toml"].surface_sha256
    assert case["a.sur"].surface_sha256 != case["c.sur"].surface_sha256


PREFIXES = st.sampled_from([("um", 1e-6), ("nm", 1e-9), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("km", 1e3)])


@examples(60)
@given(digits=st.integers(1, 10**12), unit=PREFIXES)
def test_key__does_not_see_how_a_length_is_written(digits, unit):
    name, factor = unit
    base = Case.from_json(json.dumps(CASE))
    # the decimal that the reader sees, exactly scaled: what a person would have written in metres
    exponent = round(math.log10(factor))
    texts = (f"{digits} {name}", float(f"{digits}e{exponent}"), f"{digits}e{exponent} m", f"{digits}e{exponent + 3} mm")
    assert len({vary(base, {"surface.radius": text}).key for text in texts}) == 1


CASE = {
    "surface": {"generate": "sphere", "radius": 0.01, "size": [1e-3, 1e-3], "shape": [32, 24]},
    "material": {"model": "elastic", "shear_modulus": 1e6},
    "program": [{"load": 1.0, "over": 0.0}],
}
