"""Nine layers: a file imports from its own part of the package and from layers below it."""

import ast
import pathlib
import subprocess
import sys

import roughvisc as rv

PACKAGE = pathlib.Path(rv.__file__).parent
#: Parts of each layer, lowest first. Files of one part may import each other.
LAYERS = (
    ("arguments errors labels paths progress tables units variables version",),
    ("mechanics", "topography"),
    ("experiment settings solve",),
    ("observables",),
    ("study",),
    ("runs",),
    ("judge",),
    ("plot",),
    ("__init__ __main__ api cli materials surfaces",),
)
PLACE = {name: (layer, part) for layer, parts in enumerate(LAYERS) for part in parts for name in part.split()}


def imports(path):
    """Modules that a file imports, wherever in it, but not those for type checkers alone."""
    nodes = [ast.parse(path.read_text(encoding="utf-8"))]
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path}: a relative import"
            yield from (
                (f"roughvisc.{alias.name}" for alias in node.names) if node.module == "roughvisc" else [node.module]
            )
        elif not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            nodes += ast.iter_child_nodes(node)


def test_imports__point_downward():
    upward = set()
    for path in PACKAGE.rglob("*.py"):
        name = path.relative_to(PACKAGE)
        layer, part = PLACE[name.with_suffix("").parts[0]]
        for module in imports(path):
            package, _, rest = module.partition(".")
            if package == "roughvisc":
                other = PLACE.get(rest.split(".")[0], PLACE["api"])
                if other != (layer, part) and other[0] >= layer:
                    upward.add((name.as_posix(), module))
            assert part != "mechanics" or package not in ("xarray", "netCDF4", "dask", "matplotlib"), name
    assert not upward


def modules(path):
    """Return the modules of the package that a file imports, those for type checkers too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_imports__form_no_circle():
    """Files that import nothing of the rest are taken away until none is left."""
    files = {}
    for path in PACKAGE.rglob("*.py"):
        if path.name != "__init__.py":
            name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
            files[name] = set(modules(path)) - {name}
    while leaves := [name for name, imported in files.items() if not imported & files.keys()]:
        for name in leaves:
            del files[name]
    assert not files


def test_import__brings_no_heavy_library():
    code = (
        "import sys, xarray; before = set(sys.modules); import roughvisc; "
        "heavy = {'matplotlib', 'dask', 'distributed', 'SurfaceTopography', 'x3pio', 'sdfio', 'pint'}; "
        "print(sorted(heavy & (sys.modules.keys() - before)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
