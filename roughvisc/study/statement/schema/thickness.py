"""Thickness in ``[material]``: the keys of a sheet on a rigid base, in place of a half-space."""

from __future__ import annotations

import math
from typing import Annotated, Any, get_args

from pydantic import BeforeValidator, Field, WithJsonSchema

from roughvisc.mechanics.bodies.sheet import Base
from roughvisc.study.statement.schema.entries import Unit, choice, measured, validate

_THICKNESS = measured("m", above=0)


def _thickness(value: Any) -> float:
    """A length, or an infinite one: a half-space among the sheets of a sweep."""
    endless = isinstance(value, float) and value == math.inf
    return math.inf if endless else float(validate(_THICKNESS, value))


#: key -> its kind; every model takes them, and a half-space has none of them
KEYS: dict[str, Any] = {
    "thickness": Annotated[
        float,
        BeforeValidator(_thickness),
        WithJsonSchema({"type": ["number", "string"]}),
        Field(description="a number in m, or a string with a unit of its kind, above 0; inf: a half-space"),
        Unit("m"),
    ],
    "base": choice(*get_args(Base)),
}
