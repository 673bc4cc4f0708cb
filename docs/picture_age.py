"""Pictures of the pages that are older than the code that draws them.

``docs/drawn.json`` has a digest for each picture: of the code that calls the figure, of the modules of ``roughvisc/plot``
that this code uses, and of its study. Comments, docstrings and the layout of the code do not count, and neither do
numbers: after a change of the numerics run ``docs/make_gallery.py``.
"""

import ast
import functools
import hashlib
import importlib
import inspect
import json
import tomllib
from pathlib import Path

import roughvisc as rv

HERE = Path(__file__).parent
DRAWN = HERE / "drawn.json"


def text_of(code):
    """Return a syntax tree as a text without docstrings, the same in all versions of Python."""
    if isinstance(code, ast.AST):
        parts = [(name, text_of(part)) for name, part in ast.iter_fields(code)]
        return (
            f"{type(code).__name__}({' '.join(f'{name}={text}' for name, text in parts if text)})"
        )
    if isinstance(code, list):
        return " ".join(text_of(one) for one in code if not _is_docstring(one))
    return "" if code is None else repr(code)


def _is_docstring(code):
    return isinstance(code, ast.Expr) and isinstance(code.value, ast.Constant)


@functools.cache
def plot_module(name):
    """Return the code of a module of ``roughvisc.plot`` as text, and the modules of ``roughvisc.plot`` that it imports."""
    tree = ast.parse(inspect.getsource(importlib.import_module(name)))
    imported = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == "roughvisc.plot":
            imported += [f"roughvisc.plot.{one.name}" for one in node.names]
        elif isinstance(node, ast.ImportFrom) and str(node.module).startswith("roughvisc.plot."):
            imported.append(node.module)
    return text_of(tree), imported


def digest_of(code, study=None):
    """Return the digest of the code that calls a figure, of the modules it uses and of its study."""
    named = {node.attr for node in ast.walk(code) if isinstance(node, ast.Attribute)}
    wanted = [getattr(rv.plot, name).__module__ for name in named & set(rv.plot.__all__)]
    modules = {}
    while wanted:
        name = wanted.pop()
        if name not in modules:
            modules[name], imported = plot_module(name)
            wanted += imported
    texts = [text_of(code), *(modules[name] for name in sorted(modules))]
    if study is not None:
        texts.append(repr(tomllib.loads(study.read_text(encoding="utf-8"))))
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:16]


def record(digests):
    """Write the digests of some pictures to ``drawn.json``; other digests stay."""
    known = json.loads(DRAWN.read_text(encoding="utf-8")) if DRAWN.exists() else {}
    text = json.dumps(known | digests, indent=1, sort_keys=True)
    DRAWN.write_text(text + "\n", encoding="utf-8")


def older(digests):
    """Return the pictures whose recorded digest differs from the digest of the code."""
    known = json.loads(DRAWN.read_text(encoding="utf-8"))
    return [name for name, digest in digests.items() if known.get(name) != digest]
