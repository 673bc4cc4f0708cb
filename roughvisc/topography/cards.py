"""Surface cards: TOML files that name a surface, its origin and its conditioning.

A card names either a scan ``file`` with its checksum and provenance, or a recipe to ``generate`` with its parameters.
Quantities are numbers in SI or texts with a unit. The steps of ``[conditioning]`` act in the order of :data:`STEPS`,
independent of their order in the file.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, NamedTuple

import xarray as xr

from roughvisc.arguments import a_table, call, check, dotted, located, one_of, refuse_unknown
from roughvisc.errors import InputError
from roughvisc.tables import regular
from roughvisc.topography import conditioning
from roughvisc.topography.readers import Reading, existing, read_file, sha256
from roughvisc.topography.surrogates import surrogate
from roughvisc.topography.synthesis import BOUNDARIES, RECIPES
from roughvisc.units import in_si


class Step(NamedTuple):
    """Conditioning step.

    Attributes
    ----------
    function : callable
        Takes heights and arguments, and returns heights.
    argument : str
        Name of the argument that a value states which is neither true nor a table; empty if there is none.
    """

    function: Callable[..., xr.DataArray]
    argument: str = ""


#: Conditioning steps in the order in which they act. A value is true (the function with its defaults), false (the step
#: is left out), the value of one argument, or a table of arguments.
STEPS: dict[str, Step] = {
    "crop": Step(conditioning.crop),
    "rotate90": Step(conditioning.rotate90, "turns"),
    "invert": Step(conditioning.invert),
    "level": Step(conditioning.level, "order"),
    "outliers": Step(conditioning.mask_outliers),
    "fill": Step(conditioning.fill, "method"),
    "filter": Step(conditioning.gaussian_filter, "cutoff"),
    "shortest_wave": Step(conditioning.without_short_waves, "shortest"),
    "realisation": Step(surrogate, "number"),
    "resample": Step(conditioning.resample, "shape"),
}
#: Steps that a face may have before a second face lies on it.
FACE_STEPS = ("crop", "rotate90", "invert", "level", "outliers", "fill", "filter")
#: Steps that leave a periodic surface periodic.
_KEEP_PERIOD = ("rotate90", "invert", "shortest_wave", "resample")
#: Keys of a card that change no height.
PROVENANCE = ("title", "description", "licence", "source", "instrument")
_FILE = ("file", "sha256", "format", "channel", *Reading._fields)


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
        about = {key: _text(card, key) for key in PROVENANCE if key in card}
        rest = {key: value for key, value in card.items() if key not in PROVENANCE}
        h = _scan(rest, path.parent) if "file" in rest else generate(rest)
        h = condition(h, steps, "conditioning") if conditioned else h
    except InputError as error:
        raise error.prefixed(str(path)) from error
    return h.assign_attrs(card=path.name, **about)


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


def generate(table: Mapping[str, Any], where: str = "") -> xr.DataArray:
    """Make heights by a recipe. [m]

    Parameters
    ----------
    table : mapping
        ``generate``, the name of the recipe, and its arguments: quantities are numbers in SI or texts with a unit.
    where : str
        Dotted name of the table, for messages.

    Raises
    ------
    InputError
        If the recipe or a key is unknown, a parameter is missing, or a value is wrong.
    """
    recipe = RECIPES[one_of(dotted(where, "generate"), table["generate"], RECIPES)]
    return call(recipe, where, {key: value for key, value in table.items() if key != "generate"})


def condition(h: xr.DataArray, steps: Mapping[str, Any], where: str = "") -> xr.DataArray:
    """Condition heights.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    steps : mapping
        Any of :data:`STEPS` with their values, in any order; they act in the order of that list.
    where : str
        Dotted name of the table, for messages.

    Returns
    -------
    xarray.DataArray
        Conditioned height. [m]

    Raises
    ------
    InputError
        If a step or an option is unknown, or a value is wrong.
    """
    for name, arguments in _stated(steps, where):
        with _named(steps, where, name):
            h = call(STEPS[name].function, "", arguments, h)
    return h


def check_steps(steps: Mapping[str, Any], where: str = "") -> None:
    """Check conditioning steps without heights.

    Parameters
    ----------
    steps, where
        As in :func:`condition`.
    """
    for name, arguments in _stated(steps, where):
        with _named(steps, where, name):
            check(STEPS[name].function, "", arguments)


@contextmanager
def _named(steps: Mapping[str, Any], where: str, name: str) -> Iterator[None]:
    """Put the key of a step in front of errors about its argument, which the value of the key may be itself."""
    try:
        yield
    except InputError as error:
        key = dotted(where, name)
        if error.key == STEPS[name].argument != "" and not isinstance(steps[name], Mapping | bool):
            raise InputError(key=key, found=error.found, expected=error.expected) from error
        raise located(error, key) from error


def _stated(steps: Any, where: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield name and arguments of each step that is not left out, in order."""
    refuse_unknown(where, a_table(where or "conditioning", steps), STEPS)
    for name, step in STEPS.items():
        value = steps.get(name, False)
        if isinstance(value, Mapping):
            yield name, dict(value)
        elif value is True:
            yield name, {}
        elif value is not False:
            if not step.argument:
                raise InputError(key=dotted(where, name), found=value, expected="true, false or a table")
            yield name, {step.argument: value}


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
    for step in STEPS:
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
    refuse_unknown("", card, _FILE)
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
    options = {key: card[key] for key in ("format", "channel", *Reading._fields) if key in card}
    options |= {key: in_si(card[key], "m", key) for key in ("spacing", "grid") if key in card}
    if is_card(path, options.get("format")):
        return open_card(path, **{key: value for key, value in options.items() if key != "format"})
    return read_file(existing(path), **options)


def _text(card: Mapping[str, Any], key: str) -> str:
    if not isinstance(card[key], str):
        raise InputError(f"{key} is {card[key]!r}: expected a text")
    return card[key]
