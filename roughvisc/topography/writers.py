"""Writers: a height grid to netCDF, X3P or SDF; a surface card, and the [surface] table of a study, for a file.

Libraries write, as they read.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.grid import checked, spacing
from roughvisc.topography.readers import sha256

#: Suffixes that :func:`save_scan` knows.
WRITABLE = (".nc", ".x3p", ".sdf")


def save_scan(h: xr.DataArray, path: str | os.PathLike[str]) -> None:
    """Write heights to a file that :func:`roughvisc.open_scan` can open.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), NaN where missing. [m]
    path : path
        ``.nc`` stores everything: coordinates, attributes and the mask of filled points.
        ``.x3p`` and ``.sdf`` store heights in full precision and the spacing; their grids begin at zero. X3P stores the
        history as its comment.

    Raises
    ------
    InputError
        If the suffix is unknown, or `h` is not a height grid.
    """
    h, path = checked(h, "save_scan"), Path(path)
    known_suffix(path)
    cell = spacing(h)
    if path.suffix.lower() == ".nc":
        _save_netcdf(h.rename("height"), path)
    elif path.suffix.lower() == ".x3p":
        import x3pio

        metadata = x3pio.Metadata.for_software("roughvisc", version("roughvisc"))
        metadata.comment = str(h.attrs.get("history", "")) or None
        x3pio.write(path, h.values.T, x_scale=cell[0], y_scale=cell[1], metadata=metadata)
    else:
        import sdfio

        metadata = sdfio.Metadata(manufacturer_id="roughvisc")
        sdfio.write(path, h.values.T, x_scale=cell[0], y_scale=cell[1], metadata=metadata)


def _save_netcdf(h: xr.DataArray, path: Path) -> None:
    """Write a grid with all that it holds."""
    compressed: dict[str, Any] = {"zlib": True, "complevel": 1, "shuffle": True}
    h.to_netcdf(path, engine="netcdf4", encoding={"height": compressed})


def known_suffix(path: Path) -> None:
    """Refuse a file name that :func:`save_scan` cannot write to."""
    if path.suffix.lower() not in WRITABLE:
        raise InputError(f"{path}: found the suffix {path.suffix!r}: expected one of {', '.join(WRITABLE)}")


def card_text(
    file: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    options: Mapping[str, Any],
    steps: Mapping[str, Any] | None = None,
) -> str:
    """Return the surface card of a scan file as TOML: its checksum, how it is read, and how it is conditioned.

    Parameters
    ----------
    file : path
        The scan.
    folder : path
        Folder of the card: the file is named relative to it.
    options : mapping
        ``format``, ``channel``, ``unit``, ``height_unit``, ``spacing`` [m] that the file needs to be opened, or None.
    steps : mapping, optional
        Conditioning steps, as for :func:`surface_table`. [m]

    Raises
    ------
    InputError
        If the file is a surface card itself.
    """
    file = Path(file)
    if file.suffix.lower() == ".toml":
        raise InputError(f"{file}: is a surface card already: expected a scan file")
    lines = [f"title = {_text(file.stem)}", f"file = {_text(Path(os.path.relpath(file, folder)).as_posix())}"]
    lines.append(f"sha256 = {_text(sha256(file))}")
    lines += [f"{key} = {value}" for key, value in _how_to_read(options, _numbers).items()]
    lines += ["", '# source = "..."      # where it comes from', '# licence = "..."     # who may use it']
    lines += ['# instrument = "..."', "", "# Steps on the heights whenever the card is opened.", "[conditioning]"]
    return "\n".join(lines + [f"{key} = {value}" for key, value in _as_toml(steps or {}).items()]) + "\n"


def surface_table(
    file: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    options: Mapping[str, Any],
    steps: Mapping[str, Any],
    remarks: Mapping[str, str] | None = None,
) -> str:
    """The ``[surface]`` table of a study, as TOML, for a scan and the steps that condition it.

    Parameters
    ----------
    file : path
        The scan, or a surface card.
    folder : path
        Where the study is going to be: a file below it is named relative to it, any other by its whole path.
    options : mapping
        ``format``, ``channel``, ``unit``, ``height_unit``, ``spacing`` [m] that the file needs to be opened; None where
        it does not.
    steps : mapping
        Conditioning steps, as :func:`~roughvisc.topography.cards.condition` takes them. [m]
    remarks : mapping, optional
        What stands behind a line, by its key.
    """
    file, remarks = Path(file), remarks or {}
    near = Path(os.path.relpath(file, folder))
    entries = {"file": _text((file.resolve() if near.parts[0] == ".." else near).as_posix())}
    entries |= _how_to_read(options, _lengths)
    entries |= _as_toml(steps)
    lines = [f"{key} = {value}" for key, value in entries.items()]
    width = max((len(line) for line, key in zip(lines, entries, strict=True) if key in remarks), default=0)
    shown = [
        f"{line:<{width}}  # {remarks[key]}" if key in remarks else line
        for line, key in zip(lines, entries, strict=True)
    ]
    return "\n".join(["[surface]", *shown]) + "\n"


def _as_toml(steps: Mapping[str, Any]) -> dict[str, str]:
    """Return the values of conditioning steps as TOML."""
    entries = {}
    for key, value in steps.items():
        if key == "crop":
            entries[key] = "{ " + ", ".join(f"{axis} = {_lengths(limits)}" for axis, limits in value.items()) + " }"
        elif key == "filter":
            entries[key] = _lengths(value)
        else:
            entries[key] = json.dumps(value)
    return entries


def _how_to_read(options: Mapping[str, Any], spacing: Callable[[Any], str]) -> dict[str, str]:
    """Return the options that a file needs to be opened, as TOML; lengths as `spacing` writes them."""
    ways = dict.fromkeys(("format", "channel", "unit", "height_unit"), _text) | {"spacing": spacing, "grid": spacing}
    ways |= dict.fromkeys(("no_data", "height_scale"), json.dumps)
    return {key: way(options[key]) for key, way in ways.items() if options.get(key) is not None}


def written_quantity(value: float, unit: str, digits: int = 6) -> str:
    """A quantity as study files have it, with a prefix.

    Examples
    --------
    >>> written_quantity(1.9e-5, "m"), written_quantity(7500.0, "Pa"), written_quantity(0.03, "N")
    ('19 um', '7.5 kPa', '30 mN')
    """
    prefixes = {-12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
    exponent = 3 * math.floor(math.log10(abs(value) * (1 + 1e-12)) / 3) if value else 0
    exponent = min(max(exponent, -12), 0 if unit == "m" else 9)
    return f"{float(f'{value / 10.0**exponent:.{digits}g}'):g} {prefixes[exponent]}{unit}"


def _lengths(value: Any) -> str:
    """One length, or a list of them."""
    if isinstance(value, tuple | list):
        return "[" + ", ".join(_lengths(part) for part in value) + "]"
    return _text(written_quantity(float(value), "m"))


def _text(value: str | int) -> str:
    """A TOML string or number: JSON's, but for one character."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _numbers(value: Any) -> str:
    return json.dumps([float(v) for v in value] if isinstance(value, tuple | list) else value)
