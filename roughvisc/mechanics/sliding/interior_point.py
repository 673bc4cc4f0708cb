r"""Contact under a load for an operator that is positive but not symmetric, by an interior-point method.

Pressure ``p`` and separation ``w = g + K p - level`` are sought with ``p >= 0``, ``w >= 0``, ``p w = 0`` in each cell,
and a given sum of ``p``. A monotone complementarity problem of this kind is no minimum of an energy, so that conjugate
gradients do not apply, and sets of cells in contact need not settle where the skew part of ``K`` is large. The
interior-point method of Mehrotra [1]_ does not need either: ``p`` and ``w`` stay positive in all cells, and their
product is driven to zero by Newton's method. Five to thirty iterations do, from materials without loss to loss tangents
of a thousand.

1. Each iteration solves two linear systems ``(K + D) dp - dlevel = r``, ``sum dp = 0`` with ``D = w / p``, which is
   near zero in contact and large elsewhere. GMRES [2]_ is preconditioned by ``S F^-1 (1/K_q) F S`` where the inverse
   symbol acts in contact (``S = k / (k + D)`` is near one there, ``k`` the influence of a cell on itself) and the
   diagonal elsewhere.
2. The systems are scaled by ``(k + D)^(-1/2)``. In that scale a residual of ``sqrt(p.w)`` changes the products ``p w``
   by as much as they are, and one of ``p.w / sqrt(k p.p)`` the duality gap: GMRES stops at a part of both.
3. The first system of an iteration is Newton's step to the solution itself. What it changes is the error of the
   pressure that it starts from, to second order: this is the error that is stated.

References
----------
.. [1] S. Mehrotra, SIAM J. Optim. 2 (1992) 575.
.. [2] Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Linear = Callable[[Array], Array]

# Residual that GMRES leaves, over those of note 2. Measured on line contacts with loss tangents up to 27: 0.1 and 0.3
# cost alike, 1 does not always converge.
_FORCING = 0.3
# The same over the right-hand side: at most, and where the step states the error of an accepted pressure.
_LOOSEST, _STATED = 0.5, 0.05
# Vectors after which GMRES restarts, and in all.
_RESTART, _MOST_VECTORS = 60, 300
# A vector of which less is left beside the others is made orthogonal once more.
_LEFT = 0.1
# Part of the way to the border of the feasible set.
_INSIDE = 0.995
# Least separation at the start, over the range of the gap.
_START = 0.3


@dataclass(frozen=True)
class Solution:
    """Pressure that solves the complementarity problem, or the last one found.

    Attributes
    ----------
    pressure : ndarray, shape (nx, ny)
        Not negative, exactly zero out of contact, with the sum asked for. [Pa]
    correction : ndarray, shape (nx, ny)
        What Newton's step adds to it: its error, estimated. [Pa]
    converged : bool
        Whether the error is accepted.
    iterations, vectors : int
        Interior-point iterations, and vectors of GMRES in all.
    """

    pressure: Array
    correction: Array
    converged: bool
    iterations: int
    vectors: int


def solve_complementarity(
    displacement: Linear,
    inverse: Linear,
    self_influence: float,
    gap: Array,
    total: float,
    accepts: Callable[[Array, Array], bool],
    *,
    max_iterations: int = 100,
) -> Solution:
    """Pressure under a load.

    Parameters
    ----------
    displacement : callable
        The operator ``K``: displacement of a pressure field. Its symmetric part must be positive on fields without
        mean. [Pa -> m]
    inverse : callable
        About its inverse on the whole grid. [m -> Pa]
    self_influence : float
        Displacement of a cell under unit pressure on that cell alone. [m/Pa]
    gap : ndarray, shape (nx, ny)
        Undeformed gap. [m]
    total : float
        Sum of the pressure, positive. [Pa]
    accepts : callable
        Given a pressure and its correction, whether the pressure is accurate enough.
    max_iterations : int
        The pressure reached by then is returned as not converged.

    Returns
    -------
    Solution
    """
    cells = gap.size
    pressure = np.full(gap.shape, total / cells)
    if np.ptp(gap) == 0:
        return Solution(pressure, np.zeros_like(gap), True, 0, 0)
    opening = gap + displacement(pressure)
    level = float(opening.min()) - _START * float(np.ptp(opening))
    separation = opening - level
    vectors = 0
    for iteration in range(max_iterations + 1):
        products = float(np.sum(pressure * separation))
        system = _System(displacement, inverse, self_influence, separation / pressure)
        unbalanced = opening - level - separation
        energy = self_influence * float(np.sum(pressure**2))
        enough = _FORCING * min(math.sqrt(products), products / math.sqrt(energy))

        # Newton's step to the solution: the predictor
        newton = -separation - unbalanced
        step, change, count = system.solve(newton, enough)
        vectors += count
        contact = (pressure * self_influence > separation) | (separation == separation.min())
        found = np.where(contact, pressure, 0.0)
        found *= total / float(found.sum())
        correction = pressure + step - found
        converged = accepts(found, correction)
        if converged:
            step, change, count = system.solve(newton, enough, _STATED, start=step)
            vectors += count
            correction = pressure + step - found
            converged = accepts(found, correction)
        if converged or iteration == max_iterations:
            break
        widening = -separation - separation / pressure * step
        length = min(_longest(pressure, step), _longest(separation, widening))
        reached = float(np.sum((pressure + length * step) * (separation + length * widening)))
        centring = (reached / products) ** 3 * products / cells

        # the corrector: what the predictor left out, and towards equal products
        more = (centring - step * widening) / pressure
        added, change_added, count = system.solve(more, enough)
        vectors += count
        step += added
        change += change_added
        widening += more - separation / pressure * added
        length = min(1.0, _INSIDE * min(_longest(pressure, step), _longest(separation, widening)))
        pressure += length * step
        pressure *= total / float(pressure.sum())
        separation += length * widening
        level += length * change
        opening = gap + displacement(pressure)
    return Solution(found, correction, converged, iteration, vectors)


def _longest(values: Array, step: Array) -> float:
    """Longest part of a step, up to the whole, after which positive values are not negative."""
    shrinking = np.flatnonzero(step < 0)
    return min(1.0, -float(np.maximum.reduce(values.take(shrinking) / step.take(shrinking), initial=-math.inf)))


class _System:
    """The linear system of an iteration (notes 1 and 2).

    Parameters
    ----------
    displacement, inverse : callable
        ``K``, and about its inverse.
    self_influence : float
        [m/Pa]
    stiffness : ndarray, shape (nx, ny)
        The diagonal ``D``. [m/Pa]
    """

    def __init__(self, displacement: Linear, inverse: Linear, self_influence: float, stiffness: Array) -> None:
        self._displacement, self._inverse, self._diagonal = displacement, inverse, stiffness
        both = self_influence + stiffness
        self._scale = 1 / np.sqrt(both)
        self._inside = self_influence / both
        self._outside = (1 - self._inside**2) / both
        uniform = self._about_inverse(np.ones_like(both))
        self._uniform = uniform / float(uniform.sum())

    def solve(
        self, right: Array, enough: float, relative: float = _LOOSEST, start: Array | None = None
    ) -> tuple[Array, float, int]:
        """Change of the pressure and of the level, and the vectors that it took, for a right-hand side."""
        scaled = self._scale * (right - self._level(right))
        enough = min(enough, relative * float(np.sqrt(np.sum(scaled**2))))
        known = None if start is None else start / self._scale
        solution, count = gmres(self._apply, self._precondition, scaled, enough, known)
        step = self._scale * solution
        level = self._level(self._displacement(step) + self._diagonal * step - right)
        return step, level, count

    def _apply(self, scaled: Array) -> Array:
        step = self._scale * scaled
        found = self._displacement(step)
        found += self._diagonal * step
        found -= self._level(found)
        found *= self._scale
        return found

    def _precondition(self, scaled: Array) -> Array:
        step = self._about_inverse(scaled / self._scale)
        step -= float(np.add.reduce(step, axis=None)) * self._uniform  # the load does not change
        step /= self._scale
        return step

    def _about_inverse(self, field: Array) -> Array:
        found = self._inverse(self._inside * field)
        found *= self._inside
        found += self._outside * field
        return found

    def _level(self, field: Array) -> float:
        return float(np.add.reduce(field * self._uniform, axis=None))


def gmres(
    operator: Linear, preconditioner: Linear, right: Array, enough: float, start: Array | None = None
) -> tuple[Array, int]:
    """Solution of a linear system by restarted GMRES, preconditioned from the right.

    Parameters
    ----------
    operator, preconditioner : callable
        The system, and about its inverse.
    right : ndarray
        Right-hand side.
    enough : float
        Norm of the residual at which it ends.
    start : ndarray, optional
        First guess of the solution; zero otherwise.

    Returns
    -------
    ndarray
        The solution.
    int
        Applications of the preconditioner and of the operator.

    References
    ----------
    .. [1] Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856.
    """
    solution = np.zeros_like(right) if start is None else start.copy()
    residual, count = right if start is None else right - operator(start), 0
    while True:
        norm = float(np.sqrt(np.sum(residual**2)))
        if norm <= enough or count >= _MOST_VECTORS:
            return solution, count
        basis = np.empty((_RESTART + 1, right.size))
        basis[0] = residual.ravel() / norm
        triangle, left = np.zeros((_RESTART + 1, _RESTART)), np.zeros(_RESTART + 1)
        left[0] = norm
        turns: list[tuple[float, float]] = []
        for k in range(_RESTART):
            vector = operator(preconditioner(basis[k].reshape(right.shape))).ravel()
            count += 1
            length = math.inf
            while True:  # Gram and Schmidt, once more where little is left
                along = np.einsum("ki,i->k", basis[: k + 1], vector)
                vector -= np.einsum("ki,k->i", basis[: k + 1], along)
                triangle[: k + 1, k] += along
                before, length = length, float(np.sqrt(np.einsum("i,i->", vector, vector)))
                if before < math.inf or length > _LEFT * float(np.sqrt(np.sum(along**2))):
                    break
            for i, (cosine, sine) in enumerate(turns):
                a, b = triangle[i, k], triangle[i + 1, k]
                triangle[i, k], triangle[i + 1, k] = cosine * a + sine * b, cosine * b - sine * a
            diagonal = math.hypot(triangle[k, k], length)
            turns.append((triangle[k, k] / diagonal, length / diagonal))
            triangle[k, k] = diagonal
            left[k], left[k + 1] = turns[k][0] * left[k], -turns[k][1] * left[k]
            if abs(left[k + 1]) <= enough or count >= _MOST_VECTORS:
                break
            basis[k + 1] = vector / length
        weights = np.linalg.solve(triangle[: k + 1, : k + 1], left[: k + 1])
        change = np.einsum("ki,k->i", basis[: k + 1], weights).reshape(right.shape)
        solution += preconditioner(change)
        if abs(left[k + 1]) <= enough or count >= _MOST_VECTORS:
            return solution, count
        residual = right - operator(solution)
