r"""Tangential force of a contact without shear: the force of the pressure on the inclined surface.

A profile that moves along +x is driven by ``-int p du/dx dA``, and kept on its path by ``-int p du/dy dA`` towards +y,
with the displacement ``u`` of the body, which in contact has the slope of the profile. The part ``K p`` of ``u`` adds
nothing, since ``K`` is even: on the grid its sum is zero to rounding, if the slope is that of the Fourier series. So
the force does not depend on how steeply the pressure ends at the edges of contact, as the sum of pressure times slope
of the profile does.
"""

from __future__ import annotations

import math
from typing import Any

import scipy

from roughvisc.mechanics.grid import Grid, fft_of, namespace
from roughvisc.mechanics.program import Slide

Array = Any  # an array of NumPy or CuPy


def slope(field: Array, side: float, axis: int) -> Array:
    """Return the slope of a periodic field along an axis, by its Fourier series.

    Parameters
    ----------
    field : array, shape (nx, ny)
        Of any unit.
    side : float
        Of a cell along the axis. [m]
    axis : int
        0 for x, 1 for y.

    Returns
    -------
    array, shape (nx, ny)
        The shortest wave of an even number of cells has none. [unit of the field / m]
    """
    xp, count = namespace(field), field.shape[axis]
    fft, waves = fft_of(xp), 2 * math.pi * scipy.fft.rfftfreq(count, side)
    if count % 2 == 0:
        waves[-1] = 0.0
    waves = waves[:, None] if axis == 0 else waves
    spectrum = fft.rfft(field, axis=axis) * xp.asarray(1j * waves)
    return fft.irfft(spectrum, n=count, axis=axis, overwrite_x=True)


def tangential_force(grid: Grid, pressure: Array, displacement: Array, slide: Slide, across: bool = False) -> float:
    """Return the friction force, against the motion of a profile, by the slope of the body under it. [N]

    Parameters
    ----------
    grid : Grid
        The body, periodic.
    pressure, displacement : array, shape (nx, ny)
        [Pa], [m]
    slide : Slide
        The motion.
    across : bool
        Whether to return the force to the left of the motion instead, which keeps the profile on its path. Left is 90
        degrees counter-clockwise from the motion, with x to the right and y upwards: y for a motion along x, -x for a
        motion along y.
    """
    axis, sense = slide.axis, slide.sense
    if across:
        axis, sense = 1 - axis, sense if axis == 0 else -sense
    inclined = slope(displacement, grid.spacing[axis], axis)
    return -sense * float((pressure * inclined).sum()) * grid.cell_area
