r"""Steady sliding with periodic boundaries: a fixed point of elastic contact problems.

In the frame of a profile that moves along +x at speed ``V`` a wave of pressure with wave number ``q`` oscillates in
the body with the frequency ``-q_x V``: ``u_q = K_q C*(-q_x V) p_q``. The real part of the complex compliance makes an
even, positive operator, the imaginary part a skew one. The first is the kernel of an elastic contact problem, the
second is carried in its gap:

    p+ = contact(K_even, gap = theta (g + K_skew p) + (theta - 1) K_even p)

With ``s`` the largest loss tangent on the grid, ``theta = 1 / (1 + s^2)`` contracts by ``s / sqrt(1 + s^2)``, as the
operator is strongly monotone. Below ``s = 1/2`` steps of ``theta = 1`` contract by ``s``. Anderson's acceleration
mixes the last few steps; where it does not help it is forgotten, and the safe step is left.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from roughvisc.errors import InputError
from roughvisc.mechanics.contact import ContactState, solve_contact
from roughvisc.mechanics.halfspace.kernel import Kernel
from roughvisc.mechanics.halfspace.operator import HalfSpace

Array = NDArray[np.float64]
Compliance = Callable[[Array], NDArray[np.complex128]]

# Below this loss tangent whole steps contract well enough.
_SMALL_LOSS = 0.5
# Steps that are mixed.
_MIXED = 3
# Relative duality gap of a contact problem: over the last change of the pressure; at most; and over the tolerance at
# least, and at most where the iteration ends. The error of the pressure (L1) is as large in the median.
_INNER, _LOOSEST, _TIGHTEST, _LAST = 0.1, 1e-2, 0.03, 0.1
# What is left over the last change is at least one, and at least this part of what the contraction warrants. Measured
# on 15 steady states of rough surfaces with loss tangents from 0.02 to 5: the pressure's error is 0.1 to 1 of that.
_WARRANTED = 0.35
# Changes as small are rounding, which does not fall from step to step.
_ROUNDED = 16 * float(np.finfo(float).eps)


@dataclass(frozen=True)
class SteadyState:
    """A steady state of sliding, in the frame of the profile.

    Attributes
    ----------
    pressure : ndarray, shape (nx, ny)
        [Pa]
    displacement : ndarray, shape (nx, ny)
        With periodic boundaries the mean of a half-space's is zero. [m]
    approach : float
        [m]
    power_force : float
        Friction force by the power that the material dissipates, over the speed. [N]
    slope_force : float
        Friction force by the pressure on the slopes of the profile. It differs from the other by what the grid leaves
        open at the edges of contact. [N]
    residual : float
        What the iteration leaves of the pressure, estimated: its absolute values summed, over the load. [-]
    friction_residual : float
        The same of the power force, relative. [-]
    converged : bool
        Whether both are within the tolerance.
    outer, inner : int
        Contact problems solved, and their iterations in all.
    loss_tangent : float
        The largest on the grid.
    """

    pressure: Array
    displacement: Array
    approach: float
    power_force: float
    slope_force: float
    residual: float
    friction_residual: float
    converged: bool
    outer: int
    inner: int
    loss_tangent: float


@dataclass(frozen=True)
class _InPhase(Kernel):
    """What of the displacement is in phase with the pressure: even, so that it makes an elastic contact problem."""

    body: Kernel
    compliance: Compliance
    speed: float

    def influence(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        raise InputError("steady sliding is periodic: expected boundary = 'periodic'")

    def transfer(self, qx: ArrayLike, qy: ArrayLike) -> Array:
        response = self.body.transfer(qx, qy)
        in_phase = self.compliance(np.broadcast_to(np.asarray(qx, dtype=float) * self.speed, response.shape)).real
        return np.multiply(response, in_phase, where=response > 0, out=np.zeros(response.shape))


class Sliding:
    """The operator of a sliding body: half of it a contact problem's, the other half skew.

    Parameters
    ----------
    body : Kernel
        What is slid on.
    compliance : callable
        Complex contact compliance of angular frequencies. [1/Pa]
    shape, spacing : pair
        Cells of one period, and their sides. [m]
    speed : float
        Of the profile along +x. [m/s]

    Raises
    ------
    InputError
        If the speed is not positive, or the material creeps without end where the grid has waves across the motion:
        those stand still in the body, and there is no steady state.
    """

    def __init__(
        self,
        body: Kernel,
        compliance: Compliance,
        shape: tuple[int, int],
        spacing: tuple[float, float],
        speed: float,
    ) -> None:
        if not 0 < speed < math.inf:
            raise InputError(f"speed is {speed!r}: expected a positive number [m/s]")
        (nx, ny), (dx, dy) = shape, spacing
        #: Wave numbers along x and along y, of a real transform. [1/m]
        self.qx, self.qy = 2 * math.pi * fft.fftfreq(nx, dx)[:, None], 2 * math.pi * fft.rfftfreq(ny, dy)[None, :]
        odd = self.qx.copy()
        if nx % 2 == 0:
            odd[nx // 2] = 0
        self._derivative = 1j * odd
        response = body.transfer(self.qx, self.qy)
        acting = response > 0
        complex_compliance = np.broadcast_to(compliance(-self.qx * speed), response.shape)
        endless = acting & ~np.isfinite(complex_compliance)
        if endless.any():
            raise InputError(
                "the material creeps without end, and the surface has waves across the motion, which stand still in "
                "it: there is no steady state; expected a solid, or a profile that does not change across the motion"
            )
        loss = np.where(acting, np.abs(complex_compliance.imag), 0.0)
        kept = np.where(acting, complex_compliance.real, 1.0)
        #: The largest loss tangent.
        self.loss_tangent = float(np.max(loss / kept))
        # Of the shortest wave of an even grid no sine is seen.
        skew = np.where(acting & (odd != 0), complex_compliance.imag, 0.0) * response
        #: Displacement over pressure of each wave. [m/Pa]
        self.response = np.where(acting, complex_compliance.real, 0.0) * response + 1j * skew
        self._skew = np.asarray(1j * skew, dtype=np.complex128)
        self._shape = shape
        self.even = HalfSpace(shape, spacing, "periodic", kernel=_InPhase(body, compliance, speed))

    def skew(self, pressure: Array) -> Array:
        """Displacement out of phase. [m]"""
        return self._filtered(pressure, self._skew)

    def lagging(self, pressure: Array) -> Array:
        """Slope along x of the displacement out of phase. [-]"""
        return self._filtered(pressure, self._skew * self._derivative)

    def slope(self, field: Array) -> Array:
        """Slope of a field along x, by its Fourier series. [1/m]"""
        return self._filtered(field, self._derivative)

    def _filtered(self, field: Array, symbol: NDArray[np.complex128]) -> Array:
        return np.asarray(fft.irfft2(fft.rfft2(field) * symbol, s=self._shape, overwrite_x=True))


def steady_state(
    sliding: Sliding,
    gap: Array,
    load: float,
    *,
    tolerance: float = 1e-3,
    start: Array | None = None,
    max_outer: int = 500,
) -> SteadyState:
    """Steady state under a load.

    Parameters
    ----------
    sliding : Sliding
        The body and the motion.
    gap : ndarray, shape (nx, ny)
        Undeformed gap: the profile's highest point less its height. [m]
    load : float
        [N]
    tolerance : float
        On the residuals of pressure and friction.
    start : ndarray, shape (nx, ny), optional
        A pressure nearby. [Pa]
    max_outer : int
        The state reached by then is returned as not converged.

    Returns
    -------
    SteadyState
    """
    cell, loss = sliding.even.cell_area, sliding.loss_tangent
    whole = loss < _SMALL_LOSS
    theta = 1.0 if whole else 1 / (1 + loss**2)
    total = load / cell
    rate = loss if whole else loss / math.hypot(1, loss)
    least = max(1.0, _WARRANTED * rate / (1 - rate))  # of what is left, over the last change
    inner, last, before = 0, 1.0, math.inf
    drag = residual = friction_residual = math.inf
    pressure = np.full(gap.shape, total / gap.size) if start is None else start * (total / float(start.sum()))
    even, skew = sliding.even.displacement(pressure), sliding.skew(pressure)
    taken: list[Array] = []  # pressures that steps began with, and what they came to
    given: list[Array] = []
    for outer in range(1, max_outer + 1):
        within = min(max(_INNER * last, _TIGHTEST * tolerance), _LOOSEST)
        state: ContactState = solve_contact(
            sliding.even, theta * (gap + skew) + (theta - 1) * even, load=total, tolerance=within, start=pressure
        )
        inner += state.iterations
        found = state.pressure
        before, last = last, float(np.abs(found - pressure).sum()) / total
        earlier, drag = drag, -float((found * sliding.lagging(found)).sum()) * cell
        slowed = last > _ROUNDED and not before > last
        left = math.inf if slowed else max(least, last / (before - last) if before > last else 0.0)
        residual = last * left + within
        friction_residual = abs(drag - earlier) / drag * left if drag > 0 and drag != earlier else 0.0
        settled = within <= _LAST * tolerance and max(residual, friction_residual) <= tolerance
        if settled or outer == max_outer:
            even = state.displacement
            break
        taken, given = [*taken[-_MIXED:], pressure], [*given[-_MIXED:], found]
        if last > before:
            taken, given = taken[-1:], given[-1:]
        pressure = mixed(taken, given, total)
        even = state.displacement if pressure is found else sliding.even.displacement(pressure)
        skew = sliding.skew(pressure)
    displacement = even + sliding.skew(found)
    level = float(np.sum(found * (gap + displacement)) / found.sum())
    return SteadyState(
        pressure=found,
        displacement=displacement,
        approach=level,
        power_force=drag,
        slope_force=float((found * sliding.slope(gap)).sum()) * cell,
        residual=residual,
        friction_residual=friction_residual,
        converged=settled,
        outer=outer,
        inner=inner,
        loss_tangent=loss,
    )


def mixed(taken: list[Array], given: list[Array], total: float) -> Array:
    """Pressure to go on from, by Anderson's acceleration: admissible, and of the load.

    Parameters
    ----------
    taken, given : list of ndarray
        Pressures before and after the last steps.
    total : float
        Sum of the pressure.

    References
    ----------
    .. [1] H. F. Walker, P. Ni, SIAM J. Numer. Anal. 49 (2011) 1715.
    """
    if len(taken) < 2:
        return given[-1]
    steps = [(after - before).ravel() for before, after in zip(taken, given, strict=True)]
    differences = np.stack([b - a for a, b in pairwise(steps)], axis=1)
    weights = np.linalg.lstsq(differences, steps[-1], rcond=1e-8)[0]
    pressure = given[-1].copy()
    for weight, (a, b) in zip(weights, pairwise(given), strict=True):
        pressure -= weight * (b - a)
    np.maximum(pressure, 0, out=pressure)
    scale = float(pressure.sum())
    return pressure * (total / scale) if scale > 0 else given[-1]
