"""Writers: height grids in netCDF, X3P and SDF; surface cards, and [surface] tables of studies, for scan files.

Each format is written by the library that reads it.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.grid import checked, spacing
from roughvisc.topography.readers import sha256
from roughvisc.units import unit_for

#: Suffixes that :func:`save_scan` writes.
WRITABLE = (".nc", ".x3p", ".sdf")
#: Keys of a table ``[surface]`` with lengths, and the digits of these.
_LENGTHS = {"spacing": 15, "grid": 15, "filter": 6, "crop": 6}


def save_scan(h: xr.DataArray, path: str | os.PathLike[str]) -> None:
    """Write heights to a file that :func:`roughvisc.open_scan` can open.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), NaN where missing. [m]
    path : path
        ``.nc`` stores everything: coordinates, attributes and the mask of filled points.
        ``.x3p`` and ``.sdf`` store heights in full precision and the spacing; their grids begin at zero.

    Raises
    ------
    InputError
        If the suffix is unknown, or `h` is not a height grid.
    """
    h, path = checked(h, "save_scan"), Path(path)
    known_suffix(path)
    if path.suffix.lower() == ".nc":
        compressed: dict[str, Any] = {"zlib": True, "complevel": 1, "shuffle": True}
        h.rename("height").to_netcdf(path, engine="netcdf4", encoding={"height": compressed})
        return
    library = import_module(f"{path.suffix[1:].lower()}io")
    x_scale, y_scale = spacing(h)
    library.write(path, h.values.T, x_scale=x_scale, y_scale=y_scale)


def known_suffix(path: Path) -> None:
    """Refuse a file name that :func:`save_scan` cannot write to."""
    if path.suffix.lower() not in WRITABLE:
        raise InputError(f"{path}: found the suffix {path.suffix!r}: expected one of {', '.join(WRITABLE)}")


def card_text(
    file: str | os.PathLike[str], folder: str | os.PathLike[str], options: Mapping[str, Any], steps: Mapping[str, Any]
) -> str:
    """Return the surface card of a scan file as TOML: checksum, reading options and conditioning steps.

    Parameters
    ----------
    file, folder, options, steps
        As in :func:`surface_table`; the file is named relative to the folder of the card.

    Raises
    ------
    InputError
        If the file is a surface card itself.
    """
    file = Path(file)
    if file.suffix.lower() == ".toml":
        raise InputError(f"{file}: is a surface card already: expected a scan file")
    entries = {"title": toml_text(file.stem), "sha256": toml_text(sha256(file))}
    entries |= _entries(Path(os.path.relpath(file, folder)), options, steps)
    lines = ['# source = "..."      # where it comes from', '# licence = "..."     # who may use it']
    lines += ['# instrument = "..."', *(f"{key} = {value}" for key, value in entries.items())]
    return "\n".join(lines) + "\n"


def surface_table(
    file: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    options: Mapping[str, Any],
    steps: Mapping[str, Any],
) -> str:
    """Return the ``[surface]`` table of a study, as TOML, for a scan and the steps that condition it.

    Parameters
    ----------
    file : path
        The scan, or a surface card.
    folder : path
        Folder of the study: a file below it is named relative to it, any other file by its full path.
    options : mapping
        Options of :func:`roughvisc.open_scan` that the file needs; None for unused options.
    steps : mapping
        Conditioning steps, as for :func:`~roughvisc.topography.conditioning.condition`. [m]
    """
    near = Path(os.path.relpath(file, folder))
    entries = _entries(Path(file).resolve() if near.parts[0] == ".." else near, options, steps)
    return "\n".join(["[surface]", *(f"{key} = {value}" for key, value in entries.items())]) + "\n"


def _entries(file: Path, options: Mapping[str, Any], steps: Mapping[str, Any]) -> dict[str, str]:
    """Return the keys of a table ``[surface]`` and their values as TOML."""
    given = {key: value for key, value in options.items() if value is not None}
    table = {"file": file.as_posix(), **given, **steps}
    return {key: toml_text(value, _LENGTHS.get(key)) for key, value in table.items()}


def written_quantity(value: float, unit: str, digits: int = 6) -> str:
    """Return a quantity with a prefix, in the notation of study files.

    Examples
    --------
    >>> written_quantity(1.9e-5, "m"), written_quantity(7500.0, "Pa"), written_quantity(0.03, "N")
    ('19 um', '7.5 kPa', '30 mN')
    """
    shown = unit_for([value], unit)
    return f"{value / shown.factor:.{digits}g} {shown.symbol}".replace("µ", "u")


def toml_text(value: Any, digits: int | None = None) -> str:
    """Return a value as TOML; if `digits` is given, numbers are written as lengths with this many digits."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml_text(one, digits)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple):
        return f"[{', '.join(toml_text(one, digits) for one in value)}]"
    text = value if digits is None else written_quantity(float(value), "m", digits)
    if isinstance(text, float):
        return str(text)  # inf and nan are Infinity and NaN in JSON
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")  # TOML escapes it, JSON does not
