"""A stack of contact problems of one size, solved in lockstep by the algorithm of the contact solver.

An experiment that :mod:`batched` measures. Under given loads, with periodic boundaries and in double precision, without
the solver's spacer steps and first guesses.
"""

import numpy as np
from scipy import fft

from roughvisc.mechanics.bodies import ducc
from roughvisc.mechanics.bodies.transforms import with_ducc0

# Fields that one call transforms, as many as is fastest; of wider grids one.
TOGETHER = {16: 16, 32: 16, 64: 4}


def lockstep(gap, kernel, tolerance):
    """Pressures of a stack of problems by the algorithm of the contact solver; what is solved leaves the stack."""
    (count, size), cells = gap.shape, len(kernel)
    inverse = (1 / np.where(kernel > 0, kernel, kernel.max())).astype(np.float32)
    found, number, largest = np.empty(gap.shape), np.arange(count), np.maximum.reduceat
    pressure, step_length, over_curvature = np.full(gap.shape, 1 / size), np.ones(count), np.zeros(count)
    displacement, change, response = (np.zeros(gap.shape) for _ in range(3))

    def convolve(fields, symbol):
        return convolved(fields.reshape(-1, cells, cells), symbol, TOGETHER.get(cells, 1)).reshape(-1, size)

    def add(values):
        return np.add.reduceat(values, first)

    def spread(values):
        return np.repeat(values, np.diff(first, append=last))

    while True:
        contact = np.flatnonzero(pressure)
        first, last = np.searchsorted(contact, np.arange(len(number)) * size), contact.size
        separation = gap + displacement
        held, here = pressure.take(contact), separation.take(contact)
        energy, level = add(held * displacement.take(contact)), add(here) / np.diff(first, append=last)
        left = add(held * here) - separation.min(axis=1) > tolerance * energy
        found[number[~left]] = pressure[~left]
        if not left.any():
            return found
        if not left.all():
            number, gap, pressure, displacement = number[left], gap[left], pressure[left], displacement[left]
            separation, level, change, response = separation[left], level[left], change[left], response[left]
            step_length, over_curvature = step_length[left], over_curvature[left]
        free = np.flatnonzero((separation < level[:, None]) | (pressure > 0))
        first, last = np.searchsorted(free, np.arange(len(number)) * size), free.size
        count_of = np.diff(first, append=last)
        held, residual, former = pressure.take(free), separation.take(free), change.take(free)
        residual -= spread(add(residual) / count_of)
        unit = spread(largest(np.abs(residual), first))
        field = np.zeros(gap.shape, np.float32)
        field.reshape(-1)[free] = residual / unit
        direction = convolve(field, inverse).take(free) * unit
        direction -= spread(add(direction) / count_of)
        former -= spread(add(former) / count_of)
        beta = add(direction * response.take(free)) * over_curvature
        beta[(beta < 0) | (add(residual * direction) <= beta * add(residual * former))] = 0.0
        direction -= spread(beta) * former
        trial = np.maximum(held - spread(step_length) * direction, 0)
        trial *= spread(1 / add(trial))
        move = trial - held
        change = np.zeros(gap.shape)
        change.reshape(-1)[free] = move
        response = convolve(change, kernel)
        over_curvature = 1 / add(move * response.take(free))
        minimum = np.minimum(-add(move * residual) * over_curvature, 30.0)
        empties = np.logical_or.reduceat((held > 0) & (trial == 0), first)
        with np.errstate(divide="ignore", invalid="ignore"):
            limit = np.where(empties, 1.0, -1 / np.fmin.reduceat(move / held, first))
        fraction = np.where(empties & (minimum > 0.5), 1.0, np.minimum(minimum, limit))
        pressure.reshape(-1)[free] = np.maximum(held + spread(fraction) * move, 0)
        displacement += response * fraction[:, None]
        step_length = step_length * np.clip(minimum, 0.3, np.where(minimum > limit, 1.3, 3.0))


def convolved(fields, symbol, together):
    """Fields convolved with a symbol, so many by one call."""
    found, cells = np.empty_like(fields), fields.shape[-1]
    for part in (slice(first, first + together) for first in range(0, len(fields), together)):
        spectrum = ducc.ducc0.fft.r2c(fields[part], axes=(1, 2)) if with_ducc0() else fft.rfft2(fields[part])
        spectrum *= symbol
        if with_ducc0():
            ducc.ducc0.fft.c2r(spectrum, axes=(1, 2), lastsize=cells, forward=False, inorm=2, out=found[part])
        else:
            found[part] = fft.irfft2(spectrum, s=(cells, cells), overwrite_x=True)
    return found
