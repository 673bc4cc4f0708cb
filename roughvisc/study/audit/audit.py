"""``audit``: estimates of the effects that the model neglects, compared with limits."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from typing import get_args

import xarray as xr

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.mechanics.sheet import Base
from roughvisc.observables.frames import expect_result
from roughvisc.study.audit.checks import LIMITS, Limit
from roughvisc.study.audit.scene import NotKnown, Scene
from roughvisc.units import Quantity, quantities

#: The verdicts, from the best to the worst.
HOLDS, DOUBTFUL, BROKEN, NOT_KNOWN = VERDICTS = ("holds", "doubtful", "broken", "not known")
#: Width of the printed table, which fits into a page of the documentation.
_WIDTH = 98
#: Numbers below it are shown as zero.
_LEAST = 1e-9


@dataclass(frozen=True)
class Finding:
    """Result of the check of one assumption.

    Attributes
    ----------
    name : str
        Name of the assumption.
    number : float
        Number that is compared with the limits; NaN if not known.
    sentence : str
        Meaning of the number for this result, or the missing input.
    limit : Limit
        Limits with which the number is compared.
    """

    name: str
    number: float
    sentence: str
    limit: Limit

    @property
    def verdict(self) -> str:
        """``holds``, ``doubtful``, ``broken`` or ``not known``."""
        if math.isnan(self.number):
            return NOT_KNOWN
        return BROKEN if self.number >= self.limit.broken else DOUBTFUL if self.number >= self.limit.doubtful else HOLDS

    @property
    def shown(self) -> str:
        """The number to two digits, tiny numbers as 0; empty if it is not known."""
        return "" if math.isnan(self.number) else f"{float(f'{max(self.number, _LEAST) - _LEAST:.2g}'):g}"


@dataclass(frozen=True)
class Audit:
    """Findings on the assumptions of the model for a result.

    An audit prints as a table. ``audit["thickness"]`` is the finding of one assumption, with ``number``,
    ``verdict``, ``sentence`` and ``limit``.

    Attributes
    ----------
    title : str
        Title of the result.
    findings : tuple of Finding
        In the order of the table of limits.
    """

    title: str
    findings: tuple[Finding, ...]

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.findings)

    def __getitem__(self, name: str) -> Finding:
        return {one.name: one for one in self.findings}[name]

    def __repr__(self) -> str:
        """Return a table of plain text."""
        lines = [self.title] if self.title else []
        for one in self.findings:
            head = f"{one.name:<11} {one.verdict:<9} {one.shown:>7}  "
            lines.append(textwrap.fill(one.sentence, _WIDTH, initial_indent=head, subsequent_indent=" " * len(head)))
        return "\n".join(lines)


@quantities(
    work_of_adhesion="J/m^2 >= 0",
    yield_strength="Pa > 0",
    thickness="m > 0",
    density="kg/m^3 > 0",
    linear_strain="1 > 0",
    heat_conductivity="W/m/K > 0",
    volumetric_heat_capacity="J/m^3/K > 0",
)
def audit(
    result: xr.Dataset,
    *,
    work_of_adhesion: Quantity | None = None,
    yield_strength: Quantity | None = None,
    thickness: Quantity | None = None,
    base: Base | None = None,
    density: Quantity | None = None,
    linear_strain: Quantity | None = None,
    heat_conductivity: Quantity | None = None,
    volumetric_heat_capacity: Quantity | None = None,
) -> Audit:
    """Check the assumptions of the model for a result.

    Parameters
    ----------
    result : xarray.Dataset
        A result of one case.
    work_of_adhesion : float or str, optional
        Work of adhesion of the two surfaces. [J/m2]
    yield_strength : float or str, optional
        Tensile yield strength of the body that yields first. [Pa]
    thickness : float or str, optional
        True thickness of the body that is modelled as a half-space. [m]
    base : {"bonded", "slipping"}, optional
        Contact of this body with its base; default: bonded.
    density : float or str, optional
        Density of the body. [kg/m3]
    linear_strain : float, optional
        Largest strain at which the material is linear. [-]
    heat_conductivity : float or str, optional
        Heat conductivity of the body. [W/(m K)]
    volumetric_heat_capacity : float or str, optional
        Volumetric heat capacity of the body: density times specific heat. [J/(m3 K)]

    Returns
    -------
    Audit
        A number, a verdict and a sentence for each assumption that applies. Values that are not given come from the
        table ``[audit]`` of the study, if there is one. If a value is missing, the verdict is ``not known``, and the
        sentence names the missing input.

    Raises
    ------
    InputError
        If a value has a wrong type or is out of range, or the result contains several cases.

    Notes
    -----
    :data:`roughvisc.study.audit.checks.LIMITS` contains the limits of the verdicts and their sources. The audit uses
    the lowest modulus: the modulus at the end of the program, or for the longest wavelength at the lowest speed. With
    this modulus adhesion and inertia are largest.

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-2, size=1e-3, shape=24)
    >>> ds = rv.simulate(ball, rv.elastic(1e6), rv.Program().load(5e-3, over=1.0), progress=False)
    >>> found = rv.audit(ds, work_of_adhesion="50 mJ/m^2")
    >>> found["adhesion"].verdict, found["slope"].verdict, found["yielding"].verdict
    ('broken', 'holds', 'not known')
    """
    stated = dict(locals())
    given = {name: value for name, value in stated.items() if name != "result" and value is not None}
    if base is not None:
        one_of("base", base, get_args(Base))
        if thickness is None:
            raise InputError(key="base", found=base, expected="a thickness too")
    expect_result(result, "force", "approach", "contact_area", "contact_fraction")
    if "case" in result.attrs:
        from roughvisc.study.case import Case  # imports this module

        given = {**Case.from_json(result.attrs["case"]).audit_inputs, **given}
    scene, findings = Scene(result, given), []
    for name, limit in LIMITS.items():
        try:
            found = limit.check(scene)
        except NotKnown as missing:
            found = math.nan, str(missing)
        if found is not None:
            findings.append(Finding(name, *found, limit))
    return Audit(str(result.attrs.get("title", "")), tuple(findings))
