"""The matrix of installations, run by hand before a release; prints a table.

Wheel and source archive are built here, and each is installed in an environment of its own. There, in an empty folder,
the example is written and run, as somebody does who has nothing but the archive; then a part of the tests runs against
what was installed, and the notebook of the documentation::

    python .ci/installations.py                                  # all of it; needs uv
    python .ci/installations.py --python 3.13 --libraries highest --no-tests
    python .ci/installations.py --python /usr/bin/python3.14     # an interpreter that uv does not find
"""

from __future__ import annotations

import argparse
import itertools
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
LIBRARIES = ("lowest-direct", "highest")
#: Python and libraries with which tests run, and which.
TESTED = (("3.11", "lowest-direct"), ("3.13", "highest"), ("3.14", "highest"))
TESTS = ("tests/topography", "tests/study/study_file", "tests/mechanics/contact")
#: What is named beside Python in the table.
_TOLD = ("numpy", "scipy", "xarray", "netCDF4")
_NOTEBOOK = "first_contact.ipynb"


class Failed(Exception):
    """A command ended with another status than 0; what it said last."""


def ran(*command: str | Path, at: Path, **settings: str) -> str:
    """What a command writes; the environment of the one who calls does not reach the package."""
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(list(map(str, command)), cwd=at, env=kept | settings, capture_output=True, text=True)
    if done.returncode:
        last = (done.stdout + done.stderr).strip().splitlines()[-15:]
        raise Failed("\n".join([" ".join(map(str, command)), *last]))
    return done.stdout


def built(at: Path) -> dict[str, Path]:
    """The wheel and the source archive of this checkout."""
    ran("uv", "build", "--native-tls", "--quiet", "--out-dir", at, ROOT, at=at)
    return {"wheel": next(at.glob("*.whl")), "sdist": next(at.glob("*.tar.gz"))}


def install(archive: Path, python: str, libraries: str, extra: str, at: Path) -> Path:
    """A clean environment with an archive; the folder of its commands."""
    where = at / "environment"
    ran("uv", "venv", "--quiet", "--python", python, where, at=at)
    wanted = [f"{archive}[{extra}]" if extra else archive]
    options = ["--quiet", "--native-tls", "--resolution", libraries, "--python", where]
    if libraries == "lowest-direct":  # what an archive asks for counts as direct only where it is named beside it
        named = declared(extra)
        wanted += named  # the lowest of each that has a wheel for this Python: nobody compiles NumPy here
        options += [part for one in named for part in ("--only-binary", re.split(r"[^\w-]", one)[0])]
    ran("uv", "pip", "install", *options, *wanted, at=at)
    return where / "bin"


def declared(extra: str) -> list[str]:
    """What pyproject.toml asks for, with an extra."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    others = [one for one in project["optional-dependencies"].get(extra, []) if not one.startswith(project["name"])]
    return project["dependencies"] + others


def example(commands: Path, at: Path) -> None:
    """Write and run the example in an empty folder, and look at its result."""
    empty = at / "empty"
    empty.mkdir()
    ran(commands / "roughvisc", "new", at=empty)
    ran(commands / "roughvisc", "run", "focus_variation-study.toml", at=empty)
    (result,) = (empty / "results" / "focus_variation-study").glob("*.nc")
    ran(commands / "roughvisc", "verify", result.parent, at=empty)


def unpacked(sdist: Path, at: Path) -> Path:
    """The source archive without the package: its tests then import what is installed."""
    with tarfile.open(sdist) as archive:
        archive.extractall(at, filter="data")
    (folder,) = at.glob("roughvisc-*")
    shutil.rmtree(folder / "roughvisc")
    return folder


def tests(commands: Path, sdist: Path, libraries: str, at: Path) -> str:
    """How a part of the tests ends; the warnings of old libraries are their own."""
    folder = unpacked(sdist, at)
    ignoring = ("-o", "filterwarnings=ignore") if libraries != "highest" else ()
    said = ran(commands / "python", "-m", "pytest", "-q", "-x", *ignoring, *TESTS, at=folder)
    return said.strip().splitlines()[-1].strip("= ")


def notebook(wheel: Path, python: str, at: Path) -> str:
    """Run the notebook of the documentation with nothing but the wheel and Jupyter, in an empty folder."""
    commands = install(wheel, python, "highest", "", at)
    options = ("--quiet", "--native-tls", "--python", commands.parent)
    ran("uv", "pip", "install", *options, "nbconvert", "ipykernel", at=at)
    empty = at / "empty"
    empty.mkdir()
    shutil.copy(ROOT / "docs" / _NOTEBOOK, empty)
    convert = ("nbconvert", "--to", "notebook", "--execute", "--output", "again.ipynb", _NOTEBOOK)
    ran(commands / "jupyter", *convert, at=empty, PATH=f"{commands}:{os.environ['PATH']}")
    return f"{_NOTEBOOK}: runs"


def versions(commands: Path, at: Path) -> str:
    """Python and the libraries that were chosen."""
    asked = f"from importlib.metadata import version; import sys; print(sys.version.split()[0], *map(version, {_TOLD}))"
    python, *others = ran(commands / "python", "-c", asked, at=at).split()
    return f"{python} | {', '.join(f'{name} {found}' for name, found in zip(_TOLD, others, strict=True))}"


def row(archives: dict[str, Path], python: str, kind: str, libraries: str, tested: bool, at: Path) -> str:
    """One line of the table; raises :class:`Failed`."""
    tested = tested and kind == "wheel"
    commands = install(archives[kind], python, libraries, "test" if tested else "", at)
    example(commands, at)
    ended = tests(commands, archives["sdist"], libraries, at) if tested else ""
    return f"{versions(commands, at)} | {libraries} | {kind} | runs | {ended}"


def main(arguments: list[str] | None = None) -> int:
    """Print the table; the number of installations that failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", nargs="+", default=PYTHONS, help="versions, or paths of interpreters")
    parser.add_argument("--archive", nargs="+", default=("wheel", "sdist"))
    parser.add_argument("--libraries", nargs="+", default=LIBRARIES)
    parser.add_argument("--no-tests", action="store_true")
    parser.add_argument("--no-notebook", action="store_true")
    given = parser.parse_args(arguments)
    failures = 0
    with tempfile.TemporaryDirectory(prefix="installations-") as top:
        archives = built(Path(top))
        print("| Python | libraries | resolved | archive | example | tests |\n|---|---|---|---|---|---|", flush=True)
        for python, kind, libraries in itertools.product(given.python, given.archive, given.libraries):
            tested = not given.no_tests and any(version in python and libraries == which for version, which in TESTED)
            with tempfile.TemporaryDirectory(dir=top) as at:
                try:
                    line = row(archives, python, kind, libraries, tested, Path(at))
                except Failed as failed:
                    failures += 1
                    print(failed, file=sys.stderr, flush=True)
                    line = f"{python} | | {libraries} | {kind} | FAILED | "
                print(f"| {line} |", flush=True)
        for python in () if given.no_notebook else given.python[-1:]:
            with tempfile.TemporaryDirectory(dir=top) as at:
                try:
                    print(f"\n{notebook(archives['wheel'], python, Path(at))}")
                except Failed as failed:
                    failures += 1
                    print(failed, file=sys.stderr)
    return failures


if __name__ == "__main__":
    sys.exit(main())
