"""Linear viscoelastic materials: creep as a series of exponentials or as a function, pairs of bodies, temperature.

The half-space enters the contact through one function, the contact compliance
``C(t) = 1/E*(t) = (1 - nu) J(t) / 2`` with the shear creep compliance ``J``; two deformable bodies add theirs.

A creep function is not negative and does not decrease. For a passive material it is a sum of positive exponentials.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial, wraps
from inspect import signature
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.constants import R as GAS_CONSTANT
from scipy.special import gammainc

from roughvisc.errors import InputError
from roughvisc.mechanics.quadrature import panels
from roughvisc.units import Quantity, number, quantities

Array = NDArray[np.float64]
_Making = TypeVar("_Making", bound=Callable[..., Any])

#: Largest shift factor; its inverse is the smallest. Factors beyond result from a temperature in a wrong unit.
LARGEST_SHIFT = 1e30
#: Largest relative growth of a creep compliance that has settled.
_SETTLED = 1e-9
#: Notes of a material with other times, and with other moduli.
_SHIFTED = "all times multiplied by {:.6g} (time-temperature shift)"
_STIFFENED = "all moduli multiplied by {:.6g}"
#: Decimal logarithm of the largest factor of WLF and Arrhenius.
_LARGEST = 300.0


def check_poisson(poisson: float) -> None:
    if isinstance(poisson, str):  # number() reads "0.3"
        raise InputError(key="poisson", found=poisson, expected="a number above -1 and up to 0.5")
    number(poisson, "1", "poisson", above=-1, most=0.5)


def check_terms(
    name: str, terms: Sequence[float], unit: str, times: Sequence[float], name_of_times: str = "times"
) -> None:
    """Refuse terms of a series that are negative, or fewer or more than their times, which are positive."""
    if len(terms) != len(times):
        raise InputError(key=name, found=len(terms), expected=f"as many as {name_of_times}, {len(times)}")
    for i, (term, time) in enumerate(zip(terms, times, strict=True)):
        number(term, unit, f"{name}[{i}]", least=0)
        number(time, "s", f"{name_of_times}[{i}]", above=0)


def remembers_model(function: _Making) -> _Making:
    """Decorate a function that returns a material, which then keeps the arguments of the call as its model."""
    taking = signature(function)

    @wraps(function)
    def called(*args: Any, **given: Any) -> Any:
        material = function(*args, **given)
        model = {"model": function.__name__, **taking.bind(*args, **given).arguments}
        return replace(material, model={name: value for name, value in model.items() if value is not None})

    return called  # type: ignore[return-value]


@dataclass(frozen=True)
class SeriesError:
    """Error of a series that replaces a creep function in a run.

    Attributes
    ----------
    error : float
        Largest relative deviation from `shortest` on. [-]
    shortest : float
        Shortest time of the fit. [s]
    early : float
        Error below the shortest time, see :func:`~roughvisc.mechanics.memory.early_error`. [-]
    """

    error: float
    shortest: float
    early: float


@quantities(glassy="1/Pa >= 0", fluidity="1/(Pa s) >= 0", compliances="1/Pa ...", times="s ...")
@dataclass(frozen=True)
class Prony:
    r"""Exponential (Prony) series of the shear creep compliance.

    .. math:: J(t) = J_0 + \varphi t + \sum_i J_i \left(1 - e^{-t/\tau_i}\right)

    Parameters
    ----------
    glassy : float or str
        Instantaneous compliance ``J_0``; zero for a material without instantaneous response. [1/Pa]
    fluidity : float or str
        Inverse of the steady shear viscosity, zero for a solid. [1/(Pa s)]
    compliances, times : sequence of float or str
        Retarded compliances ``J_i`` [1/Pa] and retardation times ``tau_i`` [s].
    poisson : float
        Poisson ratio, constant in time.
    note : str
        Origin of a fitted series: number of terms, misfit. Ignored in comparisons.
    stands_for : str
        Name of the bodies if the series is not one body with this Poisson ratio; otherwise empty.
    longest : float
        Time of the last row of a creep table, up to which the series is known. [s]
    warning : str
        Warning about the measurements, for the result.
    misfit : float
        Largest relative deviation from the rows of a creep table, zero if it is within their noise.
    thermal : ThermalLaw or PairLaw
        Law by which the material changes with temperature, if it has one; :meth:`at` uses it.
    model : mapping
        Model of a study file that gives this material, and its arguments in SI; empty if unknown.
    replaces : SeriesError, optional
        Error of a series that replaces a creep function.

    Raises
    ------
    InputError
        If a value is negative or not finite, a retardation time is not positive, the Poisson ratio lies
        outside (-1, 0.5], or the material is rigid.

    See Also
    --------
    roughvisc.zener, roughvisc.from_relaxation, roughvisc.creep_table, roughvisc.creep

    Examples
    --------
    >>> import roughvisc as rv
    >>> rubber = rv.Prony("0.3 1/MPa", compliances=["1 1/MPa"], times=["1 min"])
    >>> float(rubber.creep_compliance(0.0)), round(float(rubber.creep_compliance(1e6)), 12)
    (3e-07, 1.3e-06)
    """

    glassy: Quantity
    fluidity: Quantity = 0.0
    compliances: tuple[Quantity, ...] = ()
    times: tuple[Quantity, ...] = ()
    poisson: float = 0.5
    note: str = field(default="", compare=False, repr=False)
    stands_for: str = field(default="", compare=False, repr=False)
    longest: float = field(default=math.inf, repr=False)
    warning: str = field(default="", compare=False, repr=False)
    misfit: float = field(default=0.0, compare=False, repr=False)
    thermal: ThermalLaw | PairLaw | None = field(default=None, compare=False, repr=False)
    model: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)
    replaces: SeriesError | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "compliances", tuple(map(float, self.compliances)))
        object.__setattr__(self, "times", tuple(map(float, self.times)))
        check_terms("compliances", self.compliances, "1/Pa", self.times)
        check_poisson(self.poisson)
        if self.glassy + self.fluidity + sum(self.compliances) == 0:
            raise InputError(key="glassy", found=self.glassy, expected="a positive compliance, not a rigid material")

    def creep_compliance(self, t: ArrayLike) -> Array:
        """Return the shear creep compliance ``J(t)``, [1/Pa]; times beyond the longest one are refused. [s]"""
        t = known_times(t, self.longest)
        retarded = np.add.reduce(self.compliances * -np.expm1(-t[..., None] / np.array(self.times)), axis=-1)
        flowed = self.fluidity * t if self.fluidity else 0.0  # a solid has a limit at inf
        return np.asarray(self.glassy + flowed + retarded)

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Return the contact compliance ``C(t) = (1 - nu) J(t) / 2``. [1/Pa]"""
        return 0.5 * (1 - self.poisson) * self.creep_compliance(t)

    def contact_integral(self, t: ArrayLike) -> Array:
        """Return the integral ``int_0^t C``. [s/Pa]"""
        t = known_times(t, self.longest)
        crept = np.add.reduce(self.compliances * parts_of_step(t[..., None] / np.array(self.times))[1], axis=-1) * t
        return np.asarray(0.5 * (1 - self.poisson) * (self.glassy * t + self.fluidity * t**2 / 2 + crept))

    @property
    def final_compliance(self) -> float:
        """Shear compliance after endless creep, infinite for a fluid. [1/Pa]"""
        return math.inf if self.fluidity else self.glassy + sum(self.compliances)

    @property
    def is_solid(self) -> bool:
        """Whether endless creep ends at a finite compliance."""
        return not self.fluidity

    def laplace(self, s: NDArray[Any]) -> NDArray[Any]:
        """Return the shear compliance under a pressure that grows as ``exp(s t)``. [1/Pa]

        Parameters
        ----------
        s : ndarray
            Real or complex rates. [1/s]

        Returns
        -------
        ndarray
            ``s`` times the Laplace transform of ``J(t)``. [1/Pa]
        """
        transform = self.glassy + (self.fluidity / s if self.fluidity else 0 * s)
        for compliance, time in zip(self.compliances, self.times, strict=True):
            transform = transform + compliance / (1 + s * time)
        return np.asarray(transform)

    def at(self, temperature: Quantity) -> Material:
        """Return the material at another temperature [K], see :func:`at_temperature`."""
        return at_temperature(self, temperature)

    def scaled(self, time_factor: float, modulus_factor: float, note: str = "") -> Prony:
        """Return the series with all times multiplied by one factor and all moduli by another."""
        return replace(
            self,
            glassy=self.glassy / modulus_factor,
            fluidity=self.fluidity / (time_factor * modulus_factor),
            compliances=tuple(value / modulus_factor for value in self.compliances),
            times=tuple(time_factor * value for value in self.times),
            longest=time_factor * self.longest,
            replaces=self.replaces and replace(self.replaces, shortest=time_factor * self.replaces.shortest),
            note="; ".join(filter(None, (self.note, note))),
            thermal=self.thermal and self.thermal.scaled(time_factor, modulus_factor),
        )


def known_times(t: ArrayLike, longest: float) -> Array:
    """Return times up to the longest one, beyond which a material is not known. [s]"""
    t = np.asarray(t, dtype=float)
    latest = np.max(t, initial=0.0)
    if not latest <= longest * (1 + 1e-12):  # beyond rounding of a sum of steps
        late = f"creep is requested at {latest:g} s, and the table ends at {longest:g} s"
        raise InputError(f"{late}: expected a table as long as the program; creep data are not extrapolated")
    return np.minimum(t, longest)


def parts_of_step(x: ArrayLike) -> tuple[Array, Array]:
    """Return the weights of the input before and after a step in the response of an exponential to a linear input.

    Parameters
    ----------
    x : array_like
        Length of the step over the retardation time, at least zero.

    Returns
    -------
    before, after : ndarray
        ``(1 - (1 + x) exp(-x)) / x`` and ``1 - (1 - exp(-x)) / x``, with the sum ``1 - exp(-x)``; relative error below
        2e-14.
    """
    x = np.asarray(x, dtype=float)
    least = np.maximum(x, 1e-17)
    before = np.where(x < least, x / 2, gammainc(2, least) / least)
    return before, -np.expm1(-x) - before


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
    transform : callable, optional
        ``transform(s, *parameters)`` returns ``s`` times the Laplace transform of ``J`` [1/Pa] at rates ``s`` [1/s].
    note : str
        Origin of the material.
    warning : str
        Warning about measurements, of a pair with a measured body.
    misfit : float
        Largest deviation from measurements, of a pair with a measured body.
    stands_for : str
        Name of the bodies if the function is not one body with this Poisson ratio; otherwise empty.
    thermal : ThermalLaw or PairLaw
        Law by which the material changes with temperature, if it has one; :meth:`at` uses it.
    model : mapping
        Model of a study file that gives this material, and its arguments in SI; empty if unknown.
    """

    function: Callable[..., Any]
    parameters: tuple[Any, ...] = ()
    poisson: float = 0.5
    time_factor: float = 1.0
    modulus_factor: float = 1.0
    transform: Callable[..., Any] | None = field(default=None, repr=False)
    note: str = field(default="", compare=False)
    warning: str = field(default="", compare=False)
    misfit: float = field(default=0.0, compare=False)
    stands_for: str = field(default="", compare=False)
    thermal: ThermalLaw | PairLaw | None = field(default=None, compare=False)
    model: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def __repr__(self) -> str:
        return f"{self.function.__name__}({', '.join(map(repr, self.parameters))})"

    def creep_compliance(self, t: ArrayLike) -> Array:
        """Return the shear creep compliance ``J(t)`` [1/Pa] at some times. [s]"""
        compliance = self.function(np.asarray(t, dtype=float) / self.time_factor, *self.parameters)
        return np.asarray(compliance, dtype=float) / self.modulus_factor

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Return the contact compliance ``C(t) = (1 - nu) J(t) / 2``. [1/Pa]"""
        return 0.5 * (1 - self.poisson) * self.creep_compliance(t)

    def contact_integral(self, t: ArrayLike) -> Array:
        """Return ``int_0^t C``, [s/Pa], by Gauss quadrature over ``y = log(t / s)``: 1e-13 for smooth creep."""
        y, weights = panels(80, 40.0, 8)
        t = np.asarray(t, dtype=float)
        return np.asarray(t * (self.contact_compliance(t[..., None] * np.exp(-y)) @ (weights * np.exp(-y))))

    @property
    def final_compliance(self) -> float:
        """Shear compliance after endless creep, infinite if it is not bounded or not known. [1/Pa]

        A function that is not defined at an infinite time is bounded if it does not grow from ``1e15 s`` to ``1e18 s``.
        """
        with np.errstate(all="ignore"):
            try:
                late = self.creep_compliance(np.array([1e15 * self.time_factor, 1e18 * self.time_factor, math.inf]))
            except (ValueError, ArithmeticError):  # of a function that is defined up to some time
                return math.inf
        if not np.isnan(late[-1]):
            return float(late[-1])
        return float(late[1]) if abs(late[1] - late[0]) <= _SETTLED * late[1] < math.inf else math.inf

    @property
    def has_laplace(self) -> bool:
        """Whether :meth:`laplace` is known: of both bodies, if the material is a pair."""
        if self.function is pair_creep:
            return all(not isinstance(body, Creep) or body.has_laplace for body in self.parameters)
        return self.transform is not None

    @property
    def is_solid(self) -> bool:
        """Whether endless creep ends at a finite compliance."""
        return math.isfinite(self.final_compliance)

    def laplace(self, s: NDArray[Any]) -> NDArray[Any]:
        """Return the shear compliance under a pressure that grows as ``exp(s t)``. [1/Pa]

        Parameters
        ----------
        s : ndarray
            Real or complex rates. [1/s]

        Returns
        -------
        ndarray
            ``s`` times the Laplace transform of ``J(t)``. [1/Pa]

        Raises
        ------
        InputError
            If the material has no transform.
        """
        if self.function is pair_creep:
            return np.asarray(sum(2 * (1 - body.poisson) * body.laplace(s) for body in self.parameters))
        if self.transform is None:
            raise InputError(key="material", found=self, expected="a material with a known transform, such as a series")
        return np.asarray(self.transform(s * self.time_factor, *self.parameters) / self.modulus_factor)

    def at(self, temperature: Quantity) -> Material:
        """Return the material at another temperature [K], see :func:`at_temperature`."""
        return at_temperature(self, temperature)

    def scaled(self, time_factor: float, modulus_factor: float, note: str = "") -> Material:
        """Return the material with all times multiplied by one factor and all moduli by another."""
        note = "; ".join(filter(None, (self.note, note)))
        if self.function is pair_creep:
            a, b = (value.scaled(time_factor, modulus_factor) for value in self.parameters)
            return replace(pair(a, b), note=note)
        factors = time_factor * self.time_factor, modulus_factor * self.modulus_factor
        thermal = self.thermal and self.thermal.scaled(time_factor, modulus_factor)
        return replace(self, time_factor=factors[0], modulus_factor=factors[1], note=note, thermal=thermal)


#: The two kinds of materials.
Material = Prony | Creep


@dataclass(frozen=True)
class ThermalLaw:
    """Change of a material with temperature: one factor for all times, and one for all moduli.

    Parameters
    ----------
    material : Prony or Creep
        Material at the reference temperature.
    temperature : float
        Temperature of the material that has this law. [K]
    shift : callable
        Shift factor ``a_T`` at a temperature [K], relative to the reference. It refuses temperatures out of range.
    moduli : callable, optional
        Factor of all moduli at a temperature [K]. Default: they do not change.
    """

    material: Material
    temperature: float
    shift: Callable[[float], float]
    moduli: Callable[[float], float] | None = None

    def at(self, temperature: float) -> Material:
        """Return the material at a temperature, with this law. [K]"""
        factor = self.shift(temperature)
        stiffer = self.moduli(temperature) if self.moduli else 1.0
        if not 1 / LARGEST_SHIFT <= factor <= LARGEST_SHIFT:
            expected = f"a shift of times by a factor from {1 / LARGEST_SHIFT:g} to {LARGEST_SHIFT:g}, not {factor!r}"
            raise InputError(key="temperature", found=temperature, expected=expected)
        notes = [_SHIFTED.format(factor)] * (factor != 1) + [_STIFFENED.format(stiffer)] * (stiffer != 1)
        material = self.material.scaled(factor, stiffer, "; ".join(notes))
        return replace(material, thermal=replace(self, temperature=temperature))

    def scaled(self, time_factor: float, modulus_factor: float) -> Self:
        """Return the law of the material with all times multiplied by one factor and all moduli by another."""
        return replace(self, material=self.material.scaled(time_factor, modulus_factor))


@dataclass(frozen=True)
class PairLaw:
    """Change of a pair with temperature: both bodies change by their own law, and an elastic body does not change."""

    a: Material
    b: Material

    def at(self, temperature: float) -> Material:
        """Return the pair with both bodies at a temperature. [K]"""
        elastic = [isinstance(body, Prony) and not body.fluidity and not body.times for body in (self.a, self.b)]
        bodies = (self.a, self.b)
        changed = [body if fixed else body.at(temperature) for body, fixed in zip(bodies, elastic, strict=True)]
        return pair(*changed)

    def scaled(self, time_factor: float, modulus_factor: float) -> PairLaw:
        """Return the law of the pair with all times multiplied by one factor and all moduli by another."""
        return PairLaw(*(value.scaled(time_factor, modulus_factor) for value in (self.a, self.b)))


def creep(
    function: Callable[[Array], Any], poisson: float = 0.5, *, laplace: Callable[[NDArray[Any]], Any] | None = None
) -> Creep:
    """Material by its shear creep compliance.

    Parameters
    ----------
    function : callable
        ``J(t)``, [1/Pa], for an array of times from zero on [s]. It must not decrease. Steady sliding also evaluates it
        at an infinite time: a finite value makes the material a solid with this compliance after endless creep.
    poisson : float
        Poisson ratio, constant in time.
    laplace : callable, optional
        ``s`` times the Laplace transform of ``J``, [1/Pa], for an array of real or complex rates ``s`` [1/s]. With it
        friction and layers do without a fitted series.

    Returns
    -------
    Creep

    Raises
    ------
    InputError
        If a function cannot be called, or a number is out of its range.

    See Also
    --------
    roughvisc.power_law, roughvisc.Prony, roughvisc.creep_table

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
    if laplace is not None and not callable(laplace):
        raise InputError(key="laplace", found=laplace, expected="a function of the rate, the compliance [1/Pa]")
    check_poisson(poisson)
    return Creep(function, (), poisson, transform=laplace)


@quantities(glassy="1/Pa >= 0", coefficient="1/Pa > 0", exponent="1 > 0", time_scale="s > 0")
@remembers_model
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

    See Also
    --------
    roughvisc.fractional_zener, roughvisc.creep

    Examples
    --------
    >>> gel = power_law(glassy=0.0, coefficient=1e-4, exponent=0.5)
    >>> float(gel.contact_compliance(4.0))  # (1 - nu)/2 J
    5e-05
    """
    check_poisson(poisson)
    number(exponent, "1", "exponent", above=0, below=1)
    return Creep(power_creep, (glassy, coefficient, exponent, time_scale), poisson, transform=power_transform)


def power_transform(
    s: NDArray[Any], glassy: float, coefficient: float, exponent: float, time_scale: float
) -> NDArray[Any]:
    """Return the shear compliance of a power law under a pressure that grows as ``exp(s t)``. [1/Pa]"""
    return np.asarray(glassy + coefficient * math.gamma(1 + exponent) * (s * time_scale) ** -exponent)


def power_creep(t: Array, glassy: float, coefficient: float, exponent: float, time_scale: float) -> Array:
    """Return the creep compliance of a power law. [1/Pa]"""
    return np.asarray(glassy + coefficient * (t / time_scale) ** exponent)


def pair_creep(t: Array, a: Material, b: Material) -> Array:
    """Return the creep compliance of an incompressible body with the contact compliance of two bodies. [1/Pa]"""
    return 4 * (a.contact_compliance(t) + b.contact_compliance(t))


@remembers_model
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

    Raises
    ------
    InputError
        If an argument is not a material.

    See Also
    --------
    roughvisc.combine

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
    if a.thermal or b.thermal:
        about["thermal"] = PairLaw(a, b)
    if not (isinstance(a, Prony) and isinstance(b, Prony)):
        return Creep(pair_creep, bodies, **about)
    glassy = 0.0
    fluidity = 0.0
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

    See Also
    --------
    roughvisc.arrhenius, roughvisc.shift, roughvisc.thermal

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

    See Also
    --------
    roughvisc.wlf, roughvisc.shift, roughvisc.thermal

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

    See Also
    --------
    roughvisc.wlf, roughvisc.arrhenius, roughvisc.thermal

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
    shifted = check_material(material).scaled(factor, 1.0, _SHIFTED.format(factor))
    model = material.model
    return replace(shifted, model={**model, "shift_factor": factor * model.get("shift_factor", 1.0)} if model else {})


@quantities(reference_temperature="K > 0", activation_energy="J/mol > 0", wlf_c1="1 > 0")
def thermal(
    material: Material,
    reference_temperature: Quantity,
    *,
    wlf_c1: float | None = None,
    wlf_c2: float | str | None = None,
    activation_energy: Quantity | None = None,
) -> Material:
    """Give a material its law of temperature, so that ``material.at("40 degC")`` is the material at 40 degC.

    Parameters
    ----------
    material : Prony or Creep
        Material at its reference temperature.
    reference_temperature : float or str
        Temperature at which the compliance was measured. [K]
    wlf_c1, wlf_c2 : float or str
        Constants of :func:`wlf`. [-], [K]
    activation_energy : float or str
        Constant of :func:`arrhenius`, instead. [J/mol]

    Returns
    -------
    Prony or Creep
        The same material at its reference temperature, with the law.

    Raises
    ------
    InputError
        If a number is wrong, or the law is not stated by either `wlf_c1` and `wlf_c2` or `activation_energy`.

    See Also
    --------
    roughvisc.wlf, roughvisc.arrhenius, roughvisc.shift

    Examples
    --------
    >>> import roughvisc as rv
    >>> rubber = rv.thermal(rv.maxwell(1e6, 1e6), "20 degC", wlf_c1=8.0, wlf_c2=90.0)
    >>> warm = rubber.at("30 degC")  # log10 a = -8 * 10 / 100
    >>> round(rubber.fluidity / warm.fluidity, 4)
    0.1585
    """
    constants: dict[str, Any] = {"wlf_c1": wlf_c1, "wlf_c2": wlf_c2}
    for key, value in constants.items():
        if (value is None) == (activation_energy is None):
            raise InputError(key=key, found=value, expected="either wlf_c1 and wlf_c2 or activation_energy")
    function, constants = (
        (wlf, constants) if activation_energy is None else (arrhenius, {"activation_energy": activation_energy})
    )
    law = partial(function, reference_temperature=reference_temperature, **constants)
    law(reference_temperature)  # refuses wrong constants
    material = replace(check_material(material), thermal=None)
    return replace(material, thermal=ThermalLaw(material, reference_temperature, law))


def at_temperature(material: Material, temperature: Quantity) -> Material:
    """Return a material at another temperature, by its own law.

    Parameters
    ----------
    material : Prony or Creep
        A material with a law: from :func:`thermal`, from a table with several temperatures, or from a study with a
        temperature. Both bodies of a pair are brought to the temperature; an elastic body does not change.
    temperature : float or str
        The temperature. [K]

    Raises
    ------
    InputError
        If the material has no law, or the temperature is outside the range of the law.
    """
    temperature = number(temperature, "K", "temperature", above=0)
    law = check_material(material).thermal
    if law is None:
        expected = "a material with a law of temperature: rv.thermal(material, ...), or a table with temperatures"
        raise InputError(key="material", found=material, expected=expected)
    return law.at(temperature)


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
    return check_material(material).scaled(1.0, factor, _STIFFENED.format(factor))


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
