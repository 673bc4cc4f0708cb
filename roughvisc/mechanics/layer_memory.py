"""Memory of a layered body, in which space and time do not separate.

The creep depends on the wave, with the same times of the exponentials for all waves:

    C(q, t) = C_0(q) + fluidity(q) t + sum_m C_m(q) (1 - exp(-t/tau_m)).

The memory is the recursion of :class:`~roughvisc.mechanics.memory.Memory` for the transform of the pressure. Symbols
replace the compliances: ``C_0`` and each ``C_m`` are separate kernels. The compliance ``alpha`` of the elastic problem
of a step becomes a symbol too, so that the kernel of a step depends on its length:

    displacement_q = alpha_q p_q + history_q.
"""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.layer import LayerSeries
from roughvisc.mechanics.memory import History, Memory, Prediction

Array = Any  # an array of NumPy or CuPy


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
        limits = (waves.q[0], waves.q[-1]) if grid is None else grid.wave_numbers
        super().__init__(waves.fastest_wave(*limits), duration)
        self.waves, self.grid = waves, cast(Grid, grid)
        if grid is not None:
            #: Symbol of each exponential [m/Pa], of the fluidity [m/(Pa s)], and of the instantaneous response. [m/Pa]
            kernels = [*(waves.kernel(one, 0.0) for one in np.eye(self.times.size)), waves.kernel()]
            self.weights = [grid.xp.asarray(grid.symbol_of(kernel)) for kernel in kernels]

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
        symbol = at_once.copy()
        for part, one in zip(new, symbols, strict=True):
            if part:
                symbol += part * one
        answering = self.grid.answering(symbol, self.waves.kernel(new))
        return Prediction(float(symbol.any()), self.grid.field_of(carried), modes, new, step, answering)

    def unit(self, history: History) -> None:
        """Return None: the kernel differs between steps."""
        return

    def roll(self, history: History, cells: int, axis: int) -> History:
        """Return the memory of a periodic body in the frame of a profile that has moved along an axis."""
        turn = self.grid.turn(cells, axis)
        earlier = None if history.earlier is None else history.earlier * turn
        return History(history.fields * turn, history.modes * turn, earlier, history.step)
