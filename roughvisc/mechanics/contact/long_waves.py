r"""Long waves of the pressure on a grid of blocks: the second level of the preconditioner.

The inverse of the kernel, restricted to the cells in contact, is a good preconditioner within a spot of contact and
where all is in contact. On a wide and sparse contact it is far too large for waves that are longer than the distance of
the spots: a body under spots of contact gives way as a softer one does, by what each spot sinks in. Averages over
blocks of cells see that: under pressures ``s`` that are uniform over the ``N`` cells in contact of each block, the
blocks' loads displace them by ``K_b N s + c s``, with the influence ``K_b`` of blocks on each other and the local
compliance ``c`` of the spots. So the residual's mean over each block is answered by that operator's inverse, and the
preconditioner answers the rest:

    z = E (N K_b N + N c)^-1 E^T r + (1 - A)^T M (1 - A) r

where ``E`` spreads one value over a block's cells, and ``A = E N^-1 E^T`` takes the mean. Both parts are symmetric and
positive. Deflation with blocks is known as Nicolaides' coarse space [1]_.

References
----------
.. [1] R. A. Nicolaides, SIAM J. Numer. Anal. 24 (1987) 355.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.arrays import over_blocks, submit
from roughvisc.mechanics.contact.influence import Array, Cells, Influence

# Cells a side from which blocks may pay, and the part of the grid that is free up to which they do. Below the one and
# above the other the sums over blocks take the time that is saved (measured at 512 squared: 3 to 14 % more time for 10
# to 15 % fewer iterations; at 768, 0 to 18 % less; at 1024, 6 to 30 % less).
_FROM, _SPARSE = 768, 0.6
# Blocks a side, times the part of the free cells whose block is not all free, from which they pay: about as many spots
# lie side by side. Within a spot that is wider than a block they do harm. Measured at 512 to 2048 squared, with
# shortest waves of 4 to 128 cells and 2 to 50 % in contact: 29 iterations rather than 39 at 64, 24 for 25 at 45, 20
# for 16 at 35, and 135 for 19 on one round contact.
_SPOTS = 45.0
# Of the local compliance found: measured, the fewest iterations lie between half of it and all of it.
_SHARE = 0.7
# Decrease of the residual of the blocks' equations, in the norm of their preconditioner: with 0.01 instead, the same
# iterations of the contact at twice as many of these.
_TOLERANCE, _MOST = 0.1, 100
# The precision in which they are solved: for that tolerance the lower one is enough.
_KIND: type[np.floating[Any]] = np.float32
#: What both levels ask for is nearer to the error than what one does: times this, it is as cautious an estimate. By 176
#: solutions at 400 squared, one estimate is then below 0.8 of the error, and the median is 2.3 times it, as before.
CAUTION = 1.9


@dataclass(frozen=True)
class LongWaves:
    """The blocks of one free set.

    Attributes
    ----------
    influence : Influence
        Of the cells.
    blocks : ndarray of int
        Block of each free cell.
    cells : ndarray
        Free cells of each block.
    local : float
        Local compliance.
    """

    influence: Influence
    blocks: NDArray[np.intp]
    cells: Array
    local: float

    @classmethod
    def of(cls, influence: Influence, free_set: Cells, pressure: Array, energy: float) -> LongWaves | None:
        """The blocks of a free set, by a pressure on it and ``p.Kp``; None where they do not pay."""
        shape = influence.operator.shape
        if min(shape) < _FROM or free_set.size > _SPARSE * influence.size:
            return None
        coarse = influence.operator.coarse.shape
        blocks = _blocks(shape, coarse, free_set, influence.threads)
        cells = _sums(influence, blocks, None)
        all_free = cells > 0.98 * influence.size / cells.size
        partly = 1 - float(cells.sum(where=all_free)) / max(free_set.size, 1)
        if partly * min(coarse) < _SPOTS:
            return None
        loads = _sums(influence, blocks, pressure)
        spread = float((loads * loads / np.maximum(cells, 1)).sum())
        smooth = float((loads * influence.of_blocks(loads.astype(_KIND))).sum())
        if not energy > smooth:  # a kernel that bulges
            return None
        return cls(influence, blocks, cells, _SHARE * (energy - smooth) / spread)

    def preconditioned(self, residual: Array, fine: Callable[[Array], Array]) -> Array:
        """About the change of pressure that a residual on the free set asks for, but for the scale.

        Parameters
        ----------
        residual : ndarray, shape (n,)
            On the free set.
        fine : callable
            The preconditioner of the cells.
        """
        means, threads = self._means(residual), self.influence.threads
        rest = np.empty_like(residual)

        def without_means(part: slice) -> None:
            np.subtract(residual[part], means.take(self.blocks[part]), out=rest[part])

        over_blocks(without_means, residual.size, threads)
        waves = submit(partial(self._answered, self.cells * means), threads)
        try:
            found = fine(rest)
        finally:
            answer = waves()  # in any case: the blocks have one working memory
        answer -= self._means(found)

        def with_answer(part: slice) -> None:
            found[part] += answer.take(self.blocks[part])

        over_blocks(with_answer, residual.size, threads)
        return found

    def _means(self, values: Array) -> Array:
        """Mean over the free cells of each block; zero where there are none."""
        return _sums(self.influence, self.blocks, values) / np.maximum(self.cells, 1)

    def _answered(self, sums: Array) -> Array:
        """Pressure, but for the scale, that displaces blocks by the residual of these sums: conjugate gradients."""
        influence, cells, local = self.influence, self.cells.astype(_KIND), float(self.local)
        diagonal = np.where(cells > 0, cells * local + cells * cells * influence.of_one_block, 1).astype(_KIND)
        size = float(np.abs(sums).max()) or 1.0  # single precision underflows
        left = (sums / size).astype(_KIND)
        answer, eased = np.zeros_like(left), left / diagonal
        search = eased.copy()
        start = squared = _product(left, eased)
        for _ in range(_MOST):
            if not squared > _TOLERANCE**2 * start:
                break
            response = influence.of_blocks(cells * search)
            response += local * search
            response *= cells
            length = squared / _product(search, response)
            answer += length * search
            response *= length
            left -= response
            np.divide(left, diagonal, out=eased)
            before, squared = squared, _product(left, eased)
            search *= squared / before
            search += eased
        found = answer.astype(float)
        found *= size * influence.scale
        return found


def _product(a: NDArray[Any], b: NDArray[Any]) -> float:
    """Inner product; a matrix product's last bits would depend on the threads."""
    return float(np.einsum("i,i", a, b))


def _blocks(shape: tuple[int, int], coarse: tuple[int, int], cells: Cells, threads: int) -> NDArray[np.intp]:
    """Block of each cell, as flat indices."""
    rows, columns = (np.arange(n) * m // n for n, m in zip(shape, coarse, strict=True))
    begins, found = np.arange(shape[0] + 1) * shape[1], np.empty(cells.size, np.intp)

    def work(part: slice) -> None:
        here = cells[part]
        first, last = here[0] // shape[1], here[-1] // shape[1] + 1
        counts = np.diff(np.searchsorted(here, begins[first : last + 1]))  # of each row's cells
        found[part] = columns.take(here - begins[first:last].repeat(counts))
        found[part] += (rows[first:last] * coarse[1]).repeat(counts)

    if cells.size:
        over_blocks(work, cells.size, threads)
    return found


def _sums(influence: Influence, blocks: NDArray[np.intp], values: Array | None) -> Array:
    """Sums of the values of the cells in each block, or their number."""
    shape = influence.operator.coarse.shape
    sums = np.zeros(shape)

    def work(part: slice) -> tuple[slice, NDArray[Any]]:
        here = blocks[part]
        rows = slice(here[0] // shape[1], here[-1] // shape[1] + 1)  # of blocks: cells ascend
        few = here - rows.start * shape[1]
        weights = None if values is None else values[part]
        return rows, np.bincount(few, weights, (rows.stop - rows.start) * shape[1])

    for rows, found in over_blocks(work, blocks.size, influence.threads) if blocks.size else ():
        sums[rows] += found.reshape(-1, shape[1])
    return sums.reshape(-1)
