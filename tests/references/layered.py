"""Sheets on a rigid base and layers on a half-space: waves by elasticity, creep by Laplace, contact by Fredholm."""

import math
from dataclasses import dataclass
from functools import lru_cache

import mpmath as mp
import numpy as np
from scipy.optimize import brentq

from references.dense import settled
from references.half_space import pressure_of_springs
from roughvisc.mechanics.layer import effective_compliance
from roughvisc.mechanics.sheet import factors

# ----------------------------------------------------------------------------------------------------------- waves


def depth_matrix(poisson, modulus):
    """``dy/d(q z)`` of ``y = (U, W, sxz / q, szz / q)``, plane strain: Hooke's law and equilibrium, nothing solved.

    ``u_x = U sin qx``, ``u_z = W cos qx``, ``sxz ~ sin qx``, ``szz ~ cos qx``.
    """
    nu, modulus = mp.mpf(poisson), mp.mpmathify(modulus)
    ratio = nu / (1 - nu)
    return mp.matrix(
        [
            [0, 1, 1 / modulus, 0],
            [-ratio, 0, 0, (1 - 2 * nu) / (2 * modulus * (1 - nu))],
            [2 * modulus / (1 - nu), 0, 0, ratio],
            [0, 0, -1, 0],
        ]
    )


#: Components of a field that are free at a base which does not deform: both stresses, or ``U`` and the normal stress.
FREE = {"bonded": (2, 3), "slipping": (0, 3)}


def elastic_factor(x, poissons, moduli, base=None):
    """Displacement of a wave over that of a half-space of the top layer's material, by a matrix exponential.

    Wave number times thickness of the layers, from the top; Poisson's ratios and shear moduli of the layers, and of one
    material more below them unless the base is rigid: bonded or slipping.
    """
    with mp.workdps(60):
        if base is None:
            field = (depth_matrix(poissons[-1], moduli[-1]) - mp.eye(4)) ** 2  # its columns decay as (1, s) exp(-s)
        else:
            field = mp.matrix(4, 2)
            field[FREE[base][0], 0] = field[FREE[base][1], 1] = 1
        for one, poisson, modulus in list(zip(x, poissons, moduli, strict=False))[::-1]:
            field = mp.expm(-mp.mpf(one) * depth_matrix(poisson, modulus)) * field
        weights = mp.lu_solve(field[2:4, 0:2], mp.matrix([0, -1]))
        displacement = field[1, 0] * weights[0] + field[1, 1] * weights[1]
        return displacement * mp.mpmathify(moduli[0]) / (1 - mp.mpf(poissons[0]))


def layered_compliance(q, s, layer, base, thickness):
    """Displacement over pressure of a wave that grows as ``exp(s t)``. [m/Pa]"""
    shear = [one.laplace(np.asarray(s, dtype=complex)) for one in (layer, base)]
    return 2 / q * effective_compliance(q, (thickness,), (layer.poisson, base.poisson), shear)


def inverted(transform, t, nodes=16):
    """The function of time of a Laplace transform, by a fixed Talbot contour: 1e-7 of it and better.

    `transform` is given the nodes on a last axis; times on the others.

    J. Abate, P. P. Valko, Int. J. Numer. Meth. Eng. 60 (2004) 979.
    """
    t = np.asarray(t, dtype=float)[..., None]
    angle = np.arange(1, nodes) * math.pi / nodes
    cotangent = 1 / np.tan(angle)
    real = 2 * nodes / (5 * t)
    s = np.append(real + 0j, real * angle * (cotangent + 1j), axis=-1)
    weights = np.append(0.5, 1 + 1j * (angle + (angle * cotangent - 1) * cotangent))
    return (np.exp(s * t) * transform(s) * weights).sum(axis=-1).real * real[..., 0] / nodes


def relaxation_of_wave(q, layer, base, thickness, t):
    """Pressure after a unit displacement that is imposed at time zero and kept. [Pa/m]"""
    return inverted(lambda s: 1 / (s * layered_compliance(q, s, layer, base, thickness)), t)


def sliding_symbol(qx, speed, layer, base, thickness):
    """Displacement over pressure of waves along the motion of a profile at a speed, in its frame. [m/Pa]"""
    return layered_compliance(np.abs(qx), -1j * qx * speed, layer, base, thickness)


def line_contact_history(height, side, loads, step, layer, base, thickness):
    """Return the pressures of a periodic line under loads per length that end steps of time, from rest. [Pa]

    Pressure is linear in time within a step. The displacement of each wave is the sum over past steps of the mean creep
    since; the contact of each step is found by a dense matrix and an active set.
    """
    count, steps = len(height), len(loads)
    q = 2 * np.pi * np.arange(1, count // 2 + 1)[:, None] / side
    ages = np.arange(1, steps + 1) * step
    integral = inverted(lambda s: layered_compliance(q[..., None], s, layer, base, thickness) / s**2, ages + 0 * q)
    creeps = np.diff(np.pad(integral, ((1, 0), (1, 0))), axis=1) / step
    place = np.arange(count)[:, None] - np.arange(count)
    matrices = [np.fft.irfft(creep, count)[place] for creep in creeps.T]
    pressures, active = [np.zeros(count)], height > np.quantile(height, 0.9)
    for number, load in enumerate(loads):
        increments = np.diff(pressures, axis=0)
        past = sum(m @ one for m, one in zip(matrices[number:0:-1], increments, strict=True))
        gap = height.max() - height + past - matrices[0] @ pressures[-1]
        pressures.append(settled(matrices[0], gap, load / (side / count), active, 100))
        active = pressures[-1] > 0
    return np.array(pressures[1:])


# --------------------------------------------------------------------------------------------------------- contact


@dataclass(frozen=True)
class ElasticLayer:
    """A layer on a half-space, with the shear modulus of the layer over that of the half-space. [m]"""

    thickness: float
    poisson: float
    base_poisson: float
    modulus_ratio: float


def factor(body, x):
    """Displacement of waves over that of a half-space of the upper material, for wave number times thickness."""
    if isinstance(body, ElasticLayer):
        compliances = 2 / (1 - body.poisson), 2 / (1 - body.poisson) * body.modulus_ratio
        return effective_compliance(x, (1.0,), (body.poisson, body.base_poisson), compliances)
    return factors(x, body.poisson, body.base)[0]


@dataclass(frozen=True)
class OnSheet:
    r"""A round indenter on a sheet or a layer: elastic contact by a Fredholm equation.

    With the Hankel transform of the pressure ``p_q = pi E* int_0^a phi(t) cos(q t) dt`` a contact of radius ``a`` obeys

        phi(x) + int_0^a M(x, t) phi(t) dt = (2/pi) (d - g(x)), M = (2/pi) int_0^inf (S(q h) - 1) cos(q x) cos(q t) dq

    with the approach ``d``, the factor ``S`` and the profile ``g`` of the indenter on a half-space. The force is
    ``pi E* int_0^a phi``; ``phi(a) = 0`` at the edge of a smooth indenter gives ``d``.

    W. C. Hayes, L. M. Keer, G. Herrmann, L. F. Mockros, J. Biomech. 5 (1972) 541.
    """

    indenter: object
    sheet: object

    def reduced(self, radius):
        """Approach of an elastic contact. [m]"""
        return np.array([_solved(self.indenter, self.sheet, a)[0] for a in np.ravel(radius)]).reshape(np.shape(radius))

    def scaled_force(self, radius):
        """Force over contact modulus of an elastic contact. [m2]"""
        return np.array([_solved(self.indenter, self.sheet, a)[1] for a in np.ravel(radius)]).reshape(np.shape(radius))

    def scaled_pressure(self, r, radius):
        """Pressure over contact modulus of an elastic contact. [-]"""
        return pressure_of_springs(*_solved(self.indenter, self.sheet, radius)[2](), r)

    def radius_at_scaled_force(self, scaled_force):
        found = []
        for value in np.ravel(scaled_force).tolist():
            low = high = float(self.indenter.radius_at_scaled_force(value))
            while self.scaled_force(low) > value:
                low /= 2
            while self.scaled_force(high) < value:
                high *= 2
            found.append(brentq(lambda a, v=value: float(self.scaled_force(a)) - v, low, high, rtol=1e-13))
        return np.array(found).reshape(np.shape(scaled_force))


@dataclass(frozen=True)
class PunchOnSheet:
    """A flat round punch on a sheet or a layer. [m]"""

    radius: float
    sheet: object

    @property
    def scaled_stiffness(self):
        """Force over approach and contact modulus; ``2 a`` on a half-space. [m]"""
        approach, force, *_ = _solved(None, self.sheet, self.radius)
        return force / approach


@lru_cache
def gauss(count):
    return np.polynomial.legendre.leggauss(count)


@lru_cache(maxsize=4096)
def _solved(indenter, sheet, radius):
    """Approach [m], force over modulus [m2], and what gives places [m] and forces of springs over modulus [m]."""
    if radius == 0:
        return 0.0, 0.0, None
    h, a = sheet.thickness, radius / sheet.thickness
    nodes, weights = gauss(40 + int(12 * a))
    x, w = np.append(a * (nodes + 1) / 2, a), np.append(a * weights / 2, 0.0)
    # waves in panels of a phase of ten; the first panel is halved towards zero, where a stiff layer gives way by q^-3
    ends = np.linspace(0, 30, math.ceil(6 * max(a, 2.0)) + 1)
    ends = np.concatenate([[0], ends[1] * 0.5 ** np.arange(30, 0, -1), ends[1:]])
    nodes, weights = gauss(16)
    halves = np.diff(ends)[:, None] / 2
    q, wq = (ends[:-1, None] + halves * (nodes + 1)).ravel(), (halves * weights).ravel()
    lost, cosines = 2 / np.pi * wq * (1 - factor(sheet, q)), np.cos(np.outer(x, q))
    matrix = np.eye(x.size) - (cosines * lost) @ cosines.T * w
    profile = indenter.reduced(x * h) / h if indenter else 0 * x
    of_approach, of_profile = np.linalg.solve(matrix, 2 / np.pi * np.stack([np.ones_like(x), profile], axis=1)).T
    approach = of_profile[-1] / of_approach[-1] if indenter else 1.0
    density = w * (approach * of_approach - of_profile)

    def springs(count=1000):
        at = a * np.sin(np.linspace(0, np.pi / 2, count))
        waves = np.cos(np.outer(at, q)) @ (lost * (density @ cosines))
        return at * h, h * (approach + np.pi / 2 * waves) - indenter.reduced(at * h)

    return approach * h, np.pi * density.sum() * h**2, springs
