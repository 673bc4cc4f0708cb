r"""Tangential force of a contact without shear: the force of the pressure on the inclined surface.

The force ``-int p du/dx dA`` drives a profile that moves along +x, and ``-int p du/dy dA`` towards +y keeps it on its
path. The displacement ``u`` of the body has the slope of the profile in contact. The part ``K p`` of ``u`` does not
contribute, since ``K`` is even: on the grid its sum is zero to rounding, if the slope is computed from the Fourier
series. The force is therefore insensitive to the steepness of the pressure at the edges of contact. The sum of pressure
times slope of the profile is sensitive to it.
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
        Field of any unit.
    side : float
        Cell side along the axis. [m]
    axis : int
        0 for x, 1 for y.

    Returns
    -------
    array, shape (nx, ny)
        Slope; zero for the shortest wave of an even number of cells. [unit of the field / m]
    """
    xp = namespace(field)
    count = field.shape[axis]
    fft = fft_of(xp)
    waves = 2 * math.pi * scipy.fft.rfftfreq(count, side)
    if count % 2 == 0:
        waves[-1] = 0.0
    waves = waves[:, None] if axis == 0 else waves
    spectrum = fft.rfft(field, axis=axis) * xp.asarray(1j * waves)
    return fft.irfft(spectrum, n=count, axis=axis, overwrite_x=True)


def tangential_force(grid: Grid, pressure: Array, displacement: Array, slide: Slide, across: bool = False) -> float:
    """Return the friction force against the motion of a profile, from the slope of the body. [N]

    Parameters
    ----------
    grid : Grid
        Cells of the body, periodic.
    pressure, displacement : array, shape (nx, ny)
        Pressure [Pa], and displacement of the body [m].
    slide : Slide
        The motion.
    across : bool
        Whether to return the force to the left of the motion instead, which keeps the profile on its path. Left is 90
        degrees counter-clockwise from the motion, with x to the right and y upwards: y for a motion along x, -x for a
        motion along y.
    """
    axis = slide.axis
    sense = slide.sense
    if across:
        axis, sense = 1 - axis, sense if axis == 0 else -sense
    inclined = slope(displacement, grid.spacing[axis], axis)
    return -sense * float((pressure * inclined).sum()) * grid.cell_area
