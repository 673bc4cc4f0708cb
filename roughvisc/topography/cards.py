"""Surface cards: a TOML file that says which surface, from where, and how it is conditioned.

A card names either a scan ``file`` with its checksum and provenance, or a recipe to ``generate`` with its parameters.
Quantities are numbers in SI or texts with a unit. The steps of ``[conditioning]`` act in one fixed order, whatever
their order in the file: crop, rotate90, invert, level, outliers, fill, filter, shortest_wave, realisation, resample,
mirror.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.tables import regular
from roughvisc.topography import conditioning
from roughvisc.topography.readers import existing, read_file, sha256
from roughvisc.topography.surrogates import surrogate
from roughvisc.topography.synthesis import BOUNDARIES, RECIPES, UNITS, make
from roughvisc.units import quantity, shown

_PROVENANCE = ("title", "description", "licence", "source")
_FILE = ("file", "sha256", "instrument", "format", "channel", "unit", "height_unit", "spacing")


def is_card(path: Path, format: str | None) -> bool:
    """Whether a file is a surface card: by its suffix, unless the format is given."""
    return format == "card" or (format is None and path.suffix.lower() == ".toml")


def measured_file(path: Path, format: str | None) -> Path | None:
    """File with the measured heights of a surface file: the file named in a card, otherwise the file itself.

    None for a card with a recipe.

    Raises
    ------
    InputError
        If a card cannot be read.
    """
    if not is_card(path, format):
        return path
    named = read_toml(path, "a surface card in TOML").get("file")
    return path.parent / named if isinstance(named, str) else None


def open_card(path: Path, *, conditioned: bool = True, **options: Any) -> xr.DataArray:
    """Height over (x, y) as a surface card describes it, conditioned. [m]

    Parameters
    ----------
    path : Path
        The card; its ``file`` is relative to the card's folder.
    conditioned : bool
        Whether its conditioning is done; if not, the heights are as measured or made.
    **options
        Of :func:`roughvisc.open_scan`, to be refused: they belong in the card.

    Returns
    -------
    xarray.DataArray
        Height, with the card's title, description, licence and source among the attributes. [m]

    Raises
    ------
    InputError
        If an option is given beside the card, the card is no TOML, has unknown or missing keys or wrong values, or
        the checksum of the file differs.
    """
    path = Path(path)
    if named := ", ".join(f"{key}=" for key, value in options.items() if value is not None):
        raise InputError(f"{path}: found {named} together with a surface card: expected it in the card")
    card = read_toml(path, "a surface card in TOML")
    try:
        if ("file" in card) == ("generate" in card):
            raise InputError(
                "found " + ("both" if "file" in card else "neither") + ": expected either file or generate"
            )
        steps = card.pop("conditioning", {})
        about = {key: _text(card, key) for key in _PROVENANCE if key in card}
        rest = {key: value for key, value in card.items() if key not in _PROVENANCE}
        h = _scan(rest, path.parent) if "file" in rest else generate(rest)
        h = condition(h, steps) if conditioned else h
    except InputError as error:
        raise error.prefixed(str(path)) from error
    instrument = {"instrument": card["instrument"]} if "instrument" in card else {}
    return h.assign_attrs(card=path.name, **about, **instrument)


def read_toml(path: Path, wanted: str) -> dict[str, Any]:
    """Tables of a TOML file, with a byte-order mark or without.

    Raises
    ------
    InputError
        If it is no regular file, cannot be read, or is not what is ``wanted``.
    """
    regular(path)
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        line = 1 + error.object[: error.start].count(b"\n")
        where = f"line {line} contains a byte that is not UTF-8"
        found = "it is in UTF-16" if error.object[:2] in (b"\xff\xfe", b"\xfe\xff") else where
        raise InputError(f"{path}: is not {wanted}: {found}: expected a text in UTF-8") from error
    except ValueError as error:  # of TOML, of an integer of thousands of digits
        raise InputError(f"{path}: is not {wanted}: {error}") from error
    except RecursionError as error:
        raise InputError(f"{path}: is not {wanted}: it is nested too deeply") from error


def generate(table: Mapping[str, Any]) -> xr.DataArray:
    """Height from a recipe and its parameters, as cards and studies write them. [m]

    Parameters
    ----------
    table : mapping
        ``generate`` names the recipe: sphere, cone, flat_punch, wavy or self_affine; the other keys are its
        parameters, quantities as numbers in SI or texts with a unit.

    Raises
    ------
    InputError
        If the recipe or a key is unknown, a parameter is missing, or a value is wrong.
    """
    name = table["generate"]
    if not isinstance(name, str) or name not in RECIPES:
        raise InputError(f"generate is {shown(name)}: expected one of {', '.join(RECIPES)}")
    given = {key: value for key, value in table.items() if key != "generate"}
    _known(given, RECIPES[name], f"{name} takes")
    try:
        return make(name, {key: _quantities(value, UNITS.get(key), key) for key, value in given.items()})
    except TypeError as error:  # "missing 1 required positional argument: 'radius'"
        raise InputError(f"{name}: {str(error).partition('() ')[2] or error}") from error


def condition(h: xr.DataArray, steps: Mapping[str, Any]) -> xr.DataArray:
    """Height after conditioning steps, as cards and studies write them.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    steps : mapping
        Any of ``crop`` (a table of x and y limits), ``rotate90`` (turns), ``invert``, ``level`` (order, or true for a
        plane), ``outliers`` (true, or a table of window and threshold), ``fill`` (true or a method), ``filter`` (the
        cut-off, or a table of cutoff, keep and periodic), ``shortest_wave`` (a length), ``realisation`` (the number of
        a surrogate, or a table of ``number`` and ``seed``) and ``resample`` (cells). They act in this order; false
        leaves a step out.

    Returns
    -------
    xarray.DataArray
        Conditioned height. [m]

    Raises
    ------
    InputError
        If a step or an option is unknown, or a value is wrong.
    """
    if not isinstance(steps, Mapping):
        raise InputError(f"conditioning is {steps!r}: expected a table of steps")
    _known(steps, _STEPS, "conditioning takes")
    for name, step in _STEPS.items():
        value = steps.get(name, False)
        if value is not False:
            h = step(h, value)
    return h


def boundary_after(
    steps: Mapping[str, Any], made: Literal["free", "periodic"] | None
) -> Literal["free", "periodic"] | None:
    """Boundary of a surface after conditioning steps; None where it has to be said.

    Parameters
    ----------
    steps : mapping
        As :func:`condition` takes them. ``realisation`` makes any surface periodic; turns, cuts of short waves and
        other numbers of cells leave a periodic one so; all else leaves open what lies beyond the border.
    made : {"free", "periodic"} or None
        Boundary that the surface was made for.

    Examples
    --------
    >>> boundary_after({"level": 1, "realisation": 1}, None), boundary_after({"level": 1}, "free")
    ('periodic', None)
    """
    for step in _STEPS:
        if steps.get(step, False) is not False:
            kept = made == "periodic" and step in _KEEP_PERIOD
            made = "periodic" if kept or step == "realisation" else None
    return made


def boundary_of_card(path: Path) -> Literal["free", "periodic"] | None:
    """Boundary that the surface of a card is made for, by its text alone; None where it has to be said.

    Raises
    ------
    InputError
        If the card cannot be read.
    """
    card = read_toml(path, "a surface card in TOML")
    steps, recipe = card.get("conditioning", {}), card.get("generate")
    known = isinstance(steps, Mapping) and isinstance(recipe, str | None)  # else it is refused where it is opened
    return boundary_after(steps, BOUNDARIES.get(recipe or "")) if known else None


def _scan(card: Mapping[str, Any], folder: Path) -> xr.DataArray:
    _known(card, _FILE, "a card of a file takes")
    path = folder / _text(card, "file")
    if not path.exists():
        raise InputError(f"file is {card['file']!r}: there is no such file")
    found = sha256(path)
    if "sha256" not in card:
        raise InputError(f"sha256 is missing: expected the checksum of {path.name}, which is {found}")
    if _text(card, "sha256").lower() != found:
        raise InputError(
            f"the checksum of {path.name} is {found}, sha256 says {card['sha256']}: the file was changed or damaged"
        )
    options = {key: card[key] for key in ("format", "channel", "unit", "height_unit") if key in card}
    if "spacing" in card:
        options["spacing"] = _quantities(card["spacing"], "m", "spacing")
    if is_card(path, options.get("format")):
        return open_card(path, **{key: value for key, value in options.items() if key != "format"})
    return read_file(existing(path), **options)


def _text(card: Mapping[str, Any], key: str) -> str:
    if not isinstance(card[key], str):
        raise InputError(f"{key} is {card[key]!r}: expected a text")
    return card[key]


def _known(given: Mapping[str, Any], known: Any, who: str) -> None:
    unknown = [key for key in given if key not in known]
    if unknown:
        raise InputError(f"unknown key {', '.join(map(repr, unknown))}: {who} {', '.join(known)}")


def _quantities(value: Any, unit: str | None, name: str) -> Any:
    if unit is None:  # counts and switches
        return value
    if isinstance(value, list | tuple):
        return tuple(quantity(part, unit, name) for part in value)
    return quantity(value, unit, name)


def _table(name: str, value: Any, known: tuple[str, ...]) -> dict[str, Any]:
    """Options of a step that is either true or a table."""
    if value is True:
        return {}
    if not isinstance(value, Mapping):
        raise InputError(f"{name} is {value!r}: expected true, false, or a table of {', '.join(known)}")
    _known(value, known, f"{name} takes")
    return dict(value)


def _switch(name: str, step: Callable[[xr.DataArray], xr.DataArray]) -> Callable[[xr.DataArray, Any], xr.DataArray]:
    def switched(h: xr.DataArray, value: Any) -> xr.DataArray:
        if value is not True:
            raise InputError(f"{name} is {value!r}: expected true or false")
        return step(h)

    return switched


def _crop(h: xr.DataArray, value: Any) -> xr.DataArray:
    limits = _table("crop", value, ("x", "y"))
    return conditioning.crop(h, **{axis: _quantities(pair, "m", f"crop.{axis}") for axis, pair in limits.items()})


def _filter(h: xr.DataArray, value: Any) -> xr.DataArray:
    options = (
        _table("filter", value, ("cutoff", "keep", "periodic")) if isinstance(value, Mapping) else {"cutoff": value}
    )
    if "cutoff" not in options:
        raise InputError("filter.cutoff is missing: expected a wavelength [m]")
    options["cutoff"] = quantity(options["cutoff"], "m", "filter.cutoff")
    return conditioning.gaussian_filter(h, **options)


def _realisation(h: xr.DataArray, value: Any) -> xr.DataArray:
    options = _table("realisation", value, ("number", "seed")) if isinstance(value, Mapping) else {"number": value}
    if "number" not in options:
        raise InputError("realisation.number is missing: expected the number of a surrogate")
    return surrogate(h, options["number"], seed=options.get("seed", 0))


#: step -> (height, value in the file) -> height; in the order in which they act
_STEPS: dict[str, Callable[[xr.DataArray, Any], xr.DataArray]] = {
    "crop": _crop,
    "rotate90": conditioning.rotate90,
    "invert": _switch("invert", conditioning.invert),
    "level": lambda h, value: conditioning.level(h, 1 if value is True else value),
    "outliers": lambda h, value: conditioning.mask_outliers(h, **_table("outliers", value, ("window", "threshold"))),
    "fill": lambda h, value: conditioning.fill(h, "harmonic" if value is True else value),
    "filter": _filter,
    "shortest_wave": lambda h, value: conditioning.without_short_waves(h, quantity(value, "m", "shortest_wave")),
    "realisation": _realisation,
    "resample": conditioning.resample,
}
#: Steps that leave a surface that repeats one that does.
_KEEP_PERIOD = ("rotate90", "invert", "shortest_wave", "resample")
