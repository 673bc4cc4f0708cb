"""``[surface]``: an instrument file, a surface card or a recipe, and what is done to its heights."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, create_model

from roughvisc.errors import InputError
from roughvisc.mechanics.grid import Boundary
from roughvisc.settings import WORDS, Settings
from roughvisc.study.statement.schema.section import (
    FilePath,
    Flag,
    Section,
    Text,
    a_list,
    choice,
    close,
    kind,
    measured,
    nearest,
    nullable,
    one_of,
    paired,
    refuse,
    shown,
    whole,
)
from roughvisc.topography import synthesis
from roughvisc.topography.arguments import FILL, KEEP, ORDER, TURNS, WINDOW, Argument
from roughvisc.topography.synthesis import UNITS

if TYPE_CHECKING:
    import xarray as xr

LENGTH = measured("m", above=0)
SIZE = paired(LENGTH, "a length")
SHAPE = paired(whole(2), "a whole number of cells")
_LIMITS = "a list of two lengths, the lower and the upper limit"


def _ascending(limits: tuple[float, float]) -> tuple[float, float]:
    if not limits[0] < limits[1]:
        raise InputError(f"found {limits[0]:g} and {limits[1]:g} m: expected {_LIMITS}")
    return limits


LIMITS = Annotated[
    tuple[measured("m"), measured("m")],
    BeforeValidator(lambda value: a_list(value, _LIMITS, 2)),
    AfterValidator(_ascending),
    Field(description=_LIMITS),
]


def _argument(argument: Argument, schema: dict[str, Any], when_true: Any = None) -> Any:
    """Kind: an argument of a step as topography checks it; or true and false, where true stands for a value."""

    def check(value: Any) -> Any:
        if isinstance(value, bool) and when_true is not None:
            return when_true if value else False
        if not argument.allows(value):
            raise InputError(f"found {shown(value)}: expected {argument.wanted}")
        return value

    wanted = argument.wanted if when_true is None else f"true ({when_true!r}), false, or {argument.wanted}"
    return kind(Any, check, wanted, schema)


class Crop(Section):
    """The part of the scan that is used."""

    x: nullable(LIMITS) = None
    y: nullable(LIMITS) = None


class Outliers(Section):
    """Points masked that lie far from the median of their neighbours."""

    window: _argument(WINDOW, {"type": "integer", "minimum": 3, "not": {"multipleOf": 2}}) = 9
    threshold: measured("1", above=0) = 8.0


class Filter(Section):
    """A Gaussian filter."""

    cutoff: LENGTH
    keep: _argument(KEEP, {"enum": ["long", "short"]}) = "long"
    periodic: Flag = False


_OUTLIERS = "true, false, or a table of window and threshold"
_FILTER = "false, a cut-off length, or a table of cutoff, keep and periodic"


def _outliers(value: Any) -> Any:
    if isinstance(value, bool):
        return Outliers() if value else False
    if not isinstance(value, dict | Outliers):
        raise InputError(f"found {shown(value)}: expected {_OUTLIERS}")
    return Outliers.model_validate(value)


def _filter(value: Any) -> Any:
    if value is False:
        return False
    return Filter.model_validate(value if isinstance(value, dict | Filter) else {"cutoff": value})


class Prepared(Section):
    """What every face may have done to it; the steps act in the order of surface cards, which is this one."""

    crop: nullable(Crop) = None
    rotate90: nullable(_argument(TURNS, {"type": "integer"})) = None
    invert: Flag = False
    level: _argument(ORDER, {"type": ["boolean", "integer"]}, 1) = False
    outliers: kind(Outliers | Literal[False], _outliers, _OUTLIERS, {"type": ["boolean", "object"]}) = False
    fill: _argument(FILL, {"type": ["boolean", "string"]}, "harmonic") = False
    filter: kind(Filter | Literal[False], _filter, _FILTER, {"type": ["boolean", "number", "string", "object"]}) = False

    def prepared(self, height: xr.DataArray) -> xr.DataArray:
        """Heights after the steps asked for. [m]"""
        return _conditioned(self, Prepared, height)


class Conditioned(Prepared):
    """What every surface may have done to it: the steps of a face, then those of the profile that is pressed."""

    shortest_wave: nullable(LENGTH) = None
    realisation: nullable(whole(1)) = None
    resample: nullable(SHAPE) = None
    missing: choice(*WORDS["missing"]) = Settings.missing


def _conditioned(stated: Prepared, steps: type[Prepared], height: xr.DataArray, **detailed: Any) -> xr.DataArray:
    """Heights after the steps that the class ``steps`` itself declares. [m]

    The values of the steps are those stated, except for steps in ``detailed``.
    """
    from roughvisc.topography.cards import condition

    names = set(steps.__annotations__) - {"missing"}
    return condition(height, stated.model_dump(include=names, exclude_none=True) | detailed)


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
    known = _KINDS[key] if key in _KINDS else _LENGTH_OR_RATIO[UNITS[key]]
    return nullable(known) if default is None else known


#: name of a recipe -> the kind of each of its keys, and its default (``...``: none)
RECIPES: dict[str, dict[str, Any]] = {
    name: {key: (_kind(name, key, default), default) for key, default in arguments.items()}
    for name, arguments in synthesis.RECIPES.items()
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

    def surrogate_seed(self) -> int:
        """Random seed of the surrogates of this surface."""
        return 0


class FromFile(Raw):
    """An instrument file or a surface card."""

    file: FilePath
    format: nullable(Text) = None
    channel: kind(Any, _channel, _CHANNEL, {"type": ["string", "integer"]}) = None
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

    def surrogate_seed(self) -> int:
        """Random seed of the surrogates, different for each scan.

        With a common seed, the first surrogates of all scans would deviate from their mean in the same direction.
        """
        from roughvisc.topography.cards import measured_file
        from roughvisc.topography.readers import sha256

        path = measured_file(Path(self.file), self.format)
        return 0 if path is None else int(sha256(path)[:8], 16)


class FromRecipe(Raw):
    """Heights made by a recipe; each recipe has a class of its own, made from :data:`RECIPES`."""

    generate: str

    def raw(self) -> xr.DataArray:
        return synthesis.make(self.generate, {key: getattr(self, key) for key in RECIPES[self.generate]})

    def made_for(self) -> Boundary | None:
        return synthesis.BOUNDARIES[self.generate]


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


def _face(base: type[Section], of_file: type[FromFile], made: dict[str, Any], name: str) -> Any:
    """Kind: a table with a file or with a recipe, as the class of what it is."""

    def make(data: dict[str, Any], info: ValidationInfo) -> Any:
        if ("file" in data) == ("generate" in data):
            hints = [close(key, ("file", "generate")) for key in data if key not in ("file", "generate")]
            raise InputError(f"found {shown(data)}: expected either file or generate{next(filter(None, hints), '')}")
        if "file" in data:
            return of_file.model_validate(data, context=info.context)
        recipe = data["generate"]
        if not isinstance(recipe, str) or recipe not in made:
            raise refuse("generate", f"found {shown(recipe)}, which is no known recipe{nearest(recipe, made)}")
        return made[recipe].model_validate(data, context=info.context)

    wanted = "with a file, or with generate"
    return one_of(base, (of_file, *made.values()), make, f"a table {wanted}", f"a [{name}] table {wanted}")


class SecondFile(FromFile, SecondFace):
    """A second face from an instrument file or a surface card."""


class SecondRecipe(FromRecipe, SecondFace):
    """A second face made by a recipe."""


SECOND = _made(SecondRecipe, "second_")
AnySecond = _face(SecondFace, SecondFile, SECOND, "surface.second")


class SurfaceSection(Conditioned, Raw):
    """A surface, what is done to its heights, and the face that lies on it if there is one."""

    second: nullable(AnySecond) = None

    def height(self) -> xr.DataArray:
        """The heights as conditioned, peaks up; of two faces: their sum. [m]"""
        height = self.prepared(self.raw())
        if self.second is not None:
            height = self.second.laid(height)
        if self.realisation is None:
            return _conditioned(self, Conditioned, height)
        surrogate = {"number": self.realisation, "seed": self.surrogate_seed()}
        return _conditioned(self, Conditioned, height, realisation=surrogate)

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
AnySurface = _face(SurfaceSection, FileSurface, GENERATED, "surface")
