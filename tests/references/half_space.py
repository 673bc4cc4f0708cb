"""Round indenters on a viscoelastic half-space: a step load, a flat punch, and any history.

A rigid indenter of profile ``f(r)`` acts like the profile ``g(x) = x int_0^x f'(r) / sqrt(x^2 - r^2) dr`` on a row of
independent springs (method of dimensionality reduction, MDR). An elastic contact of radius ``a`` has the approach
``g(a)`` and the force ``2 E* int_0^a (g(a) - g(x)) dx``.
"""

from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace

import mpmath
import numpy as np
from scipy.optimize import brentq


@dataclass(frozen=True)
class Paraboloid:
    """A sphere of small slopes, ``f = r^2 / (2 R)``. [m]"""

    radius: float

    def reduced(self, x):
        """``g``: the approach of an elastic contact of radius `x`. [m]"""
        return np.asarray(x) ** 2 / self.radius

    def scaled_force(self, radius):
        """Force over contact modulus of an elastic contact. [m2]"""
        return 4 * np.asarray(radius) ** 3 / (3 * self.radius)

    def radius_at_approach(self, approach):
        return np.sqrt(self.radius * np.asarray(approach))

    def radius_at_scaled_force(self, scaled_force):
        return np.cbrt(0.75 * self.radius * np.asarray(scaled_force))


@dataclass(frozen=True)
class Cone:
    """A cone ``f = m r`` of small slope."""

    slope: float

    def reduced(self, x):
        return np.pi / 2 * self.slope * np.asarray(x)

    def scaled_force(self, radius):
        return np.pi / 2 * self.slope * np.asarray(radius) ** 2

    def radius_at_approach(self, approach):
        return np.asarray(approach) * 2 / (np.pi * self.slope)

    def radius_at_scaled_force(self, scaled_force):
        return np.sqrt(np.asarray(scaled_force) * 2 / (np.pi * self.slope))


def relaxation_spectrum(material):
    """Equilibrium modulus, moduli and relaxation times of a series, from the eigenvalues of its Kelvin chain. [Pa], [s]

    The strains of the elements under a step follow ``x' = b / J_0 - S x`` with ``b_i^2 = J_i / tau_i`` and
    ``S = diag(1 / tau_i) + b b^T / J_0``; a dashpot is an element of rate zero.
    """
    compliances, times = (np.array(one) for one in (material.compliances, material.times))
    with mpmath.workdps(45):  # the rates span many decades
        rates = [1 / mpmath.mpf(one) for one in times] + [mpmath.mpf(0)] * bool(material.fluidity)
        strengths = [one * rate for one, rate in zip(compliances, rates, strict=False)] + [material.fluidity]
        root = mpmath.matrix([mpmath.sqrt(one) for one in strengths[: len(rates)]])
        roots, vectors = mpmath.eigsy(mpmath.diag(rates) + root * root.T / material.glassy)
        moduli = [(vectors[:, k].T * root)[0] ** 2 / material.glassy**2 / one for k, one in enumerate(roots)]
        moduli, relaxation_times = (np.array(one, dtype=float) for one in (moduli, [1 / one for one in roots]))
    equilibrium = 0.0 if material.fluidity else 1 / (material.glassy + compliances.sum())
    return equilibrium, moduli, relaxation_times


@dataclass(frozen=True)
class Relaxation:
    """Contact modulus ``E(t) = 2 G(t) / (1 - nu)`` of an exponential series with an instantaneous compliance. [Pa]"""

    equilibrium: float
    moduli: np.ndarray
    times: np.ndarray

    @classmethod
    def of(cls, material):
        equilibrium, moduli, times = relaxation_spectrum(material)
        factor = 2 / (1 - material.poisson)
        return cls(factor * equilibrium, factor * moduli, times)

    def __call__(self, t):
        return self.equilibrium + np.exp(-np.asarray(t)[..., None] / self.times) @ self.moduli

    def integral(self, t):
        """``int_0^t E``. [Pa s]"""
        t = np.asarray(t)
        return self.equilibrium * t - np.expm1(-t[..., None] / self.times) @ (self.moduli * self.times)


# ------------------------------------------------------------------------------------------------- growing contact


@dataclass(frozen=True)
class StepLoad:
    """Contact under a load that is applied at time zero and kept (Lee and Radok, J. Appl. Mech. 27 (1960) 438).

    While a contact grows, it is at each instant the elastic one of the compliance then.
    """

    indenter: object
    material: object
    force: float

    def radius(self, t):
        return self.indenter.radius_at_scaled_force(self.force * self.material.contact_compliance(t))

    def approach(self, t):
        return self.indenter.reduced(self.radius(t))

    def pressure(self, r, t):
        """Return the pressure under a ball at one time, ``2 / (pi R) int E(t - s) d sqrt(a(s)^2 - r^2)``. [Pa]"""
        early = np.geomspace(1e-9, 0.5, 1000) * t
        times = np.concatenate([[0.0], early, t - early[-2::-1], [t]])
        distances, places = np.unique(np.round(r, 15), return_inverse=True)
        widths = np.sqrt(np.maximum(self.radius(times) ** 2 - distances[:, None] ** 2, 0))
        relaxed = Relaxation.of(self.material)(t - np.append(0.0, (times[1:] + times[:-1]) / 2))
        found = np.diff(widths, axis=1, prepend=0) @ relaxed * 2 / (np.pi * self.indenter.radius)
        return found[places].reshape(np.shape(r))


def lee_radok_step(radius, material, force):
    """Return the contact of a ball under a step load."""
    return StepLoad(Paraboloid(radius), material, force)


# ------------------------------------------------------------------------------------------------- fixed contact


def hereditary_integral(kernel, antiderivative, program, t):
    """Return ``int_0^t kernel(t - s) dv(s)`` over ramps, holds and jumps ``v`` of one control: a sum over corners."""
    t, value = np.asarray(t, dtype=float), 0.0
    total = np.zeros(t.shape)
    for segment, start in zip(program.segments, program.corners, strict=False):
        end = value if segment.end is None else segment.end
        since = np.maximum(t - start, 0.0)
        if segment.duration == 0:
            total += np.where(t >= start, (end - value) * kernel(since), 0.0)
        else:
            later = np.maximum(since - segment.duration, 0.0)
            total += (end - value) / segment.duration * (antiderivative(since) - antiderivative(later))
        value = end
    return total


def punch_approach(radius, material, program, t):
    """Return the approach of a flat round punch under loads that never fall to zero, ``int C dW / (2 a)``. [m]"""
    return hereditary_integral(material.contact_compliance, material.contact_integral, program, t) / (2 * radius)


def punch_force(radius, material, program, t):
    """Return the force on a flat round punch under a history of approach, ``2 a int E d(approach)``. [N]"""
    relaxation = Relaxation.of(material)
    return 2 * radius * hereditary_integral(relaxation, relaxation.integral, program, t)


def punch_dissipation(radius, material, amplitude, period):
    """Return the energy lost in a settled cycle of approach, ``2 pi a E'' d^2``. [J]"""
    relaxation = Relaxation.of(material)
    x = 2 * np.pi / period * relaxation.times
    return 2 * np.pi * radius * float(relaxation.moduli @ (x / (1 + x**2))) * amplitude**2


# ------------------------------------------------------------------------------------------------- any history


def pressure_of_springs(x, force, r):
    """Return the pressure of a row of springs, ``-(1/pi) int_r F'(x) / sqrt(x^2 - r^2) dx``, `force` linear between."""
    slopes = np.diff(force) / np.diff(x)
    distances, places = np.unique(np.round(r, 15), return_inverse=True)
    distances = np.maximum(distances, x[1] / 2)[:, None]
    found = -np.diff(np.arccosh(np.maximum(x / distances, 1.0)), axis=1) @ slopes / np.pi
    return found[places].reshape(np.shape(r))


def reduced_contact(indenter, material, program, times, steps=60, elements=600):
    r"""Return the contact through any history without jumps: radius, approach, force, work, springs at each time.

    With the Abel transforms ``F(x, t)`` of the pressure and ``w(x, t)`` of the displacement each spring obeys

        w = int C(t - s) dF(s),   w = approach - g(x) where it touches,   F = 0 where it does not,

    and the force is ``2 int F dx``, as long as the contact is a disc. The force of a spring is linear in time within a
    step. The material needs ``contact_compliance`` and ``contact_integral``.
    """
    largest = [(s.end or 0.0) + s.amplitude for s in program.segments if s.control == "approach"]
    largest_load = program.largest_load * float(material.contact_compliance(program.duration))
    reach = max(indenter.radius_at_approach(max([0.0, *largest])), indenter.radius_at_scaled_force(largest_load))
    x = 1.05 * float(reach) * np.linspace(0, 1, elements)
    instants, rows = [0.0], []
    forces = np.zeros((1 + steps * (len(program.segments) + len(times)), elements))
    approach = force = work = 0.0
    for number, (segment, start) in enumerate(zip(program.segments, program.corners, strict=False)):
        begin, end = (force if segment.control == "load" else approach), start + segment.duration
        stops = [start, *(t for t in times if start < t < end), end]
        for low, high in pairwise(stops):
            for now in [*(low + (high - low) * np.linspace(0, 1, steps + 1)[1:-1] ** 2), high]:
                count = len(instants)
                instants.append(float(now))
                creeps = -np.diff(material.contact_integral(now - np.array(instants))) / np.diff(instants)
                weights = np.append(0.0, creeps[:-1]) - creeps
                surface = indenter.reduced(x) + weights @ forces[:count]
                value = float(program.prescribed(number, now, begin))

                def carried(level, surface=surface, compliance=creeps[-1]):
                    return 2 / compliance * np.trapezoid(np.maximum(level - surface, 0), x)

                level, lowest, top = value, surface.min(), surface.max()
                if segment.control == "load":
                    level = lowest
                    if value > 0:
                        level = brentq(lambda d, load=value: carried(d) - load, lowest, top, xtol=1e-15 * top)
                found = carried(level)
                work += (force + found) / 2 * (level - approach)
                approach, force = level, found
                forces[count] = np.maximum(level - surface, 0) / creeps[-1]
            if high in times:
                inside = np.flatnonzero(forces[count])
                last = inside[-1] if inside.size else 0
                part = (level - surface[last]) / (surface[last + 1] - surface[last]) if inside.size else 0.0
                rows.append((x[last] + part * (x[1] - x[0]), approach, force, work, forces[count]))
    radius, approach, force, work, springs = (np.array(column) for column in zip(*rows, strict=True))
    return SimpleNamespace(radius=radius, approach=approach, force=force, work=work, x=x, springs=springs)
