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

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.layer import LayeredBody, LayerSeries
from roughvisc.mechanics.memory import History, Memory, Prediction
from roughvisc.mechanics.stepping import Scene

Array = Any  # an array of NumPy or CuPy
#: Compliance of the longest wave of a grid over the compliance of the shortest wave, from which the contact may not
#: converge.
_STIFF_LAYERS = 100.0
#: Parts of the largest load and approach at which the contact is tried.
_TRIED = (1.0, 0.1, 0.01)


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


def check_convergence(body: LayeredBody, scene: Scene) -> None:
    """Check, before a run, that the contact of stiff layers on a soft base converges.

    The elastic contact is tried at the largest load and approach, with the first and with the last compliance.

    Parameters
    ----------
    body : LayeredBody
        The body.
    scene : Scene
        Cells, memory of the body, and program; its nominal pressures are converted to loads.

    Raises
    ------
    InputError
        If a contact does not converge.
    """
    program, memory = scene.program, scene.memory
    parts = _TRIED if program.duration > 0 else _TRIED[:1]  # a jump passes through no smaller loads
    kernels: list[tuple[Any, float]] = [(body.kernel, float(memory.series.contact_compliance(program.duration)))]
    if isinstance(memory, LayerMemory):
        kernels = [(memory.waves.kernel(), 1.0), (memory.waves.kernel(memory.waves.crept(program.duration)), 1.0)]
    for kernel, compliance in kernels:
        contrast = kernel.contrast(*scene.grid.wave_numbers)
        if contrast < _STIFF_LAYERS:
            continue
        grid = scene.grid.answering(scene.grid.symbol_of(kernel), kernel)
        unit, tolerance, present = compliance / grid.cell_area, 0.2 * scene.tolerance, scene.present
        for control in ("load", "approach"):
            values = [(s.end or 0.0) + abs(s.amplitude) for s in program.segments if s.control == control]
            for value in [part * max(values, default=0.0) for part in parts if max(values, default=0.0) > 0]:
                load, approach = (value * unit, None) if control == "load" else (None, value)
                try:
                    solve_contact(grid, scene.gap, load=load, approach=approach, tolerance=tolerance, present=present)
                except ConvergenceError as error:
                    raise InputError(
                        f"material is {body!r}, whose longest waves on these cells are {contrast:.3g} times as "
                        f"compliant as the shortest, and {error}: expected layers whose moduli differ less, fewer "
                        "cells, a smaller load or a looser tolerance",
                        key="material",
                        found=body,
                    ) from error
