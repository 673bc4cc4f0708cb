r"""Tangential force of a contact without shear: that of the pressure on the inclined surface.

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
    """Slope of a periodic field along an axis, by its Fourier series.

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


def tangential_force(operator: Grid, pressure: Array, displacement: Array, slide: Slide) -> float:
    """Friction force, against the motion of a profile, by the slope of the body under it. [N]

    Parameters
    ----------
    operator : Grid
        The body, periodic.
    pressure, displacement : array, shape (nx, ny)
        [Pa], [m]
    slide : Slide
        The motion.
    """
    return slide.sense * _force_along(operator, pressure, displacement, slide.axis)


def force_across(operator: Grid, pressure: Array, displacement: Array, slide: Slide) -> float:
    """Force to the left of the motion that keeps a profile on its path, of the same fields. [N]

    Left is 90 degrees counter-clockwise from the motion, with x to the right and y upwards: of a motion along x it is
    y, and of one along y it is -x.
    """
    left = slide.sense if slide.axis == 0 else -slide.sense
    return left * _force_along(operator, pressure, displacement, 1 - slide.axis)


def _force_along(operator: Grid, pressure: Array, displacement: Array, axis: int) -> float:
    """Component along an axis of the force that holds the profile. [N]"""
    inclined = slope(displacement, operator.spacing[axis], axis)
    return -float((pressure * inclined).sum()) * operator.cell_area
