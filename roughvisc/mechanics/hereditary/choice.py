"""Choice of the memory for a material: the cheapest form whose error is within the tolerance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.hereditary.direct import History
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.mechanics.hereditary.memory import STIFF, ActsOn, Memory, stiff_ratio
from roughvisc.mechanics.materials.models import Material, Pair, PowerLaw, Prony, Tabulated
from roughvisc.mechanics.materials.passive import smallest_loss
from roughvisc.mechanics.materials.protocol import check_creep, complete
from roughvisc.mechanics.materials.series import series_of
from roughvisc.mechanics.materials.spectrum import lattice

#: Part of the tolerance that a series in place of a material may take.
SERIES_SHARE = 0.1
#: A series is certified from this part of the program's length on, if nothing else is asked for.
SHORTEST_AGE = 1e-6
#: Up to so many exponentials are remembered as pressures and as displacements where the grid may change: the passes
#: over the grid that each of them takes cost less than the convolution that this saves (measured at 128 squared).
_MOST_TWICE = 3
#: Compliance at the end of a step over its mean in it, from which steps may ring: they do from 1.5.
_RINGING = 1.45
#: The direct history is offered if its steps need not be shorter than this part of the program to stay smooth.
_SHORTEST_STEP = 1e-3
#: Instants in a decade at which a material of the user's own is looked at.
_SAMPLES = 100


#: Which memory to take: the cheapest that is accurate enough, or every past pressure.
Kind = Literal["auto", "direct"]


@dataclass(frozen=True)
class Choice:
    """A memory, and how well it stands for the material.

    Attributes
    ----------
    memory : Memory
        What a march keeps its past in.
    series_error : float
        Largest relative error of the compliance at time zero and from the shortest age on; zero where the memory is
        exact. Before that age it is less, relative to the compliance that has crept by then.
    note : str
        What is modelled, in words.
    """

    memory: Memory
    series_error: float
    note: str

    @property
    def material(self) -> Material:
        """What is pressed: the material, or the series in its place."""
        return self.memory.material


def choose_memory(
    material: Material,
    duration: float,
    tolerance: float,
    acts_on: ActsOn = "displacement",
    kind: Kind = "auto",
    shortest: float | None = None,
) -> Choice:
    """Memory for a material over a program.

    Parameters
    ----------
    material : Material
        Any material, of the user's own too.
    duration : float
        Length of the program. [s]
    tolerance : float
        Relative error that the whole computation is allowed.
    acts_on : {"displacement", "pressure"}
        The form that a recursive memory takes; one of pressures may be one of both.
    kind : {"auto", "direct"}
        ``direct``: the direct history, whatever the material; dearer, and independent of any series.
    shortest : float, optional
        Shortest age at which the compliance is asked for, beside zero; a millionth of the program's length if not
        given. [s]

    Returns
    -------
    Choice
        Recursive exponentials: those of the material, if it is a series; else a series in its place, within a tenth of
        the tolerance if there is one. A table that has none is made passive: what is pressed then is the positive
        series nearest to it.

    Raises
    ------
    InputError
        If the material is not known over the whole program, or the direct history of it would ring.
    """
    if kind not in ("auto", "direct"):
        raise InputError(f"memory is {kind!r}: expected 'auto' or 'direct'")
    material = complete(material)
    if kind == "direct":
        if duration > 0 and not isinstance(material, Prony | PowerLaw | Tabulated | Pair):
            check_creep(material, lattice(SHORTEST_AGE * duration, duration, _SAMPLES))
        if duration > 0 and not _direct_is_accurate(material, duration):
            raise InputError(
                "memory='direct' assumes linear pressure in each step, which oscillates for this material: "
                "expected memory='auto', or an instantaneous compliance that is not small"
            )
        return Choice(History(material), 0.0, f"direct history of every pressure, as asked for{_active(material)}")
    if isinstance(material, Prony):
        return Choice(_recursive(material, acts_on, duration), 0.0, terms(material))
    if duration == 0:  # jumps only: nothing but the instantaneous compliance matters
        glassy = float(material.contact_compliance(0.0))
        return Choice(History(material), 0.0, "instantaneous compliance" if glassy else "no instantaneous compliance")
    shortest = SHORTEST_AGE * duration if shortest is None else shortest
    material.contact_compliance(duration)  # refuses what ends before
    series = series_of(material, shortest, duration, SERIES_SHARE * tolerance)
    said = [terms(series.prony)]
    if series.pressed != series.prony:
        said[0] += (
            f" in place of the compliance, within {series.error:.1e} of it at once and from {series.shortest:.1g} s"
        )
    if series.repair:
        said.append(series.repair)
    return Choice(_recursive(series.prony, acts_on, duration), series.error, "; ".join(said))


def _active(material: Material) -> str:
    """What to say of tables that are not passive."""
    if isinstance(material, Pair):
        return _active(material.a) + _active(material.b)
    least = smallest_loss(material) if isinstance(material, Tabulated) else 0.0
    return f"; the table is not passive: sin(delta), about its loss factor, falls to {least:.2g}" if least < 0 else ""


def _recursive(series: Prony, acts_on: ActsOn, duration: float) -> Modes:
    twice = acts_on == "pressure" and len(series.times) + bool(series.fluidity) <= _MOST_TWICE
    rules = Modes.rules if may_ring(series, duration) else tuple(rule for rule in Modes.rules if rule != "bdf2")
    return Modes(series, "both" if twice else acts_on, rules)


def may_ring(material: Material, duration: float) -> bool:
    """Whether in some step pressure taken as linear would ring; if not, no step needs the state before the last."""
    if duration == 0:
        return False
    steps = duration * np.geomspace(1e-9, 1.0, 100)
    mean = material.mean_contact_compliance(np.zeros_like(steps), steps)
    return bool(np.any(material.contact_compliance(steps) > _RINGING * mean))


def terms(series: Prony) -> str:
    """What a series consists of, in words."""
    if not series.times and not series.fluidity:
        return "no memory: elastic"
    count = len(series.times)
    exponentials = f"{count} exponential{'' if count == 1 else 's'}"
    return f"{exponentials} and a fluidity" if series.fluidity and count else exponentials if count else "a fluidity"


def _direct_is_accurate(material: Material, duration: float) -> bool:
    """Pressure taken as linear in each step must not ring, and a jump must be followed at once."""
    if float(material.contact_compliance(0.0)) == 0:
        return False
    length = duration
    while stiff_ratio(material, length) > STIFF and length > 1e-12 * duration:
        length /= 2
    return math.isfinite(length) and length >= _SHORTEST_STEP * duration
