"""One contact problem in scaled variables."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.arrays import (
    any_positive,
    blockwise,
    concatenate,
    empty,
    is_wide,
    local_index,
    over_blocks,
    over_cells,
    total,
)
from roughvisc.mechanics.arrays import lowest as lowest_value
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact.influence import Array, Cells, Influence
from roughvisc.mechanics.contact.long_waves import CAUTION, LongWaves

Mask = NDArray[np.bool_]


class FreeSet(NamedTuple):
    """Cells that may change pressure, as flat indices, ascending.

    Attributes
    ----------
    cells : ndarray of int
        In contact, or penetrating else.
    separation, held : ndarray
        Separation and pressure of them.
    """

    cells: Cells
    separation: Array
    held: Array


@dataclass(frozen=True)
class ContactProblem:
    """A contact problem in scaled variables: pressures over ``pressure_scale``, lengths over ``length_scale``.

    Attributes
    ----------
    influence : Influence
        From pressure to displacement.
    gap : ndarray, shape (nx, ny)
        Gap without pressure, above its lowest point.
    load : float or None
        Sum of the pressure over the cells, where that is given.
    target : float
        Approach above the gap's lowest point, where that is given; else NaN.
    tolerance : float
        On the relative duality gap.
    present : ndarray of bool or None
        Cells where there is material; None: all.
    pressure_scale, length_scale, lowest : float
        What pressures [-] and lengths [m] are divided by, and the gap's lowest point [m].
    remaining : float
        Mean gap in full contact, where the approach given determines it: periodic displacements have no mean; else NaN.
    """

    influence: Influence
    gap: Array
    load: float | None
    target: float
    tolerance: float
    present: Mask | None
    pressure_scale: float
    length_scale: float
    lowest: float
    remaining: float

    @classmethod
    def scaled(
        cls,
        operator: Operator,
        gap: Array,
        *,
        load: float | None,
        approach: float | None,
        tolerance: float,
        present: Mask | None,
    ) -> ContactProblem:
        """The problem in units in which neither a load of 1e-300 nor its square is lost; uses up the gap."""
        lowest = lowest_value(gap, present, operator.threads)
        if load is not None:
            pressure_scale = load
            length_scale = load * operator.self_influence or load * operator.spacing[0]
        else:
            assert approach is not None
            length_scale = approach - lowest
            pressure_scale = length_scale / (operator.self_influence or operator.spacing[0])

        def over_length(here: Array, out: Array) -> None:
            np.subtract(here, lowest, out=out)
            out /= length_scale

        blockwise(over_length, gap, out=gap, threads=operator.threads)
        target = math.nan if approach is None else 1.0
        known = load is None and not operator.definite and present is None
        return cls(
            influence=Influence(operator, pressure_scale / length_scale),
            gap=gap,
            load=None if load is None else load / pressure_scale,
            target=target,
            tolerance=tolerance,
            present=present,
            pressure_scale=pressure_scale,
            length_scale=length_scale,
            lowest=lowest,
            remaining=float(np.mean(gap)) - target if known else math.nan,
        )

    @cached_property
    def definite(self) -> bool:
        """Whether every pressure displaces: with periodic boundaries a uniform one does not, on a half-space."""
        return self.influence.operator.definite

    @cached_property
    def sees_load(self) -> bool:
        """Whether the energy knows the load."""
        return self.load is not None or self.definite

    @cached_property
    def uniform(self) -> tuple[float, float]:
        """Uniform pressure that displaces every present cell by at least one length, and the total displacement by one.

        The pressure is zero where there is none: under a kernel that bulges.
        """
        ones = np.ones(self.gap.shape) if self.present is None else self.present.astype(float)
        response = self.influence.displacement(ones)
        inside = response if self.present is None else response[self.present]
        least = float(inside.min())
        return 1 / least if least > 0 else 0.0, float(inside.sum())

    def separation(self, displacement: Array) -> Array:
        """Gap under pressure at zero approach."""
        found = empty(self.gap.shape)
        blockwise(np.add, self.gap, displacement, out=found, threads=self.influence.threads)
        return found

    def separation_of(self, displaced: Array, part: slice) -> Array:
        """Gap under pressure of a slice of flat cells, as a new array: it is computed as fast as it would be read."""
        return self.gap.reshape(-1)[part] + displaced[part]

    def lowest_of(self, apart: Array, part: slice) -> float:
        """Least separation of some present cells; infinite if none of them is."""
        if self.present is None:
            return float(np.minimum.reduce(apart))
        return float(apart.min(where=self.present.reshape(-1)[part], initial=math.inf))

    def separated(self, displacement: Array, contact: Cells) -> tuple[float, Array, Array | None]:
        """Least separation of present cells, that of some cells, and that of all, flat, unless the field is wide."""
        if not is_wide(displacement.size):
            field = (self.gap + displacement).reshape(-1)
            return self.lowest_of(field, slice(0, field.size)), field.take(contact), field
        displaced, apart = displacement.reshape(-1), np.empty(contact.size)

        def work(part: slice, few: slice) -> float:
            here = self.separation_of(displaced, part)
            here.take(local_index(part, contact[few]), out=apart[few], mode="clip")  # by others by way of a copy
            return self.lowest_of(here, part)

        return min(over_cells(work, displaced.size, contact, self.influence.threads)), apart, None

    def free_set(self, pressure: Array, displacement: Array, level: float, separation: Array | None = None) -> FreeSet:
        """The free set at an approach; ``separation`` is that of all cells, flat, where it is known."""
        carried, displaced = pressure.reshape(-1), displacement.reshape(-1)
        present, threads = None if self.present is None else self.present.reshape(-1), self.influence.threads

        def free(part: slice) -> FreeSet:
            apart = self.separation_of(displaced, part) if separation is None else separation[part]
            here = carried[part]
            mask = apart < level
            if present is not None:
                mask &= present[part]
            mask |= here > 0
            [cells] = mask.nonzero()
            values = apart.take(cells), here.take(cells)
            if part.start:
                cells += part.start
            return FreeSet(cells, *values)

        found = over_blocks(free, pressure.size, threads)
        if len(found) == 1:
            return found[0]
        parts = [list(each) for each in zip(*found, strict=True)]
        del found
        # the parts go as they are joined
        return FreeSet(*(concatenate(parts.pop(0), threads) for _ in range(3)))

    def excess(self, vector: Array) -> float:
        """What to take off each value of a vector on the free set, so that it keeps a given load."""
        return 0.0 if self.load is None else total(vector, self.influence.threads) / vector.size

    def precondition(self, residual: Array, free_set: Cells, pressure: Array, energy: float) -> tuple[Array, float]:
        """About the change of pressure that a residual asks for, but for the scale, and how cautious to be of its size.

        By both levels of the preconditioner where the second pays. ``pressure`` is that on the free set so far, and
        ``energy`` is ``p.Kp``.
        """
        waves = LongWaves.of(self.influence, free_set, pressure, energy)
        if waves is None:
            return self.influence.approximate_pressure(residual, free_set), 1.0
        return waves.preconditioned(residual, partial(self.influence.approximate_pressure, cells=free_set)), CAUTION

    def initial_iterate(self, start: Array | None, displacement: Array | None) -> tuple[Array, Array | None]:
        """Admissible pressure near a first guess, and its displacement where that of the guess is known."""
        threads = self.influence.threads
        if start is None or not any_positive(start):
            pressure, displacement = np.ones(self.gap.shape), None
            if self.load is None:
                pressure = np.where(self.gap < self.target, self.target - self.gap, 0.0)
        else:
            pressure = start

            def over_unit(here: Array, out: Array) -> None:
                np.maximum(here, 0, out=out)
                out /= self.pressure_scale

            blockwise(over_unit, pressure, out=pressure, threads=threads)
        if self.present is not None:
            pressure = np.where(self.present, pressure, 0.0)
        factor = 1.0 if self.load is None else self.load / total(pressure.reshape(-1), threads)
        blockwise(np.multiply, pressure, factor, out=pressure, threads=threads)
        if displacement is not None:
            blockwise(np.multiply, displacement, factor / self.length_scale, out=displacement, threads=threads)
        return pressure, displacement
