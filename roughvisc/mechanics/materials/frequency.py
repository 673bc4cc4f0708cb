"""Creep seen in frequency: the complex contact compliance of a material under pressure that oscillates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.models import Material, Pair, PowerLaw, Prony
from roughvisc.mechanics.materials.protocol import complete
from roughvisc.mechanics.materials.series import series_of

Complex = NDArray[np.complex128]

# Ages beyond those of the highest and the lowest frequency, over which a series must keep its error: a term whose time
# is a hundred times off has a hundredth of its loss.
_BEYOND = 100.0


def complex_compliance(material: Material, frequency: ArrayLike) -> Complex:
    r"""Displacement over pressure where both oscillate as ``exp(i w t)``.

    Parameters
    ----------
    material : Material
        A series and a power law have it in closed form, and so has a pair of these; anything else is taken by its
        certified series, see :func:`over_frequencies`.
    frequency : array_like
        Angular frequencies ``w``, of either sign. [1/s]

    Returns
    -------
    ndarray of complex
        ``C*(w)``: conjugate for frequencies of opposite sign, its imaginary part not positive for positive ones. At
        zero the compliance after endless creep: real, or infinite where the material flows. [1/Pa]

    Raises
    ------
    InputError
        If a material without closed form is asked for at zero frequency alone, or a table ends before the times
        that the frequencies need.

    Notes
    -----
    With :math:`C(t) = \tfrac{1 - \nu}{2} J(t)`,

    .. math:: C^*(\omega) = \frac{1-\nu}{2} \left[ J_0 + \sum_i \frac{J_i}{1 + i \omega \tau_i}
              + \frac{\varphi}{i \omega} \right], \qquad
              J^*(\omega) = J_0 + c\, \Gamma(1 + \alpha)\, (i \omega T)^{-\alpha}.

    References
    ----------
    .. [1] J. D. Ferry, *Viscoelastic Properties of Polymers*, 3rd ed., Wiley, 1980, chapter 3.

    Examples
    --------
    >>> from roughvisc.mechanics.materials.models import zener
    >>> found = complex_compliance(zener(1.0, 1.0, 1.0), [0.0, 1.0])  # C = 1/4 (1 + 1 / (1 + i w))
    >>> found.real.tolist(), found.imag.tolist()
    ([0.5, 0.375], [0.0, -0.125])
    """
    w = np.asarray(frequency, dtype=float)
    closed = over_frequencies(material, w)
    if isinstance(closed, Pair):
        return complex_compliance(closed.a, w) + complex_compliance(closed.b, w)
    return _of_power_law(closed, w) if isinstance(closed, PowerLaw) else _of_series(closed, w)


def over_frequencies(material: Material, frequency: ArrayLike, tolerance: float = 1e-4) -> Prony | PowerLaw | Pair:
    """What stands for a material at some frequencies, with a complex compliance in closed form.

    Parameters
    ----------
    material : Material
        A series, a power law and a pair of these stand for themselves; anything else has a certified series fitted.
    frequency : array_like
        Angular frequencies, of either sign. [1/s]
    tolerance : float
        Relative error of a series in place of the material.

    Raises
    ------
    InputError
        As :func:`complex_compliance`.
    """
    if isinstance(material, Pair):
        return Pair(*(over_frequencies(body, frequency, tolerance) for body in (material.a, material.b)))
    if isinstance(material, Prony | PowerLaw):
        return material
    size = np.abs(np.asarray(frequency, dtype=float))
    size = size[size > 0]
    if not size.size:
        raise InputError("frequency is zero throughout: expected others too, for a material without a closed form")
    shortest, longest = 1 / (_BEYOND * float(size.max())), _BEYOND / float(size.min())
    return series_of(complete(material), shortest, longest, tolerance).prony


def _of_series(material: Prony, w: NDArray[np.float64]) -> Complex:
    total = np.full(w.shape, material.glassy, dtype=complex)
    for compliance, time in zip(material.compliances, material.times, strict=True):
        total += compliance / (1 + 1j * w * time)
    total -= 1j * material.fluidity / np.where(w == 0, 1.0, w)
    return _endless(0.5 * (1 - material.poisson) * total, (w == 0) & (material.fluidity > 0))


def _of_power_law(material: PowerLaw, w: NDArray[np.float64]) -> Complex:
    size, exponent = np.where(w == 0, 1.0, np.abs(w) * material.time_scale), material.exponent
    turned = math.cos(math.pi / 2 * exponent) - 1j * np.sign(w) * math.sin(math.pi / 2 * exponent)
    creep = material.coefficient * math.gamma(1 + exponent) * size**-exponent * turned
    return _endless(0.5 * (1 - material.poisson) * (material.glassy + creep), w == 0)


def _endless(compliance: NDArray[Any], where: NDArray[np.bool_]) -> Complex:
    """The compliance, infinite where creep goes on without end."""
    return np.asarray(np.where(where, complex(math.inf, 0.0), compliance))
