"""Verdicts on the surface: adhesion of its spots and of its roughness, slopes, waves below the grid, borders."""

from __future__ import annotations

import math

from roughvisc.study.audit.adhesion import (
    adhesive_load,
    conformal_energy,
    pull_off_force,
    punch_pull_off,
    rough_attraction,
    tabor_parameter,
)
from roughvisc.study.audit.evidence import Evidence
from roughvisc.study.audit.given import AuditInputs
from roughvisc.study.audit.limits import ATTRACTION_RANGE, LIMITS, STATED, STIFF, Finding, as_text, percent, unknown

#: Contact fraction from which on spots have grown together.
_MERGED = 0.5
#: A profile is flat where its radius of curvature exceeds so many times the width of the contact.
_FLAT = 1e4
_NO_MATERIAL = "The result does not state its material: audit the file from run, or the Dataset from simulate."


def adhesion(evidence: Evidence, given: AuditInputs) -> Finding:
    """Pull-off force of the spots in contact over the largest load."""
    contact, w = evidence.contact, given.work_of_adhesion
    if not evidence.force > 0:
        return unknown("adhesion", "There was no load, and so no contact to judge.")
    if contact is None:
        return unknown("adhesion", 'Keep the pressure, fields = ["pressure"], for the spots in contact.')
    flat = not contact.curvature * _FLAT * contact.half_width > 1
    if evidence.boundary != "free" and (flat or evidence.fraction > _MERGED):
        merged = f"{percent(evidence.fraction)} of the area is in contact"
        return unknown("adhesion", f"{merged}, without separate spots: see stickiness.")
    if flat:
        return _flat(evidence, w)
    radius = 1 / contact.curvature
    spots = f"one spot of radius {as_text(radius, 'm')}"
    if contact.spots > 1:
        spots = f"{contact.spots} spots of mean radius {as_text(radius, 'm')}"
    if w is None:
        return unknown("adhesion", f"Give work_of_adhesion: the load is on {spots}.")
    tabor = _tabor(evidence, radius, w)
    pull = contact.spots * pull_off_force(radius, w, math.inf if math.isnan(tabor) else tabor)
    ratio = pull / evidence.force
    if tabor <= STIFF:
        grown, theory = (1 + ratio) ** (2 / 3) - 1, "DMT"
    else:
        grown, theory = float(adhesive_load(1.0, ratio)) ** (2 / 3) - 1, "JKR"
    theory += "" if math.isnan(tabor) else f", Tabor parameter {as_text(tabor, '1')}"
    more = f"{percent(grown)} larger" if grown < 1 else f"{as_text(1 + grown, '1')} times as large"
    return Finding(
        "adhesion",
        ratio,
        f"{spots[0].upper()}{spots[1:]} would hold {as_text(pull, 'N')} when pulled off, and make the contact area "
        f"{more} ({theory}).",
    )


def _flat(evidence: Evidence, w: float | None) -> Finding:
    """Of a flat punch, by its largest modulus, which holds it best."""
    radius = math.sqrt(evidence.area / math.pi)
    if not evidence.early > 0:
        return unknown("adhesion", "The contact is flat, and the material has no instantaneous modulus.")
    if w is None:
        return unknown("adhesion", "Give work_of_adhesion: the contact is flat.")
    pull = punch_pull_off(radius, 1 / evidence.early, w)
    held = f"A flat contact would hold {as_text(pull, 'N')} when pulled off fast (Kendall)"
    return Finding("adhesion", pull / evidence.force, f"{held}; its area does not change.")


def stickiness(evidence: Evidence, given: AuditInputs) -> Finding | None:
    """Whether a rough surface sticks without a load; None of a smooth body in free space."""
    texture, w = evidence.texture, given.work_of_adhesion
    if texture is None:
        return unknown("stickiness", "The result contains no heights.")
    if texture.smooth and evidence.boundary == "free":
        return None
    if not texture.slope > 0:
        return unknown("stickiness", "The surface is flat: it has no roughness.")
    if math.isnan(evidence.modulus):
        return unknown("stickiness", _NO_MATERIAL)
    energy = conformal_energy(texture.roughness, evidence.modulus)
    if w is None:
        return unknown("stickiness", "Give work_of_adhesion.")
    tabor = _tabor(evidence, 2 / texture.laplacian, w)
    if tabor <= STIFF:
        ratio = rough_attraction(texture.slope, texture.laplacian, evidence.modulus, w, ATTRACTION_RANGE)
        return Finding(
            "stickiness",
            ratio,
            f"Stiff spots (Tabor parameter {tabor:.2g}): attraction around them is {ratio:.2g} times the repulsion in "
            "them (Pastewka, Robbins).",
        )
    if math.isnan(energy):
        return unknown("stickiness", "Points are absent: the energy of full contact is not known.")
    ratio = w / energy
    return Finding(
        "stickiness",
        ratio,
        f"Soft spots (Tabor parameter {as_text(tabor, '1')}): full contact stores {as_text(energy, 'J/m^2')} of "
        f"elastic energy at the last modulus, and adhesion gains {as_text(w, 'J/m^2')} (Persson, Tosatti).",
    )


def slope(evidence: Evidence, given: AuditInputs) -> Finding:
    """The rms slope of the loaded surface."""
    if math.isnan(evidence.slope):
        return unknown("slope", "The result contains no loaded heights.")
    number = evidence.slope
    where = "surface" if evidence.boundary != "free" else "part of the surface that may touch"
    return Finding("slope", number, f"The {where} has {percent(number**2 / 2)} more area than its projection.")


def strain(evidence: Evidence, given: AuditInputs) -> Finding:
    """The rms slope of the loaded surface over the linear range."""
    if math.isnan(evidence.slope):
        return unknown("strain", "The result contains no loaded heights.")
    largest = evidence.slope
    about = f"strains are at most about {percent(largest)}, and on average {percent(0.2 * largest)}"
    if given.linear_strain is None:
        return unknown("strain", f"Give linear_strain: {about}.")
    return Finding("strain", largest / given.linear_strain, f"{about[0].upper()}{about[1:]}.")


def resolution(evidence: Evidence, given: AuditInputs) -> Finding:
    """Cells in the shortest wave that a generator states; of others what the last octave adds to the rms slope."""
    texture = evidence.texture
    if texture is None:
        return unknown("resolution", "The result contains no heights.")
    if texture.stated is not None:
        wave, cells = texture.stated.wavelength, texture.stated.cells
        number = 1 / cells
        few = "" if number < LIMITS[STATED].doubtful else ". Use smaller cells, or longer wavelengths"
        return Finding(
            "resolution",
            number,
            f"The shortest wavelength of the generator, {as_text(wave, 'm')}, has {cells:.3g} cells{few}.",
            STATED,
        )
    if texture.analytic:
        return Finding("resolution", 0.0, "The profile is analytic: it has no shorter wavelengths.")
    if texture.smooth:
        return Finding(
            "resolution",
            0.005,
            f"Only form: 99 % of the squared slope lies above {as_text(texture.shortest / 2, 'm')}.",
        )
    if math.isnan(texture.last_octave):
        why = "The surface is flat" if texture.slope == 0 else "Points are absent"
        return unknown("resolution", f"{why}: its shortest wavelengths are not known.")
    return Finding(
        "resolution",
        texture.last_octave,
        f"Wavelengths below {as_text(texture.shortest, 'm')} add {percent(texture.last_octave)} of the slope, and "
        "remove as much of the area; the next octave may do so again.",
    )


def border(evidence: Evidence, given: AuditInputs) -> Finding | None:
    """Whether a surface repeats with a step; None in free space."""
    if evidence.boundary == "free":
        return None
    if evidence.texture is None:
        return unknown("border", "The result contains no heights.")
    number = evidence.texture.mismatch
    if evidence.boundary == "mirror":
        return Finding("border", number, "The surface repeats with its mirror images, without a step.")
    seam = "Opposite borders match" if number < LIMITS["border"].doubtful else "The surface repeats with a step"
    advice = "" if number < LIMITS["border"].doubtful else ' Use boundary = "mirror".'
    return Finding("border", number, f"{seam}: they differ {number:.2g} times as much as neighbouring rows.{advice}")


def _tabor(evidence: Evidence, radius: float, w: float) -> float:
    """Tabor parameter by the modulus at the end; NaN where there is none."""
    if math.isnan(evidence.modulus):
        return math.nan
    return tabor_parameter(radius, evidence.modulus, w, ATTRACTION_RANGE)
