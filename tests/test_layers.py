"""The floors of the package and the directions in which they may import each other."""

import ast
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[1]
PACKAGE = ROOT / "roughvisc"

#: floor -> floors it may import from (its own is implied)
ALLOWED = {
    "errors": set(),
    "variables": set(),
    "units": {"errors"},
    "mechanics": {"errors"},
    "topography": {"errors", "variables", "units"},
    "study": {"errors", "variables", "units", "mechanics", "topography"},
    "views": {"errors", "variables", "study"},
    "cli": {"errors", "variables", "units", "mechanics", "topography", "study", "views", "__init__"},
    "__main__": {"cli"},
}
#: libraries that a floor may not import at all
FORBIDDEN = {
    "errors": {"numpy", "xarray", "dask", "distributed", "matplotlib"},
    "mechanics": {"xarray", "dask", "distributed", "matplotlib", "netCDF4", "pint", "pydantic"},
    "topography": {"dask", "distributed", "matplotlib"},
    "study": {"matplotlib"},
}


def floor(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


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


FILES = sorted(p for p in PACKAGE.rglob("*.py") if p.parent != PACKAGE or p.stem != "__init__")


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports__point_downward(path):
    here = floor(path)
    for name in imports(path):
        parts = name.split(".")
        assert parts[0] not in FORBIDDEN.get(here, set()), f"{here} imports {name}"
        if parts[0] == "roughvisc" and parts[1:]:
            there = parts[1] if (PACKAGE / parts[1]).exists() or (PACKAGE / f"{parts[1]}.py").exists() else "__init__"
            assert there == here or there in ALLOWED[here], f"{here} imports {name}"


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
