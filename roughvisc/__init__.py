"""Contact of measured rough surfaces with linear viscoelastic materials.

``import roughvisc as rv`` gives the public names that ``__init__.pyi`` lists; each is imported from its module when
first used, so that the package itself is imported in no time. ``h.roughvisc`` has the conditioning as methods of a
DataArray, as soon as a function that gives or takes heights has been used; for DataArrays made otherwise,
``import roughvisc.topography``.
"""

from __future__ import annotations

import re
from importlib import import_module
from typing import Any

with open(f"{__file__}i", encoding="utf-8") as _stub:
    #: public name -> module or package that it is imported from
    _PUBLIC = {name: module for module, name in re.findall(r"^from (\S+) import (\w+) as \2$", _stub.read(), re.M)}

__all__ = ["__version__", *sorted(_PUBLIC)]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib import metadata  # slow to import

        return metadata.version("roughvisc")
    if name not in _PUBLIC:
        raise AttributeError(f"module 'roughvisc' has no attribute {name!r}")
    module = _PUBLIC[name]
    value = None if module == __name__ else getattr(import_module(module), name, None)
    value = value or import_module(f"{module}.{name}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
