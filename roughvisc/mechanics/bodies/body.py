"""The body that a profile is pressed on: a material, and how the surface of the body answers pressure.

A material alone is a half-space of it. A body is a value that everything takes in place of a material.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.bodies.half_space import HALF_SPACE
from roughvisc.mechanics.bodies.kernel import Kernel
from roughvisc.mechanics.bodies.sheet import Base, Sheet
from roughvisc.mechanics.materials.creep import Creep, Material, complete
from roughvisc.mechanics.materials.frequency import complex_compliance, over_frequencies
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.units import Quantity, quantities

Array = NDArray[np.float64]
#: Unless a base is given with a thickness.
BASE: Base = "bonded"


@dataclass(frozen=True)
class Body:
    """A viscoelastic body whose surface is the same everywhere.

    Parameters
    ----------
    material : Material
        A material of roughvisc, or any object with a contact compliance, see
        :class:`roughvisc.mechanics.materials.creep.Material`.
    kernel : Kernel
        Displacement of the surface under pressure at unit contact compliance; default: that of a half-space. See
        :class:`roughvisc.mechanics.bodies.kernel.Kernel` for your own kernels.

    Raises
    ------
    InputError
        If either has a wrong type.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rv.Body(rv.elastic(1e6)) == rv.sheet(rv.elastic(1e6), thickness=float("inf"))
    True
    """

    material: Material
    kernel: Kernel = HALF_SPACE

    def __post_init__(self) -> None:
        if isinstance(self.material, Body):
            raise InputError(f"material is the body {self.material!r}: expected a material")
        complete(self.material)
        for name in ("influence", "transfer"):
            if not callable(getattr(self.kernel, name, None)):
                found = type(self.kernel).__name__
                raise InputError(f"kernel is a {found}: expected a Kernel; it has no {name}")

    @property
    def separates(self) -> bool:
        """Whether space and time do: all waves creep alike, and the kernel and the material say how."""
        return True

    @property
    def materials(self) -> tuple[Prony | Creep, ...]:
        """What it is made of."""
        return (complete(self.material),)

    @property
    def note(self) -> str:
        """What a result should say of how its materials were found; often empty."""
        return "; ".join(one.note for one in self.materials if one.note)

    def over_frequencies(self, frequency: ArrayLike, tolerance: float) -> Self:
        """The same of what stands for the material at some frequencies, see :func:`over_frequencies`. [1/s]"""
        return replace(self, material=over_frequencies(self.material, frequency, tolerance))

    def waves(self, qx: Array, qy: Array, frequency: Array) -> tuple[Array, NDArray[np.complex128]]:
        """Displacement over pressure of waves that oscillate: kernel [m] and complex contact compliance [1/Pa].

        Parameters
        ----------
        qx, qy : ndarray
            Wave numbers, which broadcast. [1/m]
        frequency : ndarray
            Angular frequencies, which broadcast with them; those that :meth:`over_frequencies` was told. [1/s]

        Returns
        -------
        kernel, compliance : ndarray
            Their product is the response; both broadcast with the wave numbers. Infinite where the material creeps
            without end.
        """
        return self.kernel.transfer(qx, qy), complex_compliance(self.material, frequency)

    def attributes(self) -> dict[str, Any]:
        """What a result says of the body beside its material: names of attributes and their values."""
        return self.kernel.described()


def body_of(material: Any) -> Body:
    """The body that is meant by a material, which is a half-space of it, or by a body."""
    return material if isinstance(material, Body) else Body(material)


@quantities(thickness="m")
def sheet(material: Material, thickness: Quantity, base: Base = BASE) -> Body:
    """A sheet of a material on a rigid base.

    Parameters
    ----------
    material : Material
        Material of one body with a Poisson ratio that is constant in time.
    thickness : float or str
        Thickness; infinite for a half-space. [m]
    base : {"bonded", "slipping"}
        Whether the sheet sticks to its base, or slides on it without friction.

    Returns
    -------
    Body
        A body, which functions accept as `material`.

    Raises
    ------
    InputError
        If the thickness is not positive or the base is unknown; if the material describes two bodies, or its Poisson
        ratio is negative or changes in time, because space and time do not separate then.

    Examples
    --------
    >>> import roughvisc as rv
    >>> gel = rv.sheet(rv.zener(3e6, 1e6, 1e5), thickness=1e-4)
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=45)
    >>> ds = rv.simulate(ball, gel, rv.Program().load(1e-4, over=0), progress=False)
    >>> ds.attrs["thickness"], ds.attrs["base"]
    (0.0001, 'bonded')
    """
    amiss = separability_error(material)
    if amiss:
        raise InputError(
            f"thickness is {thickness!r}, and the material is {amiss}: expected one body, Poisson's ratio constant"
        )
    endless = thickness == math.inf
    kernel = Sheet(1.0 if endless else thickness, complete(material).poisson, base)  # checks all of it
    return Body(material) if endless else Body(material, kernel)


def separability_error(material: Any) -> str:
    """Return what a material represents if it is not one body of a constant Poisson ratio; otherwise empty."""
    return str(getattr(material, "stands_for", ""))
