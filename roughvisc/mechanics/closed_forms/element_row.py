"""The row of independent elements of the MDR under an axisymmetric indenter, and its equilibrium in one step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError
from roughvisc.mechanics.closed_forms.indenters import Indenter

Array = NDArray[np.float64]


class OutOfElements(Exception):
    """The contact reached the last element."""


class ElementRow:
    """The elements: where they are, and the equilibrium of a step.

    The edge of the contact becomes an element after every step: forces have kinks there and nowhere else.
    """

    def __init__(self, indenter: Indenter, outermost: float, count: int, capacity: int):
        self.x = np.zeros(capacity)
        self.x[:count] = outermost * (np.arange(count) / (count - 1)) ** 2
        self.g = np.zeros(capacity)
        self.g[:count] = indenter.reduced(self.x[:count])
        self.indenter = indenter
        self.count = count
        self.order = np.arange(count)

    def area(self, x: Array, y: Array, level: float) -> tuple[float, float]:
        """``int (level - y)_+ dx`` of the interpolant, and the length over which it is positive."""
        d = level - y
        d0, d1, width = d[:-1], d[1:], np.diff(x)
        low, high = np.minimum(d0, d1), np.maximum(d0, d1)
        crossing = (low < 0) & (high > 0)
        share = np.where(crossing, high / np.where(crossing, high - low, 1.0), high > 0)
        total = np.where(crossing, high * share, np.where(high > 0, d0 + d1, 0.0)) @ width / 2
        return float(total), float(share @ width)

    def level_for(self, x: Array, y: Array, area: float, guess: float) -> float:
        """Level under which the interpolant encloses an area: Newton's method on a convex function."""
        bottom, top = float(np.min(y)), float(np.max(y))
        if self.area(x, y, top)[0] < area:
            raise OutOfElements
        level = guess if bottom < guess < top else top
        for _ in range(200):
            found, slope = self.area(x, y, level)
            step = (area - found) / slope if slope > 0 else np.inf
            before, level = level, min(level + step, top)  # a hardly touching start would throw it far away
            if abs(level - before) <= 4e-16 * (abs(level) + abs(bottom)):
                break
        return max(level, bottom)


def edge(x: Array, y: Array, level: float, strict: bool) -> tuple[int, float]:
    """Index of the last touching element and the radius; (-1, 0) where nothing touches."""
    touching = level > y
    if not touching.any():
        return -1, 0.0
    last = int(len(y) - 1 - np.argmax(touching[::-1]))
    if last == len(y) - 1:
        raise OutOfElements
    depth = level - y[: last + 1]
    if strict and np.any(depth < -0.01 * np.max(depth)):
        raise ConvergenceError("the contact is no longer a disc: the reduction to independent elements does not hold")
    return last, float(x[last] + (x[last + 1] - x[last]) * depth[-1] / (y[last + 1] - y[last]))
