"""Memory of a body in which space and time do not separate: a recursion for each wave.

Where every wave creeps in its own way, ``u_q = alpha_q p_q + carried_q``: the number that reduces a step to an elastic
problem becomes a symbol, and the elastic problem is that of another operator in each step. The exponentials are kept as
transforms of the displacement that they cause.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.arrays import empty, weighted
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.hereditary.choice import (
    SERIES_SHARE,
    SHORTEST_AGE,
    Choice,
    at_once,
    choose_memory,
    may_ring,
)
from roughvisc.mechanics.hereditary.exponentials import Modes, ModesState
from roughvisc.mechanics.hereditary.memory import ActsOn, Rule
from roughvisc.mechanics.layer import LayeredBody, Layers, LayerSeries, layer_series
from roughvisc.mechanics.materials.creep import Creep, complete
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.series import series

Array = NDArray[np.float64]
Spectrum = NDArray[Any]

# Part of what a series may take that goes to series in place of the materials.
_MATERIALS = 0.3
# Wave numbers of all grids. [1/m]
_EVERY = (1e-300, 1e300)


@dataclass(frozen=True, eq=False)
class WaveMemory:
    """Recursive memory of a series for each wave. The states' fields are transforms.

    Attributes
    ----------
    series : LayerSeries
        Of the body.
    duration : float
        Of the program. [s]
    operator : Grid or None
        The grid; None where only the number of exponentials is of interest.
    """

    series: LayerSeries
    duration: float
    operator: Grid | None = None
    acts_on: ActsOn = "waves"

    @cached_property
    def material(self) -> Prony:
        """The wave of the grid that creeps most, by which steps are judged."""
        limits = _EVERY if self.operator is None else self.operator.wave_numbers
        return self.series.fastest_wave(*limits)

    @property
    def rules(self) -> tuple[Rule, ...]:
        """The rules that it knows."""
        return self._modes.rules

    @cached_property
    def _modes(self) -> Modes:
        """Of one wave."""
        rules = Modes.rules if may_ring(self.material, self.duration) else Modes.rules[:1] + Modes.rules[2:]
        return Modes(self.material, rules=rules)

    @cached_property
    def grid(self) -> Grid:
        """What answers a pressure that has come a long time ago, at unit compliance of the material."""
        assert self.operator is not None
        unit = 1 / float(self.material.contact_compliance(self.duration))
        kernel = self.series.kernel(unit * self.series.crept(self.duration), unit)
        return self.operator.answering(self.operator.symbol_of(kernel), kernel)

    @cached_property
    def _symbols(self) -> tuple[Array, list[Array]]:
        """Of what is there at once, and of each term. [m/Pa]"""
        assert self.operator is not None
        count = len(self.series.compliances)
        at_once = self.operator.symbol_of(self.series.kernel(np.zeros(count)))
        return at_once, [self.operator.symbol_of(self.series.kernel(one, 0.0)) for one in np.eye(count)]

    def start(self, shape: tuple[int, int]) -> ModesState:
        """State at rest."""
        assert self.operator is not None
        pressure = self.operator.spectrum(np.zeros(shape))
        return ModesState(np.zeros((len(self.series.compliances), *pressure.shape), pressure.dtype), pressure)

    def predict(self, state: ModesState, step: float, rule: Rule) -> tuple[float, Array]:
        """One, as the step has an operator of its own, and the displacement that is carried into it. [m]

        Zero where nothing gives way at once to a jump.
        """
        assert self.operator is not None
        own, earlier, before, after = self._modes.coefficients(state, step, rule)
        carried = state.field.copy()
        self.operator.multiply(carried, self._sum(before))
        terms = [(1.0, carried), *zip(own, state.modes, strict=True)]
        if rule == "bdf2" and state.earlier is not None:
            terms += zip(earlier, state.earlier, strict=True)
        answers = bool(after.any() or self._symbols[0].any())
        return float(answers), self.operator.field_of(self._weighted(terms, carried))

    def operator_of(self, state: ModesState, step: float, rule: Rule) -> Grid:
        """What answers the pressure of a step: ``alpha_q``. [m/Pa]"""
        assert self.operator is not None
        after = self._modes.coefficients(state, step, rule)[3]
        return self.operator.answering(self._symbols[0] + self._sum(after), self.series.kernel(after))

    def advance(self, state: ModesState, step: float, rule: Rule, field: Array) -> ModesState:
        """State after a step at whose end the pressure was ``field``. [Pa]"""
        assert self.operator is not None
        pressure = self.operator.spectrum(field)
        if step == 0:
            return ModesState(state.modes, pressure, None, 0.0)
        own, earlier, before, after = self._modes.coefficients(state, step, rule)
        modes, came = empty(state.modes.shape, state.modes.dtype), np.empty_like(pressure)
        for i, mode in enumerate(modes):
            self._weighted([(before[i], state.field), (after[i], pressure)], came)
            self.operator.multiply(came, self._symbols[1][i])
            terms = [(1.0, came), (own[i], state.modes[i])]
            if rule == "bdf2" and state.earlier is not None:
                terms.append((earlier[i], state.earlier[i]))
            self._weighted(terms, mode)
        return ModesState(modes, pressure, state.modes if "bdf2" in self.rules else None, step)

    def coefficients(self, state: ModesState, step: float, rule: Rule) -> tuple[Array, Array, Array, Array]:
        """Of the recursion, as :meth:`~roughvisc.mechanics.hereditary.exponentials.Modes.coefficients`."""
        return self._modes.coefficients(state, step, rule)

    @cached_property
    def weights(self) -> Array:
        """One for each exponential: their compliances are in the inner products."""
        return np.ones(len(self.series.compliances))

    @property
    def no_products(self) -> Array:
        """Inner products of a pressure at rest with itself: by what is there at once, and by each term."""
        return np.zeros(1 + len(self.series.compliances))

    def at_once(self, products: Array) -> float:
        """Energy that what is there at once stores, from ``<p, p>``. [J]"""
        return 0.5 * float(products[0])

    def of_elements(self, products: Array) -> Array:
        """The part of inner products of pressures that goes with each exponential."""
        return products[1 : 1 + len(self.series.times)]

    def of_flow(self, products: Array) -> float:
        """Energy that a fluidity dissipates, from ``<p, p>`` times the time. [J]"""
        return float(products[-1]) if self.series.flows else 0.0

    def products(self, state: ModesState, pressure: Spectrum, rule: Rule) -> tuple[Array, Array, Array, Array]:
        """Inner products of the pressure at the end of a step, as energies ask for them, by Parseval's theorem."""
        assert self.operator is not None
        parseval = self.operator.parseval
        both, last = (
            np.array([self.operator.even_sum(product, symbol) for symbol in (self._symbols[0], *self._symbols[1])])
            for product in ((parseval * (one.conj() * pressure).real) for one in (state.field, pressure))
        )
        weighted_pressure = parseval * pressure
        count = len(self.series.times)

        def of_modes(modes: Spectrum) -> Array:
            flat = weighted_pressure.view(np.float64).reshape(-1)
            return np.array([float(np.einsum("i,i", flat, one.view(np.float64).reshape(-1))) for one in modes[:count]])

        ahead = of_modes(state.modes)
        behind = np.zeros_like(ahead)
        if rule == "bdf2" and state.earlier is not None:
            behind = of_modes(state.earlier)
        return both, last, ahead, behind

    def restart(self, state: ModesState) -> ModesState:
        """State whose next step does not reach behind the present instant."""
        return ModesState(state.modes, state.field)

    def roll(self, state: ModesState, cells: int, axis: int) -> ModesState:
        """State of a periodic body seen from a profile that has moved by so many cells along an axis."""
        assert self.operator is not None
        turn = self.operator.turn(cells, axis)
        earlier = None if state.earlier is None else state.earlier * turn
        return ModesState(state.modes * turn, state.field * turn, earlier, state.step)

    def enlarged(self, *_: Any) -> ModesState:
        """Never: a wave is of one grid."""
        raise ValueError("a memory of waves cannot be enlarged")

    def _sum(self, weights: Array) -> Array:
        """Symbol of the terms times some weights. [m/Pa]"""
        found = np.zeros_like(self._symbols[0])
        for weight, symbol in zip(weights, self._symbols[1], strict=True):
            if weight:
                found += weight * symbol
        return found

    def _weighted(self, terms: list[tuple[float, Spectrum]], out: Spectrum) -> Spectrum:
        """Sum of transforms times their factors, the first of which `out` may be."""
        assert self.operator is not None
        weighted([(factor, one.view(np.float64)) for factor, one in terms], out.view(np.float64), self.operator.threads)
        return out


def choose_body_memory(
    body: Body,
    duration: float,
    tolerance: float,
    acts_on: ActsOn = "displacement",
    shortest: float | None = None,
    operator: Grid | None = None,
) -> Choice:
    """Memory for a body over a program: that of its material where space and time separate, else one of waves.

    Parameters
    ----------
    body : Body
    duration, tolerance, acts_on, shortest
        As :func:`~roughvisc.mechanics.hereditary.choice.choose_memory` has them.
    operator : Grid, optional
        The grid; without one the memory tells its number of exponentials alone.

    Raises
    ------
    InputError
        As there; and if no memory is known for the body.
    """
    if body.separates:
        return choose_memory(body.material, duration, tolerance, acts_on, shortest)
    if not isinstance(body, LayeredBody):
        raise InputError(
            f"material is a {type(body).__name__} in which space and time do not separate, and no memory is known for "
            "it: expected the body that layer() makes, or a Body whose kernel is constant in time"
        )
    share = SERIES_SHARE * tolerance
    shortest = SHORTEST_AGE * duration if shortest is None else shortest
    given = [complete(one) for one in body.materials]
    found = [
        series(one, shortest, duration, _MATERIALS * share) if duration > 0 else (at_once(one), 0.0) for one in given
    ]
    materials, of_materials = tuple(one for one, _ in found), max(error for _, error in found)
    waves = layer_series(Layers(body.thicknesses, materials), shortest, duration, share - of_materials)
    memory = WaveMemory(waves, duration, operator)
    error = waves.error + of_materials
    count = len(waves.times)
    note = (
        "the instantaneous compliance of each wave"
        if not len(waves.compliances)
        else (
            f"{count} exponential{'' if count == 1 else 's'}{' and a fluidity' if waves.flows else ''} that all waves "
            f"share, each with compliances of its own, within {error:.1e} of them from {shortest:.1g} s on"
        )
    )
    misfit = max(one.misfit if isinstance(one, Creep) else 0.0 for one in given)
    return Choice(memory, error, "; ".join(filter(None, [note, *(one.note for one in given)])), misfit)
