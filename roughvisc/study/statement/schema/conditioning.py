"""What may be done to the heights of a surface: the keys of ``[surface]`` that say so, beside its file or recipe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from roughvisc.errors import InputError
from roughvisc.settings import WORDS, Settings
from roughvisc.study.statement.schema.entries import Flag, a_list, choice, measured, nullable, paired, shown, whole
from roughvisc.study.statement.schema.section import Section
from roughvisc.topography.arguments import FILL, KEEP, ORDER, TURNS, WINDOW, Argument

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
    return Annotated[Any, BeforeValidator(check), WithJsonSchema(schema), Field(description=wanted)]


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


def either(check: Any, kinds: list[str], wanted: str, table: Any = Any) -> Any:
    """Kind: several types of value, told apart by a check; ``table``: what the check makes of one, or false."""
    made = table if table is Any else table | Literal[False]
    return Annotated[made, BeforeValidator(check), WithJsonSchema({"type": kinds}), Field(description=wanted)]


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
    outliers: either(_outliers, ["boolean", "object"], _OUTLIERS, Outliers) = False
    fill: _argument(FILL, {"type": ["boolean", "string"]}, "harmonic") = False
    filter: either(_filter, ["boolean", "number", "string", "object"], _FILTER, Filter) = False

    def prepared(self, height: xr.DataArray) -> xr.DataArray:
        """Heights after the steps asked for. [m]"""
        return _conditioned(self, Prepared, height)


class Conditioned(Prepared):
    """What every surface may have done to it: the steps of a face, then those of the profile that is pressed."""

    shortest_wave: nullable(LENGTH) = None
    realisation: nullable(whole(1)) = None
    band_limit: nullable(SHAPE) = None
    resample: nullable(SHAPE) = None
    taper: nullable(SIZE) = None
    mirror: Flag = False
    missing: choice(*WORDS["missing"]) = Settings.missing

    def framed(self, height: xr.DataArray) -> xr.DataArray:
        """Heights after the steps asked for that come last. [m]"""
        return _conditioned(self, Conditioned, height)


def _conditioned(stated: Prepared, steps: type[Prepared], height: xr.DataArray) -> xr.DataArray:
    """Heights after the steps that a class of them names itself. [m]"""
    from roughvisc.topography.cards import condition

    names = set(steps.__annotations__) - {"missing"}
    return condition(height, stated.model_dump(include=names, exclude_none=True))
