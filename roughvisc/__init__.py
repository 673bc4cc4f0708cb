"""Contact of measured rough surfaces with linear viscoelastic materials.

``__init__.pyi`` lists the public names of ``import roughvisc as rv``. Each name is imported from its module at its
first use, so that importing the package is quick.
"""

from __future__ import annotations

from importlib import import_module

with open(f"{__file__}i", encoding="utf-8") as _stub:
    _lines = [line.split() for line in _stub if line.startswith("from ")]
#: Public name -> its module, from each line ``from module import name as name``.
_MODULES = {words[3]: words[1] for words in _lines if len(words) == 6 and words[3] == words[5]}
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
