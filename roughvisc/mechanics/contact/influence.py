"""Displacements and preconditioner in scaled variables, with a count of the convolutions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.arrays import Cells as Cells
from roughvisc.mechanics.arrays import blockwise, gather
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.sparse import Scattered

Array = NDArray[np.float64]
Single = NDArray[np.float32]


class Influence:
    """The half-space with lengths and pressures scaled; counts convolutions.

    Parameters
    ----------
    operator : Operator
        Grid and boundary.
    scale : float
        Unit of pressure over unit of length. [1/m]

    Attributes
    ----------
    threads : int
        How many work on one field.
    convolutions : int
        Displacements and applications of the preconditioner so far.
    size : int
        Number of cells.
    """

    def __init__(self, operator: Operator, scale: float) -> None:
        self.operator = operator
        self.threads = operator.threads
        self.scale = scale
        self.convolutions = 0
        self.size = operator.size

    def at(self, field: Array, cells: Cells) -> Array:
        """Values of a field at some cells, as flat indices."""
        return gather(field, cells, self.threads)

    @property
    def largest(self) -> float:
        """Largest eigenvalue of the influence, or a bound on it."""
        return self.operator.largest_influence * self.scale

    def displacement(self, pressure: Array, out: Array | None = None, less: Array | None = None) -> Array:
        """Displacement by a pressure, in double precision, less another one.

        Into some memory on large grids, where that is given.
        """
        self.convolutions += 1
        displacement = self.operator.displacement(pressure, out)

        def scale_and_subtract(here: Array, other: Array, out: Array) -> None:
            np.multiply(here, self.scale, out=out)
            out -= other

        if less is None:
            blockwise(np.multiply, displacement, self.scale, out=displacement, threads=self.threads)
        else:
            blockwise(scale_and_subtract, displacement, less, out=displacement, threads=self.threads)
        return displacement

    def displacement_single(self, pressure: Array, cells: Cells) -> tuple[Single, float]:
        """Displacement by a pressure on some cells in single precision, and its unit."""
        self.convolutions += 1
        field = Scattered.over_largest(self.operator.shape, cells, pressure)
        unit = field.size * self.operator.largest_influence * self.scale
        return self.operator.displacement_single(field), unit

    def approximate_pressure(self, displacement: Array, cells: Cells) -> Array:
        """About the pressure on some cells that displaces them, but for the scale: the preconditioner."""
        self.convolutions += 1
        return self.operator.approximate_inverse_within(
            Scattered.over_largest(self.operator.shape, cells, displacement)
        )

    def approximate_pressure_field(self, displacement: Single) -> Array:
        """The same for a displacement everywhere, of ordinary size."""
        self.convolutions += 1
        return self.operator.approximate_inverse(displacement).astype(float)

    def of_blocks(self, loads: NDArray[Any]) -> NDArray[Any]:
        """Displacement of blocks of cells by their loads, both flat, in one precision: no convolution to speak of."""
        blocks, single = self.operator.coarse, loads.dtype == np.float32
        pressure: NDArray[Any] = loads.reshape(blocks.shape) / (blocks.cell_area / self.operator.cell_area)
        displacement: NDArray[Any] = blocks.displacement_single(pressure) if single else blocks.displacement(pressure)
        displacement *= self.scale * (blocks.largest_influence if single else 1.0)
        return displacement.reshape(-1)

    @property
    def of_one_block(self) -> float:
        """Displacement of a block by a unit load on it alone."""
        blocks = self.operator.coarse
        return blocks.self_influence * self.scale * self.operator.cell_area / blocks.cell_area
