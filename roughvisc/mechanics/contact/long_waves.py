"""Second level of the preconditioner of the contact solver, for contact in many small spots."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from roughvisc.mechanics.grid import Grid

Array = Any  # an array of NumPy or CuPy, depending on the grid

#: Largest part of free cells for blocks.
SPARSE = 0.6
#: Blocks pay if the number of blocks along a side, times the part of the free cells that lies in partly free blocks, is
#: at least this. Within a contact spot that is wider than a block, blocks slow the iteration.
SPOTS = 45.0
#: Part of the local compliance that is used. The number of iterations is least between 0.5 and 1.
LOCAL_SHARE = 0.7


class LongWaves(NamedTuple):
    """Blocks of about 8 by 8 cells, for the long waves of the residual.

    The inverse of the kernel, restricted to the free cells, is far too large for waves longer than the distance between
    spots. Pressures ``s`` that are uniform over the ``N`` free cells of each block displace the blocks by
    ``K_b N s + c s``, with the influence ``K_b`` of the blocks on each other and the local compliance ``c`` of the
    spots. The inverse of this operator is applied to the mean residual of each block, and the inverse of the kernel to
    the rest [1]_.

    Attributes
    ----------
    blocks : Grid
        Grid of the blocks.
    block : array of int
        Block of each free cell.
    sums : callable
        Sums values of the free cells over each block.
    free : array
        Number of free cells of each block.
    part : float
        Area of a cell over the area of a block.
    local : float
        Local compliance. [m]

    References
    ----------
    .. [1] R. A. Nicolaides, SIAM J. Numer. Anal. 24 (1987) 355.
    """

    blocks: Grid
    block: Array
    sums: Callable[[Array], Array]
    free: Array
    part: float
    local: float

    @classmethod
    def of(cls, grid: Grid, cells: Array, held: Array, energy: float, on_grid: Any, passes: Any) -> LongWaves | None:
        """Return the blocks of the free cells, with their pressure and ``p.Kp``; None if they do not pay."""
        if cells.size > SPARSE * grid.size:
            return None
        xp, blocks = grid.xp, grid.coarse
        block = grid.block_of_cell.take(cells)
        sums = passes.block_sums(grid, cells, block, on_grid)
        free = sums(xp.ones(cells.size))
        whole = float(xp.where(free > 0.98 * grid.size / blocks.size, free, 0).sum())
        if (1 - whole / max(cells.size, 1)) * min(blocks.shape) < SPOTS:
            return None
        part, loads = grid.cell_area / blocks.cell_area, sums(held)
        displaced = blocks.displacement((loads * part).reshape(blocks.shape)).reshape(-1)
        smooth, spread = passes.spot_sums(loads, displaced, free)
        if not energy > smooth:
            return None
        return cls(blocks, block, sums, free, part, LOCAL_SHARE * (energy - smooth) / spread)

    def mean(self, sums: Array) -> Array:
        """Return the mean over the free cells of each block from the sum; zero if there are none."""
        return sums / self.blocks.xp.maximum(self.free, 1)
