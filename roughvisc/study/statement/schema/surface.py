"""``[surface]``: an instrument file, a surface card or a recipe, and what is done to its heights."""

from __future__ import annotations

from functools import reduce
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, WrapValidator, create_model

from roughvisc.errors import InputError
from roughvisc.mechanics.bodies.operator import Boundary
from roughvisc.study.statement.schema.conditioning import LENGTH, SHAPE, SIZE, Conditioned, Prepared, either
from roughvisc.study.statement.schema.entries import (
    FilePath,
    Flag,
    Text,
    choice,
    measured,
    nullable,
    paired,
    shown,
    whole,
)
from roughvisc.study.statement.schema.section import Section, close, nearest, refuse
from roughvisc.topography import recipes
from roughvisc.topography.recipes import UNITS

if TYPE_CHECKING:
    import xarray as xr

PURE = measured("1", above=0)
_LENGTH_OR_RATIO = {"m": LENGTH, "1": PURE}
#: kinds of the arguments of recipes whose unit does not say it all
_KINDS = {
    "size": SIZE,
    "shape": paired(whole(1), "a whole number of cells"),  # one cell along an axis is a strip
    "exact": Flag,
    "waves": whole(1, 2),
    "hurst": measured("1", above=0, most=1),
    "amplitudes": choice("fixed", "gaussian"),
    "seed": whole(0),
}


def _kind(recipe: str, key: str, default: Any) -> Any:
    if recipe == "self_affine" and key == "shape":
        return SHAPE  # roughness needs waves both ways
    kind = _KINDS[key] if key in _KINDS else _LENGTH_OR_RATIO[UNITS[key]]
    return nullable(kind) if default is None else kind


#: name of a recipe -> the kind of each of its keys, and its default (``...``: none)
RECIPES: dict[str, dict[str, Any]] = {
    name: {key: (_kind(name, key, default), default) for key, default in arguments.items()}
    for name, arguments in recipes.RECIPES.items()
}


_CHANNEL = "the name or the number of a channel"


def _channel(value: Any) -> Any:
    if value is not None and (isinstance(value, bool) or not isinstance(value, str | int)):
        raise InputError(f"found {shown(value)}: expected {_CHANNEL}")
    return value


class Raw(Section):
    """Source of the heights."""

    def raw(self) -> xr.DataArray:
        """The heights as read or made. [m]"""
        raise NotImplementedError

    def made_for(self) -> Boundary | None:
        """Boundary that the heights are made for; None where the study has to say it."""
        raise NotImplementedError


class FromFile(Raw):
    """An instrument file or a surface card."""

    file: FilePath
    format: nullable(Text) = None
    channel: either(_channel, ["string", "integer"], _CHANNEL) = None
    unit: nullable(Text) = None
    height_unit: nullable(Text) = None
    spacing: nullable(SIZE) = None

    def raw(self) -> xr.DataArray:
        from roughvisc.topography.scans import open_scan

        keys = ("format", "channel", "unit", "height_unit", "spacing")
        return open_scan(self.file, **{key: getattr(self, key) for key in keys})

    def made_for(self) -> Boundary | None:
        from roughvisc.topography.cards import boundary_of_card, is_card

        path = Path(self.file)
        return boundary_of_card(path) if is_card(path, self.format) else None


class FromRecipe(Raw):
    """Heights made by a recipe; each recipe has a class of its own, made from :data:`RECIPES`."""

    generate: str

    def raw(self) -> xr.DataArray:
        return recipes.make(self.generate, {key: getattr(self, key) for key in RECIPES[self.generate]})

    def made_for(self) -> Boundary | None:
        return recipes.BOUNDARIES[self.generate]


class SecondFace(Prepared, Raw):
    """The face that lies on the first, its peaks towards it."""

    flip: choice("x", "y", "none") = "x"
    offset: paired(measured("m"), "a length") = (0.0, 0.0)

    def laid(self, height: xr.DataArray) -> xr.DataArray:
        """Sum of this face and the first, given as conditioned. [m]"""
        from roughvisc.topography.framing import combine

        flip = None if self.flip == "none" else self.flip
        try:
            own = self.prepared(self.raw())
        except InputError as error:
            raise InputError(f"second: {error}") from error
        return combine(height, own, flip, align="centre", offset=self.offset)


def _made(recipe: type[FromRecipe], prefix: str = "") -> dict[str, Any]:
    return {
        name: create_model(prefix + name, __base__=recipe, generate=(Literal[name], ...), **keys)
        for name, keys in RECIPES.items()
    }


def _picker(whole: type[Section], of_file: type[FromFile], made: dict[str, Any]) -> Any:
    """A table as the class of what it is; ``whole`` is the class that all of them share."""

    def pick(data: Any, _: Any, info: Any) -> Any:
        if isinstance(data, whole):
            return data
        if not isinstance(data, dict):
            raise InputError(f"found {shown(data)}: expected a table with a file, or with generate")
        if ("file" in data) == ("generate" in data):
            hints = [close(key, ("file", "generate")) for key in data if key not in ("file", "generate")]
            raise InputError(f"found {shown(data)}: expected either file or generate{next(filter(None, hints), '')}")
        if "file" in data:
            return of_file.model_validate(data, context=info.context)
        recipe = data["generate"]
        if not isinstance(recipe, str) or recipe not in made:
            raise refuse("generate", f"found {shown(recipe)}, which is no known recipe{nearest(recipe, made)}")
        return made[recipe].model_validate(data, context=info.context)

    return WrapValidator(pick)


class SecondFile(FromFile, SecondFace):
    """A second face from an instrument file or a surface card."""


class SecondRecipe(FromRecipe, SecondFace):
    """A second face made by a recipe."""


SECOND = _made(SecondRecipe, "second_")
_SECOND_WANTED = "a [surface.second] table with a file, or with generate"
AnySecond = Annotated[
    reduce(or_, (SecondFile, *SECOND.values())),
    _picker(SecondFace, SecondFile, SECOND),
    Field(description=_SECOND_WANTED),
]


class SurfaceSection(Conditioned, Raw):
    """A surface, what is done to its heights, and the face that lies on it if there is one."""

    second: nullable(AnySecond) = None

    def height(self) -> xr.DataArray:
        """The heights as conditioned, peaks up; of two faces: their sum. [m]"""
        height = self.prepared(self.raw())
        return self.framed(height if self.second is None else self.second.laid(height))

    def boundary(self) -> Boundary | None:
        """Boundary that the surface is made for, without its heights; None where the study has to say it."""
        from roughvisc.topography.cards import boundary_after

        stated = self.model_dump(include=set(Conditioned.model_fields) - {"missing"}, exclude_none=True)
        prepared = boundary_after(
            {name: stated.pop(name) for name in stated.keys() & Prepared.model_fields}, self.made_for()
        )
        return boundary_after(stated, prepared if self.second is None else None)


class FileSurface(FromFile, SurfaceSection):
    """A surface from an instrument file or a surface card."""


class RecipeSurface(FromRecipe, SurfaceSection):
    """A surface made by a recipe."""


GENERATED = _made(RecipeSurface)
AnySurface = Annotated[
    reduce(or_, (FileSurface, *GENERATED.values())),
    _picker(SurfaceSection, FileSurface, GENERATED),
    Field(description="a [surface] table with a file, or with generate"),
]
