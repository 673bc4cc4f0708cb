"""Contact of measured rough surfaces with linear viscoelastic materials.

``import roughvisc as rv`` gives the public names that ``__init__.pyi`` lists. Each is imported from its module when it
is first used, so that importing the package is quick.
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
