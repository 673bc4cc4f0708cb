"""Memory of a layered body, in which space and time do not separate.

Each wave creeps in its own way, and all waves share the times of the exponentials:

    C(q, t) = C_0(q) + fluidity(q) t + sum_m C_m(q) (1 - exp(-t/tau_m)).

The memory is the recursion of :class:`~roughvisc.mechanics.memory.Memory` for the transform of the pressure. Symbols
take the place of compliances: ``C_0`` and each ``C_m`` are kernels of their own. The number ``alpha`` that reduces a
step to an elastic problem becomes a symbol too, so that each length of step has a kernel of its own:

    displacement_q = alpha_q p_q + history_q.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, cast

import numpy as np

from roughvisc.mechanics.body import Kernel
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.layer import LayerSeries
from roughvisc.mechanics.memory import History, Memory, Prediction, Rule

Array = Any  # an array of NumPy or CuPy


class LayerMemory(Memory):
    """Exponential series of the waves of a layered body. Fields and modes of a history are transforms of pressures.

    The wave of the grid that creeps most stands for the body if a step is judged: how stiff it is, and how errors fade.

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

    @cached_property
    def instantaneous(self) -> Array:
        """Symbol of the instantaneous response. [m/Pa]"""
        return self._symbol_of(self.waves.kernel())

    @cached_property
    def symbols(self) -> list[Array]:
        """Symbol of each exponential [m/Pa], and last of the fluidity [m/(Pa s)]."""
        return [self._symbol_of(self.waves.kernel(one, 0.0)) for one in np.eye(self.times.size)]

    def _symbol_of(self, kernel: Kernel) -> Array:
        """Return the transform of a kernel on the device of the grid."""
        return self.grid.xp.asarray(self.grid.symbol_of(kernel))

    def remaining(self, time: float) -> float:
        """Return one: each wave fades in its own way."""
        return 1.0

    def start(self, nothing: Array) -> History:
        """Return the memory of an undisturbed body, under a pressure of zeros, shape (nx, ny)."""
        fields = self.grid.spectrum(nothing)[None]
        return History(fields, self.grid.xp.zeros((self.times.size, *fields.shape), fields.dtype))

    def predict(self, history: History, step: float, rule: Rule | None = None) -> Prediction:
        """Return the elastic problem of a step [s], with its kernel; its compliance is one, or zero if it is rigid."""
        own, earlier, before, new = self.recursion(step, history.step, rule or self.rule(history, step))
        xp = self.grid.xp
        modes = xp.empty_like(history.modes)
        carried, symbol = xp.zeros_like(history.fields[0]), self.instantaneous.copy()
        for i, mode in enumerate(modes):
            xp.multiply(history.modes[i], own[i], out=mode)
            if earlier[i] and history.earlier is not None:
                mode += earlier[i] * history.earlier[i]
            if before[i]:
                mode += before[i] * history.fields
            carried += self._response(mode[0], self.symbols[i])
            if new[i]:
                symbol += new[i] * self.symbols[i]
        answering = self.grid.answering(symbol, self.waves.kernel(new))
        return Prediction(float(symbol.any()), self.grid.field_of(carried), modes, new, step, answering)

    def advance(self, history: History, prediction: Prediction, unit: Array, pressure: Array) -> History:
        """Return the memory after a step, at whose end the pressure [Pa] is given; `unit` is not used."""
        return self.after_step(history, prediction, self.grid.spectrum(pressure)[None])

    def displacement(self, history: History) -> Array:
        """Return the displacement, shape (1, nx, ny). [m]"""
        total = self._response(history.fields[0], self.instantaneous)
        for mode, symbol in zip(history.modes, self.symbols, strict=True):
            total += self._response(mode[0], symbol)
        return self.grid.field_of(total)[None]

    def at_once(self, history: History) -> Array:
        """Return the instantaneous part of the displacement. [m]"""
        return self.grid.field_of(self._response(history.fields[0], self.instantaneous))

    def unit(self, history: History) -> None:
        """Return nothing: the steps have no common kernel."""
        return

    def after_rest(self, history: History, time: float) -> Array:
        """Return the displacement after a time without pressure, of a body that carries none now. [m]"""
        own = self.recursion(time, 0.0, "linear")[0]
        total = self.grid.xp.zeros_like(history.fields[0])
        for part, mode, symbol in zip(own, history.modes, self.symbols, strict=True):
            total += part * self._response(mode[0], symbol)
        return self.grid.field_of(total)

    def roll(self, history: History, cells: int, axis: int) -> History:
        """Return the memory of a periodic body, seen from a profile that has moved along an axis."""
        turn = self.grid.turn(cells, axis)
        earlier = None if history.earlier is None else history.earlier * turn
        return History(history.fields * turn, history.modes * turn, earlier, history.step)

    def _response(self, spectrum: Array, symbol: Array) -> Array:
        """Return the product of a transform and a symbol."""
        product = spectrum.copy()
        self.grid.multiply(product, symbol)
        return product
