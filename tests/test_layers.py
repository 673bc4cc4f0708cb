"""The rooms of the package and the directions in which they may import each other."""

import ast
import pathlib
import subprocess
import sys
from graphlib import TopologicalSorter

import pytest

ROOT = pathlib.Path(__file__).parents[1]
PACKAGE = ROOT / "roughvisc"

#: room -> rooms it may import from (its own is implied). A room is a sub-package, or a folder or file that has none.
_LABELS = {"errors", "groups", "labels", "notebook", "units", "variables"}
_BODY = {"mechanics.bodies", "mechanics.materials"}
_ARRAYS = {"mechanics.arrays", "mechanics.sparse"}
_MARCH = {*_BODY, *_ARRAYS, "mechanics.contact", "mechanics.hereditary", "mechanics.stepping"}
_PROBLEM = {*_LABELS, *_BODY, "topography", "settings"}
_EXPERIMENT = {*_PROBLEM, *_MARCH, "mechanics.sliding", "problem", "recorder"}
_SOLVE = {
    *_EXPERIMENT,
    "experiment",
    "progress",
}
_STATEMENT = {*_PROBLEM, "mechanics.stepping", "experiment"}
_STORAGE = {*_STATEMENT, *_MARCH, "recorder", "study.statement", "study.ensembles"}
_EXECUTION = {*_SOLVE, *_STORAGE, "solve", "study.storage"}
_AUDIT = {*_STORAGE, "mechanics.closed_forms", "study.storage"}
_COST = {*_EXECUTION, "study.execution", "study.audit"}
_TRADE = {*_COST, "study.cost", "mechanics.closed_forms"}
ALLOWED = {
    "errors": set(),
    "lazy": set(),
    "units": {"errors"},
    "tables": {"errors", "units"},
    "variables": {"errors", "units"},
    "labels": {"errors", "units", "variables"},
    "groups": {"errors", "variables"},
    "notebook": set(),
    "progress": {"errors"},
    "mechanics.materials": {"errors", "notebook", "units"},
    "mechanics.arrays": set(),
    "mechanics.sparse": {"mechanics.arrays"},
    "mechanics.bodies": {*_ARRAYS, "errors", "mechanics.materials", "units"},
    "mechanics.contact": {*_ARRAYS, "errors", "mechanics.bodies"},
    "mechanics.hereditary": {*_ARRAYS, "errors", "mechanics.materials"},
    "mechanics.stepping": {*_MARCH, "errors", "notebook", "units"} - {"mechanics.stepping"},
    "mechanics.sliding": {"errors", "mechanics.arrays", "mechanics.contact", "mechanics.bodies"},
    "mechanics.transport": {"errors", "mechanics.contact", "mechanics.bodies"},
    "mechanics.closed_forms": {*_BODY, "errors", "lazy", "mechanics.stepping", "units"},
    "topography": {*_LABELS, "tables"},
    "settings": {"errors", "mechanics.bodies", "units", "variables"},
    "problem": _PROBLEM,
    "recorder": {"mechanics.bodies"},
    "experiment": _EXPERIMENT,
    "solve": _SOLVE,
    "study.statement": {*_STATEMENT, "tables"},
    "observables": {*_LABELS, "mechanics.bodies", "mechanics.transport", "study.statement", "topography"},
    "study.ensembles": {"errors", "study.statement"},
    "study.storage": _STORAGE,
    "study.execution": _EXECUTION,
    "study.observed": {*_LABELS, "study.statement", "study.storage", "study.execution", "observables"},
    "study.audit": _AUDIT,
    "study.cost": _COST,
    "study.quantities": {"errors", "variables", "observables", "study.statement"},
    "study.trade": {*_TRADE, "study.quantities"},
    "study.budget": {*_TRADE, "study.quantities", "study.trade", "study.ensembles", "observables"},
    "views.realisation_rows": {"units"},
    "views.figures": {*_LABELS, "study.storage", "study.trade", "topography", "observables"},
    "views.sweep_figures": {
        *_LABELS,
        "study.statement",
        "study.ensembles",
        "study.storage",
        "views.figures",
        "observables",
    },
    "views.plot": {*_LABELS, "views.figures", "views.sweep_figures"},
    "views.export": {*_LABELS, "study.storage", "views.figures"},
    "views.report": {
        *_LABELS,
        "topography",
        "study.statement",
        "study.storage",
        "study.audit",
        "observables",
        "views.figures",
        "views.sweep_figures",
        "views.plot",
        "views.realisation_rows",
    },
    "views.console": {
        *_LABELS,
        "views.realisation_rows",
        "topography",
        "study.audit",
        "study.execution",
        "study.trade",
        "observables",
    },
    "api": {*_SOLVE, "solve", "study.budget", "study.execution", "study.statement", "study.storage"},
    "cli": {
        *_LABELS,
        "progress",
        "topography",
        "study.statement",
        "study.storage",
        "study.execution",
        "study.audit",
        "study.cost",
        "study.quantities",
        "study.trade",
        "study.budget",
        "views.plot",
        "views.figures",
        "views.console",
        "views.report",
        "views.sweep_figures",
        "views.export",
        "study.observed",
        "__init__",
    },
    "__main__": {"cli"},
}
#: libraries that a floor may not import at all
FORBIDDEN = {
    "errors": {"numpy", "xarray", "dask", "distributed", "matplotlib"},
    "tables": {"xarray", "dask", "distributed", "matplotlib"},
    "mechanics": {"xarray", "dask", "distributed", "matplotlib", "netCDF4", "pint", "pydantic"},
    "topography": {"dask", "distributed", "matplotlib"},
    "study": {"matplotlib"},
}
#: folders whose entries are rooms of their own
FOLDERS = {"mechanics", "study", "views"}


def room(module):
    """Room of a dotted module name below the package."""
    parts = module.split(".")
    return ".".join(parts[:2]) if parts[0] in FOLDERS else parts[0]


def there_is(module):
    path = PACKAGE.joinpath(*module.split("."))
    return path.is_dir() or path.with_suffix(".py").exists()


def imports(path):
    """Dotted names imported by a file, wherever in it; relative ones made absolute."""
    package = ("roughvisc", *path.relative_to(PACKAGE).parts[:-1])
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            module = ".".join(part for part in (base, node.module) if part)
            yield from (f"{module}.{alias.name}" for alias in node.names)


FILES = sorted(p for p in PACKAGE.rglob("*.py") if p != PACKAGE / "__init__.py")


def module_of(path):
    """Dotted name below the package."""
    return ".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__")


def modules(path):
    """Modules of the package that a file imports, dotted names below the package."""
    for name in imports(path):
        head, _, rest = name.partition(".")
        if head != "roughvisc" or not rest:
            continue
        while rest and not there_is(rest):
            rest = rest.rpartition(".")[0]
        yield rest or "__init__"


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports__point_downward(path):
    here = room(module_of(path))
    for name in imports(path):
        assert name.split(".")[0] not in FORBIDDEN.get(here.split(".")[0], set()), f"{here} imports {name}"
    if here in FOLDERS:
        return  # the folder's own first line
    for module in modules(path):
        assert room(module) == here or room(module) in ALLOWED[here], f"{here} imports {module}"


def test_storage__is_the_one_door_to_result_files():
    outside = [path for path in FILES if room(module_of(path)) != "study.storage"]
    assert len(outside) < len(FILES)
    for path in outside:
        assert "netCDF4" not in {name.split(".")[0] for name in imports(path)}, path
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and getattr(node.func, "attr", "") in ("glob", "rglob"):
                assert ".nc" not in ast.unparse(node), f"{path} looks for results by name"


def test_rooms__form_no_circle():
    order = TopologicalSorter(ALLOWED)
    assert set(ALLOWED) <= set(order.static_order())


def test_modules__form_no_circle():
    """Not even through imports inside functions."""
    graph = {module_of(path): {one for one in modules(path) if one != "__init__"} for path in FILES}
    TopologicalSorter({one: uses - {one} for one, uses in graph.items()}).prepare()


def test_top_level__is_what_the_user_prescribed():
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if tracked.returncode:
        pytest.skip("not a git checkout")
    top = {line.split("/")[0] for line in tracked.stdout.splitlines()}
    prescribed = {
        "pyproject.toml",
        "roughvisc",
        "surfaces",
        "tests",
        "workflows",
        "README.md",
        "docs",
        "LICENSE",
    }
    assert {name for name in top if not name.startswith(".")} <= prescribed


def test_import__brings_no_heavy_library():
    code = (
        "import sys, roughvisc; "
        "heavy = {'matplotlib', 'dask', 'distributed', 'SurfaceTopography', 'x3pio', 'sdfio', 'pint', 'pydantic'}; "
        "print(sorted(heavy & (sys.modules.keys() - before)))"
    )
    code = "import sys, xarray; before = set(sys.modules); " + code
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
