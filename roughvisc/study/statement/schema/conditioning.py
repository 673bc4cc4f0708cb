"""What may be done to the heights of a surface: the keys of ``[surface]`` that say so, beside its file or recipe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from roughvisc.errors import InputError
from roughvisc.study.statement.schema.entries import Flag, a_list, choice, measured, optional, paired, shown, whole
from roughvisc.study.statement.schema.section import Section
from roughvisc.study.statement.settings import WORDS, Settings

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


class Crop(Section):
    """The part of the scan that is used."""

    x: optional(LIMITS) = None
    y: optional(LIMITS) = None


class Outliers(Section):
    """Points masked that lie far from the median of their neighbours."""

    window: whole(3, odd=True) = 9
    threshold: measured("1", above=0) = 8.0


class Filter(Section):
    """A Gaussian filter."""

    cutoff: LENGTH
    keep: choice("long", "short") = "long"
    periodic: Flag = False


def either(check: Any, kinds: list[str], wanted: str, table: Any = Any) -> Any:
    """Kind: several types of value, told apart by a check; ``table``: what the check makes of one, or false."""
    made = table if table is Any else table | Literal[False]
    return Annotated[made, BeforeValidator(check), WithJsonSchema({"type": kinds}), Field(description=wanted)]


_LEVEL = "true (a plane), false, or the order of the polynomial removed: 0, 1, 2 or 3"
_FILL = "true, false, 'harmonic', 'nearest' or 'linear'"
_OUTLIERS = "true, false, or a table of window and threshold"
_FILTER = "false, a cut-off length, or a table of cutoff, keep and periodic"


def _level(value: Any) -> Any:
    if isinstance(value, bool):
        return 1 if value else False
    if not isinstance(value, int) or not 0 <= value <= 3:
        raise InputError(f"found {shown(value)}: expected {_LEVEL}")
    return value


def _fill(value: Any) -> Any:
    if isinstance(value, bool):
        return "harmonic" if value else False
    if value not in ("harmonic", "nearest", "linear"):
        raise InputError(f"found {shown(value)}: expected {_FILL}")
    return value


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

    crop: optional(Crop) = None
    rotate90: optional(whole(0, 3)) = None
    invert: Flag = False
    level: either(_level, ["boolean", "integer"], _LEVEL) = False
    outliers: either(_outliers, ["boolean", "object"], _OUTLIERS, Outliers) = False
    fill: either(_fill, ["boolean", "string"], _FILL) = False
    filter: either(_filter, ["boolean", "number", "string", "object"], _FILTER, Filter) = False

    def prepared(self, height: xr.DataArray) -> xr.DataArray:
        """Heights after the steps asked for. [m]"""
        return _conditioned(self, Prepared, height)


class Conditioned(Prepared):
    """What every surface may have done to it: the steps of a face, then those of the profile that is pressed."""

    resample: optional(SHAPE) = None
    taper: optional(SIZE) = None
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
