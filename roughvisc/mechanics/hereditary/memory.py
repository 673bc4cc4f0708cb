"""What a march asks of a memory: the past reduces a step to ``u = alpha v + H``, with a number and a known field."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.materials.prony import Prony

Array = NDArray[np.float64]

#: Weight :func:`old_weight` from which the damped rule is taken (docs/theory.md, "Step lengths").
STIFF = 0.5

#: How pressure is taken to run within a step. ``linear``: second order, exact for piecewise-linear pressure.
#: ``bdf2``: second order, damps what relaxes within a step. ``euler``: its start. ``right``: constant, jumping at
#: the start of the step.
Rule = Literal["linear", "bdf2", "euler", "right"]
ActsOn = Literal["displacement", "pressure", "both", "waves"]


class Memory(Protocol):
    """What a march asks of a memory. ``field`` is ``v``, ``p`` or both, one upon the other, as ``acts_on`` says."""

    @property
    def material(self) -> Prony:
        """Whose past it is; of waves, that one of them by which steps are judged."""
        ...

    @property
    def acts_on(self) -> ActsOn:
        """Whether the fields are displacements at unit compliance [Pa m] or pressures [Pa], or ``(p, v)``.

        One of waves takes pressures, and carries displacements.
        """
        ...

    @property
    def rules(self) -> tuple[Rule, ...]:
        """The rules that it knows."""
        ...

    def start(self, shape: tuple[int, int]) -> Any:
        """State at rest."""
        ...

    def predict(self, state: Any, step: float, rule: Rule) -> tuple[float, Array]:
        """``alpha`` [1/Pa] and the carried field of a step ahead, which may be zero (a jump). [s]"""
        ...

    def advance(self, state: Any, step: float, rule: Rule, field: Array) -> Any:
        """State after that step, at whose end the field was ``field``."""
        ...

    def restart(self, state: Any) -> Any:
        """State in which no step reaches behind the present instant: after a jump or a corner."""
        ...

    def roll(self, state: Any, cells: int, axis: int) -> Any:
        """State of a periodic body seen from a profile that has moved by so many cells along an axis."""
        ...

    def enlarged(
        self, state: Any, shape: tuple[int, int], offset: tuple[int, int], displaced: Callable[[Array], Array]
    ) -> Any:
        """State on a larger grid, in which the present one begins at ``offset``; not of displacements alone.

        ``displaced`` gives the displacement at unit compliance under a pressure there.
        """
        ...


def mean_compliance(material: Prony, step: float) -> float:
    """Mean contact compliance over the first ``step`` of creep, ``int_0^h C / h``. [1/Pa]"""
    return float(material.mean_contact_compliance(0.0, step))


def old_weight(compliance: float, mean: float) -> float:
    """Weight of the old over the new pressure in a ``linear`` step; above :data:`STIFF` it rings.

    From the compliance at the end of the step and its mean over it [1/Pa]: zero for an elastic material, one for a
    dashpot or a Kelvin-Voigt solid.
    """
    return compliance / mean - 1 if mean > 0 else math.inf
