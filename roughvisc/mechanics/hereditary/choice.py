"""Choice of the memory for a material: its exponentials, or the series nearest to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.mechanics.hereditary.memory import ActsOn, Memory
from roughvisc.mechanics.materials.creep import Creep, Material, complete
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.series import series

#: Largest error of a series that replaces a material, as a part of the tolerance.
SERIES_SHARE = 0.1
#: Default shortest time of a series, as a part of the length of the program.
SHORTEST_AGE = 1e-6
#: Up to so many exponentials are remembered as pressures and as displacements where the grid may change: the passes
#: over the grid that each of them takes cost less than the convolution that this saves (measured at 128 squared).
_MOST_TWICE = 3
#: Compliance at the end of a step over its mean in it, from which steps may ring: they do from 1.5.
_RINGING = 1.45


@dataclass(frozen=True)
class Choice:
    """A memory, and its distance from the material.

    Attributes
    ----------
    memory : Memory
        The memory of the time integration.
    series_error : float
        Largest relative error of the compliance at time zero and from the shortest age on; zero where the memory is
        exact. Before that age it is less, relative to the compliance that has crept by then.
    note : str
        The model in words.
    misfit : float
        Largest relative deviation of the series from the rows of a table, zero if it is within their noise.
    """

    memory: Memory
    series_error: float
    note: str
    misfit: float = 0.0

    @property
    def material(self) -> Prony:
        """The Prony series that the solver uses: the material, or the series in its place."""
        return self.memory.material

    def warning(self, tolerance: float) -> str:
        """What to say of a series that is farther from the material than the tolerance; empty if it is not."""
        off = max(self.series_error, self.misfit)
        if off <= tolerance:
            return ""
        return (
            f"The series in place of the material is {100 * off:.2g} % off at worst, more than the tolerance "
            f"{tolerance:g} (memory): no passive material comes nearer to it."
        )


def choose_memory(
    material: Material,
    duration: float,
    tolerance: float,
    acts_on: ActsOn = "displacement",
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
        The form that the memory takes; one of pressures may be one of both.
    shortest : float, optional
        Shortest time at which the compliance matters, apart from zero; default: a millionth of the program's length.
        [s]

    Returns
    -------
    Choice
        Exponentials: those of the material, if it is a series; otherwise a series in its place, within a tenth of
        the tolerance if the material is passive. For a program of jumps alone it has the material's instantaneous
        compliance, which is exact.

    Raises
    ------
    InputError
        If the material is not known over the whole program.
    """
    material = complete(material)
    if isinstance(material, Prony):
        return Choice(_recursive(material, acts_on, duration), 0.0, _joined(terms(material), material.note))
    if duration == 0:
        jumped, note = at_once(material), "instantaneous compliance"
        return Choice(_recursive(jumped, acts_on, duration), 0.0, note if jumped.glassy else f"no {note}")
    shortest = SHORTEST_AGE * duration if shortest is None else shortest
    found, error = series(material, shortest, duration, SERIES_SHARE * tolerance)
    within = f" in place of the compliance, within {error:.1e} of it at time zero and from {shortest:.1g} s"
    active = "no positive series comes nearer: the material is not passive" if error > tolerance else ""
    note = _joined(terms(found) + within * bool(error), material.note, active)
    return Choice(_recursive(found, acts_on, duration), error, note, material.misfit)


def at_once(material: Prony | Creep) -> Prony:
    """Return the elastic material of a program of jumps, which needs the instantaneous compliance only."""
    glassy = float(material.contact_compliance(0.0)) * 2 / (1 - material.poisson)
    return Prony(glassy, 0.0 if glassy else 1.0, poisson=material.poisson)


def _recursive(series: Prony, acts_on: ActsOn, duration: float) -> Modes:
    twice = acts_on == "pressure" and len(series.times) + bool(series.fluidity) <= _MOST_TWICE
    rules = Modes.rules if may_ring(series, duration) else tuple(rule for rule in Modes.rules if rule != "bdf2")
    return Modes(series, "both" if twice else acts_on, rules)


def may_ring(material: Prony, duration: float) -> bool:
    """Whether in some step pressure taken as linear would ring; if not, no step needs the state before the last."""
    if duration == 0:
        return False
    steps = duration * np.geomspace(1e-9, 1.0, 100)
    mean = material.mean_contact_compliance(np.zeros_like(steps), steps)
    return bool(np.any(material.contact_compliance(steps) > _RINGING * mean))


def terms(series: Prony) -> str:
    """Return the terms of a series in words."""
    if not series.times and not series.fluidity:
        return "no memory: elastic"
    count = len(series.times)
    exponentials = f"{count} exponential{'' if count == 1 else 's'}"
    return f"{exponentials} and a fluidity" if series.fluidity and count else exponentials if count else "a fluidity"


def _joined(*notes: str) -> str:
    return "; ".join(filter(None, notes))
