"""Time steps of the MDR solution: a grid in time that resolves every decade of the material."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.materials.models import Material, Prony
from roughvisc.mechanics.stepping.program import Segment

Array = NDArray[np.float64]


def instants_of(segment: Segment, start: float, stops: Array, steps: int, refine: int, fastest: float) -> Array:
    """Instants after the start of a segment: fine after the corner, landing on the stops, nested when refined."""
    length = segment.duration
    if length == 0:
        return np.zeros(16 * refine)
    if segment.amplitude:  # uniform but for the first quarter of a period
        steps = int(np.ceil(steps * max(1.0, length / segment.period)))
        bend = min(segment.period / (2 * length), 0.5)

        def instant(u: Array) -> Array:
            return np.where(u < bend, u**2 / (2 * bend), u - bend / 2) / (1 - bend / 2)

    else:  # quadratic, then exponential, so that all decades down to the fastest mode are seen
        stretch = np.arcsinh(np.sqrt(min(max(1.0, length / fastest), 1e12)))
        closing = segment.control == "load" and segment.end == 0  # quadratic again where the contact vanishes

        def instant(u: Array) -> Array:
            if closing:
                u = u * (2 - u)
            return np.asarray((np.sinh(stretch * u) / np.sinh(stretch)) ** 2)

    fine = np.linspace(0, 1, 20001)
    inner = [stop - start for stop in stops if start < stop < start + length]
    marks = [0.0, *(np.interp(np.array(inner) / length, instant(fine), fine) if inner else []), 1.0]
    instants = []
    for (u0, u1), (t0, t1) in zip(pairwise(marks), pairwise([0.0, *inner, length]), strict=True):
        count = refine * max(1, int(np.ceil(steps * (u1 - u0) - 1e-9)))
        part = instant(u0 + (u1 - u0) * np.arange(count + 1) / count)
        instants.append(t0 + (t1 - t0) * (part[1:] - part[0]) / (part[-1] - part[0]))
        instants[-1][-1] = t1
    return np.concatenate(instants)


def fastest_change(material: Material) -> float:
    """Shortest time on which a material changes; infinite if unknown. [s]"""
    if not isinstance(material, Prony):
        return np.inf
    times = list(material.times)
    if material.glassy:
        times += list(material.relaxation_spectrum()[2])
    return min(times, default=np.inf)


def same_instant(times: Array, instant: float) -> NDArray[np.bool_]:
    """Which of the times an instant is: a time less the start of its segment, plus that, may be a rounding off."""
    return np.abs(times - instant) <= 4 * np.finfo(float).eps * times
