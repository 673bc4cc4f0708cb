"""Memory of a body for a program: the exponential series of its material, and the error of the series.

If space and time do not separate in a layered body, the creep depends on the wave, with the same times of the
exponentials for all waves:

    C(q, t) = C_0(q) + fluidity(q) t + sum_m C_m(q) (1 - exp(-t/tau_m)).

The memory is the recursion of :class:`~roughvisc.mechanics.memory.Memory` for the transform of the pressure. Symbols
replace the compliances: ``C_0`` and each ``C_m`` are separate kernels. The compliance ``alpha`` of the elastic problem
of a step becomes a symbol too, so that the kernel of a step depends on its length:

    displacement_q = alpha_q p_q + history_q.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from roughvisc.mechanics.body import Body, wave_limits
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.layer import LayeredBody, LayerSeries, layer_series
from roughvisc.mechanics.materials.creep import Material
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.series import series
from roughvisc.mechanics.memory import History, Memory, Prediction

Array = Any  # an array of NumPy or CuPy

#: Largest error of a series that replaces a material, as a part of the tolerance.
SERIES_SHARE = 0.1
#: Part of this error for the series of the materials of a layered body; the rest is for the series of its waves.
MATERIALS_SHARE = 0.3


class LayerMemory(Memory):
    """Exponential series of the waves of a layered body. Fields and modes of a history are transforms of pressures.

    The wave of the grid that creeps most represents the body in the choice of rules and lengths of steps.

    Parameters
    ----------
    waves : LayerSeries
        Series of the body.
    duration : float
        Length of the program: no step is longer. [s]
    grid : Grid or None
        Cells and boundary; its kernel is not used. None if only the number of exponentials is of interest.
    """

    def __init__(self, waves: LayerSeries, duration: float, grid: Grid | None) -> None:
        limits = (waves.q[0], waves.q[-1]) if grid is None else wave_limits(grid.period, grid.spacing)
        super().__init__(waves.fastest_wave(*limits), duration)
        self.waves, self.grid = waves, cast(Grid, grid)
        if grid is not None:
            #: Symbol of each exponential [m/Pa], of the fluidity [m/(Pa s)], and of the instantaneous response. [m/Pa]
            alone = np.eye(len(waves.compliances))
            self.weights = [grid.xp.asarray(grid.symbol_of(waves.kernel(one))) for one in alone]

    def remaining(self, time: float) -> float:
        """Return one: a common rate of decay does not exist."""
        return 1.0

    def kept(self, unit: Array, pressure: Array) -> Array:
        """Return the transform of the pressure."""
        return self.grid.spectrum(pressure)[None]

    def response(self, field: Array, number: int, part: float = 1.0) -> Array:
        """Return the product of a transform and a symbol, times a part."""
        product = field.copy()
        self.grid.multiply(product, self.weights[number])
        return product if part == 1 else part * product

    def on_cells(self, total: Array) -> Array:
        """Return the displacement, shape (1, nx, ny). [m]"""
        return self.grid.field_of(total[0])[None]

    def problem(self, carried: Array, modes: Array, new: np.ndarray, step: float) -> Prediction:
        """Return the elastic problem of a step, with its kernel; its compliance is one, or zero if it is rigid."""
        *symbols, at_once = self.weights
        symbol = sum((part * one for part, one in zip(new, symbols, strict=True) if part), at_once)
        cells, kernel = self.grid, self.waves.kernel(np.append(new, 1.0))
        grid = Grid(cells.shape, cells.spacing, cells.boundary, kernel=kernel, symbol=symbol, xp=cells.xp)
        return Prediction(float(symbol.any()), cells.field_of(carried), modes, new, step, grid)

    def unit(self, history: History) -> None:
        """Return None: the kernel differs between steps."""
        return

    def roll(self, history: History, cells: int, axis: int) -> History:
        """Return the memory of a periodic body in the frame of a profile that has moved along an axis."""
        turn = self.grid.turn(cells, axis)
        earlier = None if history.earlier is None else history.earlier * turn
        return History(history.fields * turn, history.modes * turn, earlier, history.step)


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
    body: Body, duration: float, tolerance: float, shortest: float, grid: Any = None, keeps_pressure: bool = False
) -> Choice:
    """Return the memory of a body for a program.

    Parameters
    ----------
    body : Body
        A body.
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
        If the material is not known over the whole program.
    """
    share = SERIES_SHARE * tolerance
    if isinstance(body, LayeredBody) and not body.separates:
        return _of_layers(body, duration, share, shortest, grid)
    found, error = _series(body.material, shortest, duration, share)
    within = f" in place of the compliance, within {error:.1e} of it at time zero and from {shortest:.1g} s"
    active = "no positive series comes nearer: the material is not passive" if error > tolerance else ""
    notes = in_words(found) + within * bool(error), body.material.note, active
    memory = Memory(found, duration, keeps_pressure)
    return Choice(memory, error, "; ".join(filter(None, notes)), body.material.misfit * (duration > 0))


def _of_layers(body: LayeredBody, duration: float, share: float, shortest: float, grid: Any) -> Choice:
    """Return the memory of a layered body: exponentials that all waves share."""
    given = body.materials
    found, errors = zip(*(_series(one, shortest, duration, MATERIALS_SHARE * share) for one in given), strict=True)
    waves = layer_series(body.of(found), shortest, duration, share - max(errors))
    memory, error = LayerMemory(waves, duration, grid), waves.error + max(errors)
    note = "the instantaneous compliance of each wave"
    if waves.times:
        within = f"within {error:.1e} of them from {shortest:.1g} s on"
        note = f"{in_words(memory.series)} that all waves share, each with compliances of its own, {within}"
    notes = "; ".join(filter(None, (note, *(one.note for one in given))))
    return Choice(memory, error, notes, max(one.misfit for one in given))


def _series(material: Material, shortest: float, duration: float, tolerance: float) -> tuple[Prony, float]:
    """Return the series of a material and its error; a program of jumps needs the instantaneous compliance only."""
    if duration > 0 or (isinstance(material, Prony) and material.longest == math.inf):
        return series(material, shortest, duration, tolerance)
    glassy = float(material.creep_compliance(0.0))
    return Prony(glassy, 0.0 if glassy else 1.0, poisson=material.poisson), 0.0


def in_words(found: Prony) -> str:
    """Return the terms of a series in words."""
    count = len(found.times)
    terms = [f"{count} exponential{'s' * (count > 1)}"] * (count > 0) + ["a fluidity"] * (found.fluidity > 0)
    return " and ".join(terms) or "no memory: elastic"
