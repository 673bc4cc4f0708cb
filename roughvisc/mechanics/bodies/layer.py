"""A layer of one material on another one that gives way too, and any number of layers.

With two materials space and time do not separate: what a wave answers depends on its length and on its frequency
together. They do separate where the compliances of the materials are in proportion, as those of elastic ones are.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.bodies.body import Body, separability_error
from roughvisc.mechanics.bodies.half_space import HALF_SPACE
from roughvisc.mechanics.bodies.layered import Layered, effective_compliance
from roughvisc.mechanics.materials.creep import Creep, Material, complete
from roughvisc.mechanics.materials.frequency import complex_compliance, over_frequencies
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.units import Quantity, quantities, said

Array = NDArray[np.float64]
# Ages at which compliances are compared, the first at which all are known and none is zero or infinite. [s]
_AGES = (math.inf, 0.0, 1.0, 1e-3, 1e-6)
# Compliances that differ by no more, relative, are in proportion.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Stratum:
    """One material of a layered body.

    Attributes
    ----------
    material : Material
        One body of a constant Poisson's ratio.
    thickness : float
        Infinite of the lowest one. [m]
    """

    material: Material
    thickness: float


@dataclass(frozen=True, repr=False)
class LayeredBody(Body):
    """Layers on a half-space, see :func:`layer`. Its `material` is that of the top layer.

    Parameters
    ----------
    strata : tuple of Stratum
        From the top.
    """

    strata: tuple[Stratum, ...] = ()

    def __repr__(self) -> str:
        *layers, base = self.strata
        text = repr(base.material)
        for one in layers[::-1]:
            text = f"layer({one.material!r}, thickness={said(one.thickness, 'm')}, on={text})"
        return text

    @property
    def materials(self) -> tuple[Prony | Creep, ...]:
        """Of the strata, from the top."""
        return tuple(complete(one.material) for one in self.strata)

    @property
    def thicknesses(self) -> tuple[float, ...]:
        """Of the layers, from the top. [m]"""
        return tuple(one.thickness for one in self.strata[:-1])

    @property
    def poissons(self) -> tuple[float, ...]:
        """Poisson's ratios of the strata."""
        return tuple(material.poisson for material in self.materials)

    @property
    def separates(self) -> bool:
        """Whether space and time do: the compliances of all materials are in proportion."""
        return all(compliance_ratio(one, self.materials[0]) is not None for one in self.materials)

    def over_frequencies(self, frequency: ArrayLike, tolerance: float) -> LayeredBody:
        """The same of what stands for the materials at some frequencies. [1/s]"""
        strata = (replace(one, material=over_frequencies(one.material, frequency, tolerance)) for one in self.strata)
        return replace(self, material=over_frequencies(self.material, frequency, tolerance), strata=tuple(strata))

    def waves(self, qx: Array, qy: Array, frequency: Array) -> tuple[Array, NDArray[np.complex128]]:
        """Kernel of a half-space [m], and the contact compliance that is effective in each wave. [1/Pa]"""
        q = np.hypot(qx, qy)
        contact = [complex_compliance(one.material, frequency) for one in self.strata]
        flows = np.any([~np.isfinite(one) for one in contact], axis=0)
        shear = [
            2 / (1 - poisson) * np.where(flows, 1.0, one) for poisson, one in zip(self.poissons, contact, strict=True)
        ]
        found = effective_compliance(np.where(q > 0, q, 1.0), self.thicknesses, self.poissons, shear)
        return HALF_SPACE.transfer(qx, qy), np.where(flows, complex(math.inf, 0.0), found)

    def attributes(self) -> dict[str, Any]:
        """What it is, in words."""
        return {"kernel": repr(self)}


@quantities(thickness="m")
def layer(material: Material, thickness: Quantity, *, on: Material | Body) -> Body:
    """A layer of a material, bonded to a half-space of another one or to another layer.

    Parameters
    ----------
    material : Material
        Material of one body with a Poisson's ratio that is constant in time.
    thickness : float or str
        Of the layer; infinite for a half-space of its material. [m]
    on : Material or Body
        What it lies on: a material, which is a half-space of it, or another layer.

    Returns
    -------
    Body
        A body, which functions accept as `material`.

    Raises
    ------
    InputError
        If the thickness is not positive; if a material describes two bodies, its Poisson's ratio is negative or
        changes in time, or it is rigid at once together with all others; if what it lies on is a sheet or a body of
        your own.

    Notes
    -----
    Each wave of pressure has a response of its own, see
    :func:`~roughvisc.mechanics.bodies.layered.effective_compliance`: short waves feel the layer alone, waves that are
    much longer than its thickness what lies below.

    Examples
    --------
    >>> import roughvisc as rv
    >>> lacquer, rubber = rv.elastic(1e9, poisson=0.35), rv.elastic(1e6)
    >>> coated = rv.layer(lacquer, "20 um", on=rubber)
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=45)
    >>> press = rv.Program().load(1e-4, over=0)
    >>> ds = rv.simulate(ball, coated, press, progress=False)
    >>> bare = rv.simulate(ball, rubber, press, progress=False)
    >>> bool(ds.approach[-1] < bare.approach[-1])
    True
    """
    if not (isinstance(thickness, int | float) and thickness > 0):
        raise InputError(f"thickness is {thickness!r}: expected a positive number [m]")
    below = on.strata if isinstance(on, LayeredBody) else (_half_space("on", on),)
    top = _half_space("material", material)
    if thickness == math.inf:
        return Body(material)
    strata = (replace(top, thickness=float(thickness)), *below)
    return LayeredBody(material, _kernel(strata), strata)


def _half_space(name: str, material: Any) -> Stratum:
    """A material as the lowest stratum."""
    if isinstance(material, Body):
        if material.kernel != HALF_SPACE or name == "material":
            raise InputError(f"{name} is the body {material!r}: expected a material{' or a layer' * (name == 'on')}")
        material = material.material
    amiss = separability_error(material)
    if amiss:
        raise InputError(f"{name} is {amiss}: expected one body, Poisson's ratio constant")
    poisson = complete(material).poisson
    if not 0 <= poisson <= 0.5:
        raise InputError(f"{name} has Poisson's ratio {poisson!r}: expected 0 to 1/2 in a layered body")
    return Stratum(material, math.inf)


def _kernel(strata: tuple[Stratum, ...]) -> Layered:
    """Of the strata as they are in the end, or where one flows as they are at once."""
    materials = [complete(one.material) for one in strata]
    for age in _AGES:
        with suppress(InputError):  # a table ends before
            shear = [float(one.contact_compliance(age)) * 2 / (1 - one.poisson) for one in materials]
            if all(0 < one < math.inf for one in shear):
                break
    poissons = tuple(one.poisson for one in materials)
    return Layered(tuple(one.thickness for one in strata[:-1]), poissons, tuple(one / shear[0] for one in shear))


def compliance_ratio(material: Material, other: Material) -> float | None:
    """Shear compliance of a material over that of another one, at any time; None where it changes in time."""
    if not (isinstance(material, Prony) and isinstance(other, Prony)):
        return 1.0 if material == other else None
    if material.times != other.times:
        return None
    mine, theirs = (np.array([one.glassy, one.fluidity, *one.compliances]) for one in (material, other))
    ratio = float(mine.sum() / theirs.sum())
    return ratio if np.all(np.abs(mine - ratio * theirs) <= _ROUNDING * mine.max()) else None
