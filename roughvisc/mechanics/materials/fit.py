"""What a fit leaves unknown of a material: its rows left out in turn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import scipy  # which imports a submodule when it is first used
from numpy.typing import ArrayLike, NDArray

from roughvisc.mechanics.materials.spectrum import lattice

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Groups of rows, each of which is left out once, and the fewest that tell anything.
_GROUPS, _FEWEST = 10, 4
#: Instants in a decade, and over how many decades their variances are averaged: that of one instant is of few draws.
_INSTANTS, _WIDTH = 10, 1.0


def _compliance(material: Response, times: Array) -> Array:
    return np.asarray(material.contact_compliance(times))


class Response(Protocol):
    """What is refitted: anything with a contact compliance."""

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Contact compliance. [1/Pa]"""


Property = Callable[[Any, Array], Array]


@dataclass(frozen=True, eq=False)
class Fit:
    r"""A material's measurement, and what it leaves unknown.

    Parameters
    ----------
    refit : callable
        Material from some of the rows, by a mask over them.
    rows : int
        Number of rows, in the order of their times.
    measured : tuple of float
        First and last of the times that they tell of. [s]
    complaint : str
        What is wrong with the measurement; empty if nothing is.
    misfit : float
        Relative error that the complaint makes, whatever rows are left out.
    time_factor : float
        By which all times are longer than those measured: a shift to another temperature.
    keeps_ends : bool
        Whether the first and the last row stay: what interpolates ends there.

    Notes
    -----
    Each of ten interleaved groups of rows is left out once. The logarithms of the contact compliance of the ten
    materials have the jackknife variance [1]_ :math:`\frac{9}{10} \sum (x_k - \bar x)^2`, averaged over half a decade
    to each side; its root times Student's 2.26 is the error at 95 %. An error that all rows share, as that of a
    gauge length, does not show in it.

    References
    ----------
    .. [1] B. Efron and C. Stein, Ann. Statist. 9 (1981) 586.
    """

    refit: Callable[[Mask], Response]
    rows: int
    measured: tuple[float, float]
    complaint: str = ""
    misfit: float = 0.0
    time_factor: float = 1.0
    keeps_ends: bool = False

    def error(self, times: ArrayLike, of: Property = _compliance) -> Array:
        """Relative error of the modulus at 95 %, at times [s]; beyond the measured ones that at their end.

        Missing where there are too few rows. ``of`` gives another property of a material at times, which must not be
        negative and adds up for two bodies.
        """
        t = np.clip(np.asarray(times, dtype=float) / self.time_factor, *self.measured)
        at, error = self._errors if of is _compliance else self._errors_of(of)
        return np.asarray(np.hypot(np.interp(np.log(t), np.log(at), error), self.misfit))

    def span(self) -> tuple[float, float]:
        """First and last of the times that the rows tell of, of the shifted material. [s]"""
        return self.measured[0] * self.time_factor, self.measured[1] * self.time_factor

    def shifted(self, factor: float) -> Fit:
        """That of the material with all times multiplied."""
        return replace(self, time_factor=factor * self.time_factor)

    @cached_property
    def _refitted(self) -> list[Response]:
        """The materials without each group of rows."""
        order = np.arange(self.rows)
        free = order[1:-1] if self.keeps_ends else order
        groups = [free[start::_GROUPS] for start in range(min(_GROUPS, free.size))]
        return [self.refit(~np.isin(order, out)) for out in groups] if len(groups) >= _FEWEST else []

    @cached_property
    def _errors(self) -> tuple[Array, Array]:
        return self._errors_of(_compliance)

    def _errors_of(self, of: Property) -> tuple[Array, Array]:
        """Instants [s], and the error at each."""
        at = lattice(*self.measured, _INSTANTS)
        count = len(self._refitted)
        if not count:
            return at, np.full(at.size, np.nan)
        logarithms = np.log(np.maximum([of(one, at) for one in self._refitted], 1e-300))
        variance = (count - 1) / count * np.sum((logarithms - logarithms.mean(axis=0)) ** 2, axis=0)
        near = np.abs(np.log10(at[:, None] / at)) <= _WIDTH / 2
        return at, float(scipy.special.stdtrit(count - 1, 0.975)) * np.sqrt((near @ variance) / near.sum(axis=1))


@dataclass(frozen=True, eq=False)
class PairFit:
    """That of two bodies whose contact compliances add.

    Parameters
    ----------
    bodies : tuple
        Contact compliance and fit of each; None for one that is no fit.
    """

    bodies: tuple[tuple[Response, Fit | PairFit | None], ...]
    time_factor: float = 1.0

    @property
    def complaint(self) -> str:
        """What is wrong with the measurements."""
        return "; ".join(fit.complaint for _, fit in self.bodies if fit is not None and fit.complaint)

    def error(self, times: ArrayLike) -> Array:
        """As :meth:`Fit.error`; those of the bodies are independent."""
        t = np.asarray(times, dtype=float) / self.time_factor
        parts = [np.asarray(body.contact_compliance(t)) for body, _ in self.bodies]
        errors = [
            0.0 if fit is None else part * fit.error(t) for part, (_, fit) in zip(parts, self.bodies, strict=True)
        ]
        return np.asarray(np.sqrt(sum(error**2 for error in errors)) / sum(parts))

    def span(self) -> tuple[float, float]:
        """Times that all rows tell of. [s]"""
        spans = [fit.span() for _, fit in self.bodies if fit is not None]
        return self.time_factor * max(one[0] for one in spans), self.time_factor * min(one[1] for one in spans)

    def shifted(self, factor: float) -> PairFit:
        """That of the pair with all times multiplied."""
        return replace(self, time_factor=factor * self.time_factor)


AnyFit = Fit | PairFit
