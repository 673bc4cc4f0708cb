r"""A rigid cylinder that slides or rolls steadily on a viscoelastic body of one retardation time, without shear.

In the frame of the cylinder, which moves along +x at speed ``V``, the operator ``D = 1 - V tau d/dx`` takes the memory
out of ``q = C0 p + C1 z``, where ``z - V tau z' = p``:

    D q = f = (C0 + C1) p - C0 V tau p'

vanishes outside the contact ``|x| < a``, and the slope of the surface there is ``u' = -(x - e) / R`` with the axis of
the cylinder at ``x = e``. So ``f`` solves ``-(2/pi) int f(s) / (x - s) ds = D u'`` on the contact alone:

    f = [c0 + c1 T1(x/a) + c2 T2(x/a)] / sqrt(a^2 - x^2),     c1 = a (e + V tau) / 2R,     c2 = -a^2 / 4R

with Chebyshev polynomials. Two conditions give ``c0`` and ``e``: no pressure at the rear edge, and the slope of the
surface at the front edge, which comes to the contact from the undeformed surface ahead.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ive, kve

# exp of minus that is nothing.
_NEGLIGIBLE = 40.0


@dataclass(frozen=True)
class SlidingCylinder:
    """Half-width [m], offset of its middle ahead of the axis of the cylinder [m], load [N/m], friction coefficient."""

    half_width: float
    offset: float
    load: float
    friction_coefficient: float


def sliding_cylinder(radius, material, load, speed):
    r"""Return steady sliding or rolling, without shear, on a solid with one retardation time.

    Hunter's problem (J. Appl. Mech. 28 (1961) 611), by the equations of this module, which are a new derivation.
    Load and friction follow from moments of :math:`f` over the contact:

    .. math:: W = \frac{\pi c_0}{C_0 + C_1}, \qquad
              \mu = \frac1R \left[ \frac{\pi a c_1 / 2 - C_0 V \tau W}{(C_0 + C_1) W} - e \right].
    """
    factor = (1 - material.poisson) / 2
    at_once, in_the_end = factor * material.glassy, factor * (material.glassy + material.compliances[0])
    trail = speed * material.times[0]

    def contact(half_width):
        return _of_half_width(half_width, radius, at_once, in_the_end, trail)

    hertz = math.sqrt(4 * radius * load / math.pi)  # of unit compliance
    least, most = 0.5 * hertz * math.sqrt(at_once), 2 * hertz * math.sqrt(in_the_end)
    return contact(float(brentq(lambda a: contact(a).load / load - 1, least, most, xtol=1e-15 * most, rtol=1e-14)))


def _of_half_width(a, radius, at_once, in_the_end, trail):
    """The linear equations for ``c0`` and the offset of the axis."""
    z, decay = a / trail, in_the_end / at_once * a / trail
    c2 = -(a**2) / (4 * radius)
    rear = ive([0, 1, 2], decay)  # int f exp(-x decay / a) = 0: no pressure at the rear edge
    # Ahead of the contact, at x = a cosh(s), the n-th Chebyshev polynomial makes the slope exp(-n s) / sinh(s) of D u.
    # Two of these integrals have closed forms, which cancel to nothing at high speed.
    far = min(math.acosh(1 + _NEGLIGIBLE / z), _NEGLIGIBLE)
    ahead = [kve(0, z), *(quad(_decaying, 0, far, args=(n, z), epsabs=0, epsrel=1e-12)[0] for n in (1, 2))]
    # Unknowns c0 and e; c1 = a (e + trail) / (2 R). The slope at the front edge is -(a - e) / R.
    per_offset = a / (2 * radius)
    matrix = np.array(
        [
            [rear[0], -per_offset * rear[1]],
            [-2 / trail * ahead[0], -2 / trail * per_offset * ahead[1] - 1 / radius],
        ]
    )
    given = np.array(
        [
            per_offset * trail * rear[1] - c2 * rear[2],
            -a / radius + 2 / trail * (per_offset * trail * ahead[1] + c2 * ahead[2]),
        ]
    )
    c0, axis = np.linalg.solve(matrix, given)
    load = math.pi * c0 / in_the_end
    moment = (math.pi * a * per_offset * (axis + trail) / 2 - at_once * trail * load) / in_the_end
    return SlidingCylinder(a, -float(axis), float(load), float((moment / load - axis) / radius))


def _decaying(s, n, z):
    return math.exp(-n * s - z * (math.cosh(s) - 1))
