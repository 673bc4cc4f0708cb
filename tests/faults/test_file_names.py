"""Files that cannot be opened: pipes and folders under names of results, names of another locale, empty paths."""

import os
import resource
import shutil
import subprocess
import sys

import pytest
from support import SMALL, refused

import roughvisc as rv
from roughvisc.cli import main
from roughvisc.cli.group import PATH
from roughvisc.errors import RoughviscError
from roughvisc.plot.save import in_parallel
from roughvisc.runs.run import run_case

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="files of POSIX")

TWO = SMALL + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'
#: Every name in a folder of results; KEY is the key of the second case.
NAMES = {
    "KEY.nc",
    ".cases.json.gz",
    ".index.json.gz",
    "sweep.log",
    "cases.csv",
    ".KEY.lock",
    ".KEY.unfinished",
    ".KEY.unfinished/state.npz",
    ".KEY.unfinished/rows-0000.npz",
    ".KEY.0123abcd.part.nc",
    "KEY.failed.json",
    "KEY.nc.damaged",
    "KEY.csv",
    "load_5mN-history.png",
    "KEY-report.html",
    "load_5mN-maps.png",
    "sweep-force.png",
    "report.html",
}
#: Names at which the program reads or appends without a rename.
OPENED = (".cases.json.gz", ".index.json.gz", "sweep.log", ".KEY.unfinished/state.npz")
QUICK = (("run", "two.toml", "--workers", "0", "-q", "--out"), ("table",))
COMMANDS = (
    *QUICK,
    *(("plot", "--all"), ("report",), ("verify",), ("audit",), ("clean",), ("clean", "--all")),
    *(("plot", "KEY"), ("report", "KEY"), ("table", "KEY")),
)
KINDS = {
    "pipe": os.mkfifo,
    "folder": os.mkdir,
    "link": lambda path: os.symlink("/nowhere/at/all", path),
}


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A folder with the results of two cases, their keys and their study."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "two.toml").write_text(TWO)
    cases = rv.read_cases(folder / "two.toml")
    rv.sweep(cases, folder / "out", workers=0, progress=False)
    return folder, [case.key for case in cases]


@pytest.mark.timeout(1800)
@pytest.mark.parametrize(
    ("kind", "names", "commands"),
    [
        pytest.param("pipe", OPENED, QUICK, id="quick"),
        *(pytest.param(kind, sorted(NAMES), COMMANDS, marks=pytest.mark.long, id=kind) for kind in KINDS),
    ],
)
def test_no_regular_file__under_any_name_ends_in_one_sentence(
    swept, tmp_path, invoke, monkeypatch, coarse_pictures, kind, names, commands
):
    monkeypatch.setattr("roughvisc.runs.cluster.threads_each", lambda _: 1)  # a pool takes seconds
    source, (other, key) = swept
    (tmp_path / "two.toml").write_text(TWO)
    for name in names:
        of_one = name.startswith("KEY") and "nc" not in name
        for verb, *options in commands if of_one else [one for one in commands if "KEY" not in one]:
            out = tmp_path / "out"
            shutil.copytree(source / "out", out)
            sound = (out / f"{other}.nc").read_bytes()
            place = out / name.replace("KEY", key)
            if "unfinished" in name or "lock" in name or "part" in name:
                (out / f"{key}.nc").unlink()
            place.parent.mkdir(exist_ok=True)
            place.unlink(missing_ok=True)
            if name.endswith(".damaged"):
                (out / f"{key}.nc").write_text("damaged")
            KINDS[kind](place)
            target = out / f"{key}.nc" if options == ["KEY"] else out
            status, _, err = invoke(verb, *(one for one in options if one != "KEY"), target)
            case = (name, verb, *options, err)
            assert status in (0, 1, 2), case
            assert all(line.startswith(("roughvisc: ", "drawing: ", "report: ")) for line in err.splitlines()), case
            assert status == 0 or key in err or name in err, case
            assert (out / f"{other}.nc").read_bytes() == sound, case
            if name in OPENED and status == 2:
                assert os.path.lexists(place), case
            shutil.rmtree(out)
    with refused(found=str(tmp_path)):
        rv.read_study(tmp_path)


def test_empty_path__is_refused_by_every_option(invoke, tmp_path):
    """It would be the current folder."""
    (tmp_path / "0123456789abcdef.failed.json").write_text("{}")
    tried = 0
    for command in main.commands.values():
        for place, option in enumerate(one for one in command.params if isinstance(one.type, type(PATH))):
            named = [option.opts[0]] if option.opts[0].startswith("-") else []
            before = [] if place == 0 else ["x"]
            status, out, err = invoke(command.name, *before, *named, "")
            assert (status, out, err.count("\n"), ": found ''" in err) == (2, "", 1, True), (command.name, named, err)
            tried += 1
    assert tried > 20
    assert [one.name for one in tmp_path.iterdir()] == ["0123456789abcdef.failed.json"]


def test_empty_path__is_refused_by_every_function(swept, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    case = rv.read_cases(swept[0] / "two.toml")[0]
    ds = rv.open_result(swept[0] / "out" / f"{case.key}.nc")
    reads = (rv.open_scan, rv.read_study, rv.read_cases, rv.read_program, rv.open_result, rv.run, rv.sweep, rv.plan)
    calls = [("path", read) for read in reads]
    calls += [("out", rv.open_results), ("out", rv.to_table), ("results", rv.report)]
    calls += [("path", lambda path: rv.to_csv(ds, path)), ("path", lambda path: rv.plot.animate(ds, path))]
    calls += [("path", lambda path: rv.save_scan(ds.height, path)), ("path", lambda path: rv.report(ds, path))]
    for function in (rv.run, rv.trade, rv.budget):
        calls.append(("out", lambda out, function=function: function(case, out=out, progress=False)))
    for function in (rv.sweep, rv.plan, rv.observe):
        calls.append(("out", lambda out, function=function: function([case], out)))
    for key, call in calls:
        with refused(key, ""):
            call("")
    for key in ("surface", "surface.second"):
        with refused(f"{key}.file", ""):
            rv.vary(case, {f"{key}": {"file": ""}} if key == "surface" else {key: {"file": "", "level": 1}})
    (tmp_path / "card.toml").write_text('file = ""')
    with refused("file", ""):
        rv.open_scan(tmp_path / "card.toml")
    assert [one.name for one in tmp_path.iterdir()] == ["card.toml"]


def test_process_of_a_pool__that_is_killed_is_one_sentence():
    with pytest.raises(RoughviscError, match="killed"):
        in_parallel(os._exit, [9, 9], 2, "drawing")


@pytest.mark.thorough
def test_locale_without_letters__damages_no_result(swept, tmp_path):
    """As a batch system starts a process: the names of files are ASCII."""
    folder = tmp_path / "größe"
    folder.mkdir()
    shutil.copytree(swept[0] / "out", folder / "out")
    (folder / "zwölf.toml").write_text(TWO)
    (folder / "scan.toml").write_text('file = "fünf.csv"\n')
    before = {path.name: path.read_bytes() for path in (folder / "out").glob("*.nc")}
    run = ["run", "zwölf.toml", "--out", "out", "--workers", "0", "-q"]
    lines = [
        ["verify", str(folder / "out")],
        ["table", str(folder / "out" / next(iter(before)))],
        run,
        ["run", "zwölf.toml", "--out", "neu ö", "--workers", "0", "-q"],
        ["scan", "scan.toml"],
    ]
    code = "import sys\nfrom roughvisc.cli import main\n"
    code += "for line in sys.argv[1:]:\n    try: main(line.split('|'))\n    except SystemExit as end: print(end.code)"
    command = [sys.executable, "-c", code, *map("|".join, lines)]
    environment = os.environ | {"LC_ALL": "C", "PYTHONUTF8": "0"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True)
    statuses = [int(line) for line in done.stdout.splitlines() if line.isdigit()]
    assert statuses == [0, 0, 0, 0, 2], done.stderr
    assert b"Traceback" not in done.stderr
    assert {path.name: path.read_bytes() for path in (folder / "out").glob("*.nc*")} == before
    assert len(list((folder / "neu ö").glob("*.nc"))) == 2
    with rv.open_result(next((folder / "neu ö").glob("*.nc"))) as ds:
        assert ds.attrs["history"].endswith("run of zwölf.toml")


def test_too_many_open_files__are_no_damage(swept, tmp_path):
    shutil.copytree(swept[0] / "out", tmp_path / "out")
    (tmp_path / "two.toml").write_text(TWO)
    (tmp_path / "map.csv").write_text("1,2,4\n2,3,7\n")
    case, result = rv.read_cases(tmp_path / "two.toml")[0], tmp_path / "out" / f"{swept[1][0]}.nc"
    before = result.read_bytes()
    reads = {
        "two.toml": lambda: rv.read_cases(tmp_path / "two.toml"),
        "map.csv": lambda: rv.open_scan(tmp_path / "map.csv", unit="um", spacing="1 um"),
        "two.toml ": lambda: rv.read_program(tmp_path / "two.toml"),
        result.name: lambda: rv.open_result(result),
        f"{result.name} ": lambda: run_case(case, tmp_path / "out"),
    }
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    messages = {}
    for read in reads.values():  # what a process loads once
        try:
            read()
        except rv.InputError:
            continue
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))
    try:
        for name, read in reads.items():
            try:
                read()
            except rv.InputError as error:
                messages[name] = str(error)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    for name in reads:
        assert f"{name.strip()}: cannot be read: Too many open files" in messages[name]
    assert {path.name for path in result.parent.glob("*.nc*")} == {f"{key}.nc" for key in swept[1]}
    assert result.read_bytes() == before
