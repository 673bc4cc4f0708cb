"""Verdicts on the body: yielding, thickness, inertia, heat, sideways displacement."""

from __future__ import annotations

import math

from roughvisc.mechanics.sheet import BASE, Sheet
from roughvisc.study.audit.evidence import Evidence
from roughvisc.study.audit.given import AuditInputs
from roughvisc.study.audit.limits import LIMITS, Finding, as_text, percent, unknown
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
#: Density of osmium, the densest solid. [kg/m3]
_DENSEST = 22_600.0


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
    if evidence.sheet is not None:
        return _modelled(evidence.sheet, given)
    if evidence.kernel:
        return Finding("thickness", 0.0, f"Modelled: {evidence.kernel}.")
    if len(evidence.bodies) != 1:
        return unknown("thickness", "Two bodies, or a Poisson ratio that changes: there is no sheet to compare with.")
    poisson = evidence.bodies[0].poisson
    if poisson < 0:
        return unknown("thickness", "Poisson's ratio is negative: there is no sheet to compare with.")
    if given.thickness is None:
        return unknown("thickness", "Give thickness.")
    sheet = Sheet(given.thickness, poisson, given.base or BASE)
    excess, shortfall = _excess(evidence, sheet), _shortfall(evidence, sheet)
    if math.isnan(excess):
        return unknown("thickness", _WITHOUT_LOAD)
    sentence = f"On a {sheet.base} sheet of {as_text(sheet.thickness, 'm', 3)} the approach would be {percent(excess)}"
    sentence += " smaller at the same load"
    if shortfall > excess:
        sentence += f"; at the same approach the force here is {percent(shortfall)} too small"
    return Finding("thickness", max(excess, shortfall), f"{sentence}.")


def _modelled(sheet: Sheet, given: AuditInputs) -> Finding:
    if given.thickness is not None and not math.isclose(given.thickness, sheet.thickness, rel_tol=1e-9):
        other = f"{as_text(sheet.thickness, 'm', 3)}, and {as_text(given.thickness, 'm', 3)} is stated"
        return unknown("thickness", f"The result is for a sheet of {other}: run the study with that thickness.")
    return Finding("thickness", 0.0, f"Modelled: a sheet of {as_text(sheet.thickness, 'm', 3)}, {sheet.base}.")


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


def _shortfall(evidence: Evidence, sheet: Sheet) -> float:
    """Of the force; 0 where the force is proportional to the approach, and with periodic boundaries."""
    force, approach, late = evidence.force, evidence.approach, evidence.late
    if evidence.boundary != "free" or not (force > 0 and approach > 0 and late > 0):
        return 0.0
    # the stiffness of a round contact is that of a flat punch of its radius, 2 a / C
    if not 2 * evidence.half_width * approach / (late * force) > _FLAT:
        return 0.0
    return half_space_shortfall(sheet, late, force, approach)


def inertia(evidence: Evidence, given: AuditInputs) -> Finding:
    """What waves change: by their lag over the time scale of the program, and by the speed of slides against theirs."""
    width, scale = evidence.half_width, evidence.time_scale
    if math.isnan(evidence.late) or math.isnan(scale):
        return unknown("inertia", "The result does not state its material and program.")
    if not width > 0 or not evidence.late > 0:
        return unknown("inertia", "The width of the contact is not known, or there is no creep.")
    if math.isnan(evidence.speed):
        return unknown("inertia", "The speed of the slides is not known: audit the result with all of its steps.")
    bodies = [(one.late, one.poisson) for one in evidence.bodies] or [(evidence.late, _SOFTEST)]
    solids = [((1 - poisson) / (2 * late), poisson) for late, poisson in bodies if late > 0]
    shear = min(modulus for modulus, _ in solids)

    def lag_and_excess(density: float) -> tuple[float, float]:
        lag = radiation_lag(width, shear, density) / scale
        if not evidence.speed:
            return lag, 0.0
        return lag, max(moving_load_excess(evidence.speed, modulus, density, poisson) for modulus, poisson in solids)

    any_solid, density = "", given.density
    if density is None:
        if max(lag_and_excess(_DENSEST)) >= LIMITS["inertia"].doubtful:
            return unknown("inertia", "Give density.")
        density, any_solid = _DENSEST, f" in any solid (up to {_DENSEST:g} kg/m^3)"
    lag, excess = lag_and_excess(density)
    number = max(lag, excess)
    if excess > lag:
        waves = f"Shear waves{any_solid} travel at {as_text(math.sqrt(shear / density), 'm/s')}"
        more = "faster than waves along the surface"
        if math.isfinite(excess):
            more = f"which increases the displacement by {percent(excess)}"
        return Finding(
            "inertia",
            number,
            f"{waves}, and the profile slides at {as_text(evidence.speed, 'm/s')}, {more}.",
        )
    takes = f"the program changes within {as_text(scale, 's')}" if math.isfinite(scale) else "nothing changes"
    return Finding(
        "inertia",
        number,
        f"Waves{any_solid} lag by {as_text(lag * scale, 's')} over {as_text(2 * width, 'm')}; {takes}.",
    )


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
