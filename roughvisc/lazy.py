"""Packages whose public names are imported from their modules when they are first used, as their stubs list them."""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib import import_module
from typing import Any


def public_names(package: dict[str, Any]) -> tuple[Callable[[str], Any], list[str]]:
    """``__getattr__`` and ``__all__`` of a package; ``__init__.pyi`` has ``from module import name as name`` for each.

    Parameters
    ----------
    package : dict
        Its ``globals()``, which keep what was imported.
    """
    with open(f"{package['__file__']}i", encoding="utf-8") as stub:
        modules = {name: module for module, name in re.findall(r"^from (\S+) import (\w+) as \2$", stub.read(), re.M)}

    def load(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package['__name__']!r} has no attribute {name!r}")
        module = modules[name]
        value = None if module == package["__name__"] else getattr(import_module(module), name, None)
        package[name] = value or import_module(f"{module}.{name}")
        return package[name]

    return load, sorted(modules)
