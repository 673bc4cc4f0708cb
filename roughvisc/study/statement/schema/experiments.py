"""Tables of a study that say what is done with the surface, each in place of the segments of a program."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from roughvisc.errors import InputError
from roughvisc.experiment.base import Experiment
from roughvisc.experiment.sliding import DIRECTIONS, SteadySliding
from roughvisc.mechanics.program import INSTEAD
from roughvisc.study.statement.schema.section import (
    Section,
    Unit,
    choice,
    kind,
    measured,
    nullable,
    refuse,
    shown,
    validate,
    whole,
)


class ExperimentSection(Section):
    """A table that states an experiment."""

    def experiment(self) -> Experiment:
        """What is done, as the solver takes it."""
        raise NotImplementedError


_SPEED = measured("m/s", above=0)
_WANTED = "a speed in m/s, a list of them, or a table with from, to and count"
#: More speeds than a curve has decades for are taken for a slip.
_MOST_SPEEDS = 1000


class Decades(Section):
    """Speeds between two ends, evenly on a logarithmic axis."""

    from_: Annotated[_SPEED, Field(alias="from")]
    to: _SPEED
    count: whole(2, _MOST_SPEEDS)


def _speeds(value: Any, info: ValidationInfo) -> tuple[float, ...]:
    """Speeds in order, each once."""
    if isinstance(value, dict):
        ends = Decades.model_validate(value, context=info.context)
        if not ends.from_ < ends.to:
            raise InputError(f"found from {ends.from_:g} to {ends.to:g} m/s: expected the lower end first")
        found = np.geomspace(ends.from_, ends.to, ends.count).tolist()
    elif isinstance(value, list | tuple):
        found = [validate(_SPEED, one) for one in value]
        if not 0 < len(found) <= _MOST_SPEEDS:
            raise InputError(f"found {len(found)} speeds: expected 1 to {_MOST_SPEEDS}")
    elif isinstance(value, str | int | float) and not isinstance(value, bool):
        found = [validate(_SPEED, value)]
    else:
        raise InputError(f"found {shown(value)}: expected {_WANTED}")
    return tuple(sorted({float(f"{speed:.12g}") for speed in found}))


class FrictionSection(ExperimentSection):
    """Steady sliding at given speeds."""

    speeds: kind(
        tuple[float, ...],
        _speeds,
        _WANTED,
        {"type": ["number", "string", "array", "object"], "items": {"type": ["number", "string"]}},
        Unit("m/s"),
    )
    load: nullable(measured("N", above=0, instead=INSTEAD["load"])) = None
    pressure: nullable(measured("Pa", above=0, instead=INSTEAD["pressure"])) = None
    direction: choice(*DIRECTIONS) = SteadySliding.direction

    @model_validator(mode="after")
    def _has_one_load(self) -> FrictionSection:
        if self.load is None and self.pressure is None:
            raise refuse("load", "missing: expected a load in N, or a nominal pressure in Pa as pressure")
        if self.load is not None and self.pressure is not None:
            raise refuse("pressure", "found beside load: expected one of them")
        return self

    def experiment(self) -> SteadySliding:
        """What is asked, as the solver takes it."""
        return SteadySliding(**dict(self))
