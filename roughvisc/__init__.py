"""Contact of measured rough surfaces with linear viscoelastic materials.

``__init__.pyi`` lists the public names of ``import roughvisc as rv``, ``materials.py`` and ``surfaces.py`` the names of
constructors. Each name is imported from its module at its first use, so that importing the package is quick.
"""

from __future__ import annotations

from importlib import import_module


def _modules(name: str) -> dict[str, str]:
    """Return public name -> module, as the import statements of a file of this package list them."""
    modules = {}
    with open(f"{__path__[0]}/{name}", encoding="utf-8") as file:
        statements = file.read().split("\nfrom ")[1:]
    for statement in statements:
        module, _, listed = statement.partition(" import ")
        listed = listed[1 : listed.index(")")] if listed.startswith("(") else listed.partition("\n")[0]
        for entry in filter(None, map(str.strip, listed.split(","))):
            if entry == "*":
                modules |= _modules(f"{module.rpartition('.')[2]}.py")
            else:
                modules[entry.partition(" as ")[0]] = module
    return modules


#: Public name -> its module.
_MODULES = _modules("__init__.pyi")
__all__ = ["__version__", *sorted(_MODULES)]


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib import metadata  # slow to import

        return metadata.version("roughvisc")
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = _MODULES[name]
    value = None if module == __name__ else getattr(import_module(module), name, None)
    globals()[name] = value or import_module(f"{module}.{name}")
    return globals()[name]


def __dir__() -> list[str]:
    return __all__
