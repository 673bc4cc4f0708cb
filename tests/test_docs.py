"""The documentation: its Python runs, its studies are accepted, its commands and names exist."""

import ast
import inspect
import json
import re
import shutil
import sys
import tomllib
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import click
import matplotlib
import pytest
from experiment.stack import LOADS, Stack, StackSection

import roughvisc as rv
from roughvisc.cli import main
from roughvisc.study.statement import schema
from roughvisc.study.statement.case import read_cases, read_study
from roughvisc.topography import instruments
from roughvisc.variables import axes
from roughvisc.views.sweep_figures.case_text import study_text

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
    "machine.csv": '"Prüfzeit";"Standardkraft";"Standardweg"\n"s";"N";"mm"\n12,30;-0,0004;0,1000\n'
    "12,40;0,0102;0,1021\n12,50;0,0199;0,1043\n12,60;0,0200;0,1050\n",
    "dma.csv": "frequency, storage [MPa], loss [MPa]\n0.1, 1, 0.2\n1, 1.5, 0.5\n10, 3, 0.6\n100, 3.5, 0.3\n",
}


#: Pages that lead a reader through the files of the package.
NAMES_FILES = ("how-a-solve-runs", "add-a-variable", "add-an-experiment", "add-your-own", "development")


README = ROOT / "README.md"


def named(path):
    return str(path.relative_to(ROOT))


def blocks(path, language):
    """Blocks of a language that are to be tried; one is left out by a comment above it that says why."""
    found = _BLOCK.finditer(path.read_text(encoding="utf-8"))
    return [b["text"] for b in found if b["language"] == language and "not run:" not in b["before"]]


@contextmanager
def as_before():
    """What a page adds to the package's tables is gone afterwards."""
    studies = (schema.Study, schema.StudyFile)
    tables = [instruments.READERS, rv.plot.FIGURES, axes.AXES]
    known = [(table, dict(table)) for table in (*tables, *(study.model_fields for study in studies))]
    experiments = list(schema.EXPERIMENTS)
    yield
    for table, before in known:
        table.clear()
        table.update(before)
    if experiments != schema.EXPERIMENTS:
        schema.EXPERIMENTS[:] = experiments
        for study in studies:
            study.model_rebuild(force=True)


@pytest.fixture
def there(tmp_path, monkeypatch):
    """The project's folder as a reader has it, with measured data."""
    shutil.copytree(ROOT / "surfaces", tmp_path / "surfaces")
    shutil.copytree(ROOT / "workflows", tmp_path / "workflows", ignore=shutil.ignore_patterns("results"))
    for name, text in MEASURED.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with as_before():
        yield tmp_path


def completed(text):
    """A study of which the page shows a part, with the tables that it lacks."""
    stated = tomllib.loads(text)
    lacking = {name: table for name, table in BASE.items() if name not in stated}
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
            assert case.material().contact_compliance(1.0) > 0


@pytest.mark.thorough
@pytest.mark.parametrize("path", [p for p in PAGES if blocks(p, "python")], ids=named)
def test_python__runs(path, there):
    for text in blocks(path, "toml")[:1]:
        (there / {"tutorial": "first.toml"}.get(path.stem, "study.toml")).write_text(completed(text))
    space = {}
    with matplotlib.rc_context({"backend": "agg"}):
        for text in blocks(path, "python"):
            exec(compile(text, str(path), "exec"), space)
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


def test_experiment_of_a_page__is_gone_afterwards(tmp_path):
    path = tmp_path / "stack.toml"
    loading = study_text(BASE)
    stacked = study_text({name: BASE[name] for name in ("surface", "material", "solve")} | {"stack": {"loads": [1.0]}})
    with as_before():
        axes.declare(LOADS)
        schema.add_experiment(StackSection, "stack")
        path.write_text(stacked)
        assert read_study(path).experiment() == Stack((1.0,))
    assert "load" not in axes.AXES
    with pytest.raises(rv.InputError, match="stack: unknown key"):
        read_study(path)
    path.write_text(loading)
    assert read_study(path).experiment().axis == "time"


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


def test_readme__is_short_and_has_the_numbers_of_the_pages_that_it_links():
    text = README.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 110
    said = text.split("## Accuracy and speed\n")[1].split("\n\n")[0]
    bullets = re.findall(r"^- \*\*(.*?)\*\*.*\]\((.*?)\)\)\.$", said, re.M)
    assert len(bullets) == len(said.splitlines()) == 3
    for number, page in bullets:
        assert number in (ROOT / page).read_text(encoding="utf-8"), f"{page} has no {number}"


def test_readme__runs_and_explains_eight_variables_of_its_dataset(there):
    text = README.read_text(encoding="utf-8")
    table = text.split("## What you get\n")[1].split("\n\n")[0]
    names = [name for row in table.splitlines()[2:] for name in re.findall(r"^\| `(\w+)`", row)]
    assert len(names) == 8
    space = {}
    with matplotlib.rc_context({"backend": "agg"}):
        (code,) = blocks(README, "python")
        exec(compile(code, str(README), "exec"), space)
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
    assert set(names) <= set(space["ds"].data_vars)


def test_reference__names_everything_public():
    listed = re.findall(r"^   (\w+)$", (DOCS / "reference.md").read_text(), re.M)
    public = {name for name in rv.__all__ if name != "__version__" and not inspect.ismodule(getattr(rv, name))}
    assert public <= set(listed)
    functions = set(re.findall(r"^   (\w+\.\w+)$", (DOCS / "reference.md").read_text(), re.M))
    assert functions == {f"{name}.{one}" for name in ("plot", "observables") for one in getattr(rv, name).__all__}


def test_gallery__shows_every_study_as_it_is():
    text = (DOCS / "gallery.md").read_text(encoding="utf-8")
    for study in (ROOT / "workflows").glob("*.toml"):
        assert study.read_text(encoding="utf-8").rstrip() in text, f"run docs/make_gallery.py: {study.name} has changed"
    for picture in re.findall(r"\]\((.*?\.png)\)", text):
        assert 0 < (DOCS / picture).stat().st_size < 400_000


def test_gallery__is_made_by_running_a_study(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    import make_gallery

    make_gallery.draw("load_sweep", tmp_path)
    assert (tmp_path / "load_sweep-area.png").stat().st_size > 5000
    assert make_gallery.page() == (DOCS / "gallery.md").read_text(encoding="utf-8")


def test_notebook__runs_and_shows_what_it_gives(tmp_path, monkeypatch):
    cells = [
        one for one in json.loads((DOCS / "first_contact.ipynb").read_text())["cells"] if one["cell_type"] == "code"
    ]
    assert all(cell["execution_count"] == number for number, cell in enumerate(cells, 1)), "run docs/make_gallery.py"
    kinds = {kind for cell in cells for output in cell["outputs"] for kind in output.get("data", ())}
    assert {"image/png", "text/html"} <= kinds
    assert not any(output["output_type"] == "error" for cell in cells for output in cell["outputs"])
    monkeypatch.chdir(tmp_path)  # it needs no file but those that are installed
    space = {}
    with matplotlib.rc_context({"backend": "agg"}):
        for cell in cells:
            exec("".join(line for line in cell["source"] if not line.startswith("%")), space)
    sys.modules["matplotlib.pyplot"].close("all")
    assert space["both"].shape == (160, 256)


#: A piece of code in the text of a page, and the paths and functions among them.
_SPAN = re.compile(r"`([^`\n]+)`")
_PATH = re.compile(r"(?:[\w-]+/)+(?:[\w-]+\.py)?")
_CALL = re.compile(r"((?:\w+\.)*\w+)\(\)")


def place_of(path):
    """File or folder that a page means; below the package where it says no more."""
    roots = (ROOT, ROOT / "roughvisc", ROOT / "tests" / "faults")
    return next((root / path for root in roots if (root / path).exists()), None)


def names_in(path):
    """Functions, classes and methods of a module, the latter with their class's name in front and without."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ClassDef):
            methods = {one.name for one in node.body if isinstance(one, ast.FunctionDef)}
            found |= {node.name, *methods, *(f"{node.name}.{one}" for one in methods)}
        elif isinstance(node, ast.FunctionDef):
            found.add(node.name)
    return found


def pieces(path):
    """Paragraphs, items and rows of a page, without its code."""
    text = _BLOCK.sub("\n", path.read_text(encoding="utf-8"))
    return re.split(r"\n\n|\n(?=[|-]|\d+\. )", text)


def test_files__that_pages_name_are_there():
    tried = 0
    for page in PAGES:
        for piece in pieces(page):
            for span in _SPAN.findall(piece):
                is_path = _PATH.fullmatch(span) or re.fullmatch(r"\w+\.py", span)
                if is_path and (page.stem in NAMES_FILES or ("/" in span and span.endswith(".py"))):
                    assert place_of(span) is not None, f"{named(page)}: {span}"
                    tried += 1
    assert tried > 80


def test_functions__that_pages_name_beside_a_file_are_in_it():
    """The file is the last one named before, in the same paragraph, item or row."""
    tried = 0
    for page in (p for p in PAGES if p.stem in NAMES_FILES):
        for piece in pieces(page):
            file = None
            for span in _SPAN.findall(piece):
                if _PATH.fullmatch(span) or span.endswith(".py"):
                    file = place_of(span)
                elif (call := _CALL.fullmatch(span)) and file is not None and file.is_file():
                    assert call[1] in names_in(file), f"{named(page)}: {span} in {file}"
                    tried += 1
    assert tried > 40


def test_code__fits_its_page():
    """A line of 98 characters fits beside the sidebars; the gallery, which has none, shows studies as they are."""
    for path in PAGES:
        for block in _BLOCK.finditer(path.read_text(encoding="utf-8")):
            longest = max(block["text"].splitlines(), key=len)
            assert len(longest) <= (120 if path.stem == "gallery" else 98), f"{named(path)}: {longest}"
    for cell in json.loads((DOCS / "first_contact.ipynb").read_text())["cells"]:
        assert cell["cell_type"] != "code" or all(len(line) <= 98 for line in cell["source"])


def test_lines__are_not_taken_for_comments():
    """MyST leaves out a line that begins with a percent sign, as a wrapped "5 %" may."""
    for path in PAGES:
        for line in _BLOCK.sub("\n", path.read_text(encoding="utf-8")).splitlines():
            assert not line.lstrip().startswith("%"), f"{named(path)}: {line}"


def test_links__lead_somewhere():
    for path in [README, *PAGES]:
        for target in re.findall(r"\]\((?!https?:|#)([^)#]+)", path.read_text(encoding="utf-8")):
            assert (path.parent / target).exists(), f"{named(path)}: {target}"


def public():
    """Functions that a user may call, by name."""
    modules = (rv, rv.plot, rv.observables, rv.closed_forms)
    found = {f"{module.__name__}.{name}": getattr(module, name) for module in modules for name in module.__all__}
    found |= {f"Program.{name}": getattr(rv.Program, name) for name in ("load", "approach", "hold", "table", "cycle")}
    return {name: one for name, one in found.items() if inspect.isroutine(one)}


@pytest.mark.parametrize("name", sorted(public()))
def test_public_functions__say_what_goes_in_and_what_comes_out(name):
    function = public()[name]
    text, signature = inspect.getdoc(function), inspect.signature(function)
    sections = {line for line, rule in pairwise(text.splitlines()) if rule.startswith("---")}
    if signature.parameters:
        assert "Parameters" in sections
    assert sections & {"Returns", "Yields", "Examples"} or str(signature.return_annotation) in ("None", "Program")
