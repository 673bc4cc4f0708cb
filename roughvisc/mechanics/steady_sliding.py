r"""Steady sliding with periodic boundaries, as a contact problem whose operator is positive but not symmetric.

In the frame of a profile that moves along +x at speed ``V``, a wave of pressure with wave number ``q`` oscillates in
the body with the frequency ``-q_x V``: ``u_q = K_q C*(-q_x V) p_q``. The real part of the complex compliance gives a
symmetric, positive operator, the imaginary part a skew-symmetric one; ``K`` is their sum.

Pressure ``p`` and separation ``w = g + K p - approach`` satisfy ``p >= 0``, ``w >= 0``, ``p w = 0`` in each cell under
a given load. This monotone complementarity problem is not the minimum of an energy. Conjugate gradients do not apply,
and active-set methods may cycle if the skew part is large. The interior-point method of Mehrotra [1]_ avoids both
problems: ``p`` and ``w`` stay positive in all cells, and Newton's method drives their product to zero. It takes five to
thirty iterations, from materials without loss to loss tangents of a thousand.

1. Each iteration solves two linear systems ``(K + D) dp - d_approach = r``, ``sum dp = 0`` with ``D = w / p``, which is
   near zero in contact and large elsewhere. The preconditioner of GMRES [2]_ is ``S F^-1 (1/K_q) F S`` in contact
   and the diagonal elsewhere. ``S = k / (k + D)`` is near one in contact; ``k`` is the influence of a cell on itself.
2. The systems are scaled by ``(k + D)^(-1/2)``. In this scale a residual of ``sqrt(p.w)`` changes the products ``p w``
   by their own size, and a residual of ``p.w / sqrt(k p.p)`` changes the duality gap by its own size. GMRES stops at a
   fraction of both.
3. The first system of an iteration is Newton's step to the solution. Its change of the pressure is the error of that
   pressure, to second order: the stated error.
4. If thirty iterations do not suffice, the method follows the central path in short, accurate steps without Mehrotra's
   second-order term. It then converges slowly, but its iterates do not recur.

References
----------
.. [1] S. Mehrotra, SIAM J. Optim. 2 (1992) 575.
.. [2] Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856.
.. [3] H. F. Walker, L. Zhou, Numer. Linear Algebra Appl. 1 (1994) 571.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import fft

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.contact.solver import unsolved
from roughvisc.mechanics.grid import namespace, transforms

Array = Any  # an array of NumPy or CuPy

# Stated error over the change by Newton's step. Measured on line contacts against dense solutions, with loss tangents
# up to 27: the true error is 0.8 to 2.8 times that change.
_CAUTION = 2.25
# Largest residual of GMRES over the residuals of note 2. Measured on line contacts with loss tangents up to
# 27: 0.1 and 0.3 cost the same, 1 does not always converge.
_FORCING = 0.3
# Iterations after which the method follows the central path closely: fraction that replaces the last one, and least
# product of the next iterate over the product of this one, without the second-order term. Otherwise the iterates may
# recur if two cells compete for the load, as in 7 of 1,500 contacts of one or two cells.
_MANY = 30
_STRICT = 1e-3
_CENTRED = 0.5
# Largest residual of GMRES over the right-hand side: in any step, and in the step that gives the stated error.
_LOOSEST = 0.5
_STATED = 0.05
# Stiffest over softest wave up to which the preconditioner of a body with losses computes in single precision. Measured
# on random profiles on Kelvin-Voigt materials and on series with little instantaneous compliance: up to 1e4 the
# precision does not change the number of convolutions. From 3e4 on single precision needs up to 1.5 times as many, and
# some problems do not converge.
_SINGLE_PRECISION = 1e4
# Part of the distance to the border of the feasible set that a step takes.
_INSIDE = 0.995
# Least separation at the start, over the range of the gap.
_START = 0.3
# Vectors of GMRES before a restart, and in total.
_RESTART = 60
_MOST_VECTORS = 300
# Largest residual of a solution over the residual at which GMRES stops, because of rounding.
_REACHED = 1.5
# A vector is orthogonalised a second time if its length falls below this fraction of its projection.
_REPEATED = 0.1


@dataclass(frozen=True)
class SteadyState:
    """Steady state of sliding, in the frame of the profile.

    Attributes
    ----------
    pressure : array, shape (nx, ny)
        Pressure, exactly zero out of contact, whose integral is the load. [Pa]
    displacement : array, shape (nx, ny)
        Displacement; its mean is zero on a half-space, and on any body that uniform pressure compresses without end.
        [m]
    approach : float
        Approach, without the mean displacement if the kernel omits it. [m]
    power_force : float
        Friction force: dissipated power over the speed. [N]
    residual : float
        Estimated error of the pressure: sum of its absolute values over the load. [-]
    friction_residual : float
        Estimated relative error of the power force. [-]
    cell_error : float
        Estimated error of the pressure of a cell, the largest. [Pa]
    """

    pressure: Array
    displacement: Array
    approach: float
    power_force: float
    residual: float
    friction_residual: float
    cell_error: float


class Sliding:
    """The operator of a sliding body: a symmetric, positive part and a skew-symmetric one.

    Parameters
    ----------
    body : Body
        Its materials have a complex compliance in closed form.
    shape, spacing : pair
        Number of cells in one period, and cell sides. [m]
    speed : float
        Speed of the profile along +x, positive. [m/s]
    xp : module
        NumPy, or CuPy for fields on a device.

    Raises
    ------
    InputError
        If the material creeps without end and the grid has waves across the motion. These waves do not move in the
        body, so that a steady state does not exist.

    Notes
    -----
    If uniform pressure compresses the body without end, as on a compressible sheet of a material that creeps without
    end, the mean displacement is left out like on a half-space.
    """

    def __init__(
        self, body: Body, shape: tuple[int, int], spacing: tuple[float, float], speed: float, xp: Any = np
    ) -> None:
        nx, ny = shape
        dx, dy = spacing
        #: Wave numbers along x and along y, of a real transform. [1/m]
        self.qx = 2 * math.pi * fft.fftfreq(nx, dx)[:, None]
        self.qy = 2 * math.pi * fft.rfftfreq(ny, dy)[None, :]
        response, complex_compliance = body.waves(self.qx, self.qy, -self.qx * speed)
        complex_compliance = np.where(response > 0, complex_compliance, 0.0)
        if not np.isfinite(complex_compliance[0, 0]):  # uniform pressure compresses the body without end
            complex_compliance[0, 0] = 0.0
        if not np.isfinite(complex_compliance).all():  # of waves across the motion, which do not move in the material
            solid = "a solid, because this material creeps without end or to a compliance that is not known"
            expected = f"{solid}, or a profile uniform across the motion"
            raise InputError(key="material", found=body.materials, expected=expected)
        skew = 1j * (complex_compliance.imag * response)
        across = self.qy.copy()
        if nx % 2 == 0:  # the sine of the shortest wave vanishes at the centres of an even number of cells
            skew[nx // 2] = 0
        if ny % 2 == 0:
            across[:, -1] = 0
        self._derivatives = xp.asarray(1j * self.qx), xp.asarray(1j * across)
        displaced = complex_compliance.real * response + skew
        # Pressure over displacement of each wave; waves without displacement count as the softest. [Pa/m]
        stiffness = 1 / np.where(displaced == 0, np.abs(displaced).max(), displaced)
        stiffest = float(np.abs(stiffness).max())
        softest = float(np.abs(stiffness).min())
        is_single = stiffest <= _SINGLE_PRECISION * softest or not skew.any()
        precision = np.complex64 if is_single else np.complex128
        #: Displacement over pressure of each wave. [m/Pa]
        self.response = xp.asarray(displaced)
        self._skew = xp.asarray(skew)
        self._stiffness = xp.asarray((stiffness / stiffest).astype(precision)), stiffest
        self._transforms = transforms(nx * ny, xp)
        #: Number of convolutions so far, including the preconditioner.
        self.convolutions = 0
        self.cell_area = dx * dy
        unit_pressure = xp.zeros(shape)
        unit_pressure[0, 0] = 1.0
        #: Displacement of a cell under unit pressure on that cell alone. [m/Pa]
        self.self_influence = float(self.displacement(unit_pressure)[0, 0])

    def displacement(self, pressure: Array) -> Array:
        """Return the displacement of a pressure. [m]"""
        return self._convolved(pressure, self.response)

    def full_contact(self, displacement: Array) -> Array:
        """Return the pressure for a displacement in full contact, for a preconditioner. [Pa]

        In single precision, unless the stiffness of the waves differs by more than it can hold.
        """
        symbol, unit = self._stiffness
        most = float(abs(displacement).max()) or 1.0  # single precision underflows
        stiffened = self._convolved((displacement / most).astype(symbol.real.dtype), symbol)
        return stiffened.astype(float) * (most * unit)

    def slope(self, pressure: Array, axis: int = 0) -> Array:
        r"""Return the slope, along x or y, of the part of the displacement that is out of phase with the pressure.

        In contact the surface of the body has the slope of the profile: the force on the profile is :math:`-\int p\,
        \partial u\, \mathrm dA`. Along x it drives the profile, along y it keeps the profile on its path. The
        displacement in phase does not contribute: its kernel is even, so that the sum of the pressure times its slope
        is zero. The other part is a symmetric operator, and insensitive to the steepness of the pressure at the edges
        of contact.
        """
        return self._convolved(pressure, self._skew * self._derivatives[axis])

    def _convolved(self, field: Array, symbol: Array) -> Array:
        """Return a convolution in the precision of field and symbol."""
        self.convolutions += 1
        waves = self._transforms.waves(field)
        waves *= symbol
        return self._transforms.waves_back(waves, field.shape)


def steady_state(
    sliding: Sliding, gap: Array, load: float, *, tolerance: float = 1e-3, max_iterations: int = 100
) -> SteadyState:
    """Return the steady state of sliding under a load.

    Parameters
    ----------
    sliding : Sliding
        The body and the motion.
    gap : array, shape (nx, ny)
        Undeformed gap: the profile's highest point less its height. [m]
    load : float
        Positive. [N]
    tolerance : float
        Largest residual of pressure and friction. [-]
    max_iterations : int
        Largest number of iterations.

    Returns
    -------
    SteadyState

    Raises
    ------
    ConvergenceError
        If the residuals do not reach the tolerance.
    """
    xp = namespace(gap)
    total = load / sliding.cell_area
    pressure = xp.full(gap.shape, total / gap.size)
    opening = gap + sliding.displacement(pressure)
    if xp.ptp(gap) == 0:  # uniform pressure, without friction
        return SteadyState(pressure, opening - gap, float(opening.mean()), 0.0, 0.0, 0.0, 0.0)
    approach = float(opening.min()) - _START * float(xp.ptp(opening))
    separation = opening - approach
    errors = math.inf, math.inf
    for iteration in range(max_iterations + 1):
        products = float((pressure * separation).sum())
        if not math.isfinite(products):
            raise ConvergenceError(unsolved(iteration, max(errors), tolerance))
        energy = sliding.self_influence * float((pressure**2).sum())
        is_usual = iteration < _MANY
        enough = (_FORCING if is_usual else _STRICT) * min(math.sqrt(products), products / math.sqrt(energy))
        diagonal = separation / pressure
        system = _NewtonSystem(sliding, diagonal)
        contact = (pressure * sliding.self_influence > separation) | (separation == separation.min())
        trial = xp.where(contact, pressure, 0.0)
        trial *= total / float(trial.sum())

        # Predictor: Newton's step to the solution. It corrects the pressure, which is restricted to the contact. The
        # force is a quadratic form of the pressure. The term of second order counts if the pressure is almost uniform:
        # then the pressure before the correction has no friction. If both errors are below the tolerance, a more
        # accurate step gives the stated errors.
        right = approach - opening
        step: Array = None
        for relative in (_LOOSEST, _STATED):
            step, approach_step, is_accurate = system.solve(right, enough, relative, step)
            if not math.isfinite(float(step.sum())):  # the tolerance is below rounding
                raise ConvergenceError(unsolved(iteration, max(errors), tolerance))
            correction = pressure + step - trial
            of_force = 0.0
            of_pressure = _CAUTION * float(abs(correction).sum() / trial.sum())
            if of_pressure <= tolerance:
                slope = sliding.slope(trial)
                force = -float((trial * slope).sum()) * sliding.cell_area
                change = -float((correction * (2 * slope + sliding.slope(correction))).sum()) * sliding.cell_area
                of_force = _CAUTION * abs(change) / abs(force + change) if change else 0.0
            errors = of_pressure, of_force
            if max(errors) > tolerance:
                break
        else:
            if is_accurate:
                displacement = sliding.displacement(trial)
                approach = float((trial * (gap + displacement)).sum()) / total
                of_cell = _CAUTION * float(abs(correction).max())
                return SteadyState(trial, displacement, approach, force, *errors, of_cell)
        widening = -separation - diagonal * step
        length = min(_longest(pressure, step), _longest(separation, widening))
        reached = float(((pressure + length * step) * (separation + length * widening)).sum())
        centring = max((reached / products) ** 3, 0.0 if is_usual else _CENTRED) * products / gap.size

        # Corrector: the second-order term that the predictor leaves out, and a step towards equal products.
        right = (centring - step * widening if is_usual else centring) / pressure
        added, approach_added, _ = system.solve(right, enough)
        step += added
        widening += right - diagonal * added
        length = _INSIDE * min(_longest(pressure, step), _longest(separation, widening))
        pressure += length * step
        pressure *= total / float(pressure.sum())
        separation += length * widening
        approach += length * (approach_step + approach_added)
        opening = gap + sliding.displacement(pressure)
    raise ConvergenceError(unsolved(iteration, max(errors), tolerance))


class _NewtonSystem:
    """Linear system of an iteration (notes 1 and 2).

    Parameters
    ----------
    sliding : Sliding
        The operator ``K``.
    diagonal : array, shape (nx, ny)
        ``D``. [m/Pa]
    """

    def __init__(self, sliding: Sliding, diagonal: Array) -> None:
        self._sliding = sliding
        self._diagonal = diagonal
        both = sliding.self_influence + diagonal
        xp = namespace(diagonal)
        self._scale = 1 / xp.sqrt(both)
        self._inside = sliding.self_influence / both
        self._outside = (1 - self._inside**2) / both
        #: Pressure that the preconditioner assigns to a uniform displacement, scaled to a sum of 1.
        self._punch = self._inverse(xp.ones_like(both))
        self._punch /= float(self._punch.sum())

    def solve(
        self, right: Array, enough: float, relative: float = _LOOSEST, start: Array | None = None
    ) -> tuple[Array, float, bool]:
        """Return the changes of pressure and approach, and whether they are accurate.

        Parameters
        ----------
        right : array, shape (nx, ny)
            Right-hand side ``r``. [m]
        enough, relative : float
            Residuals, at the smaller of which GMRES stops: scaled, and relative to the right-hand side.
        start : array, shape (nx, ny), optional
            First guess of the change of the pressure. [Pa]
        """
        scaled = self._scaled(right)
        step = start
        vectors = 0
        norm = whole = math.sqrt(float((scaled**2).sum()))
        enough = min(enough, relative * norm)
        if start is not None:
            right = right - self._product(start)
            scaled = self._scaled(right)

        def multiply(vector: Array) -> Array:
            return self._scaled(self._product(self._precondition(vector)))

        # Preconditioned from the right: GMRES sees the residual of the system itself. It starts again if rounding of
        # the preconditioner, in single precision, hides that the residual is larger.
        while True:
            solution, count = gmres(multiply, scaled, enough)
            change = self._precondition(solution)
            step = change if step is None else step + change
            vectors = vectors + count
            right = right - self._product(change)
            scaled = self._scaled(right)
            before = norm
            norm = math.sqrt(float((scaled**2).sum()))
            if not _REACHED * enough < norm < before / 2 or vectors >= _MOST_VECTORS:
                break
        return step, -float((right * self._punch).sum()), norm <= _REACHED * max(enough, _STATED * whole)

    def _product(self, step: Array) -> Array:
        """Return ``(K + D) dp``. [m]"""
        return self._sliding.displacement(step) + self._diagonal * step

    def _scaled(self, field: Array) -> Array:
        """Return a displacement without its rigid part, scaled."""
        return (field - float((field * self._punch).sum())) * self._scale

    def _precondition(self, scaled: Array) -> Array:
        """Return a change of the pressure at constant load. [Pa]"""
        step = self._inverse(scaled / self._scale)
        return step - float(step.sum()) * self._punch

    def _inverse(self, field: Array) -> Array:
        """Return approximately ``(K + D)^-1`` times a displacement. [Pa]"""
        return self._inside * self._sliding.full_contact(self._inside * field) + self._outside * field


def gmres(operator: Callable[[Array], Array], right: Array, enough: float) -> tuple[Array, int]:
    """Solve a linear system by restarted GMRES [2]_, in the form of Walker and Zhou [3]_.

    Parameters
    ----------
    operator : callable
        Takes and returns arrays of the shape of the right-hand side.
    right : array
        Right-hand side.
    enough : float
        Norm of the residual at which the iteration ends.

    Returns
    -------
    array
        The solution, or the last iterate after 300 or more vectors.
    int
        Number of vectors.

    Notes
    -----
    SciPy's GMRES uses BLAS for inner products. Its last bits then depend on the number of threads, which differs
    between this process and the workers of Dask. CuPy's GMRES stops only at a restart. ``einsum`` does not call BLAS
    here.
    """
    xp = namespace(right)
    shape = right.shape
    residual = right.reshape(-1)
    solution = xp.zeros(right.size)
    count = 0
    norm = math.sqrt(float(xp.einsum("i,i->", residual, residual)))
    directions = xp.empty((_RESTART + 1, right.size))
    while norm > enough and count < _MOST_VECTORS:
        # The first direction is the residual; each further direction is the image of the last one, orthonormalised.
        directions[0] = residual / norm
        triangle = np.zeros((_RESTART, _RESTART))
        along_residual = np.zeros(_RESTART)
        size = 0
        for k in range(_RESTART):
            image = operator(directions[k].reshape(shape)).reshape(-1)
            for _ in range(2):  # Gram-Schmidt, a second time if little is left
                along = xp.einsum("ki,i->k", directions[1 : k + 1], image)
                image -= xp.einsum("ki,k->i", directions[1 : k + 1], along)
                triangle[:k, k] += along.tolist()  # on the host, like the rest of the small system
                length = math.sqrt(float(xp.einsum("i,i->", image, image)))
                if length > _REPEATED * math.sqrt(float((along**2).sum())):
                    break
            if not 0 < length < math.inf:  # the image adds no new direction
                break
            triangle[k, k], size = length, k + 1
            directions[k + 1] = image / length
            along_residual[k] = float(xp.einsum("i,i->", directions[k + 1], residual))
            residual = residual - along_residual[k] * directions[k + 1]
            norm = math.sqrt(float(xp.einsum("i,i->", residual, residual)))
            count += 1
            if norm <= enough:
                break
        if size == 0:
            break
        weights = xp.asarray(np.linalg.solve(triangle[:size, :size], along_residual[:size]))
        solution += xp.einsum("ki,k->i", directions[:size], weights)
    return solution.reshape(shape), count


def _longest(values: Array, step: Array) -> float:
    """Return the largest fraction of a step, at most 1, after which positive values are not negative."""
    shrinking = namespace(step).flatnonzero(step < 0)
    return min(1.0, float((values.take(shrinking) / -step.take(shrinking)).min())) if shrinking.size else 1.0
