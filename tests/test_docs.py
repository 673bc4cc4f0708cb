"""The documentation: its Python runs, its studies are accepted, its commands and names exist."""

import ast
import importlib
import inspect
import json
import operator
import os
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import fields
from pathlib import Path

import click
import pytest

import roughvisc as rv
from roughvisc.cli import main
from roughvisc.mechanics.materials import MODELS
from roughvisc.settings import Settings
from roughvisc.study.case import read_cases
from roughvisc.study.case_text import study_text
from roughvisc.study.study_file import GEOMETRY, TABLES, TEMPERATURE

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(p for p in DOCS.rglob("*.md") if not {"generated", "_build"} & set(p.parts))
_BLOCK = re.compile(r"(?P<before>[^\n]*)\n```(?P<language>\w+)\n(?P<text>.*?)\n```", re.S)
#: What a page's part of a study is completed with.
BASE = {
    "surface": {"generate": "wavy", "amplitude": 1e-5, "wavelength": 5e-4, "size": 1e-3, "shape": 16},
    "material": {"model": "zener", "shear_modulus": 3e6, "kelvin_modulus": 1e6, "kelvin_viscosity": 1e5},
    "program": [{"load": 1e-4, "over": 0.1}],
    "solve": {"boundary": "periodic", "tolerance": 1e-2},
    "keep": {"times": 2},
}
MEASURED = {
    "creep.csv": "time [s], compliance [1/MPa]\n0.01, 0.20\n0.1, 0.31\n1, 0.55\n10, 0.82\n",
    "relaxation.csv": "time [s], modulus [MPa]\n0.01, 3\n0.1, 2\n1, 1.5\n10, 1.2\n",
    "machine.csv": '"Prüfzeit [s]";"Standardkraft [N]";"Standardweg [mm]"\n12,30;-0,0004;0,1000\n'
    "12,40;0,0102;0,1021\n12,50;0,0199;0,1043\n12,60;0,0200;0,1050\n",
    "dma.csv": "frequency, storage [MPa], loss [MPa]\n0.1, 1, 0.2\n1, 1.5, 0.5\n10, 3, 0.6\n100, 3.5, 0.3\n",
}


README = ROOT / "README.md"


def named(path):
    return str(path.relative_to(ROOT))


def blocks(path, language):
    """Blocks of a language that are to be tried; one is left out by a comment above it that says why."""
    found = _BLOCK.finditer(path.read_text(encoding="utf-8"))
    return [b["text"] for b in found if b["language"] == language and "not run:" not in b["before"]]


@pytest.fixture
def there(tmp_path, monkeypatch):
    """The project's folder as a reader has it, with measured data."""
    shutil.copytree(ROOT / "surfaces", tmp_path / "surfaces")
    shutil.copytree(ROOT / "workflows", tmp_path / "workflows", ignore=shutil.ignore_patterns("results"))
    shown = re.findall(r"`([\w.]+)`:\n\n```text\n(.*?)\n```", (DOCS / "howto" / "machine.md").read_text("utf-8"), re.S)
    for name, text in [*MEASURED.items(), *shown]:
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def completed(text):
    """A study of which the page shows a part, with the tables that it lacks."""
    stated = tomllib.loads(text)
    lacking = {name: table for name, table in BASE.items() if name not in stated}
    if "program.0.pressure" in stated.get("sweep", {}):  # of a study by `roughvisc new`
        lacking["program"] = [{"pressure": "6 kPa", "over": "50 ms"}]
    if "friction" in stated:
        lacking = {name: table for name, table in lacking.items() if name not in ("program", "keep")}
    return text + "\n" + study_text(lacking)


@pytest.mark.parametrize("path", [README, *(p for p in PAGES if blocks(p, "toml"))], ids=named)
def test_studies__are_accepted(path, there):
    for number, text in enumerate(blocks(path, "toml")):
        file = there / ("workflows" if path.stem == "gallery" else ".") / f"study{number}.toml"
        file.write_text(completed(text))
        for case in read_cases(file):
            case.height()
            assert case.material.contact_compliance(1.0) > 0


def run_python(codes, folder):
    """Run blocks of code one after the other in a process of their own, where warnings to the user are errors."""
    script = folder / "script.py"
    strict = ["import warnings", 'warnings.simplefilter("error", UserWarning)']
    strict.append('warnings.filterwarnings("ignore", ".*above the tolerance")')  # examples have few cells
    tests = 'for name in [one for one in globals() if one.startswith("test_")]: globals()[name]()'
    script.write_text("\n".join([*strict, *codes, tests]))
    setting = {"MPLBACKEND": "agg", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, script], cwd=folder, env=os.environ | setting, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "path", [README, *(pytest.param(p, marks=pytest.mark.thorough) for p in PAGES if blocks(p, "python"))], ids=named
)
def test_python__runs(path, there):
    for text in blocks(path, "toml")[:1]:
        (there / {"tutorial": "first.toml"}.get(path.stem, "study.toml")).write_text(completed(text))
    run_python(blocks(path, "python"), there)


@pytest.mark.thorough
def test_notebook__runs(tmp_path):
    """In an empty folder: it needs no file but those that are installed."""
    cells = json.loads((DOCS / "first_contact.ipynb").read_text(encoding="utf-8"))["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    run_python([re.sub(r"^%.*$", "", one, flags=re.M) for one in code], tmp_path)


def test_commands__exist_with_their_options():
    tried = 0
    for path in [*PAGES, ROOT / "README.md"]:
        for text in blocks(path, "sh"):
            for verb, rest in re.findall(r"roughvisc (\w+)(.*)", text):
                command = main.commands[verb]
                known = {o for p in command.params if isinstance(p, click.Option) for o in p.opts}
                assert {w for w in rest.split("#")[0].split() if w.startswith("-")} <= known, (
                    f"{path.name}: {verb}{rest}"
                )
                tried += 1
    assert tried > 10


def test_reference__names_everything_public(docs_script):
    """The names of a section come from the package: each section that has names is on the page."""
    reference = docs_script("reference_names")
    page = (DOCS / "reference.md").read_text(encoding="utf-8")
    sections = reference.names()
    assert sorted(reference.MARK.findall(page)) == sorted(sections)
    listed = re.findall(r"^   ([\w.]+)$", reference.filled(page), re.M)
    public = {name for name in rv.__all__ if name != "__version__" and not inspect.ismodule(getattr(rv, name))}
    for module in ("plot", "observables", "closed_forms"):
        public |= {f"{module}.{name}" for name in getattr(rv, module).__all__}
    assert public <= set(listed)
    assert all(sections.values())
    assert {"zener", "wlf", "read_material"} <= set(sections["Materials"])


def test_reference__names_nothing_that_is_not_there(docs_script):
    page = docs_script("reference_names").filled((DOCS / "reference.md").read_text(encoding="utf-8"))
    for part in page.split(".. currentmodule:: ")[1:]:
        module = importlib.import_module(part.partition("\n")[0])
        for name in re.findall(r"^   ([\w.]+)$", part, re.M):
            assert operator.attrgetter(name)(module) is not None, name


def test_gallery__is_what_its_script_writes(docs_script):
    page = docs_script("make_gallery").page()
    assert page == (DOCS / "gallery.md").read_text(encoding="utf-8"), "run docs/make_gallery.py"


@pytest.mark.thorough
def test_pictures__are_not_older_than_the_code_that_draws_them(docs_script):
    gallery = docs_script("make_gallery")
    older = docs_script("picture_age").older(gallery.digests())
    names = {gallery.drawing_code()[path][0] for path in older}
    assert not older, f"python docs/make_gallery.py {' '.join(sorted(names))}; with --as-they-are if no picture changes"


def test_picture__is_older_after_an_edit_that_may_change_it(docs_script):
    age, study = docs_script("picture_age"), ROOT / "workflows" / "quickstart.toml"
    before = age.digest_of(ast.parse("def draw(ds):\n    'As it was.'\n    rv.plot.maps(ds, dpi=100)"), study)
    same = ast.parse("# a comment\ndef draw(ds):\n    rv.plot.maps(\n        ds, dpi=100\n    )")
    assert age.digest_of(same, study) == before
    for code in (
        "def draw(ds):\n    return rv.plot.maps(ds, dpi=120)",
        "def draw(ds):\n    return rv.plot.section(ds, dpi=100)",
    ):
        assert age.digest_of(ast.parse(code), study) != before
    assert age.digest_of(same, ROOT / "workflows" / "friction.toml") != before


def test_pictures__have_a_text_for_readers_who_do_not_see_them():
    for path in [README, *PAGES]:
        for text in re.findall(r"!\[(.*?)\]\(", path.read_text(encoding="utf-8")):
            assert len(text.split()) > 3, f"{named(path)}: {text}"


def test_tables__are_in_the_pages_as_the_package_has_them(docs_script):
    page_tables = docs_script("page_tables")
    tables = []
    for path in PAGES:
        page = path.read_text(encoding="utf-8")
        tables += [name for name, _ in page_tables.MARK.findall(page)]
        assert page_tables.filled(page) == page, f"{named(path)}: run docs/page_tables.py"
        new = page_tables.MARK.sub(r'<!-- table "\1" -->\n', page)  # as a contributor writes it, without tables
        assert page_tables.filled(new) == page, f"{named(path)}: run docs/page_tables.py"
    assert sorted(tables) == sorted(page_tables.TABLES)


def test_study_files_page__has_every_key_with_its_meaning(docs_script):
    page, study_keys = (DOCS / "study-files.md").read_text(encoding="utf-8"), docs_script("study_keys")
    for model in MODELS:
        assert "$$" in page.split(f"### `{model}`")[1].split("<!-- table")[0], f"{model} has no formula"
    keys = {}
    for table in study_keys.TABLES:
        rows = study_keys.rows(table)
        assert all(meaning for *_, meaning in rows), table
        keys[table] = {key for key, *_ in rows}
    assert keys["study"] == {*TABLES, "sweep"}
    assert keys["material: temperature"] | keys["material: thickness"] == {*TEMPERATURE, *GEOMETRY}
    assert keys["solve"] | keys["keep"] == {one.name for one in fields(Settings)} - {"missing", "adhesion"}
    assert keys["observe"] == {*rv.observables.OBSERVABLES}


def test_functions_and_comments__that_pages_name_are_there():
    named_there = re.compile(r'`([\w./-]+\.py)`:\s`([\w.]+)(?:\(\))?`((?:(?:,| and) "[^"]+")*)')
    found = [one for page in PAGES for one in named_there.findall(page.read_text(encoding="utf-8"))]
    assert len(found) > 20
    for path, name, comments in found:
        code = (ROOT / "roughvisc" / path).read_text(encoding="utf-8")
        assert re.search(rf"(def|class) {name.split('.')[-1]}\b", code), f"{path}: {name}"
        for comment in re.findall(r'"([^"]+)"', comments):
            assert f"# {comment}" in code, f"{path}: {comment}"


def test_links_and_files__are_there():
    for path in [README, *PAGES]:
        text = path.read_text(encoding="utf-8")
        for target in re.findall(r"\]\((?!https?:|#)([^)#]+)", text):
            assert (path.parent / target).exists(), f"{named(path)}: {target}"
        for name in re.findall(r"`([\w./-]+/[\w-]+\.py)`", text):
            assert any((folder / name).exists() for folder in (ROOT, ROOT / "roughvisc")), f"{named(path)}: {name}"
