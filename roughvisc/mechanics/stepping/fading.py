"""What is left at a kept time of the error that a step makes: it fades as the material relaxes.

The error of a step is that of pressure taken as linear in it. Its displacement must be taken back by later pressure, so
that it fades by the relaxation of the material, much faster than by creep. With an error ``e_i`` in each internal
variable and ``eps`` in the pressure, ``C_0 eps + sum w_i e_i = 0`` while contact stays, and in the symmetric variables
``y_i = e_i sqrt(w_i / (g_i C_0))``

    ``y' = -S y + b d``,    ``S = diag(r) + b b^T``,    ``b_i = sqrt(g_i w_i / C_0)``,    ``eps = -b . y``,

with the error ``d`` of the interpolation, ``g_i = r_i = 1 / tau_i``, and ``g = 1``, ``r = 0`` for a fluidity.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.materials.prony import Prony

Array = NDArray[np.float64]

# Ages at which the weight of a step is tabulated, over the shortest time of the material, and how many in a decade.
_YOUNGEST, _PER_DECADE = 1e-4, 12
# Part of what is allowed that the last step before a kept time may take by what it gets wrong of its own end.
_LAST = 0.06


class Fading:
    """How the errors of steps fade.

    Parameters
    ----------
    series : Prony
        The material, with an instantaneous compliance.
    duration : float
        No age is longer. [s]
    """

    def __init__(self, series: Prony, duration: float) -> None:
        times, weights = np.array(series.times), np.array(series.compliances)
        rates = gains = 1 / times
        if series.fluidity:
            rates, gains = np.append(rates, 0.0), np.append(gains, 1.0)
            weights = np.append(weights, series.fluidity)
        driven = np.sqrt(gains * weights / series.glassy)
        self._times, self._flows = times, bool(series.fluidity)
        decays, basis = np.linalg.eigh(np.diag(rates) + np.outer(driven, driven))
        self._decays = np.maximum(decays, 0.0)  # it is no less than that, to rounding
        self._driven = driven @ basis
        self._read = basis.T * np.sqrt(weights / (gains * series.glassy))
        fastest = 1 / float(self._decays.max())
        decades = max(np.log10(duration / (_YOUNGEST * fastest)), 1.0)
        self._ages = np.geomspace(_YOUNGEST * min(fastest, duration), duration, int(_PER_DECADE * decades))
        rate = np.maximum(np.exp(-np.outer(self._ages, self._decays)) @ self._driven**2, 0.0)
        self._left, root = rate / float(self._driven @ self._driven), np.cbrt(rate)
        past = np.cumsum(0.5 * (root[1:] + root[:-1]) * np.diff(self._ages))
        weight = root**2 * np.append(0.0, past)
        self._weights = np.maximum.accumulate(weight[::-1])[::-1]  # at this kept time or a later one

    def remaining(self, left: float) -> float:
        """Part of an error of the pressure that is left after a time. [s]"""
        return float(np.interp(left, self._ages, self._left))

    def weight(self, left: float, step: float) -> float:
        """Largest part of the error of a step that is left at a kept time.

        Parameters
        ----------
        left : float
            From the start of the step to the next kept time. [s]
        step : float
            Its length. [s]

        Notes
        -----
        The fewest steps that keep to what is allowed at a kept time err by what is left of that over
        ``rho(theta)^(2/3) int_0^theta rho^(1/3)`` each, with the rate ``rho(t) = b exp(-S t) b`` at which an error
        fades. What is left of it is not counted: it is taken as all. Steps that all use up what they may come to two
        to four times as much, and those of a march stay well below that, since their lengths double at most. What a
        step gets wrong of its own end does not follow from its mean error, and is asked for besides.
        """
        mean = float(np.interp(left, self._ages, self._weights))
        x = step / self._times
        small, large = np.minimum(x, 0.1), np.maximum(x, 0.1)
        kick = np.where(x < 0.1, small / 6 * (1 - small / 2), ((large - 2) + (large + 2) * np.exp(-large)) / large**2)
        if self._flows:
            kick = np.append(kick, step / 6)
        end = 6 * float(self._driven * np.exp(-self._decays * max(left - step, 0.0)) @ (self._read @ kick))
        return max(mean, abs(end) / _LAST)


@lru_cache(maxsize=8)
def fading(series: Prony, duration: float) -> Fading:
    """Of a material in a program; asked for at every step."""
    return Fading(series, duration)
