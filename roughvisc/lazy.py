"""Lazy packages: each public name, listed in the stub of the package, is imported at its first use."""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False
if TYPE_CHECKING:  # typing takes longer to import than the rest
    from collections.abc import Callable
    from typing import Any


def public_names(package: dict[str, Any]) -> tuple[Callable[[str], Any], list[str]]:
    """Return ``__getattr__`` and ``__all__`` of a package.

    Its stub, ``__init__.pyi``, has a line ``from module import name as name`` for each public name.

    Parameters
    ----------
    package : dict
        ``globals()`` of the package, to which the imported names are added.
    """
    with open(f"{package['__file__']}i", encoding="utf-8") as stub:
        lines = [line.split() for line in stub if line.startswith("from ")]
    modules = {words[3]: words[1] for words in lines if len(words) == 6 and words[3] == words[5]}

    def load(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package['__name__']!r} has no attribute {name!r}")
        module = modules[name]
        value = None if module == package["__name__"] else getattr(import_module(module), name, None)
        package[name] = value or import_module(f"{module}.{name}")
        return package[name]

    return load, sorted(modules)
