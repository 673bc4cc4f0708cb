"""The direct history: every pressure since the start, for any creep compliance, with no series fitted.

Only the antiderivative of the compliance is needed. Each instant keeps the pressure of the cells in contact then and
nothing of the rest of the grid; a step costs one weighted sum over the past and one convolution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.hereditary.memory import ActsOn, Rule, mean_compliance
from roughvisc.mechanics.materials.models import Material

Array = NDArray[np.float64]

# Instants gathered into one block: a weighted sum over a block is one pass, not one scattered addition each.
_BLOCK = 32


@dataclass(frozen=True)
class Block:
    """Pressures at some instants: ``pressures[n]`` on the cells ``cells`` (flat indices), zero elsewhere."""

    cells: NDArray[np.intp]
    pressures: Array


@dataclass(frozen=True)
class HistoryState:
    """State of the direct history.

    Attributes
    ----------
    shape : tuple of int
        Of the grid.
    times : ndarray
        Instants, ascending; the first is the state at rest. Two alike are a jump. [s]
    blocks : tuple of Block
        Pressures at these instants, in order.
    """

    shape: tuple[int, int]
    times: Array
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class History:
    """Direct memory of any material, exact for pressure that is linear between the instants.

    Parameters
    ----------
    material : Material
        Its antiderivative gives the weights.
    """

    material: Material
    acts_on: ActsOn = "pressure"
    rules: tuple[Rule, ...] = ("linear", "right")

    def start(self, shape: tuple[int, int]) -> HistoryState:
        """State at rest."""
        nothing = Block(np.zeros(0, np.intp), np.zeros((1, 0)))
        return HistoryState(shape, np.zeros(1), (nothing,))

    def predict(self, state: HistoryState, step: float, rule: Rule) -> tuple[float, Array]:
        """``alpha`` [1/Pa] and the carried effective pressure of a step ahead. [s]

        Notes
        -----
        ``q = sum_n m_n (p_n - p_(n-1))`` with the mean compliance ``m_n`` over the lags of interval ``n``: the
        increments of pressure, each with the compliance that it has met on average.
        """
        if rule not in self.rules:
            raise ValueError(f"the direct history knows no rule {rule!r}")
        alpha = mean_compliance(self.material, step) if rule == "linear" else self._compliance(step)
        ages = (state.times[-1] - state.times) + step
        means = np.asarray(self.material.mean_contact_compliance(ages[1:], ages[:-1] - ages[1:]))
        # of p_n rather than of its increments; the first instant is at rest and has no weight
        weights = np.append(0.0, means - np.append(means[1:], alpha)) if means.size else np.zeros(1)
        carried = np.zeros(state.shape)
        flat = carried.reshape(-1)
        first = 0
        for block in state.blocks:
            last = first + len(block.pressures)
            # einsum, not a matrix product: the same bits whatever the number of threads
            flat[block.cells] += np.einsum("n,nc->c", weights[first:last], block.pressures)
            first = last
        return alpha, carried

    def advance(self, state: HistoryState, step: float, rule: Rule, field: Array) -> HistoryState:
        """State after a step at whose end the pressure was ``field``."""
        values = field.reshape(-1)
        cells = np.flatnonzero(values)
        fresh = Block(cells, values[cells][None, :])
        blocks = (*state.blocks, fresh)
        tail = [block for block in blocks if len(block.pressures) == 1]
        if len(tail) == _BLOCK:
            blocks = (*blocks[:-_BLOCK], _gathered(tail))
        return HistoryState(state.shape, np.append(state.times, state.times[-1] + step), blocks)

    def restart(self, state: HistoryState) -> HistoryState:
        """The same state: no step reaches behind the present instant by a rule of its own."""
        return state

    def roll(self, state: HistoryState, cells: int, axis: int) -> HistoryState:
        """State of a periodic body seen from a profile that has moved by so many cells along an axis."""

        def rolled(block: Block) -> Block:
            place = list(np.unravel_index(block.cells, state.shape))
            place[axis] = (place[axis] - cells) % state.shape[axis]
            return Block(np.ravel_multi_index((place[0], place[1]), state.shape), block.pressures)

        return HistoryState(state.shape, state.times, tuple(rolled(block) for block in state.blocks))

    def enlarged(
        self,
        state: HistoryState,
        shape: tuple[int, int],
        offset: tuple[int, int],
        displaced: Callable[[Array], Array],
    ) -> HistoryState:
        """State on a larger grid, in which the present one begins at ``offset``."""

        def moved(block: Block) -> Block:
            x, y = np.unravel_index(block.cells, state.shape)
            return Block(np.ravel_multi_index((x + offset[0], y + offset[1]), shape), block.pressures)

        return HistoryState(shape, state.times, tuple(moved(block) for block in state.blocks))

    def _compliance(self, age: float) -> float:
        return float(self.material.contact_compliance(age))


def _gathered(blocks: list[Block]) -> Block:
    """One block for several, on all their cells."""
    cells = np.unique(np.concatenate([block.cells for block in blocks]))
    pressures = np.zeros((len(blocks), cells.size))
    for row, block in zip(pressures, blocks, strict=True):
        row[np.searchsorted(cells, block.cells)] = block.pressures[0]
    return Block(cells, pressures)


def history_bytes(cells_in_contact: float, steps: float) -> float:
    """Memory that a direct history of so many steps and cells takes, about. [bytes]"""
    return 8.0 * cells_in_contact * steps
