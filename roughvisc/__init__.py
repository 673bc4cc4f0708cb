"""Contact of measured rough surfaces with linear viscoelastic materials.

``import roughvisc as rv`` gives the public names that ``__init__.pyi`` lists; each is imported from its module when
first used, so that the package itself is imported in no time.
"""

from __future__ import annotations

from typing import Any

from roughvisc.lazy import public_names

_load, _names = public_names(globals())
__all__ = ["__version__", *_names]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib import metadata  # slow to import

        return metadata.version("roughvisc")
    return _load(name)


def __dir__() -> list[str]:
    return __all__
