"""Memory of a body for a program: the exponential series of its material, and the error of the series."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from roughvisc.errors import InputError
from roughvisc.mechanics.body import Body, as_body
from roughvisc.mechanics.materials.creep import Creep, Material
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.series import series
from roughvisc.mechanics.memory import Memory

#: Largest error of a series that replaces a material, as a part of the tolerance.
SERIES_SHARE = 0.1
#: Part of this error for the series of the materials of a layered body; the rest is for the series of its waves.
MATERIALS_SHARE = 0.3


@dataclass(frozen=True)
class Choice:
    """A memory, and its deviation from the material.

    Attributes
    ----------
    memory : Memory
        Memory of the time steps.
    series_error : float
        Largest relative error of the compliance at time zero and from the shortest age on; zero if the memory is exact.
    note : str
        The model in words.
    misfit : float
        Largest relative deviation of the series from the rows of a table, zero if it is within their noise.
    """

    memory: Memory
    series_error: float
    note: str
    misfit: float = 0.0


def choose_memory(
    body: Body | Material,
    duration: float,
    tolerance: float,
    shortest: float,
    grid: Any = None,
    keeps_pressure: bool = False,
) -> Choice:
    """Return the memory of a body for a program.

    Parameters
    ----------
    body : Body or Material
        A body, or the material of a half-space.
    duration : float
        Length of the program. [s]
    tolerance : float
        Relative error that the whole computation may have.
    shortest : float
        Shortest time at which the compliance matters, apart from zero. [s]
    grid : Grid, optional
        Cells; needed for a layered body only.
    keeps_pressure : bool
        Whether the memory also keeps the pressure that causes the displacement.

    Returns
    -------
    Choice
        A series within a tenth of the tolerance if the material is passive.

    Raises
    ------
    InputError
        If the material is not known over the whole program, or no memory of the body is known.
    """
    body = as_body(body)
    if not body.separates:
        return _of_layers(body, duration, tolerance, shortest, grid)
    material = body.material
    if isinstance(material, Prony) and material.longest == math.inf:
        memory = Memory(material, duration, keeps_pressure)
        return Choice(memory, 0.0, "; ".join(filter(None, (in_words(material), material.note))))
    if duration == 0:
        found = at_once(material)
        note = "instantaneous compliance" if found.glassy else "no instantaneous compliance"
        return Choice(Memory(found, duration, keeps_pressure), 0.0, note)
    found, error = series(material, shortest, duration, SERIES_SHARE * tolerance)
    within = f" in place of the compliance, within {error:.1e} of it at time zero and from {shortest:.1g} s"
    active = "no positive series comes nearer: the material is not passive" if error > tolerance else ""
    notes = in_words(found) + within * bool(error), material.note, active
    return Choice(Memory(found, duration, keeps_pressure), error, "; ".join(filter(None, notes)), material.misfit)


def _of_layers(body: Body, duration: float, tolerance: float, shortest: float, grid: Any) -> Choice:
    """Return the memory of a layered body: exponentials that all waves share."""
    from roughvisc.mechanics.layer import LayeredBody, Layers, layer_series
    from roughvisc.mechanics.layer_memory import LayerMemory

    if not isinstance(body, LayeredBody):
        raise InputError(
            f"material is a {type(body).__name__} in which space and time do not separate, and no memory is known for "
            "it: expected the body that layer() makes, or a Body whose kernel is constant in time"
        )
    share = SERIES_SHARE * tolerance
    given = body.materials
    found = [
        series(one, shortest, duration, MATERIALS_SHARE * share) if duration > 0 else (at_once(one), 0.0)
        for one in given
    ]
    of_materials = max(error for _, error in found)
    layers = Layers(body.thicknesses, tuple(one for one, _ in found))
    waves = layer_series(layers, shortest, duration, share - of_materials)
    memory, error = LayerMemory(waves, duration, grid), waves.error + of_materials
    note = "the instantaneous compliance of each wave"
    if len(waves.compliances):
        within = f"within {error:.1e} of them from {shortest:.1g} s on"
        note = f"{in_words(memory.series)} that all waves share, each with compliances of its own, {within}"
    misfit = max(one.misfit for one in given)
    notes = "; ".join(filter(None, (note, *(one.note for one in given))))
    return Choice(memory, error, notes, misfit)


def at_once(material: Prony | Creep) -> Prony:
    """Return the elastic material of a program of jumps, which needs the instantaneous compliance only."""
    glassy = float(material.contact_compliance(0.0)) * 2 / (1 - material.poisson)
    return Prony(glassy, 0.0 if glassy else 1.0, poisson=material.poisson)


def in_words(found: Prony) -> str:
    """Return the terms of a series in words."""
    count = len(found.times)
    terms = [f"{count} exponential{'s' * (count > 1)}"] * (count > 0) + ["a fluidity"] * (found.fluidity > 0)
    return " and ".join(terms) or "no memory: elastic"
