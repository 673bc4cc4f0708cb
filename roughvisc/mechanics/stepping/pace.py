"""State of the step length control: suggested length, sharpness, rejected error.

It knows nothing of surfaces and materials: estimated errors, what of them is allowed, and lengths are all it is told.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

# A step that is tried again is shortened to meet what is allowed, of which it aims at the square of the first number,
# and within the other two. The third is taken where there is no estimate.
_AIM, _SHORTEST, _LONGEST = 0.7, 0.2, 0.5
# A shorter step whose error is above this part of the longer one's was in vain: halving it gains a factor of two at
# least, unless a cell enters, which makes the pressure jump however short the step is.
_IN_VAIN = 0.93
# Steps are shortened where what is stated exceeds the first part of the tolerance and has grown by more than a factor
# since it was last told, and lengthened again where it is below the second part. Their share stays between two limits.
_MOST_USED, _LEAST_USED = 0.7, 0.3
_GROWING, _SHARPEST, _BLUNTEST = 1.03, 0.125, 1.0


@dataclass(frozen=True)
class ControllerState:
    """What the choice of the next step remembers.

    Attributes
    ----------
    suggestion : float
        Length of the next step; zero after an event. [s]
    sharpness : float
        Part of their usual share of the tolerance that steps may use, by what those so far have come to. [-]
    blind : bool
        Whether the next estimate leaves the pressure out, once.
    rejected_error : float
        Estimate of the last attempt at the present step, if it was rejected; else infinite. [-]
    """

    suggestion: float = 0.0
    sharpness: float = 1.0
    ignore_pressure_error: bool = False
    rejected_error: float = math.inf

    def shortening_failed(self, error: float) -> bool:
        """Whether a shorter step was hardly better than the one that was rejected before."""
        return error > _IN_VAIN * self.rejected_error

    def rejected(self, length: float, error: float, allowed: float) -> ControllerState:
        """After a step of some length [s] whose error, NaN where there is no estimate, is not allowed."""
        if math.isnan(error):
            return replace(self, suggestion=_SHORTEST * length, rejected_error=math.inf)
        shrink = min(max(_AIM * math.sqrt(allowed / error), _SHORTEST), _LONGEST)
        return replace(self, suggestion=shrink * length, rejected_error=error)

    def accepted(self, suggestion: float, error: float, allowed: float, fresh: bool) -> ControllerState:
        """After an accepted step; ``fresh``: it was the first after an event, and the second one judges it.

        Where it was accepted since shortening was in vain, the pressure has jumped: the next estimate would see that
        jump once more.
        """
        ignored = self.shortening_failed(error) and error > allowed
        rejected_error = self.rejected_error if fresh else math.inf
        return replace(self, suggestion=suggestion, ignore_pressure_error=ignored, rejected_error=rejected_error)

    def with_pressure_error(self) -> ControllerState:
        """After a step: the next estimate sees the pressure."""
        return replace(self, ignore_pressure_error=False)

    def after_event(self, suggestion: float = 0.0) -> ControllerState:
        """Where nothing is extrapolated, with the length of the next step if it is known. [s]"""
        return replace(self, suggestion=suggestion)

    def sharpened(self, used: float, earlier: float) -> ControllerState:
        """By what is stated, over the tolerance, now and when it was last told."""
        if used > _MOST_USED and used > _GROWING * earlier:  # what stays whatever the steps is none of their doing
            wanted = max(_MOST_USED / used, 0.5)
        elif used < _LEAST_USED:
            wanted = 1.5
        else:
            return self
        # in steps of sqrt(2): what rounding does to small differences must not show in the length of steps
        wanted = 2 ** (0.5 * round(2 * math.log2(wanted)))
        return replace(self, sharpness=min(max(self.sharpness * wanted, _SHARPEST), _BLUNTEST))
