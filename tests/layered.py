"""A layer on a half-space by other roads than the package takes: what its body is held against.

Elasticity is integrated through the depth by a matrix exponential at high precision, creep follows by numerical
Laplace inversion, and axisymmetric contact that grows by a march of Fredholm equations.
"""

import math
from functools import partial

import mpmath as mp
import numpy as np
from references.layer import layer_complement, layer_factor
from scipy.optimize import brentq


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


def elastic_factor(x, poissons, moduli, digits=60):
    """Displacement of a wave over that of a half-space of the top layer's material, by the equations of elasticity.

    Wave number times thickness of the layers, from the top; Poisson's ratios and shear moduli of one material more.
    """
    with mp.workdps(digits):
        field = (depth_matrix(poissons[-1], moduli[-1]) - mp.eye(4)) ** 2  # its columns decay as (1, s) exp(-s)
        for one, poisson, modulus in zip(x[::-1], poissons[-2::-1], moduli[-2::-1], strict=True):
            field = mp.expm(-mp.mpf(one) * depth_matrix(poisson, modulus)) * field
        weights = mp.lu_solve(field[2:4, 0:2], mp.matrix([0, -1]))
        displacement = field[1, 0] * weights[0] + field[1, 1] * weights[1]
        return complex(displacement * mp.mpmathify(moduli[0]) / (1 - mp.mpf(poissons[0])))


def laplace_compliance(material, s):
    """``s L[J](s)`` of an exponential series: the shear compliance that algebra uses for a modulus in its place."""
    retarded = zip(material.compliances, material.times, strict=True)
    return material.glassy + material.fluidity / s + sum(one / (1 + s * time) for one, time in retarded)


def layered_compliance(q, s, layer, base, thickness):
    """Displacement over pressure of a wave, as :func:`laplace_compliance`. [m/Pa]"""
    upper = laplace_compliance(layer, s)
    ratio = laplace_compliance(base, s) / upper
    return (1 - layer.poisson) * upper / q * layer_factor(q * thickness, layer.poisson, base.poisson, ratio)


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


def creep_of_wave(q, layer, base, thickness, t):
    """Displacement after a unit pressure that is applied at time zero and kept. [m/Pa]"""
    return inverted(lambda s: layered_compliance(q, s, layer, base, thickness) / s, t)


def relaxation_of_wave(q, layer, base, thickness, t):
    """Pressure after a unit displacement that is imposed at time zero and kept. [Pa/m]"""
    return inverted(lambda s: 1 / (s * layered_compliance(q, s, layer, base, thickness)), t)


def sliding_symbol(qx, speed, layer, base, thickness):
    """Displacement over pressure of waves along the motion of a profile at a speed, in its frame. [m/Pa]"""
    return layered_compliance(np.abs(qx), -1j * qx * speed, layer, base, thickness)


class GrowingOnLayer:
    r"""An axisymmetric indenter under a load kept from time zero, on a layer and a base that creep as they like.

    With the Hankel transform of the pressure ``p_q(t) = pi int_0^a psi(x, t) cos(q x) dx`` the displacement within
    ``r`` depends on

        theta(x, t) = int C1(t - s) d psi(x, s) + (2/pi) int dq cos(q x) int D_q(t - s) d int psi(y, s) cos(q y) dy

    of ``x < r`` alone, as on an elastic body (module ``closed_forms.sheet``), with the creep ``C1`` of the layer and
    ``D_q = C1 (S - 1)`` of a wave by Laplace inversion. So ``theta = (2/pi) (d(t) - g(x))`` for all ``x < a(t)`` and
    ``psi = 0`` beyond holds for any history of contacts that are discs: it needs no separation of space and time.
    Psi is linear in time within a step; the edge is free of pressure, ``psi(a) = 0``.

    In thicknesses; the indenter's reduced profile ``g`` likewise.
    """

    first, new, in_panel = 24, 3, 16

    def __init__(self, profile, layer, base, force, times, widest=3.0):
        self.profile, self.force, self.times = profile, force, np.asarray(times, dtype=float)
        self.layer, self.base = layer, base
        count = math.ceil(4 * max(widest, 2.0))
        ends = np.append(0.0, 24.0 / count * np.append(0.5 ** np.arange(4, 0, -1), np.arange(1, count + 1)))
        nodes, weights = np.polynomial.legendre.leggauss(self.in_panel)
        side = np.diff(ends)[:, None]
        self.q, self.wq = (ends[:-1, None] + side * (nodes + 1) / 2).ravel(), (side * weights / 2).ravel() * 2 / math.pi
        self.march()

    def local(self, s):
        return (1 - self.layer.poisson) / 2 * laplace_compliance(self.layer, s)

    def beyond(self, s):
        """``C1 (S - 1)`` of all waves, which come before the nodes on the last axis."""
        ratio = laplace_compliance(self.base, s) / laplace_compliance(self.layer, s)
        complement = layer_complement(self.q[:, None], self.layer.poisson, self.base.poisson, ratio)
        return -self.local(s) * complement

    def solved(self, radius, x, w, local, beyond, remembered_x, remembered_q):
        """Psi on the nodes, its spectrum, and the approach, with the implicit creeps and what is remembered."""
        cosines, edge = np.cos(np.outer(x, self.q)), np.cos(radius * self.q)
        matrix = local * np.eye(x.size) + (cosines * (self.wq * beyond)) @ cosines.T * w
        known = -remembered_x - cosines @ (self.wq * remembered_q)
        sides = np.stack([np.full(x.size, 2 / math.pi), known - 2 / math.pi * self.profile(x)], axis=1)
        of_approach, rest = np.linalg.solve(matrix, sides).T

        def at_edge(psi):
            return float(edge @ (self.wq * beyond * ((w * psi) @ cosines)))

        lacking = -2 / math.pi * float(self.profile(radius)) - float(edge @ (self.wq * remembered_q)) - at_edge(rest)
        approach = lacking / (at_edge(of_approach) - 2 / math.pi)
        psi = approach * of_approach + rest
        return psi, (w * psi) @ cosines, approach

    def march(self):
        nodes, weights = np.polynomial.legendre.leggauss(self.first)
        more, more_weights = np.polynomial.legendre.leggauss(self.new)
        at_once = 1e30  # in place of infinity: all creep is later
        begin = float(np.real(self.local(at_once))), np.real(self.beyond(np.array([at_once])))[:, 0]

        def first(radius):
            x, w = radius * (nodes + 1) / 2, radius * weights / 2
            return x, w, *self.solved(radius, x, w, *begin, 0.0, np.zeros_like(self.q))

        def too_much(radius, contact):
            found = contact(radius)
            return math.pi * float(found[1] @ found[2]) - self.force

        low = high = 1e-2
        while too_much(high, first) < 0:
            low, high = high, 1.5 * high
        radius = brentq(too_much, low, high, args=(first,), xtol=1e-12)
        x, w, psi, spectrum, approach = first(radius)
        self.radius, self.approach = [radius], [approach]
        psis, spectra = [psi], [spectrum]
        for k, now in enumerate(self.times[1:], start=1):
            last = self.radius[-1]
            integrals = [
                (inverted(lambda s: self.local(s) / s**2, since), inverted(lambda s: self.beyond(s) / s**2, since))
                for since in now - self.times[:k]
            ] + [(0.0, 0.0)]
            means = [  # of what is laid on evenly in a step
                ((before[0] - after[0]) / span, (before[1] - after[1]) / span)
                for before, after, span in zip(integrals[:-1], integrals[1:], np.diff(self.times[: k + 1]), strict=True)
            ]
            begun = inverted(lambda s: self.local(s) / s, now), inverted(lambda s: self.beyond(s) / s, now)
            steps = [np.diff(value, axis=0) for value in (np.array(psis), np.array(spectra))]
            local, beyond = means[-1]
            remembered_x = begun[0] * psis[0] + sum(m[0] * one for m, one in zip(means, steps[0], strict=False))
            remembered_q = begun[1] * spectra[0] + sum(m[1] * one for m, one in zip(means, steps[1], strict=False))
            remembered_x, remembered_q = remembered_x - local * psis[-1], remembered_q - beyond * spectra[-1]
            contact = partial(
                self._grown, last, x, w, (more, more_weights), (local, beyond, remembered_x, remembered_q)
            )
            low, high = last * (1 + 1e-9), 1.02 * last
            while too_much(high, contact) < 0:
                high *= 1.1
            settled = too_much(low, contact) > 0
            radius = low if settled else brentq(too_much, low, high, args=(contact,), xtol=1e-12)
            x, w, psi, spectrum, approach = contact(radius)
            psis = [np.append(one, np.zeros(self.new)) for one in psis] + [psi]
            spectra.append(spectrum)
            self.radius.append(radius)
            self.approach.append(approach)

    def _grown(self, last, x, w, more, creeps, radius):
        """The contact of a step, with nodes beyond the last one."""
        local, beyond, remembered_x, remembered_q = creeps
        x = np.append(x, last + (radius - last) * (more[0] + 1) / 2)
        w = np.append(w, (radius - last) * more[1] / 2)
        remembered = np.append(remembered_x, np.zeros(self.new))
        return x, w, *self.solved(radius, x, w, local, beyond, remembered, remembered_q)
