r"""Energy balance: energy stored in the springs of the material and dissipated in its dashpots.

A creep compliance in exponentials is a chain of a spring, a dashpot and Kelvin elements. With the internal variable
``z_i`` of each element, a pressure with ``tau_i z_i' = p - z_i``, and ``<a, b>`` the sum of ``a K b`` over the surface,

    ``stored = C_0 <p, p> / 2 + sum C_i <z_i, z_i> / 2``,
    ``dissipated = int sum C_i tau_i <z_i', z_i'> + phi <p, p> dt``.

Both need inner products only, which follow recursions of their own: for each element one new product of two fields a
step, and no convolution. For pressure that is linear in each step they are exact, whatever the length of the step.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.arrays import inner, summed
from roughvisc.mechanics.hereditary.exponentials import Modes, ModesState
from roughvisc.mechanics.hereditary.memory import Rule
from roughvisc.mechanics.materials.prony import by_size, one_less_mean_decay
from roughvisc.mechanics.sparse import Sparse
from roughvisc.mechanics.stepping.wave_memory import WaveMemory

Array = NDArray[np.float64]


def _nothing() -> Array:
    return np.zeros(0)


# Where elements relax within a step, the two ways of counting what they dissipate differ: by so much of that it is
# uncertain (measured on jumps of the load, sphere and wave).
_PATH = 0.25


@dataclass(frozen=True)
class Energy:
    """Energies of a march so far, and the inner products from which they go on.

    Attributes
    ----------
    stored, dissipated : float
        In all of the half-space, the uniform displacement of a periodic one left out. [J]
    unresolved : float
        What may be dissipated more or less where elements relaxed within a single step. [J]
    pressure : float or ndarray
        ``<p, p>`` at the present instant, with each kernel where the elements' differ. [Pa2 m3]
    beside : ndarray, shape (m,)
        ``<p, z_i>``. [Pa2 m3]
    lagged : ndarray, shape (m,)
        ``<p, z_i>`` with ``z_i`` of one step ago. [Pa2 m3]
    own, crossed, earlier : ndarray, shape (m,)
        ``<z_i, z_i>``, the product with ``z_i`` one step ago, and the product of that with itself. [Pa2 m3]
    """

    stored: float = 0.0
    dissipated: float = 0.0
    unresolved: float = 0.0
    pressure: Any = 0.0
    beside: Array = field(default_factory=_nothing)
    lagged: Array = field(default_factory=_nothing)
    own: Array = field(default_factory=_nothing)
    crossed: Array = field(default_factory=_nothing)
    earlier: Array = field(default_factory=_nothing)


def at_rest(memory: Modes | WaveMemory) -> Energy:
    """Nothing stored, nothing dissipated."""
    nothing = np.zeros(len(memory.material.times))
    return Energy(0.0, 0.0, 0.0, memory.no_products, nothing, nothing, nothing, nothing, nothing)


#: ``<p_n, p_n+1>`` and ``<p_n+1, p_n+1>``, numbers, or one for each kernel where the elements' differ; then
#: ``<p_n+1, z_n>`` and ``<p_n+1, z_n-1>`` of each element.
Products = tuple[Any, Any, Array, Array]


def inner_products(
    memory: Modes, state: ModesState, rule: Rule, start: Array, end: tuple[Sparse, Array], area: float
) -> Products:
    """Inner products of the pressure at the end of a step, from displacements that are known.

    Parameters
    ----------
    memory, state : Modes, ModesState
        The memory, and its state at the start.
    rule : Rule
        How pressure is taken to run within the step.
    start : ndarray, shape (nx, ny)
        Displacement at unit compliance at its start. [Pa m]
    end : Sparse, and ndarray, shape (nx, ny)
        Pressure at its end [Pa], and its displacement at unit compliance [Pa m].
    area : float
        Of a cell. [m2]
    """
    cells, pressure = end[0].not_zero()
    both, last = (area * inner(field, cells, pressure, end[0].threads) for field in (start, end[1]))
    ahead = area * memory.products(state.modes, end[1], cells, pressure)
    behind = np.zeros_like(ahead)
    if rule == "bdf2" and state.earlier is not None:
        behind = area * memory.products(state.earlier, end[1], cells, pressure)
    return both, last, ahead, behind


def after_step(
    energy: Energy,
    memory: Modes | WaveMemory,
    state: ModesState,
    step: float,
    rule: Rule,
    products: Products,
    fresh: bool = False,
    jumped: bool = False,
    work: float | None = None,
) -> Energy:
    """Energies after a step.

    Parameters
    ----------
    energy : Energy
        At its start.
    memory, state : Modes or WaveMemory, ModesState
        The memory, and its state at the start.
    step : float
        Length; zero is a jump, which is quasi-static: its work is stored. [s]
    rule : Rule
        How pressure is taken to run within the step.
    products : tuple
        Of the pressure at its end. [Pa2 m3]
    fresh : bool
        Whether the step is the first one after an event: elements that relax within it do so beside the pressure.
    jumped : bool
        Whether the pressure changed at once at the start of the step.
    work : float, optional
        Of the step, where it is known: what of it is not stored is dissipated. [J]

    Notes
    -----
    Exact for ``linear`` and ``right``. By ``bdf2`` and ``euler``, and where a fresh step is longer than an element's
    time, what that dissipates is the work of the mean pressure on its change, less what it stores: exact where the
    load or the approach is held.
    """
    whole_both, whole_last, ahead, behind = products
    if step == 0:
        stored = energy.stored + memory.at_once(whole_last - energy.pressure)
        return replace(energy, stored=stored, pressure=whole_last, beside=ahead)
    weights, (own, earlier, before, after) = memory.weights, memory.coefficients(state, step, rule)
    if memory.material.fluidity:  # it comes last
        weights, own, earlier, before, after = (each[:-1] for each in (weights, own, earlier, before, after))
    first, both, last = (memory.of_elements(one) for one in (energy.pressure, whole_both, whole_last))
    # z_n+1 = own z_n + earlier z_n-1 + before p_n + after p_n+1
    beside = own * ahead + earlier * behind + before * both + after * last
    crossed = own * energy.own + earlier * energy.crossed + before * energy.beside + after * ahead
    squared = own * crossed + after * beside + before * (own * energy.beside + before * first + after * both)
    if rule == "bdf2":  # it takes nothing from p_n
        squared = squared + earlier * (own * energy.crossed + earlier * energy.earlier + after * behind)
    flowed = step * (energy.pressure + whole_both + whole_last) / 3
    unresolved = energy.unresolved
    if fresh or rule != "linear":
        # work of the mean pressure on the change of an element, less what it stores: <(p_n + p_n+1) / 2, z_n+1 - z_n>
        held = own * energy.beside + earlier * energy.lagged + before * first + after * both  # <p_n, z_n+1>
        worked = 0.5 * (beside - ahead + held - energy.beside)
        lost = weights * (worked - 0.5 * (squared - energy.own))
    if fresh or rule == "linear":
        lag = first - 2 * energy.beside + energy.own  # <w, w> with w = p_n - z_n; d = p_n+1 - p_n
        drift = both - first - ahead + energy.beside  # <w, d>
        change = last - 2 * both + first  # <d, d>
        of_lag, of_drift, of_change = _lost(memory.material.times, step)
        exact = weights * (of_lag * lag + of_drift * drift + of_change * change)
        if fresh:
            quick = np.array(memory.material.times) < step
            unresolved += _PATH * float(np.sum(np.abs(lost - exact), where=quick))
            lost = np.where(quick, lost, exact) if rule == "linear" else lost
        else:
            lost = exact
    if rule == "right":
        lost = weights * _lost(memory.material.times, step)[0] * (last - 2 * ahead + energy.own)
        flowed = step * whole_last
    elif jumped and rule != "linear":
        lost = weights * (beside - ahead - 0.5 * (squared - energy.own))
        flowed = step * whole_last
    stored = memory.at_once(whole_last) + 0.5 * summed(weights * squared)
    dissipated = summed(lost) + memory.of_flow(flowed)
    if work is not None:
        dissipated, unresolved = work - (stored - energy.stored), energy.unresolved
    dissipated += energy.dissipated
    return Energy(stored, dissipated, unresolved, whole_last, beside, ahead, squared, crossed, energy.own)


@lru_cache(maxsize=8)
def _lost(times: tuple[float, ...], step: float) -> tuple[Array, Array, Array]:
    """What elements lose in a step, over their compliance: factors of ``<w, w>``, ``<w, d>`` and ``<d, d>``."""
    x = step / np.array(times)
    mean, twice = one_less_mean_decay(x), one_less_mean_decay(2 * x)
    return x * (1 - twice), 2 * (twice - mean), _both_rises(x, mean, twice)


# (-1)^(k+1) (2 - 2^k) / (k+1)! for k >= 2: up to 0.3 the next term is below rounding
_ORDERS = np.arange(2.0, 18)
_SERIES = (-1.0) ** (_ORDERS + 1) * (2 - 2**_ORDERS) / np.cumprod(np.append(6.0, _ORDERS[1:] + 1))


def _both_rises(x: Array, mean: Array, twice: Array) -> Array:
    """``int_0^1 (1 - exp(-x s))^2 ds / x`` to full relative precision; ``x / 3`` for small ``x``.

    Parameters
    ----------
    x, mean, twice : ndarray, shape (m,)
        Steps over retardation times, and one less the mean decay over one of these and over two.
    """
    return by_size(
        x,
        0.3,
        lambda x: np.add.reduce(_SERIES * x[..., None] ** (_ORDERS - 1), axis=-1),
        lambda x: (2 * mean - twice) / x,
    )
