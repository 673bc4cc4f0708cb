r"""The paper's algorithm with its slips corrected, not accelerated: the reference for speed and accuracy.

"A robust algorithm for the contact of viscoelastic materials" presses a profile step by step: rectangle rule in
time, one convolution for each past increment of pressure, plain conjugate gradients from a uniform first guess with
all cells in contact, stopped when the pressure stagnates. The printed equations do not work as they stand; numbered
notes say where this code leaves them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.materials.models import Prony
from roughvisc.mechanics.sparse import Sparse, Sum
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.mechanics.stepping.state import UNKNOWN, Instant, State, Step
from roughvisc.mechanics.stepping.step import at_edge, edge_error, work_between

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SeedSolution:
    """Pressure [Pa], its displacement [m], the level [m], what it took, and whether the pressure stagnated."""

    pressure: Array
    displacement: Array
    level: float
    iterations: int
    convolutions: int
    stagnated: bool


def conjugate_gradients(
    operator: Operator,
    gap: Array,
    compliance: float,
    load: float,
    *,
    epsilon: float = 1e-5,
    sign: float = 1.0,
    max_iterations: int = 3000,
) -> SeedSolution:
    """Constrained conjugate gradients of the seed paper, equations (6) to (16).

    Parameters
    ----------
    operator : Operator
        Grid and boundary.
    gap : ndarray, shape (nx, ny)
        Gap without the present pressure. [m]
    compliance : float
        Contact compliance of the present step, ``C(0)``. [1/Pa]
    load : float
        Normal force. [N]
    epsilon : float
        Stop when the pressure changes by less than this part of the load, equation (16).
    sign : float
        Of the conjugation in equation (9); -1 is the printed one, which stalls.
    max_iterations : int
        Give up then.
    """
    area = operator.cell_area
    # 1. The uniform first guess, all cells in contact.
    pressure = np.full(gap.shape, load / (area * gap.size))
    direction = np.zeros_like(gap)
    old_norm, restart = 1.0, True
    iterations, convolutions, stagnated = 0, 0, False
    while iterations < max_iterations and not stagnated:
        iterations += 1
        contact = pressure > 0
        displacement = compliance * operator.displacement(pressure)
        convolutions += 1
        opening = gap + displacement
        opening -= float(np.mean(opening[contact]))  # 2. (7): the mean is over the contact, not over all cells
        residual = np.where(contact, opening, 0.0)
        norm = float(np.sum(residual**2))
        if norm == 0:
            stagnated = True
            break
        # 3. (9) is printed with a minus. With r the gradient of (8) and the update p - alpha d of (12) the sign is
        #    plus, as in Polonsky and Keer; with the minus Hertz contact stalls.
        factor = 0.0 if restart else sign * norm / old_norm
        direction = np.where(contact, residual + factor * direction, 0.0)
        old_norm = norm
        # 4. (11) uses the kernel at lag k; the operator of the present step is the one at lag 0. With the printed
        #    one the step is Phi(k dt)/Phi(0) times too short, and (16) then stops far from the solution.
        change = compliance * operator.displacement(direction)
        convolutions += 1
        change -= float(np.mean(change[contact]))  # (10), over the contact
        curvature = float(np.sum(direction * change))
        length = float(np.sum(residual * direction)) / curvature if curvature else 0.0
        previous = pressure
        pressure = np.maximum(pressure - length * direction, 0)  # (12), (13)
        penetrating = (pressure == 0) & (opening < 0)  # (14)
        pressure[penetrating] -= length * opening[penetrating]
        restart = bool(penetrating.any())
        # 5. (15) and (16) miss the cell's area.
        total = float(np.sum(pressure)) * area
        if total == 0:
            pressure = previous
            break
        pressure *= load / total
        stagnated = float(np.sum(np.abs(pressure - previous))) * area <= epsilon * load
    displacement = compliance * operator.displacement(pressure)
    convolutions += 1
    contact = pressure > 0
    level = float(np.mean((gap + displacement)[contact]))
    return SeedSolution(pressure, displacement, level, iterations, convolutions, stagnated)


def check_stability(material: Prony, step: float) -> None:
    """Refuse steps in which the rectangle rule is unstable.

    Raises
    ------
    InputError
        Unless ``sum J_i tanh(h / 2 tau_i) + phi h / 2 < J_0``.
    """
    growth = sum(c * math.tanh(step / (2 * t)) for c, t in zip(material.compliances, material.times, strict=True))
    growth += material.fluidity * step / 2
    if not growth < material.glassy:
        raise InputError(
            f"method='seed' is unstable with a time step of {step:g} s: sum J_i tanh(h / 2 tau_i) + phi h / 2 is "
            f"{growth:.3g} 1/Pa, expected less than the instantaneous compliance {material.glassy:.3g} 1/Pa; "
            "take a smaller time_step or method='fast'"
        )


def march_seed(scene: Scene) -> Iterator[Step]:
    """Press a profile as the seed paper does, in steps like those of :func:`~roughvisc.mechanics.stepping.march.march`.

    Parameters
    ----------
    scene : Scene
        What is prescribed: load control only, all cells present, an exponential series with a glassy part.
        ``scene.time_step`` None: a hundredth of the program.

    Raises
    ------
    InputError
        If the scene holds what the seed paper does not treat, or a step is unstable.
    """
    material = scene.material
    if not isinstance(material, Prony) or material.glassy == 0:
        raise InputError("method='seed' needs an exponential series with an instantaneous compliance")
    if any(s.control != "load" for s in scene.program.segments) or scene.present is not None:
        raise InputError("method='seed' treats given loads and complete surfaces only; use method='fast'")
    largest_step = scene.time_step or scene.program.duration / 100
    state = State(Instant(0.0, Sparse.whole(np.zeros_like(scene.gap)), 0.0, 0.0), np.zeros_like(scene.gap), None)
    if scene.program.segments and scene.program.segments[0].duration > 0:
        nothing, unknown = np.zeros_like(scene.gap), math.nan
        yield Step(
            state.now, Sum.whole(nothing), None, 0.0, "load", True, unknown, unknown, unknown, UNKNOWN, scene, state
        )
    increments: list[tuple[float, Array]] = []  # 6. (5) starts at n = 1, with no pressure before it
    for index, segment in enumerate(scene.program.segments):
        state = replace(state, segment=index, began=state.now.time, start=state.now.force)
        end = scene.program.corners[index + 1]
        following = scene.program.segments[index + 1 : index + 2]
        while True:
            event = min(scene.next_kept(state.now.time), end)
            distance = event - state.now.time
            steps = max(1, math.ceil(distance / largest_step * (1 - 1e-9)))
            length = distance / steps
            check_stability(material, length)
            for n in range(1, steps + 1) if distance > 0 else [1]:
                time = event if n == steps else event - (steps - n) * length
                load = segment.value(time - state.began, state.start)
                state, step = _advance(scene, material, state, increments, time, load)
                last = time == end and following and following[0].duration == 0
                if not last:
                    yield step
            if event == end:
                break


def _advance(
    scene: Scene, material: Prony, state: State, increments: list[tuple[float, Array]], time: float, load: float
) -> tuple[State, Step]:
    """One step: the displacement of every past increment, then the contact under the present load."""
    operator = scene.operator
    glassy = float(material.contact_compliance(0.0))
    past = np.zeros_like(scene.gap)
    for applied, increment in increments:
        # 7. (5): an increment "acted at n dt" is one applied then and kept; its lag is k - n, zero for the present
        #    one, whose compliance is therefore C(0) also in (17).
        past += operator.displacement(float(material.contact_compliance(time - applied)) * increment)
    past -= glassy * operator.displacement(state.now.pressure)
    gap = scene.gap + past
    if load == 0:
        solution = SeedSolution(np.zeros_like(gap), np.zeros_like(gap), float(np.min(gap)), 0, 0, True)
    else:
        solution = conjugate_gradients(operator, gap, glassy, load, epsilon=1e-2 * scene.tolerance)
    if not solution.stagnated:
        raise ConvergenceError(
            f"at {time:.6g} s the contact is not solved after {solution.iterations} iterations: try a looser tolerance "
            "or method='fast'"
        )
    contact = Sparse.whole(solution.pressure)
    if at_edge(scene, contact):
        raise edge_error(scene, time)
    increments.append((time, solution.pressure - state.now.pressure))
    now = Instant(time, contact, load, solution.level)
    displacement = past + solution.displacement
    state = replace(
        state,
        now=now,
        displacement=displacement,
        largest_force=max(state.largest_force, load),
        largest_approach=max(state.largest_approach, abs(solution.level)),
        work=state.work + work_between(scene, state, now.pressure, displacement),
        iterations=state.iterations + solution.iterations,
        convolutions=state.convolutions + solution.convolutions + len(increments),
    )
    return state, Step(
        shown=now,
        displaced=Sum.whole(displacement),
        effective=None,
        level=solution.level,
        control="load",
        given=True,
        bound=math.nan,
        solver_error=math.nan,
        solver_error_approach=math.nan,
        uncertainty=UNKNOWN,
        scene=scene,
        state=state,
    )
