"""Verdicts on the body: yielding, thickness, inertia, heat, sideways displacement."""

from __future__ import annotations

import math

from roughvisc.mechanics.sheet import BASE, Sheet
from roughvisc.study.audit.evidence import Evidence
from roughvisc.study.audit.given import AuditInputs
from roughvisc.study.audit.limits import Finding, as_text, percent, unknown
from roughvisc.study.audit.validity import (
    dundurs_coupling,
    flash_temperature,
    half_space_excess,
    half_space_shortfall,
    moving_load_excess,
    radiation_lag,
)

#: Poisson's ratio by which the shear modulus behind a contact modulus is the least.
_SOFTEST = 0.5
_WITHOUT_LOAD = (
    'Known by load, approach and material; with periodic boundaries keep the pressure, fields = ["pressure"].'
)
#: Exponent of the force over the approach up to which a contact is taken for a flat one, whose force is proportional to
#: the approach; it is 3/2 of a sphere and 2 of a cone.
_FLAT = 1.25


def yielding(evidence: Evidence, given: AuditInputs) -> Finding:
    """The largest pressure over the yield strength."""
    if evidence.contact is None:
        return unknown("yielding", 'Keep the pressure, fields = ["pressure"], for the largest.')
    peak = evidence.contact.peak
    about = f"the largest pressure is {as_text(peak, 'Pa')}"
    if given.yield_strength is None:
        return unknown("yielding", f"Give yield_strength: {about}.")
    shown = as_text(given.yield_strength, "Pa")
    return Finding("yielding", peak / given.yield_strength, f"T{about[1:]}, on a body that yields at {shown}.")


def thickness(evidence: Evidence, given: AuditInputs) -> Finding:
    """By how much approach or force are off on a half-space, in place of the sheet that there is."""
    modelled = evidence.sheet
    if modelled is not None:
        shown = as_text(modelled.thickness, "m", 3)
        if given.thickness is None or math.isclose(given.thickness, modelled.thickness, rel_tol=1e-9):
            return Finding("thickness", 0.0, f"Modelled: a sheet of {shown}, {modelled.base}.")
        other = f"{shown}, and {as_text(given.thickness, 'm', 3)} is stated"
        return unknown("thickness", f"The result is for a sheet of {other}: run the study with that thickness.")
    if evidence.kernel:
        return Finding("thickness", 0.0, f"Modelled: {evidence.kernel}.")
    if len(evidence.bodies) != 1:
        return unknown("thickness", "Two bodies, or a Poisson ratio that changes: there is no sheet to compare with.")
    poisson = evidence.bodies[0].poisson
    if poisson < 0:
        return unknown("thickness", "Poisson's ratio is negative: there is no sheet to compare with.")
    if given.thickness is None:
        return unknown("thickness", "Give thickness.")
    force, approach, late, contact = evidence.force, evidence.approach, evidence.late, evidence.contact
    is_free = evidence.boundary == "free"
    if not (force > 0 and approach > 0) or math.isnan(late) or (contact is None and not is_free):
        return unknown("thickness", _WITHOUT_LOAD)
    sheet, shortfall = Sheet(given.thickness, poisson, given.base or BASE), 0.0
    if is_free:
        excess = half_space_excess(sheet, late, force, approach)
        # the stiffness of a round contact is that of a flat punch of its radius, 2 a / C
        if late > 0 and 2 * evidence.half_width * approach / (late * force) > _FLAT:
            shortfall = half_space_shortfall(sheet, late, force, approach)
    else:
        assert contact is not None
        first = late * contact.relief(sheet) / approach
        excess = first / (1 + first)
    sentence = f"On a {sheet.base} sheet of {as_text(sheet.thickness, 'm', 3)} the approach would be {percent(excess)}"
    sentence += " smaller at the same load"
    if shortfall > excess:
        sentence += f"; at the same approach the force here is {percent(shortfall)} too small"
    return Finding("thickness", max(excess, shortfall), f"{sentence}.")


def inertia(evidence: Evidence, given: AuditInputs) -> Finding:
    """What waves change: by their lag over the time scale of the program, and by the speed of slides against theirs."""
    width, scale, speed, density = evidence.half_width, evidence.time_scale, evidence.speed, given.density
    if math.isnan(evidence.late) or math.isnan(scale):
        return unknown("inertia", "The result does not state its material and program.")
    if not width > 0 or not evidence.late > 0:
        return unknown("inertia", "The width of the contact is not known, or there is no creep.")
    if math.isnan(speed):
        return unknown("inertia", "The speed of the slides is not known: audit the result with all of its steps.")
    if density is None:
        return unknown("inertia", "Give density.")
    bodies = [(one.late, one.poisson) for one in evidence.bodies] or [(evidence.late, _SOFTEST)]
    solids = [((1 - poisson) / (2 * late), poisson) for late, poisson in bodies if late > 0]
    shear = min(modulus for modulus, _ in solids)
    lag = radiation_lag(width, shear, density)
    excess = max(moving_load_excess(speed, modulus, density, poisson) for modulus, poisson in solids) if speed else 0.0
    if excess > lag / scale:
        more = "faster than waves along the surface"
        if math.isfinite(excess):
            more = f"which increases the displacement by {percent(excess)}"
        waves = f"Shear waves travel at {as_text(math.sqrt(shear / density), 'm/s')}"
        return Finding("inertia", excess, f"{waves}, and the profile slides at {as_text(speed, 'm/s')}, {more}.")
    takes = f"the program changes within {as_text(scale, 's')}" if math.isfinite(scale) else "nothing changes"
    waves = f"Waves lag by {as_text(lag, 's')} over {as_text(2 * width, 'm')}"
    return Finding("inertia", lag / scale, f"{waves}; {takes}.")


def heating(evidence: Evidence, given: AuditInputs) -> Finding | None:
    """Rise of temperature of the spots by friction, in a slide; None where nothing slides."""
    area, spots, speed, power = evidence.rubbed_area, evidence.rubbed_spots, evidence.speed, evidence.friction_power
    if speed == 0:
        return None
    if math.isnan(power):
        return unknown("heating", "The speed of the slides is not known: audit the result with all of its steps.")
    if not spots or not area > 0:
        return unknown("heating", 'Keep the pressure, fields = ["pressure"], for the spots that friction heats.')
    radius = math.sqrt(area / (math.pi * spots))
    many = "one spot" if spots == 1 else f"{spots} spots"
    about = f"{as_text(max(power, 0.0), 'W')} of friction heat {many} of radius {as_text(radius, 'm')}"
    flux, conductivity, capacity = (
        max(power, 0.0) / area,
        given.heat_conductivity,
        given.volumetric_heat_capacity,
    )
    if conductivity is None or capacity is None:
        missing = " and ".join(
            name for name in ("heat_conductivity", "volumetric_heat_capacity") if getattr(given, name) is None
        )
        return unknown("heating", f"Give {missing}: {about}.")
    rise = flash_temperature(flux, radius, speed, conductivity, capacity)
    return Finding("heating", rise, f"{about[0].upper()}{about[1:]} by {as_text(rise, 'K')} above the surface around.")


def coupling(evidence: Evidence, given: AuditInputs) -> Finding:
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
        return unknown("coupling", "There is no creep by the end of the program.")
    number = max(found)
    told = "The body is incompressible: static friction does not change the pressure." if number == 0 else ""
    return Finding(
        "coupling", number, told or "The body is compressible: static friction would change the pressure slightly."
    )
