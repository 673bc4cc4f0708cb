"""Contact of measured rough surfaces with linear viscoelastic materials.

``__init__.pyi`` lists the public names of ``import roughvisc as rv``. Each name is imported from its module at its
first use, so that importing the package is quick.
"""

from __future__ import annotations

from roughvisc.lazy import public_names

_load, _names = public_names(globals())
__all__ = ["__version__", *_names]


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib import metadata  # slow to import

        return metadata.version("roughvisc")
    return _load(name)


def __dir__() -> list[str]:
    return __all__
