"""``[want]``: how accurate numbers are wanted, and what is known of their errors. It changes no case's key."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, WithJsonSchema, create_model, model_validator

from roughvisc.study.statement.schema.conditioning import LENGTH
from roughvisc.study.statement.schema.entries import choice, literal_or, measured, nullable
from roughvisc.study.statement.schema.section import Section, refuse

#: Numbers whose whole error is known, as the budget knows them.
WANTED = (
    "contact_area",
    "mean_gap",
    "approach",
    "force",
    "friction_coefficient",
    "leak_rate",
    "thermal_conductance",
    "incremental_stiffness",
)
#: What is known of their errors.
KNOWN = ("modulus_error", "time_scale_error", "cutoff", "population")
#: In place of an error: the smallest that the time allows.
BEST = "best"
_TEXT = WithJsonSchema({"type": ["number", "string"]})
_ERROR = "'best', or a part of one above 0 and below 1, such as '1 %'"
_SHARE = "a part of one, at least 0 and below 1, such as '10 %'"


class _Wanted(Section):
    """How accurate numbers are wanted, and what is known of their errors."""

    def numbers(self) -> list[str]:
        """Those that are wanted."""
        return [name for name in WANTED if getattr(self, name) is not None]

    def targets(self) -> dict[str, float]:
        """Number -> relative error that is wanted of it, at 95 %, where one is stated."""
        return {name: found for name in self.numbers() if (found := getattr(self, name)) != BEST}

    @property
    def chooses(self) -> bool:
        """Whether grid and tolerance are to be chosen."""
        return bool(self.numbers() or getattr(self, "time", None))

    @model_validator(mode="after")
    def _best_in_a_time(self) -> _Wanted:
        for name in self.numbers():
            if getattr(self, name) == BEST and getattr(self, "time", None) is None:
                raise refuse(name, f"found {BEST!r} without a time: expected time = '60 s' or the like beside it")
        return self


WantSection: Any = create_model(
    "WantSection",
    __base__=_Wanted,
    __doc__=_Wanted.__doc__,
    **{name: (nullable(literal_or(BEST, measured("1", above=0, below=1), _ERROR)), None) for name in WANTED},
    time=(nullable(measured("s", above=0)), None),
    modulus_error=(nullable(Annotated[measured("1", least=0, below=1), _TEXT, Field(description=_SHARE)]), None),
    time_scale_error=(nullable(Annotated[measured("1", least=0, below=1), _TEXT, Field(description=_SHARE)]), None),
    cutoff=(nullable(LENGTH), None),
    population=(nullable(choice("patch", "ensemble")), None),
)
