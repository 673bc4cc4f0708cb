"""Complex contact compliance of a material under oscillating pressure."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.creep import Creep, Material, check_material, pair, pair_creep, power_creep
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.series import series

Complex = NDArray[np.complex128]

# Factor by which the times of a series must extend beyond the times of the frequencies, shorter and longer: a term
# whose time is a hundred times off contributes a hundredth of its loss.
_BEYOND = 100.0


def complex_compliance(material: Material, frequency: ArrayLike) -> Complex:
    r"""Return the complex contact compliance: displacement over pressure if both oscillate as ``exp(i w t)``.

    Parameters
    ----------
    material : Material
        Series, power laws and pairs of these have closed forms. Any other material is replaced by a series, see
        :func:`over_frequencies`.
    frequency : array_like
        Angular frequencies ``w``, of either sign. [1/s]

    Returns
    -------
    ndarray of complex
        ``C*(w)``, conjugate for frequencies of opposite sign, with a negative or zero imaginary part at positive
        frequencies. At zero frequency the compliance after endless creep: real, or infinite if the material flows.
        [1/Pa]

    Raises
    ------
    InputError
        If all frequencies are zero for a material without closed form, or a table ends before the times that the
        frequencies need.

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
    material = over_frequencies(material, w)
    if isinstance(material, Prony):
        total = np.full(w.shape, material.glassy, dtype=complex)
        for compliance, time in zip(material.compliances, material.times, strict=True):
            total += compliance / (1 + 1j * w * time)
        total -= 1j * material.fluidity / np.where(w == 0, 1.0, w)
        flows = material.fluidity > 0
    elif material.function is pair_creep:
        return np.asarray(sum(complex_compliance(one, w) for one in material.parameters))
    else:
        glassy, coefficient, exponent, time_scale = material.parameters
        w = w * material.time_factor
        size = np.where(w == 0, 1.0, np.abs(w) * time_scale)
        turned = math.cos(math.pi / 2 * exponent) - 1j * np.sign(w) * math.sin(math.pi / 2 * exponent)
        total = glassy + coefficient * math.gamma(1 + exponent) * size**-exponent * turned
        total, flows = total / material.modulus_factor, True
    found = 0.5 * (1 - material.poisson) * total
    return np.asarray(np.where((w == 0) & flows, complex(math.inf, 0.0), found))


def over_frequencies(material: Material, frequency: ArrayLike, tolerance: float = 1e-4) -> Material:
    """Return a material with a closed form of the complex compliance that replaces a material at some frequencies.

    Parameters
    ----------
    material : Material
        Series, power laws and pairs of these are returned unchanged. Measured creep is replaced by the series fitted
        to it, any other material by a certified series.
    frequency : array_like
        Angular frequencies, of either sign. [1/s]
    tolerance : float
        Relative error of a series that replaces the material.

    Raises
    ------
    InputError
        See :func:`complex_compliance`.
    """
    material = check_material(material)
    if isinstance(material, Creep) and material.function is pair_creep:
        return pair(*(over_frequencies(one, frequency, tolerance) for one in material.parameters))
    if material.longest == math.inf if isinstance(material, Prony) else material.function is power_creep:
        return material
    size = np.abs(np.asarray(frequency, dtype=float))
    size = size[size > 0]
    if not size.size:
        raise InputError("frequency is zero throughout: expected others too, for a material without a closed form")
    shortest, longest = 1 / (_BEYOND * float(size.max())), _BEYOND / float(size.min())
    if isinstance(material, Creep):
        return series(material, shortest, longest, tolerance)[0]
    material.creep_compliance(longest)  # refuses a table that ends earlier
    return replace(material, longest=math.inf)
