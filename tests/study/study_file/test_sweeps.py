"""``[sweep]`` and ``[[sweep]]``: products, lists, patterns of files and realisations; refusals at the key."""

import pytest
from support import refused

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.study.case import Case, read_study, vary

ROUGH = {"generate": "self_affine", "size": "1 mm", "shape": [9, 7], "hurst": 0.8, "rms_slope": 0.1, "seed": 5}
GAUSSIAN = ROUGH | {"amplitudes": "gaussian"}
SCAN, MIRROR = {"file": "rough.nc"}, {"boundary": "mirror"}
LOADS = {"program.0.load": ["1 N", 2]}


def test_product__of_all_lists(read, tmp_path):
    cases = read(sweep=LOADS | {"material": {"poisson": [0.4, 0.5]}})
    assert [dict(case.varied) for case in cases] == [
        {"program.0.load": load, "material.poisson": nu} for load in (1.0, 2.0) for nu in (0.4, 0.5)
    ]
    assert [case.program.segments[0].end for case in cases] == [1, 1, 2, 2]
    assert len({case.key for case in cases}) == 4
    with refused("sweep", "4 cases"):
        read_study(tmp_path / "study.toml")


def test_lists__entry_by_entry_table_after_table(read):
    cases = read(sweep=[{"program.0.load": [1, 2], "solve.tolerance": [1e-3, 1e-4]}, {"program.0.load": 3}])
    found = [(case.program.segments[0].end, case.settings.tolerance) for case in cases]
    assert found == [(1, 1e-3), (2, 1e-4), (3, 1e-3)]


def test_times__after_the_end_of_a_program_are_left_out_of_its_case(read, tmp_path):
    holds = {"program.1.hold": [0.1, "1 s"]}
    changes = {"surface.shape": [12, 9], "program.0.load": "1 mN", "keep.times": [0.05, "0.1 s", 1], "keep.fields": []}
    cases = read(changes, sweep=holds)
    assert [case.settings.times for case in cases] == [(0.05, 0.1), (0.05, 0.1, 1.0)]
    assert [case.late_times for case in cases] == [(1.0,), ()]
    assert Case.from_json(cases[0].to_json()).key == cases[0].key
    assert read(changes | {"keep.times": [0.05, 0.1], "program.1.hold": 0.1})[0].key == cases[0].key
    assert [("1 s" in note) for note in rv.plan(cases).note.values] == [True, False]
    done = rv.sweep(cases, tmp_path, workers=0, progress=False)
    assert done.time.count("row").values.tolist() == [2, 3]
    (log,) = (line for path in tmp_path.glob("*.log") for line in path.read_text().splitlines() if "left out" in line)
    assert cases[0].key in log
    for short in (
        changes | {"program.1.hold": 0.1},
        changes | {"program.1.hold": 0.1, "sweep": {"material.poisson": [0.4, 0.5]}},
        changes | {"keep.times": [0.1, 3], "sweep": holds},
        changes | {"keep.times": [3], "sweep": holds},
    ):
        with refused("keep.times"):
            read(short)


def test_pattern__stands_for_the_files_that_match_it(read, tmp_path):
    for name in ("b.csv", "a.csv", "c.txt", "d[1].csv", "deep/e.csv"):
        (tmp_path / "creep" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "creep" / name).write_text(f"time [s], compliance [1/Pa]\n0, 1\n1, {2 + len(name)}")
    (tmp_path / "creep" / "folder.csv").mkdir()

    def files(stated, **more):
        sweep = {"material.file": stated, **more}
        creep = {"model": "creep_table", "file": "creep/a.csv", "kind": "shear"}
        return [case.varied["material.file"] for case in read(material=creep, sweep=[sweep] if more else sweep)]

    every = ["creep/a.csv", "creep/b.csv", "creep/d[1].csv"]
    assert files("creep/*.csv") == every
    assert files("creep/*.csv", **{"material.noise": [0.1, 0.2, 0.3]}) == every
    assert files(["creep/c.txt", "creep/[ab].csv"]) == ["creep/c.txt", *every[:2]]
    assert files(["creep/d[1].csv"]) == every[2:], "the name of a file is no pattern"
    assert files("**/e.csv") == ["creep/deep/e.csv"]
    assert files(f"{tmp_path}/creep/*.txt") == [str(tmp_path / "creep" / "c.txt")]
    with refused("sweep.material.file"):
        files("creep/*.sur")


@pytest.fixture
def realised(read, tmp_path):
    """Reads the cases of a sweep over realisations of a surface."""
    (tmp_path / "rough.nc").write_text("a scan, by its name")

    def cases(surface, sweep=None, **solve):
        pressed = [{"pressure": "10 kPa", "over": 0}]
        return read(surface=surface, program=pressed, solve=solve or None, sweep=sweep)

    return cases


def test_realisations__of_generated_roughness_are_the_seeds_from_the_stated_one(realised):
    (plain,), three = realised(GAUSSIAN), realised(GAUSSIAN, {"realisations": 3})
    assert [dict(case.varied) for case in three] == [
        {"surface.seed": 4 + number, "realisation": number} for number in (1, 2, 3)
    ]
    assert [case.key for case in three] == [vary(plain, {"surface.seed": seed}).key for seed in (5, 6, 7)]
    more = realised(GAUSSIAN, {"realisations": 5})
    assert [case.key for case in more[:3]] == [case.key for case in three], "those that are there are used again"


def test_realisations__of_a_scan_are_the_scan_itself_and_its_surrogates(realised):
    (plain,), cases = realised(SCAN, **MIRROR), realised(SCAN, {"realisations": 2}, **MIRROR)
    assert [dict(case.varied) for case in cases] == [{"realisation": number} for number in (0, 1, 2)]
    assert cases[0].key == plain.key
    assert [c.key for c in cases[1:]] == [vary(plain, {"surface.realisation": number}).key for number in (1, 2)]


def test_realisations__are_crossed_with_lists_and_belong_to_their_table(realised):
    crossed = realised(GAUSSIAN, {"realisations": 2, "program.0.pressure": ["1 kPa", "2 kPa"]})
    told = [(case.varied["program.0.pressure"], case.varied["realisation"]) for case in crossed]
    assert told == [(1e3, 1), (1e3, 2), (2e3, 1), (2e3, 2)]
    tables = [{"realisations": 2, "surface.hurst": [0.6, 0.7]}, {"surface.hurst": 0.9}]
    found = [(case.surface["hurst"], case.varied.get("realisation")) for case in realised(GAUSSIAN, tables)]
    assert found == [(0.6, 1), (0.6, 2), (0.7, 1), (0.7, 2), (0.9, None)]
    kinds = realised(GAUSSIAN, [{"realisations": 2, "surface": [SCAN]}], **MIRROR)
    assert [case.varied["realisation"] for case in kinds] == [0, 1, 2]


@pytest.mark.parametrize(
    ("surface", "sweep"),
    [
        (GAUSSIAN, {"realisations": 1}),
        (GAUSSIAN, {"realisations": [6, 24]}),
        (ROUGH, {"realisations": 3}),
        (GAUSSIAN | {"second": GAUSSIAN}, {"realisations": 3}),
        (GAUSSIAN, {"realisations": 3, "surface.seed": [1, 2]}),
        (SCAN | {"realisation": 2}, {"realisations": 3}),
        ({"generate": "sphere", "radius": "1 mm", "size": "0.1 mm", "shape": 9}, {"realisations": 3}),
    ],
)
def test_realisations__are_refused_if_the_surface_has_none(realised, surface, sweep):
    with refused("sweep.realisations"):
        realised(surface, sweep)


@pytest.mark.parametrize(
    ("sweep", "key"),
    [
        ({"program.0.load": 3}, "sweep.program.0.load"),
        ({"program.7.load": [3]}, "program.7.load"),
        ({"program.0.lod": [1, 2]}, "program.0.lod"),
        ({"program.0.load": [1, -2]}, "program.0.load"),
        ({"title.x": [1]}, "title.x"),
        ({"observe.leakage.viscosity": [1, 2]}, "observe.leakage.viscosity"),
        ([{"program.0.load": [1, 2], "solve.tolerance": [1e-3]}], "sweep.0"),
        ([], "sweep"),
    ],
)
def test_sweep__is_refused_at_the_key(read, sweep, key):
    with refused(key):
        read(sweep=sweep)


def test_sweep__of_a_misspelt_step_suggests_the_step(read):
    with pytest.raises(InputError, match=r"surface\.fliter: unknown key; did you mean 'filter'\?"):
        read(sweep={"surface.fliter": ["2 um"]})
