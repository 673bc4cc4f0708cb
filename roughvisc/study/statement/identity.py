"""Key of a case: a digest of all that determines its numbers."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from roughvisc.errors import InputError
from roughvisc.study.statement.schema import Study
from roughvisc.study.statement.schema.surface import FromFile, Raw, SecondFace, SurfaceSection
from roughvisc.topography.cards import read_toml
from roughvisc.topography.readers import sha256

#: Raised by whoever changes the numbers that an unchanged case gives.
NUMERICS_REVISION = 30

#: Keys of a surface card that say whence it came and change no height.
_PROSE = {
    "title",
    "name",
    "description",
    "comment",
    "licence",
    "license",
    "source",
    "instrument",
    "sha256",
    "synthetic",
}
#: Keys of ``[solve]`` and ``[keep]`` that count at their defaults too. No new key does, so that the keys of former
#: cases stay. The precision of the file is a key of ``[keep]`` and no setting of a solve.
_ALWAYS = {"boundary", "tolerance", "times", "fields", "edge", "time_step", "precision"}


def identity(settings: Study) -> tuple[str, str]:
    """Digest of all that determines the numbers, sixteen hexadecimal digits, and that of the surface's file or recipe.

    Both come from one reading of the file. The surface counts by the content of its file and not by its path, as do
    tables of a material; the program by its segments and not by how they were written. No title counts, nothing that is
    observed of the result, and nothing that an audit is told or that is wanted; nor does the library of the transforms,
    which changes the last digits: a result says what it was made with.
    """
    stated = settings.model_dump(
        mode="json",
        exclude={"title", "audit", "observe", "program", "surface", "material", "friction"},
        serialize_as_any=True,
    )
    for table, section in (("solve", settings.solve), ("keep", settings.keep)):
        usual = type(section)().model_dump(mode="json")
        stated[table] = {key: value for key, value in stated[table].items() if key in _ALWAYS or value != usual[key]}
    experiment = settings.experiment()
    stated[experiment.table] = experiment.content()
    stated["material"] = settings.material.content()
    surface = surface_content(settings.surface)
    stated["surface"] = surface
    stated["numerics"] = NUMERICS_REVISION
    return _digest(stated)[:16], surface[0]


@cache
def program() -> str:
    """This program and its version, as results state their source."""
    return f"roughvisc {metadata.version('roughvisc')}"


def program_version() -> str:
    """This version of roughvisc, and of the numbers that it gives.

    Examples
    --------
    >>> program_version()  # doctest: +SKIP
    'roughvisc 0.1.dev493+g9bdb14a83 (numerics 15)'
    """
    return f"{program()} (numerics {NUMERICS_REVISION})"


def surface_content(surface: Raw) -> tuple[str, dict[str, Any]]:
    """Digest of what the surface is made of, and what is done to it: the face that lies on it counts there.

    Returns
    -------
    sha256 : str
        Of the scan's file; for a card, of the file that it names; for a recipe, of the recipe.
    treatment : dict
        The conditioning, of the card too.
    """
    stated = surface.model_dump(mode="json", serialize_as_any=True, exclude={"second"})
    stated = {key: value for key, value in stated.items() if value is not None}
    second = getattr(surface, "second", None)
    above = {} if second is None else {"second": surface_content(second)}
    if not isinstance(surface, FromFile):
        steps = SecondFace if isinstance(surface, SecondFace) else SurfaceSection
        treatment = {key: stated.pop(key) for key in steps.model_fields if key in stated}
        return _digest(stated), treatment | above
    stated |= above
    path = Path(stated.pop("file"))
    if path.suffix.lower() != ".toml":
        return _checksum(path), stated
    card = read_toml(path, "a surface card in TOML")
    stated["card"] = {key: value for key, value in card.items() if key not in _PROSE and key != "file"}
    if isinstance(card.get("file"), str):
        return _checksum(path.parent / card["file"]), stated
    return _digest(stated["card"]), stated


def _checksum(path: Path) -> str:
    try:
        return sha256(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}: expected a scan file") from error


def _digest(stated: Any) -> str:
    """SHA-256 of nested values, the same wherever they are equal to 15 significant digits."""
    text = json.dumps(_rounded(stated), sort_keys=True, separators=(",", ":"), default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return f"{value + 0.0:.15g}"
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(entry) for entry in value]
    return value
