"""Verdicts on the body: yielding, thickness, inertia, sideways displacement."""

from __future__ import annotations

import math
from dataclasses import replace

from scipy.optimize import bisect

from roughvisc.mechanics.closed_forms.validity import dundurs_coupling, half_space_excess, radiation_lag
from roughvisc.mechanics.halfspace.sheet import Sheet
from roughvisc.study.audit.evidence import Evidence
from roughvisc.study.audit.finding import Finding, percent, told, unknown
from roughvisc.study.audit.given import Given
from roughvisc.study.audit.limits import LIMITS
from roughvisc.study.statement.body import BASE

#: Poisson's ratio by which the shear modulus behind a contact modulus is the least.
_SOFTEST = 0.5
_WITHOUT_LOAD = (
    'Known by load, approach and material; with periodic boundaries keep the pressure, fields = ["pressure"].'
)
#: Of osmium: no solid is denser. [kg/m3]
_DENSEST = 22_600.0


def yielding(evidence: Evidence, given: Given) -> Finding:
    """The largest pressure over the yield strength."""
    if not evidence.ran:
        return unknown("yielding", "Known after the run, by the largest pressure.")
    if evidence.contact is None:
        return unknown("yielding", 'Keep the pressure, fields = ["pressure"], for the largest.')
    peak = evidence.contact.peak
    about = f"the largest pressure is {told(peak, 'Pa')}"
    if given.yield_strength is None:
        least = told(peak / LIMITS["yielding"].doubtful, "Pa")
        return unknown("yielding", f"Give yield_strength: {about}; above {least} nothing yields.")
    shown = told(given.yield_strength, "Pa")
    return Finding("yielding", peak / given.yield_strength, f"T{about[1:]}, on a body that yields at {shown}.")


def thickness(evidence: Evidence, given: Given) -> Finding:
    """By how much the approach is too large on a half-space, in place of the sheet that there is."""
    if evidence.sheet is not None:
        return _modelled(evidence.sheet, given)
    if len(evidence.bodies) != 1:
        return unknown("thickness", "Two bodies, or a Poisson ratio that changes: no sheet to compare with is known.")
    poisson = evidence.bodies[0].poisson
    if poisson < 0:
        return unknown("thickness", "Poisson's ratio is negative: no sheet to compare with is known.")
    if given.thickness is None:
        return unknown("thickness", f"Give thickness{_enough(evidence, Sheet(1.0, poisson))}.")
    sheet = Sheet(given.thickness, poisson, given.base or BASE)
    number = _excess(evidence, sheet)
    if math.isnan(number):
        return unknown("thickness", _WITHOUT_LOAD if evidence.ran else "Known after the run, by the pressure.")
    words = f"a {sheet.base} sheet of {told(sheet.thickness, 'm', 3)}"
    return Finding("thickness", number, f"On {words} the approach would be {percent(number)} smaller at the same load.")


def _modelled(sheet: Sheet, given: Given) -> Finding:
    if given.thickness is not None and not math.isclose(given.thickness, sheet.thickness, rel_tol=1e-9):
        other = f"{told(sheet.thickness, 'm', 3)}, and {told(given.thickness, 'm', 3)} is stated"
        return unknown("thickness", f"The sheet that was pressed is one of {other}: press that one.")
    return Finding("thickness", 0.0, f"Modelled: a sheet of {told(sheet.thickness, 'm', 3)}, {sheet.base}.")


def _excess(evidence: Evidence, sheet: Sheet) -> float:
    """Of the approach; NaN where load, approach, modulus, or with periodic boundaries the pressure, are not known."""
    force, approach, late = evidence.force, evidence.approach, evidence.late
    if not (force > 0 and approach > 0) or math.isnan(late):
        return math.nan
    if evidence.boundary == "free":
        return half_space_excess(sheet, late, force, approach)
    if evidence.contact is None:
        return math.nan
    first = late * evidence.contact.relief(sheet) / approach
    return first / (1 + first)


def _enough(evidence: Evidence, sheet: Sheet) -> str:
    """From which thickness on a half-space would do, the sheet bonded."""
    low, high = (factor * max(evidence.size) for factor in (1e-3, 1e3))
    if not math.isfinite(high) or math.isnan(_excess(evidence, sheet)):
        return ""

    def beyond(thickness: float) -> float:
        return _excess(evidence, replace(sheet, thickness=thickness)) - LIMITS["thickness"].doubtful

    if beyond(low) <= 0:
        return f": from {told(low, 'm')} on a half-space does, if not before"
    return f": from {told(bisect(beyond, low, high, rtol=1e-3), 'm')} on a half-space does, even if bonded"


def inertia(evidence: Evidence, given: Given) -> Finding:
    """The lag by waves over the time scale of the program."""
    width, scale = evidence.half_width, evidence.time_scale
    if math.isnan(evidence.late) or math.isnan(scale):
        return unknown("inertia", "The result does not say its material and program.")
    if not width > 0 or not evidence.late > 0:
        return unknown("inertia", "The width of the contact is not known, or nothing has crept.")
    bodies = [(one.late, one.poisson) for one in evidence.bodies] or [(evidence.late, _SOFTEST)]
    shear = min((1 - poisson) / (2 * late) for late, poisson in bodies if late > 0)
    known = given.density is not None
    lag = radiation_lag(width, shear, given.density if known else _DENSEST)
    if not known and lag / scale >= LIMITS["inertia"].doubtful:
        most = _DENSEST * (LIMITS["inertia"].doubtful * scale / lag) ** 2
        return unknown("inertia", f"Give density: up to {float(f'{most:.2g}'):g} kg/m^3 the motion is slow.")
    of = "Waves lag" if known else f"Of any solid (up to {_DENSEST:g} kg/m^3) waves lag"
    takes = f"the program changes within {told(scale, 's')}" if math.isfinite(scale) else "nothing changes"
    return Finding("inertia", lag / scale, f"{of} by {told(lag, 's')} over {told(2 * width, 'm')}; {takes}.")


def coupling(evidence: Evidence, given: Given) -> Finding:
    """Dundurs' second constant."""
    if not evidence.bodies:
        return unknown("coupling", "Poisson's ratio of each body is not known, or changes in time.")
    poissons = [one.poisson for one in evidence.bodies]
    found = [
        dundurs_coupling(compliances, poissons)
        for compliances in ([one.early for one in evidence.bodies], [one.late for one in evidence.bodies])
        if sum(compliances) > 0
    ]
    if not found:
        return unknown("coupling", "Nothing has crept by the end of the program.")
    number = max(found)
    told = "Incompressible: friction at rest changes nothing." if number == 0 else ""
    return Finding(
        "coupling", number, told or "Friction at rest would tilt the pressure a little, as the body is compressible."
    )
