"""Materials given by a creep function, pairs of bodies, temperature, and the certified exponential series.

A creep function is not negative and does not decrease. For a passive material it is a sum of positive exponentials. The
solver uses the Prony series that :func:`series` fits to any material for the times of the program, with a measured
error.

The terms of a series are positive, so that it is a passive material. It has the instantaneous compliance of the
material, so that jumps are exact. Both compliances increase. Before the shortest time they therefore differ by less
than the creep up to this time.

Under oscillating pressure a material has a complex compliance. Series and power laws have it in closed form. Any other
material is replaced by a certified series.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
import scipy  # which imports a submodule when it is first used: scipy.optimize takes 0.2 s
from numpy.typing import ArrayLike, NDArray
from scipy.constants import R as GAS_CONSTANT

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.prony import Prony, check_poisson
from roughvisc.mechanics.quadrature import panels
from roughvisc.units import Quantity, number, quantities

Array = NDArray[np.float64]

#: Largest relative decrease of a creep function that counts as rounding.
_ROUNDING = 1e-9
#: Largest shift factor; its inverse is the smallest. Factors beyond result from a temperature in a wrong unit.
LARGEST_SHIFT = 1e30
#: Decimal logarithm of the largest factor of WLF and Arrhenius.
_LARGEST = 300.0
#: Number of times per decade at which a series is fitted, and at which its error is measured.
_FITTED, _MEASURED = 30, 100
#: Numbers of retardation times per decade to try in turn, and largest number of retardation times.
_OFFERED, _MOST_OFFERED = (0.5, 0.7, 1, 1.5, 2, 3, 4, 6, 8, 12, 24, 48), 300
#: Shortest time over the shortest retardation time, two values to try: the larger one gives a better fit before the
#: shortest time, with more terms. Longest retardation time over the longest time.
_FASTER, _SLOWER = (3.0, 10.0), 3.0
#: Number of times that the rows are reweighted to level the error.
_LEVELLINGS = 6
#: Number of successive trials without a smaller error after which the fit ends.
_IDLE = 3
#: Terms whose part of the target is below this in all rows are left out.
_UNSEEN = 1e-10
#: Factor by which the times of a series must extend beyond the times of the frequencies, shorter and longer: a term
#: whose time is a hundred times off contributes a hundredth of its loss.
_BEYOND = 100.0
#: Number of rows above which they are first reduced to a triangular factor.
_MANY = 1000


@dataclass(frozen=True, repr=False)
class Creep:
    """A shear creep compliance ``J(t)``, given as a function and its numbers.

    Parameters
    ----------
    function : callable
        ``function(t, *parameters)`` returns ``J`` [1/Pa] for an array of times [s]. It does not decrease.
    parameters : tuple
        Numbers of the function.
    poisson : float
        Poisson ratio, constant in time.
    time_factor, modulus_factor : float
        Factors of all times and of all moduli. [-]
    note : str
        Origin of the material.
    warning : str
        Warning about measurements, of a pair with a measured body.
    misfit : float
        Largest deviation from measurements, of a pair with a measured body.
    stands_for : str
        Name of the bodies if the function is not one body with this Poisson ratio; otherwise empty.
    """

    function: Callable[..., Any]
    parameters: tuple[Any, ...] = ()
    poisson: float = 0.5
    time_factor: float = 1.0
    modulus_factor: float = 1.0
    note: str = field(default="", compare=False)
    warning: str = field(default="", compare=False)
    misfit: float = field(default=0.0, compare=False)
    stands_for: str = field(default="", compare=False)

    def __repr__(self) -> str:
        return f"{self.function.__name__}({', '.join(map(repr, self.parameters))})"

    def creep_compliance(self, t: ArrayLike) -> Array:
        """Return the shear creep compliance ``J(t)`` [1/Pa] at some times. [s]"""
        found = self.function(np.asarray(t, dtype=float) / self.time_factor, *self.parameters)
        return np.asarray(found, dtype=float) / self.modulus_factor

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Return the contact compliance ``C(t) = (1 - nu) J(t) / 2``. [1/Pa]"""
        return 0.5 * (1 - self.poisson) * self.creep_compliance(t)

    def contact_integral(self, t: ArrayLike) -> Array:
        """Return ``int_0^t C``, [s/Pa], by Gauss quadrature over ``y = log(t / s)``: 1e-13 for smooth creep."""
        y, weights = panels(80, 40.0, 8)
        t = np.asarray(t, dtype=float)
        return np.asarray(t * (self.contact_compliance(t[..., None] * np.exp(-y)) @ (weights * np.exp(-y))))

    def scaled(self, time_factor: float, modulus_factor: float, note: str = "") -> Material:
        """Return the material with all times multiplied by one factor and all moduli by another."""
        note = "; ".join(filter(None, (self.note, note)))
        if self.function is pair_creep:
            a, b = (one.scaled(time_factor, modulus_factor) for one in self.parameters)
            return replace(pair(a, b), note=note)
        factors = time_factor * self.time_factor, modulus_factor * self.modulus_factor
        return replace(self, time_factor=factors[0], modulus_factor=factors[1], note=note)


#: The two kinds of materials.
Material = Prony | Creep


def creep(function: Callable[[Array], Any], poisson: float = 0.5) -> Creep:
    """Material by its shear creep compliance.

    Parameters
    ----------
    function : callable
        ``J(t)``, [1/Pa], for an array of times from zero on [s]. It must not decrease.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    Creep

    Raises
    ------
    InputError
        If the function cannot be called, or a number is out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> import roughvisc as rv
    >>> rubber = rv.creep(lambda t: 1e-6 * (1 + 0.2 * np.log1p(t / 1e-3)), poisson=0.5)
    >>> float(rubber.contact_compliance(0.0))  # (1 - nu)/2 J
    2.5e-07
    """
    if not callable(function):
        raise InputError(key="function", found=function, expected="a function of time, the creep compliance [1/Pa]")
    check_poisson(poisson)
    return Creep(function, (), poisson)


@quantities(glassy="1/Pa >= 0", coefficient="1/Pa > 0", time_scale="s > 0")
def power_law(
    glassy: Quantity, coefficient: Quantity, exponent: float, time_scale: Quantity = 1.0, poisson: float = 0.5
) -> Creep:
    r"""Power-law creep, :math:`J(t) = J_0 + c \, (t/T)^\alpha`.

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

    Returns
    -------
    Creep

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> gel = power_law(glassy=0.0, coefficient=1e-4, exponent=0.5)
    >>> float(gel.contact_compliance(4.0))  # (1 - nu)/2 J
    5e-05
    """
    check_poisson(poisson)
    number(exponent, "1", "exponent", above=0, below=1)
    return Creep(power_creep, (glassy, coefficient, exponent, time_scale), poisson)


def power_creep(t: Array, glassy: float, coefficient: float, exponent: float, time_scale: float) -> Array:
    """Return the creep compliance of a power law. [1/Pa]"""
    return np.asarray(glassy + coefficient * (t / time_scale) ** exponent)


def pair_creep(t: Array, a: Material, b: Material) -> Array:
    """Return the creep compliance of an incompressible body with the contact compliance of two bodies. [1/Pa]"""
    return 4 * (a.contact_compliance(t) + b.contact_compliance(t))


def pair(a: Material, b: Material) -> Material:
    """Two deformable bodies: their contact compliances add.

    Parameters
    ----------
    a, b : Prony or Creep
        The two materials, in any order.

    Returns
    -------
    Prony or Creep
        A series if both materials are series. Its Poisson ratio is a half; each body keeps its own ratio.

    Examples
    --------
    >>> import roughvisc as rv
    >>> float(pair(rv.elastic(2e6, 0.3), rv.maxwell(1e6, 1e6)).contact_compliance(3.0))  # 0.35/2e6 + 0.25 (1 + 3)/1e6
    1.175e-06
    """
    bodies = check_material(a), check_material(b)
    about: dict[str, Any] = {
        "note": "; ".join(f"{name}: {body.note}" for name, body in zip("ab", bodies, strict=True) if body.note),
        "stands_for": "a pair of bodies",
        "warning": " ".join(filter(None, (body.warning for body in bodies))),
        "misfit": max(body.misfit for body in bodies),
    }
    if not (isinstance(a, Prony) and isinstance(b, Prony)):
        return Creep(pair_creep, bodies, **about)
    glassy, fluidity = 0.0, 0.0
    compliances: dict[float, float] = {}
    for body in (a, b):
        share = 2 * (1 - body.poisson)  # J = 4 C, with C = (1 - nu) J / 2 of the body
        glassy += share * body.glassy
        fluidity += share * body.fluidity
        for compliance, time in zip(body.compliances, body.times, strict=True):
            compliances[time] = compliances.get(time, 0.0) + share * compliance
    about["longest"] = min(a.longest, b.longest)
    return Prony(glassy, fluidity, tuple(compliances.values()), tuple(compliances), **about)


@quantities(temperature="K > 0", reference_temperature="K > 0", wlf_c1="1 > 0")
def wlf(temperature: Quantity, reference_temperature: Quantity, wlf_c1: float, wlf_c2: float | str) -> float:
    r"""Shift factor of Williams, Landel and Ferry, for polymers from the glass transition to about 100 K above it.

    Parameters
    ----------
    temperature : float or str
        Temperature ``T`` of the contact. [K]
    reference_temperature : float or str
        Temperature ``T_r`` at which the compliance was measured. [K]
    wlf_c1 : float
        First constant, with the decimal logarithm. [-]
    wlf_c2 : float or str
        Second constant, a difference of temperatures. [K]

    Returns
    -------
    float
        ``a_T``, the factor for all times of the material. [-]

    Raises
    ------
    InputError
        If a number is not positive and finite, or the temperature is not above ``T_r - c2``, where the formula is not
        defined.

    Notes
    -----
    .. math:: \log_{10} a_T = -\frac{c_1 (T - T_r)}{c_2 + T - T_r}

    References
    ----------
    .. [1] M. L. Williams, R. F. Landel and J. D. Ferry, J. Am. Chem. Soc. 77 (1955) 3701-3707.

    Examples
    --------
    >>> wlf(298.15, 298.15, 17.44, 51.6)  # at the reference temperature nothing is shifted
    1.0
    """
    c2 = number(wlf_c2, "K", "wlf_c2", above=0, difference=True)
    above = temperature - reference_temperature
    if not c2 + above > 0:
        expected = f"more than {reference_temperature - c2:g} K, reference temperature less wlf_c2, the pole of WLF"
        raise InputError(key="temperature", found=temperature, expected=expected)
    return 10.0 ** min(-wlf_c1 * above / (c2 + above), _LARGEST)


@quantities(temperature="K > 0", reference_temperature="K > 0", activation_energy="J/mol > 0")
def arrhenius(temperature: Quantity, reference_temperature: Quantity, activation_energy: Quantity) -> float:
    r"""Shift factor of a thermally activated process, after Arrhenius.

    Parameters
    ----------
    temperature : float or str
        Temperature ``T`` of the contact. [K]
    reference_temperature : float or str
        Temperature ``T_r`` at which the compliance was measured. [K]
    activation_energy : float or str
        ``E_a``. [J/mol]

    Returns
    -------
    float
        ``a_T``, the factor for all times of the material. [-]

    Raises
    ------
    InputError
        If a number is not positive and finite.

    Notes
    -----
    .. math:: \ln a_T = \frac{E_a}{R} \left(\frac{1}{T} - \frac{1}{T_r}\right)

    References
    ----------
    .. [1] J. D. Ferry, *Viscoelastic Properties of Polymers*, 3rd ed., Wiley, 1980, chapter 11.

    Examples
    --------
    >>> round(arrhenius(283.15, 293.15, 80e3), 3)  # 10 K colder
    3.187
    """
    power = activation_energy / GAS_CONSTANT * (1 / temperature - 1 / reference_temperature)
    return math.exp(min(power, math.log(10) * _LARGEST))


def shift(material: Material, factor: float) -> Material:
    r"""Shift a material to another temperature: multiply all its times by one factor.

    Parameters
    ----------
    material : Prony or Creep
        Material at its reference temperature. Both bodies of a pair are shifted.
    factor : float
        Shift factor ``a_T``, from :func:`wlf`, :func:`arrhenius` or a measurement; above one for slower response, at
        lower temperature. [-]

    Returns
    -------
    Prony or Creep
        The shifted material. Its ``note`` states the factor.

    Raises
    ------
    InputError
        If the factor is not between 1e-30 and 1e30.

    Notes
    -----
    .. math:: C(t;\, T) = C(t / a_T;\, T_r)

    The material is thermorheologically simple: temperature changes only times, not compliances. There is no vertical
    shift.

    Examples
    --------
    >>> import roughvisc as rv
    >>> float(shift(rv.maxwell(1e6, 1e6), 10.0).creep_compliance(20.0))  # J(2 s) at the reference temperature
    3e-06
    """
    factor = number(factor, "1", "factor", least=1 / LARGEST_SHIFT, most=LARGEST_SHIFT)
    note = f"all times multiplied by {factor:.6g} (time-temperature shift)"
    return check_material(material).scaled(factor, 1.0, note)


def stiffened(material: Material, factor: float) -> Material:
    r"""Multiply all moduli and viscosities of a material by one factor, :math:`C(t) \to C(t) / f`.

    Parameters
    ----------
    material : Prony or Creep
        Material; both bodies of a pair are stiffened.
    factor : float
        Factor; above one makes the material stiffer. [-]

    Returns
    -------
    Prony or Creep
        The stiffened material. Its ``note`` states the factor.

    Raises
    ------
    InputError
        If the factor is not positive and finite.

    Examples
    --------
    >>> import roughvisc as rv
    >>> stiffened(rv.elastic(1e6), 2.0).glassy
    5e-07
    """
    factor = number(factor, "1", "modulus_factor", above=0)
    return check_material(material).scaled(1.0, factor, f"all moduli multiplied by {factor:.6g}")


def check_material(material: Any, key: str = "material") -> Material:
    """Return the argument if it is a material.

    Raises
    ------
    InputError
        If it is not a :class:`Prony` or a :class:`Creep`.
    """
    if not isinstance(material, Prony | Creep):
        raise InputError(key=key, found=material, expected="a material, such as rv.zener(...) or rv.creep(function)")
    return material


def check_creep(material: Material, times: Array) -> Array:
    """Return the creep compliance at some times [1/Pa], after a check that it is not negative and does not decrease.

    Parameters
    ----------
    material : Prony or Creep
        Material to check.
    times : ndarray
        Times, positive and ascending. [s]

    Raises
    ------
    InputError
        If the number of values is wrong, or a value is negative, not finite, lower than an earlier one, or zero after
        time zero. The message names the time.
    """
    times = np.append(0.0, times)
    values = material.creep_compliance(times)
    if values.shape != times.shape:
        raise InputError(f"creep of {material!r} gives {values.shape} of {times.shape} times: expected a number each")
    falls = np.append(False, np.diff(values) < -_ROUNDING * values[1:])
    is_possible = np.isfinite(values) & (values >= 0) & ((values > 0) | (times == 0)) & ~falls
    for at in np.flatnonzero(~is_possible)[:1]:
        found = f"creep of {material!r} is {values[at]:g} 1/Pa at {times[at]:g} s"
        raise InputError(f"{found}: expected a positive compliance (zero only at time zero), no less than before")
    return values[1:]


def series(material: Material, shortest: float, longest: float, tolerance: float) -> tuple[Prony, float]:
    r"""Fit a Prony series to a material for a range of times.

    Parameters
    ----------
    material : Material
        Any material. A Prony series is returned unchanged, unless it was fitted to a creep table with more terms than
        the tolerance needs.
    shortest, longest : float
        Range of times. [s]
    tolerance : float
        Largest relative error allowed.

    Returns
    -------
    series : Prony
        The series with the fewest terms within the tolerance; otherwise the most accurate series. It has the
        instantaneous compliance of the material.
    error : float
        Largest ``|J~ - J| / J`` at a hundred instants per decade, more than the series was fitted to. It exceeds the
        tolerance if the material is not passive.

    Raises
    ------
    InputError
        If the material is not known over the range, or its creep compliance decreases.

    Notes
    -----
    Non-negative least squares [1]_ on a lattice of retardation times, :math:`J_0 + \varphi t + \sum_i J_i (1 -
    e^{-t/\tau_i})`. The rows are reweighted by the error to reduce its largest value (Lawson's iteration [1]_).

    References
    ----------
    .. [1] C. L. Lawson and R. J. Hanson, *Solving Least Squares Problems*, Prentice-Hall, 1974, chapter 23.
    """
    if isinstance(material, Prony) and material.longest == math.inf:
        return material, 0.0
    instants = _instants(shortest, longest, _MEASURED)
    compliance = check_creep(material, instants)
    if isinstance(material, Creep) and material.function is pair_creep:
        joined = cast(Prony, pair(*(series(one, shortest, longest, tolerance)[0] for one in material.parameters)))
        return joined, _error(joined, instants, compliance)
    fits = _fits(material, instants, compliance, tolerance)
    error, found = min(fits, key=lambda one: (max(one[0], tolerance), len(one[1].times)))
    if isinstance(material, Prony) and (error > tolerance or len(found.times) >= len(material.times)):
        return replace(material, longest=math.inf), 0.0
    return found, error


def _fits(material: Material, instants: Array, compliance: Array, tolerance: float) -> Iterator[tuple[float, Prony]]:
    """Yield errors and series, from ever denser lattices of retardation times."""
    shortest, longest = instants[0], instants[-1]
    glassy, t = float(material.creep_compliance(0.0)), _instants(shortest, longest, _FITTED)
    exact = material.creep_compliance(t)
    for faster in _FASTER:
        idle, reached = 0, math.inf
        for per_decade in _OFFERED:
            times = lattice(shortest / faster, longest * _SLOWER, per_decade)
            if idle == _IDLE or reached <= tolerance or times.size > _MOST_OFFERED:
                break
            columns = np.column_stack([t / longest, -np.expm1(-t[:, None] / times)])
            before, importance = reached, np.ones(t.size)
            for _ in range(_LEVELLINGS):
                weights = nonnegative(columns, exact - glassy, exact / importance)
                used = weights[1:] > 0
                terms = tuple(weights[1:][used]), tuple(times[used])
                found = Prony(glassy, float(weights[0] / longest), *terms, material.poisson)
                error = _error(found, instants, compliance)
                yield error, found
                reached = min(reached, error)
                misfit = np.abs((glassy + columns @ weights) / exact - 1)
                importance = importance * np.sqrt(0.02 + misfit / max(float(misfit.max()), 1e-300))
            idle = 0 if reached < 0.9 * before else idle + 1


def _instants(shortest: float, longest: float, per_decade: int) -> Array:
    """Return at least `per_decade` instants, evenly spaced in the logarithm. [s]"""
    return np.geomspace(shortest, longest, int(per_decade * max(np.log10(longest / shortest), 1.0)) + 1)


def _error(found: Prony, instants: Array, compliance: Array) -> float:
    """Return the largest relative error of the creep compliance at some instants."""
    return float(np.abs(found.creep_compliance(instants) / compliance - 1).max())


def lattice(shortest: float, longest: float, per_decade: float) -> Array:
    """Return times from the shortest to the longest, evenly spaced in the logarithm. [s]"""
    count = max(2, int(np.ceil(per_decade * np.log10(longest / shortest))) + 1) if longest > shortest else 1
    return np.geomspace(shortest, longest, count)


def nonnegative(columns: Array, target: Array, scale: Array) -> Array:
    """Return non-negative weights of columns, mostly zeros, whose weighted sum fits a target in least squares.

    Parameters
    ----------
    columns : ndarray, shape (rows, terms)
        Columns to combine.
    target : ndarray, shape (rows,)
        Target of the sum.
    scale : ndarray, shape (rows,)
        Positive scale of the misfit of each row.
    """
    if not columns.size:  # which SciPy's function cannot do
        return np.zeros(columns.shape[1])
    scaled = columns / scale[:, None]
    norms = np.sqrt(np.sum(scaled**2, axis=0))
    norms[norms == 0] = 1.0
    matrix, wanted = scaled / norms, target / scale
    if wanted.size > _MANY:  # the triangular factor has the same squared misfit up to a constant
        factor: Array = np.asarray(np.linalg.qr(np.column_stack([matrix, wanted]), mode="r"))
        matrix, wanted = factor[:, :-1], factor[:, -1]
    weights, _ = scipy.optimize.nnls(matrix, wanted, maxiter=50 * columns.shape[1])
    seen = np.abs(scaled / norms).max(axis=0) * weights
    return np.where(seen > _UNSEEN, weights / norms, 0.0)


def complex_compliance(material: Material, frequency: ArrayLike) -> NDArray[np.complex128]:
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
        If a table ends before the times that the frequencies need.

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
    >>> from roughvisc.mechanics.materials.prony import zener
    >>> found = complex_compliance(zener(1.0, 1.0, 1.0), [0.0, 1.0])  # C = 1/4 (1 + 1 / (1 + i w))
    >>> found.real.tolist(), found.imag.tolist()
    ([0.5, 0.375], [0.0, -0.125])
    """
    w = np.asarray(frequency, dtype=float)
    material = over_frequencies(material, w)
    if isinstance(material, Creep) and material.function is pair_creep:
        return np.asarray(sum(complex_compliance(one, w) for one in material.parameters))
    with np.errstate(divide="ignore", invalid="ignore"):  # at zero frequency
        found = 0.5 * (1 - material.poisson) * laplace_compliance(material, 1j * w)
    return np.where(np.isfinite(found), found, complex(math.inf, 0.0))


def laplace_compliance(material: Material, s: NDArray[Any]) -> NDArray[Any]:
    """Return the shear compliance of a series or a power law under a pressure that grows as ``exp(s t)``.

    Parameters
    ----------
    material : Material
        Series, or power law.
    s : ndarray
        Real or complex rates. [1/s]

    Returns
    -------
    ndarray
        Shear compliance: ``s`` times the Laplace transform of ``J(t)``. [1/Pa]
    """
    if isinstance(material, Creep):
        glassy, coefficient, exponent, time_scale = material.parameters
        crept = coefficient * math.gamma(1 + exponent) * (s * (material.time_factor * time_scale)) ** -exponent
        return np.asarray((glassy + crept) / material.modulus_factor)
    found = material.glassy + (material.fluidity / s if material.fluidity else 0 * s)
    for compliance, time in zip(material.compliances, material.times, strict=True):
        found = found + compliance / (1 + s * time)
    return np.asarray(found)


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
    if isinstance(material, Creep) and material.function is pair_creep:
        return pair(*(over_frequencies(one, frequency, tolerance) for one in material.parameters))
    if material.longest == math.inf if isinstance(material, Prony) else material.function is power_creep:
        return material
    size = np.abs(np.asarray(frequency, dtype=float))
    shortest, longest = 1 / (_BEYOND * float(size.max())), _BEYOND / float(size[size > 0].min())
    if isinstance(material, Creep):
        return series(material, shortest, longest, tolerance)[0]
    material.creep_compliance(longest)  # refuses a table that ends earlier
    return replace(material, longest=math.inf)
