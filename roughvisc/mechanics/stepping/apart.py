"""Time of first contact of surfaces that are apart, by root finding.

A surface that carries no pressure recovers: the approach at which it would be touched never rises. What is prescribed
is monotone between the turns of a cycle. Both bound the crossing on any interval, so that no contact is missed.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain

from roughvisc.mechanics.stepping.program import Segment
from roughvisc.mechanics.stepping.scene import Scene, State

# Times are found to this part of the way to the next event.
_RESOLVED = 1e-9
# Surfaces that are apart for less than this part of the way touch at once.
_AT_ONCE = 1e-6


def closing_time(
    scene: Scene, state: State, segment: Segment, event: float, touched: Callable[[float], float]
) -> float:
    """Time up to which the surfaces, apart now, stay apart; the present time if they touch at once. [s]

    Parameters
    ----------
    scene, state, segment : Scene, State, Segment
        What is prescribed, and how far it has come.
    event : float
        No later than this. [s]
    touched : callable
        Approach at which the surfaces would just touch at a time to come. [m]
    """
    now = state.now.time
    if segment.control == "load":
        return event if segment.is_nothing(state.start) else now
    # the undeformed surface is the lowest that it recovers to
    if segment.highest(state.start) <= min(scene.lowest(scene.gap), scene.outside):
        return event

    def prescribed(time: float) -> float:
        return segment.value(time - state.began, state.start)

    def limit(time: float) -> float:
        return min(touched(time), scene.outside)

    shortest = _RESOLVED * (event - now)
    turns = (state.began + t for t in segment.turns(now - state.began, event - state.began))
    begin = now
    for end in chain(turns, (event,)):
        crossing = _first_crossing(prescribed, limit, begin, end, shortest)
        if crossing is not None:
            return crossing if crossing - now > _AT_ONCE * (event - now) else now
        begin = end
    return event


def _first_crossing(
    prescribed: Callable[[float], float], limit: Callable[[float], float], begin: float, end: float, shortest: float
) -> float | None:
    """A time just before what is prescribed, monotone here, first exceeds a limit that never rises; None if never."""
    pending = [(begin, end)]
    while pending:
        first, last = pending.pop()
        lowest = limit(last)
        if max(prescribed(first), prescribed(last)) <= lowest:
            continue  # nowhere between can it be exceeded
        if last - first <= shortest:
            if prescribed(last) > lowest:
                return first
            continue
        middle = 0.5 * (first + last)
        pending += [(middle, last), (first, middle)]
    return None
