"""Attraction of two surfaces: a tension that decays exponentially with the gap."""

from __future__ import annotations

from dataclasses import dataclass

from roughvisc.errors import InputError
from roughvisc.units import Quantity, quantities


@dataclass(frozen=True)
class Adhesion:
    """Attraction of two surfaces with the tension ``strength exp(-gap / range)``.

    Attributes
    ----------
    work : float
        Work of adhesion, the energy that separates a unit area. [J/m2]
    range : float
        Gap over which the tension falls by a factor of e. [m]
    """

    work: float
    range: float

    @property
    def strength(self) -> float:
        """Largest tension, at zero gap. [Pa]"""
        return self.work / self.range


@quantities(work="J/m^2 >= 0", range="m > 0", strength="Pa > 0")
def adhesion(
    *,
    work: Quantity,
    range: Quantity | None = None,
    strength: Quantity | None = None,
) -> Adhesion:
    r"""Return the attraction of two surfaces for the argument `adhesion` of :func:`roughvisc.simulate`.

    Parameters
    ----------
    work : float or str
        Work of adhesion: energy that separates a unit area of the surfaces; zero: none. [J/m2]
    range : float or str
        Gap over which the tension falls by a factor of e. [m]
    strength : float or str
        Largest tension, instead of the range. [Pa]

    Returns
    -------
    Adhesion
        With the attributes ``work``, ``range`` and ``strength``.

    Raises
    ------
    InputError
        If a quantity is not valid, or not exactly one of `range` and `strength` is given.

    See Also
    --------
    roughvisc.simulate, roughvisc.observables.pull_off

    Notes
    -----
    Surfaces at the gap :math:`g` attract each other with the tension

    .. math:: a(g) = (w / \rho) \exp(-g / \rho)

    with the work of adhesion :math:`w` and the range :math:`\rho`. A short range is the limit of Johnson, Kendall and
    Roberts [1]_, a long range the limit of Derjaguin, Muller and Toporov. Maugis [2]_ describes the transition. The
    cells of the surface must resolve the range.

    References
    ----------
    .. [1] K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301.
    .. [2] D. Maugis, J. Colloid Interface Sci. 150 (1992) 243.

    Examples
    --------
    >>> adhesion(work="50 mJ/m2", range="20 nm")
    Adhesion(work=0.05, range=2e-08)
    >>> adhesion(work="50 mJ/m2", strength="2.5 MPa").range
    2e-08
    """
    if (range is None) == (strength is None):
        given = "neither" if range is None else "both"
        raise InputError(key="range", found=given, expected="either a range [m] or a strength [Pa]")
    if range is None:
        if work == 0:
            raise InputError(key="work", found=work, expected="a work above 0, or a range instead of the strength")
        range = work / strength  # type: ignore[operator]
    return Adhesion(work, range)
