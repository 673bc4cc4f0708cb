r"""Steady sliding with periodic boundaries.

In the frame of a profile that moves along +x at speed ``V`` a wave of pressure with wave number ``q`` oscillates in
the body with the frequency ``-q_x V``: ``u_q = K_q C*(-q_x V) p_q``. The real part of the complex compliance makes an
even, positive operator, the imaginary part a skew one. The contact is the complementarity problem of both, solved by
:func:`~roughvisc.mechanics.sliding.interior_point.solve_complementarity`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from roughvisc.errors import InputError
from roughvisc.mechanics.arrays import threads_of
from roughvisc.mechanics.bodies.body import Body
from roughvisc.mechanics.bodies.transforms import transforms
from roughvisc.mechanics.sliding.interior_point import solve_complementarity

Array = NDArray[np.float64]

# Stated error over the change by Newton's step. Measured on line contacts against dense solutions, with loss tangents
# up to 27: the true error is 0.8 to 2.8 times that change.
_CAUTION = 2.25


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
    residual : float
        Error of the pressure that the iteration leaves, estimated: its absolute values summed, over the load. [-]
    friction_residual : float
        The same of the power force, relative. [-]
    converged : bool
        Whether both are within the tolerance.
    iterations : int
        Interior-point iterations.
    vectors : int
        Vectors of the linear solver in all; each costs two convolutions.
    """

    pressure: Array
    displacement: Array
    approach: float
    power_force: float
    residual: float
    friction_residual: float
    converged: bool
    iterations: int
    vectors: int


class Sliding:
    """The operator of a sliding body: an even, positive part and a skew one.

    Parameters
    ----------
    body : Body
        What is slid on; its materials have a complex compliance in closed form.
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
        body: Body,
        shape: tuple[int, int],
        spacing: tuple[float, float],
        speed: float,
    ) -> None:
        if not 0 < speed < math.inf:
            raise InputError(f"speed is {speed!r}: expected a positive number [m/s]")
        (nx, ny), (dx, dy) = shape, spacing
        #: Wave numbers along x and along y, of a real transform. [1/m]
        self.qx, self.qy = 2 * math.pi * fft.fftfreq(nx, dx)[:, None], 2 * math.pi * fft.rfftfreq(ny, dy)[None, :]
        odd, odd_across = self.qx.copy(), self.qy.copy()  # the shortest wave of an even number of cells has no slope
        if nx % 2 == 0:
            odd[nx // 2] = 0
        if ny % 2 == 0:
            odd_across[:, -1] = 0
        self._derivative, self._derivative_across = 1j * odd, 1j * odd_across
        response, complex_compliance = body.waves(self.qx, self.qy, -self.qx * speed)
        acting, complex_compliance = response > 0, np.broadcast_to(complex_compliance, response.shape)
        endless = acting & ~np.isfinite(complex_compliance)
        if endless.any():
            raise InputError(
                "the material creeps without end, and the surface has waves across the motion, which stand still in "
                "it: there is no steady state; expected a solid, or a profile that does not change across the motion"
            )
        # Of the shortest wave of an even grid no sine is seen.
        skew = np.where(acting & (odd != 0), complex_compliance.imag, 0.0) * response
        #: Displacement over pressure of each wave. [m/Pa]
        self.response = np.where(acting, complex_compliance.real, 0.0) * response + 1j * skew
        self._skew = np.asarray(1j * skew, dtype=np.complex128)
        softest = np.abs(self.response).max()
        acts = self.response != 0
        # Pressure over displacement of each wave; of those without displacement as of the softest. [Pa/m]
        stiffness = np.divide(1.0, self.response, where=acts, out=np.full(acts.shape, 1 / softest, complex))
        stiffest = float(np.abs(stiffness).max())
        self._stiffness = (stiffness / stiffest).astype(np.complex64), stiffest
        #: Cells of one period.
        self.shape = shape
        self._transforms, self._threads = transforms(mirrored=False), threads_of(nx * ny)
        #: Convolutions so far: forward and inverse transforms in pairs, those of the preconditioner too.
        self.convolutions = 0
        self.cell_area = dx * dy
        one = np.zeros(shape)
        one[0, 0] = 1.0
        #: Displacement of a cell under unit pressure on it alone. [m/Pa]
        self.self_influence = float(self.displacement(one)[0, 0])

    def displacement(self, pressure: Array) -> Array:
        """Displacement of a pressure. [m]"""
        return self._convolved(pressure, self.response)

    def full_contact(self, displacement: Array) -> Array:
        """Pressure of a displacement of all of the surface, to single precision: it is for a preconditioner. [Pa]"""
        symbol, unit = self._stiffness
        largest = float(np.abs(displacement).max()) or 1.0  # single precision underflows
        found = self._convolved((displacement / largest).astype(np.float32), symbol)
        return np.multiply(largest * unit, found, dtype=np.float64)

    def lagging(self, pressure: Array) -> Array:
        """Slope along x of the displacement out of phase. [-]"""
        return self._convolved(pressure, self._skew * self._derivative)

    def force_across(self, pressure: Array) -> float:
        r"""Force towards +y that keeps the profile on its path, :math:`-\int p\, \partial_y u\, \mathrm dA`. [N]

        Parameters
        ----------
        pressure : ndarray, shape (nx, ny)
            Of a steady state. [Pa]

        Notes
        -----
        In contact the body has the slope of the profile. As of the friction force along x, the displacement in phase
        with the pressure adds nothing: its kernel is even, so that the sum over its slope is zero. What is left does
        not depend on how steeply the pressure ends at the edges of contact.
        """
        inclined = self._convolved(pressure, self._skew * self._derivative_across)
        return -float((pressure * inclined).sum()) * self.cell_area

    def _convolved(self, field: NDArray[Any], symbol: NDArray[Any]) -> NDArray[Any]:
        """Convolution in the precision of field and symbol."""
        self.convolutions += 1
        waves = self._transforms.of_field(field, workers=self._threads)
        waves *= symbol
        return self._transforms.field_back(waves, s=self.shape, overwrite_x=True, workers=self._threads)


def steady_state(
    sliding: Sliding, gap: Array, load: float, *, tolerance: float = 1e-3, max_iterations: int = 100
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
    max_iterations : int
        The state reached by then is returned as not converged.

    Returns
    -------
    SteadyState
    """
    cell = sliding.cell_area

    def drag(pressure: Array) -> float:
        return -float((pressure * sliding.lagging(pressure)).sum()) * cell

    def residual(pressure: Array, correction: Array) -> float:
        return _CAUTION * float(np.abs(correction).sum() / pressure.sum())

    def friction_residual(pressure: Array, correction: Array) -> float:
        force, corrected = drag(pressure), drag(pressure + correction)
        return _CAUTION * abs(corrected - force) / abs(corrected) if corrected != force else 0.0

    def is_accurate(pressure: Array, correction: Array) -> bool:
        within = residual(pressure, correction) <= tolerance
        return within and friction_residual(pressure, correction) <= tolerance

    found = solve_complementarity(
        sliding.displacement,
        sliding.full_contact,
        sliding.self_influence,
        gap,
        load / cell,
        is_accurate,
        max_iterations=max_iterations,
    )
    pressure = found.pressure
    displacement = sliding.displacement(pressure)
    return SteadyState(
        pressure=pressure,
        displacement=displacement,
        approach=float(np.sum(pressure * (gap + displacement)) / pressure.sum()),
        power_force=drag(pressure),
        residual=residual(pressure, found.correction),
        friction_residual=friction_residual(pressure, found.correction),
        converged=found.converged,
        iterations=found.iterations,
        vectors=found.vectors,
    )
