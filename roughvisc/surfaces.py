"""Constructors of surfaces, for completion in an editor. Each is also a name of :mod:`roughvisc`."""

from roughvisc.topography.exchange import from_topography
from roughvisc.topography.framing import combine, mirror
from roughvisc.topography.readers import from_array
from roughvisc.topography.recipes import cone, flat_punch, from_spectrum, self_affine, sphere, surrogates, wavy
from roughvisc.topography.scans import open_scan

__all__ = [
    "combine",
    "cone",
    "flat_punch",
    "from_array",
    "from_spectrum",
    "from_topography",
    "mirror",
    "open_scan",
    "self_affine",
    "sphere",
    "surrogates",
    "wavy",
]


def __dir__() -> list[str]:
    return __all__
