"""Second level of the preconditioner of the contact solver, for contact in many small spots."""

from __future__ import annotations

from typing import Any, NamedTuple

from roughvisc.mechanics.contact.free_cells import Free
from roughvisc.mechanics.grid import Grid

Array = Any  # an array of NumPy or CuPy, depending on the grid

#: Largest part of free cells for blocks.
SPARSE = 0.6
#: A block counts as full if more than this part of its cells is free.
FULL = 0.98
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
    place : array of int
        Block of each free cell; on a GPU, :attr:`~roughvisc.mechanics.contact.free_cells.Free.ends`.
    free, left : array
        Number of free cells of each block, and sum of their residual.
    part : float
        Area of a cell over the area of a block.
    local : float
        Local compliance. [m]

    References
    ----------
    .. [1] R. A. Nicolaides, SIAM J. Numer. Anal. 24 (1987) 355.
    """

    blocks: Grid
    place: Array
    free: Array
    left: Array
    part: float
    local: float

    @classmethod
    def of(cls, grid: Grid, found: Free, passes: Any) -> LongWaves | None:
        """Return the blocks of the free cells; None if they do not pay."""
        if found.cells.size > SPARSE * grid.size:
            return None
        blocks = grid.coarse
        part = grid.cell_area / grid.coarse.cell_area
        free, loads, left, place = passes.block_sums(grid, found)
        displaced = blocks.displacement((loads * part).reshape(blocks.shape)).reshape(-1)
        smooth, spread, whole = passes.spot_sums(loads, displaced, free, FULL * grid.size / blocks.size)
        if (1 - whole / max(found.cells.size, 1)) * min(blocks.shape) < SPOTS or not found.energy > smooth:
            return None
        return cls(blocks, place, free, left, part, LOCAL_SHARE * (found.energy - smooth) / spread)
