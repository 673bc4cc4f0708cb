"""What the time steps leave unknown of an instant, part by part."""

from __future__ import annotations

import math
from dataclasses import dataclass

_EXCESS = ("stored_excess", "dissipated_excess")


@dataclass(frozen=True)
class Uncertainty:
    """What the time steps leave unknown at an instant, by the companion that takes steps twice as long.

    Attributes
    ----------
    pressure : float
        Of the pressure, its absolute values summed. [N]
    approach, force : float
        [m], [N]
    work, dissipated : float
        [J]
    friction : float
        Of the tangential force, in a slide. [N]
    inside, outside : float
        Area in contact that may be none, and area out of contact that may be in it. [m2]
    stored_excess, dissipated_excess : float
        What steps of finite length add to these energies, to leading order. [J]
    """

    pressure: float = 0.0
    approach: float = 0.0
    force: float = 0.0
    work: float = 0.0
    dissipated: float = 0.0
    friction: float = 0.0
    inside: float = 0.0
    outside: float = 0.0
    stored_excess: float = 0.0
    dissipated_excess: float = 0.0

    def or_worse(self, other: Uncertainty, part: float) -> Uncertainty:
        """The larger of both, part by part; what steps add to the energies lies a part of the way to the other's."""
        worse = {name: max(value, getattr(other, name)) for name, value in vars(self).items()}
        here, there = ({name: getattr(one, name) for name in _EXCESS} for one in (self, other))
        return Uncertainty(**worse | {name: (1 - part) * here[name] + part * there[name] for name in _EXCESS})

    def relative(self, force: float, approach: float) -> float:
        """The largest of pressure, force and approach over what these have come to so far [N], [m]. [-]"""
        if math.isnan(self.pressure):  # unknown, of surfaces at rest too
            return math.nan
        by_force = max(self.pressure, self.force) / force if force > 0 else 0.0
        return max(by_force, self.approach / approach if approach > 0 else 0.0)


#: Of a march that has no companion.
UNKNOWN = Uncertainty(**dict.fromkeys(Uncertainty.__dataclass_fields__, math.nan))
