"""Creep compliance as a power of time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_number, check_poisson
from roughvisc.mechanics.materials.words import Built, PrintedAsBuilt, as_built
from roughvisc.units import Quantity, quantities

Array = NDArray[np.float64]


@quantities(glassy="1/Pa", coefficient="1/Pa", time_scale="s")
@dataclass(frozen=True, repr=False)
class PowerLaw(PrintedAsBuilt):
    r"""Power-law creep.

    .. math:: J(t) = J_0 + c \, (t/T)^\alpha

    Parameters
    ----------
    glassy : float or str
        Instantaneous compliance ``J_0``; zero for a material without instantaneous response. [1/Pa]
    coefficient : float or str
        Creep ``c`` at the time ``T``. [1/Pa]
    exponent : float
        ``alpha``, between 0 (elastic) and 1 (a dashpot), both excluded.
    time_scale : float or str
        ``T``. [s]
    poisson : float
        Poisson ratio, constant in time.
    note : str
        Source of the numbers. Ignored in comparisons.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> gel = PowerLaw(glassy=0.0, coefficient=1e-4, exponent=0.5)
    >>> float(gel.contact_compliance(4.0))  # (1 - nu)/2 J
    5e-05
    """

    glassy: Quantity
    coefficient: Quantity
    exponent: float
    time_scale: Quantity = 1.0
    poisson: float = 0.5
    note: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        check_number("glassy", self.glassy, "1/Pa", zero=True)
        check_number("coefficient", self.coefficient, "1/Pa")
        check_number("time_scale", self.time_scale, "s")
        check_poisson(self.poisson)
        if not 0 < self.exponent < 1:
            wanted = "a number above 0 and below 1"
            message = f"exponent is {self.exponent!r}: expected {wanted}"
            raise InputError(message, key="exponent", found=self.exponent, expected=wanted)

    def _built(self) -> Built:
        """With readable units."""
        return as_built(
            "PowerLaw",
            self.poisson,
            self.note,
            glassy=(self.glassy, "1/Pa"),
            coefficient=(self.coefficient, "1/Pa"),
            exponent=(self.exponent, "1"),
            time_scale=(self.time_scale, "s"),
        )

    def creep_compliance(self, t: ArrayLike) -> Array:
        """Shear creep compliance ``J(t)``. [1/Pa]"""
        t = np.asarray(t, dtype=float)
        return np.asarray(self.glassy + self.coefficient * (t / self.time_scale) ** self.exponent)

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Contact compliance ``C(t) = (1 - nu) J(t) / 2``. [1/Pa]"""
        return np.asarray(0.5 * (1 - self.poisson) * self.creep_compliance(t))

    def contact_integral(self, t: ArrayLike) -> Array:
        """First antiderivative ``int_0^t C``. [s/Pa]"""
        t = np.asarray(t, dtype=float)
        creep = self.coefficient * (t / self.time_scale) ** self.exponent / (1 + self.exponent)
        return np.asarray(0.5 * (1 - self.poisson) * t * (self.glassy + creep))

    def mean_contact_compliance(self, s: ArrayLike, h: ArrayLike) -> Array:
        """Mean of ``C`` over ``[s, s + h]``, [1/Pa]; ``C(s)`` for ``h = 0``. [s]

        Notes
        -----
        With ``S = s + h`` and ``y = h/S`` the mean of ``t^alpha`` is ``S^alpha (1 - (1-y)^(1+alpha)) / ((1+alpha) y)``,
        and the power of ``1 - y`` is taken by ``expm1`` and ``log1p``: a difference of antiderivatives would lose
        about ``eps s/h``.
        """
        s, h = np.asarray(s, dtype=float), np.asarray(h, dtype=float)
        end = s + h
        share = h / np.where(end > 0, end, 1.0)
        exponent = 1 + self.exponent
        with np.errstate(divide="ignore"):
            lost = -np.expm1(exponent * np.log1p(-share))
        mean = np.where(share > 0, lost / (exponent * np.where(share > 0, share, 1.0)), 1.0)
        creep = self.coefficient * (end / self.time_scale) ** self.exponent * mean
        return np.asarray(0.5 * (1 - self.poisson) * (self.glassy + creep))
