"""``audit``: what the model leaves out, and whether that matters in a result."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.mechanics.sheet import Base
from roughvisc.study.audit import body_verdicts as of_body
from roughvisc.study.audit import surface_verdicts as of_surface
from roughvisc.study.audit.evidence import of_result
from roughvisc.study.audit.given import AuditInputs
from roughvisc.study.audit.limits import Finding

#: In the order of the table of limits.
_VERDICTS = (
    of_surface.adhesion,
    of_surface.stickiness,
    of_body.yielding,
    of_body.thickness,
    of_surface.slope,
    of_surface.strain,
    of_body.inertia,
    of_body.heating,
    of_body.coupling,
    of_surface.resolution,
    of_surface.border,
)
#: Of the printed table: what a page of the documentation holds.
_WIDTH = 98


@dataclass(frozen=True)
class Audit:
    """Findings on the assumptions that a scene makes.

    It prints as a table. ``audit["thickness"]`` is the finding of one assumption, with ``number``,
    ``verdict``, ``sentence`` and ``limit``.

    Attributes
    ----------
    title : str
        Of what was audited.
    findings : tuple of Finding
        In the order of the table of limits.
    """

    title: str
    findings: tuple[Finding, ...]

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.findings)

    def __len__(self) -> int:
        return len(self.findings)

    def __getitem__(self, name: str) -> Finding:
        for finding in self.findings:
            if finding.name == name:
                return finding
        raise KeyError(f"{name!r}: expected one of {', '.join(one.name for one in self.findings)}")

    def __repr__(self) -> str:
        """A table of plain text."""
        lines = [self.title] if self.title else []
        for one in self.findings:
            head = f"{one.name:<11} {one.verdict:<9} {one.shown:>7}  "
            lines.append(textwrap.fill(one.sentence, _WIDTH, initial_indent=head, subsequent_indent=" " * len(head)))
        return "\n".join(lines)

    def to_dataset(self) -> xr.Dataset:
        """The findings over ``assumption``: number, verdict, sentence, and from where on it is doubtful and broken."""
        columns = {
            "number": [one.number for one in self],
            "verdict": [one.verdict for one in self],
            "sentence": [one.sentence for one in self],
            "doubtful_from": [one.limit.doubtful for one in self],
            "broken_from": [one.limit.broken for one in self],
            "source": [one.limit.source for one in self],
        }
        names = np.array([one.name for one in self])
        dataset = xr.Dataset({name: ("assumption", np.array(values)) for name, values in columns.items()})
        return dataset.assign_coords(assumption=names).assign_attrs(title=self.title)


def audit(
    result: xr.Dataset,
    *,
    work_of_adhesion: float | str | None = None,
    yield_strength: float | str | None = None,
    thickness: float | str | None = None,
    base: Base | None = None,
    density: float | str | None = None,
    linear_strain: float | None = None,
    heat_conductivity: float | str | None = None,
    volumetric_heat_capacity: float | str | None = None,
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
        table ``[audit]`` of the study, if there is one. Without a value the verdict is ``not known``, and the sentence
        says what to give.

    Raises
    ------
    InputError
        If a value has a wrong type or is out of range, or the result is not that of one case.

    Notes
    -----
    :data:`roughvisc.study.audit.limits.LIMITS` contains the limits of the verdicts and their sources. The audit uses
    the lowest modulus: that at the end of the program, or for the longest wavelength at the lowest speed. This is the
    least favourable choice for neglecting adhesion and inertia.

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-2, size=1e-3, shape=24)
    >>> ds = rv.simulate(ball, rv.elastic(1e6), rv.Program().load(5e-3, over=1.0), progress=False)
    >>> found = rv.audit(ds, work_of_adhesion="50 mJ/m^2")
    >>> found["adhesion"].verdict, found["slope"].verdict, found["yielding"].verdict
    ('broken', 'holds', 'not known')
    """
    given = AuditInputs(
        work_of_adhesion=work_of_adhesion,
        yield_strength=yield_strength,
        thickness=thickness,
        base=base,
        density=density,
        linear_strain=linear_strain,
        heat_conductivity=heat_conductivity,
        volumetric_heat_capacity=volumetric_heat_capacity,
    )
    if base is not None and thickness is None:
        raise InputError(key="base", found=base, expected="a thickness too")
    evidence = of_result(result)
    given = given.over(evidence.given)
    found = (verdict(evidence, given) for verdict in _VERDICTS)
    return Audit(str(result.attrs.get("title", "")), tuple(one for one in found if one is not None))
