"""Surfaces: scan files, surface cards and the table ``[surface]`` of a study.

The table names a scan ``file`` and how to read it, or a recipe to ``generate`` and its parameters, and the conditioning
steps. A surface card is this table in a separate TOML file, with the origin of the surface.
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Mapping
from importlib import import_module
from io import BytesIO, TextIOWrapper
from pathlib import Path
from typing import Any

import xarray as xr

from roughvisc.arguments import (
    NoData,
    a_table,
    arguments,
    call,
    check,
    check_keys,
    dotted,
    one_key,
    one_of,
    refuse_unknown,
    split,
)
from roughvisc.errors import InputError
from roughvisc.paths import path_of, read_bytes
from roughvisc.topography.conditioning import FACE_STEPS, STEPS, boundary_after, condition
from roughvisc.topography.framing import combine
from roughvisc.topography.grid import checked
from roughvisc.topography.grid import spacing as cell_sides
from roughvisc.topography.heights import digest_in, read_heights
from roughvisc.topography.readers import existing, read_file, sha256
from roughvisc.topography.recipes import BOUNDARIES, RECIPES, check_recipe
from roughvisc.units import Quantity, quantities, unit_for

_Path = str | os.PathLike[str]
#: Keys of a card that do not affect the heights.
PROVENANCE = ("title", "description", "licence", "source", "instrument")
#: Suffixes that :func:`save_scan` writes.
WRITABLE = (".nc", ".x3p", ".sdf")
#: Keys of a table ``[surface]`` with lengths, and the digits of these.
_LENGTHS = {"spacing": 15, "grid": 15, "filter": 6, "crop": 12}


@quantities(spacing="m", grid="m > 0", height_scale="1 > 0")
def open_scan(
    path: _Path,
    *,
    format: str | None = None,
    channel: int | str | None = None,
    unit: str | tuple[str, str] | None = None,
    spacing: Quantity | tuple[Quantity, Quantity] | None = None,
    grid: Quantity | None = None,
    no_data: float | None = None,
    height_scale: float | None = None,
) -> xr.DataArray:
    """Open a scanned surface from an instrument file, a grid file or a surface card.

    Parameters
    ----------
    path : path
        X3P, SDF, NetCDF, CSV, a surface card (``.toml``), or any format that SurfaceTopography reads.
    format : str, optional
        A key of :func:`~roughvisc.supported_formats`. Default: by the suffix; texts of some makers are recognised by
        their content.
    channel : int or str, optional
        Number or name of the channel. Default: the height channel, or the default of the library if there are several;
        the attribute ``other_channels`` then lists the others.
    unit : str or pair of str, optional
        Unit of length in a file that states none, such as ``"um"``; or two, of x and y and of the heights, such as
        ``"mm,um"``.
    spacing : float or str, or a pair, optional
        Cell sides (dx, dy), instead of those in the file. [m]
    grid : float or str, optional
        Side of the square cells into which points x, y, z are sorted: each has the mean height of its points, and is
        missing without a point. Default: the lattice on which the points lie, to a hundredth of its steps. [m]
    no_data : float, optional
        Number that marks a missing point, in the unit of the file. Default: the lowest or highest number, if it is at
        least 999 in size, occurs at four points or more, and is further from all others than ten times their range, or
        than their range if it is a usual mark such as -9999; a warning reports it.
    height_scale : float, optional
        Factor of the heights, for a file that states a wrong unit: 1e-6 if micrometres are labelled as metres. [-]

    Returns
    -------
    xarray.DataArray
        Height over (x, y), peaks up, NaN where missing. [m] Coordinates are the cell centres; the spacing is the size
        over the number of points. The attributes contain the name and checksum of the file, format,
        channel, orientation (whether y is known to point up, or the map may be a mirror image) and
        ``history``. Rows of a matrix in text, CSV or NumPy run along x: row j of the file is ``y[j]``.

    Raises
    ------
    InputError
        If the file is absent, damaged, of an unknown format, not an areal height scan, without unit or size, or
        implausible: wider than 1 m, cells below 10 pm, heights beyond 1 m; or if points lie on no lattice. For a card
        also if it is not TOML, has unknown or missing keys or wrong values, or the checksum of its file differs.

    Warns
    -----
    UserWarning
        If the checksum in an X3P file is wrong, an index row or column is removed, a number is taken for missing
        points, or cells of `grid` hold no point.

    See Also
    --------
    roughvisc.inspect, roughvisc.level, roughvisc.from_array, roughvisc.supported_formats

    Examples
    --------
    >>> import roughvisc as rv
    >>> scan = rv.open_scan(rv.example_scan())
    >>> scan.shape, scan.attrs["format"]
    ((160, 256), 'x3p')
    """
    options = {
        "format": format,
        "channel": channel,
        "unit": unit,
        "spacing": spacing,
        "grid": grid,
        "no_data": no_data,
        "height_scale": height_scale,
    }
    given = {key: value for key, value in options.items() if value is not None}
    path = existing(path)
    if not is_card(path):
        return read_file(path, given)
    if given:
        named = ", ".join(f"{key}=" for key in given)
        raise InputError(f"{path}: found {named} together with a surface card: expected it in the card")
    about, table = read_card(path)
    try:
        one_key("the card", table, ("file", "generate"))
        stated = about.pop("sha256", None)
        file = table.get("file")
        if stated and file and stated.lower() != (checksum := sha256(existing(file, "file"))):
            expected = f"{checksum}, that of {Path(file).name}, which was changed or damaged"
            raise InputError(key="sha256", found=stated, expected=expected)
        h = condition(raw_height("", table), split(table, *STEPS)[0])
    except InputError as error:
        raise error.prefixed(str(path)) from error
    return h.assign_attrs(card=path.name, **about)


def save_scan(h: xr.DataArray, path: _Path) -> None:
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

    See Also
    --------
    roughvisc.open_scan, roughvisc.from_array, roughvisc.to_topography

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> rough = rv.self_affine("1 mm", 32, hurst=0.8, rms_height="1 um", seed=1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     rv.save_scan(rough, f"{folder}/rough.nc")
    ...     again = rv.open_scan(f"{folder}/rough.nc")
    >>> bool((again == rough).all())
    True
    """
    h = checked(h, "save_scan")
    path = path_of(path, "path")
    known_suffix(path)
    if path.suffix.lower() == ".nc":
        compressed: dict[str, Any] = {"zlib": True, "complevel": 1, "shuffle": True}
        h.rename("height").to_netcdf(path, engine="netcdf4", encoding={"height": compressed})
        return
    library = import_module(f"{path.suffix[1:].lower()}io")
    x_scale, y_scale = cell_sides(h)
    library.write(path, h.values.T, x_scale=x_scale, y_scale=y_scale)


def known_suffix(path: Path) -> None:
    """Refuse a file name that :func:`save_scan` cannot write to."""
    if path.suffix.lower() not in WRITABLE:
        raise InputError(f"{path}: found the suffix {path.suffix!r}: expected one of {', '.join(WRITABLE)}")


def read_card(path: Path) -> tuple[dict[str, str], dict[str, Any]]:
    """Return the origin and the checksum that a surface card states, and its table with the path of its file.

    Raises
    ------
    InputError
        If the card cannot be read, or one of these entries is not a text.
    """
    about, table = split(read_toml(path, "a surface card in TOML"), *PROVENANCE, "sha256")
    for key, value in {**about, **split(table, "file", "generate")[0]}.items():
        if not isinstance(value, str) or (key == "file" and not value):
            raise InputError(f"{path}: {key}: found {value!r}: expected a text", key=key, found=value)
    if "file" in table:
        table["file"] = str(path.parent / table["file"])
        if is_card(Path(table["file"])):
            raise InputError(f"{path}: file: found a surface card: expected a scan file", key="file")
    return about, table


def is_card(path: Path) -> bool:
    """Return whether a file is a surface card, by its suffix."""
    return path.suffix.lower() == ".toml"


def measured_file(path: Path) -> Path | None:
    """Return the file with the measured heights: the file named in a surface card, otherwise the file itself.

    None for a card with a recipe.

    Raises
    ------
    InputError
        If a card cannot be read.
    """
    if not is_card(path):
        return path
    named = read_card(path)[1].get("file")
    return None if named is None else Path(named)


#: A line of TOML with a number and a unit without quotes: the key and the quantity.
_UNQUOTED = re.compile(r'\s*([\w."-]+)\s*=\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?\s*[^\d\s",\]}#.][^",\]}#]*?)\s*(?:#.*)?')


def read_toml(path: Path, wanted: str) -> dict[str, Any]:
    """Return the tables of a TOML file, with or without a byte-order mark.

    Raises
    ------
    InputError
        If it is not a regular file, cannot be read, or is not `wanted`.
    """
    content = read_bytes(path, wanted)
    try:
        return tomllib.loads(TextIOWrapper(BytesIO(content), "utf-8-sig").read())
    except (ValueError, RecursionError) as error:  # for example an integer of thousands of digits
        advice = _forgotten_quotes(content, str(error))
        raise InputError(f"{path}: is not {wanted}: {error}: expected TOML in UTF-8{advice}") from error


def _forgotten_quotes(content: bytes, message: str) -> str:
    """Return the advice for a line of TOML that cannot be read because a quantity lacks its quotes; else empty."""
    number = re.search(r"at line (\d+)", message)
    lines = content.decode(errors="replace").splitlines()
    if number and int(number[1]) <= len(lines):
        stated = _UNQUOTED.fullmatch(lines[int(number[1]) - 1])
        if stated:
            return f'; quantities with a unit stand in quotes: {stated[1]} = "{stated[2]}"'
    return ""


def surface_height(table: Mapping[str, Any], given: xr.DataArray | None = None) -> xr.DataArray:
    """Return the conditioned heights of a table ``[surface]``; for two faces, their sum. [m]

    Parameters
    ----------
    table : mapping
        The table.
    given : xarray.DataArray, optional
        Heights of the file that the table names, if they need not be read. [m]
    """
    height = _face_height("surface", table, given)
    if "second" in table:
        placing, face = split(table["second"], "flip", "offset")
        flip = placing.pop("flip", "x")
        placing |= {"flip": None if flip == "none" else flip}
        height = call(combine, "surface.second", placing, height, _face_height("surface.second", face))
    _, rest = split(table, *FACE_STEPS)
    steps, _ = split(rest, *STEPS)
    if isinstance(steps.get("realisation"), int):
        # with a common seed, the first surrogates of all scans would deviate from their mean in the same direction
        scan = measured_file(Path(table["file"])) if "file" in table else None
        known = (digest_in(scan.name) or sha256(scan))[:8] if scan else "0"
        steps["realisation"] = {"number": steps["realisation"], "seed": int(known, 16)}
    return condition(height, steps, "surface")


def raw_height(where: str, table: Mapping[str, Any]) -> xr.DataArray:
    """Return the heights of a table of a surface before conditioning. [m]"""
    _, source = split(table, *STEPS, "second", "missing")
    recipe, arguments = split(source, "generate")
    if recipe:
        return call(RECIPES[one_of(dotted(where, "generate"), recipe["generate"], RECIPES)], where, arguments)
    file, options = split(source, "file")
    if digest_in(file["file"]):
        return read_heights(Path(file["file"]))
    return call(open_scan, where, options, file["file"])


def _face_height(where: str, table: Mapping[str, Any], given: xr.DataArray | None = None) -> xr.DataArray:
    return condition(raw_height(where, table) if given is None else given, split(table, *FACE_STEPS)[0], where)


def check_surface(table: Mapping[str, Any], where: str = "surface") -> None:
    """Check a table of a surface without its heights."""
    table = a_table(where, table)
    source_key = one_key(where, table, ("file", "generate"))
    is_second = where != "surface"
    step_keys = FACE_STEPS if is_second else tuple(STEPS)
    place_keys = ("flip", "offset") if is_second else ("second", "missing")
    steps, rest = split(table, *step_keys)
    placing, source = split(rest, *place_keys)
    recipe = one_of(f"{where}.generate", table["generate"], RECIPES) if source_key == "generate" else ""
    known = arguments(RECIPES[recipe]) if recipe else arguments(open_scan, 1)
    refuse_unknown(where, table, (source_key, *known, *step_keys, *place_keys))
    no_data: Any = NoData()
    condition(no_data, steps, where)
    if source_key == "generate":
        check_recipe(where, source)
    else:
        check_keys(open_scan, where, split(source, "file")[1], 1)
    if is_second:
        one_of(f"{where}.flip", placing.pop("flip", "x"), ("x", "y", "none"))
        check(combine, where, placing, 2)
    elif "second" in placing:
        check_surface(placing["second"], "surface.second")


def surface_boundary(table: Mapping[str, Any]) -> Any:
    """Return the boundary for which a surface is made, without its heights; None if the study has to state it."""
    made = BOUNDARIES.get(table.get("generate", ""))
    if "file" in table:
        path = Path(table["file"])
        made = surface_boundary(read_card(path)[1]) if is_card(path) else None
    of_face, rest = split(table, *FACE_STEPS)
    made = boundary_after(of_face, made)
    return boundary_after(split(rest, *STEPS)[0], None if "second" in table else made)


def card_text(file: _Path, folder: _Path, options: Mapping[str, Any], steps: Mapping[str, Any]) -> str:
    """Return the surface card of a scan file as TOML: title, checksum, reading options and conditioning steps.

    Parameters
    ----------
    file, folder, options, steps
        As in :func:`surface_table`.

    Raises
    ------
    InputError
        If the file is a surface card itself.
    """
    file = Path(file)
    if is_card(file):
        raise InputError(f"{file}: is a surface card already: expected a scan file")
    stated = {"title": file.stem, "sha256": sha256(file)}
    return _entries(stated) + surface_table(file, folder, options, steps).partition("\n")[2]


def surface_table(file: _Path, folder: _Path, options: Mapping[str, Any], steps: Mapping[str, Any]) -> str:
    """Return the ``[surface]`` table of a study, as TOML, for a scan and the steps that condition it.

    Parameters
    ----------
    file : path
        The scan, or a surface card.
    folder : path
        Folder of the study or the card: the file is named relative to it, unless the whole path is shorter.
    options : mapping
        Options of :func:`roughvisc.open_scan` that the file needs; None for unused options.
    steps : mapping
        Conditioning steps, as for :func:`~roughvisc.topography.conditioning.condition`. [m]
    """
    given = {key: value for key, value in options.items() if value is not None}
    relative = os.path.relpath(file, folder)
    path = min(relative, os.path.abspath(file), key=len)  # many steps up are harder to read than the whole path
    return "[surface]\n" + _entries({"file": Path(path).as_posix(), **given, **steps})


def _entries(table: Mapping[str, Any]) -> str:
    """Return the entries of a table of a surface as TOML, one a line."""
    return "".join(f"{key} = {toml_text(value, _LENGTHS.get(key))}\n" for key, value in table.items())


def written_quantity(value: float, unit: str, digits: int = 6) -> str:
    """Return a quantity with a prefix, in the notation of study files.

    Examples
    --------
    >>> written_quantity(1.9e-5, "m"), written_quantity(7500.0, "Pa"), written_quantity(0.03, "N")
    ('19 um', '7.5 kPa', '30 mN')
    """
    return unit_for([value], unit).text(value, digits).replace("µ", "u")


def toml_text(value: Any, digits: int | None = None) -> str:
    """Return a value as TOML; if `digits` is given, numbers are written as lengths with this many digits."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml_text(inner, digits)}" for key, inner in value.items()) + " }"
    if isinstance(value, list | tuple):
        return f"[{', '.join(toml_text(inner, digits) for inner in value)}]"
    text = value if digits is None else written_quantity(float(value), "m", digits)
    if isinstance(text, float):
        return str(text)  # inf and nan are Infinity and NaN in JSON
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")  # TOML escapes it, JSON does not
