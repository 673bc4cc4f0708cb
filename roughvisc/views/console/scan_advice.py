"""What is seen in a scan and what to do about it, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rich.console import Group
from rich.table import Table
from rich.text import Text

from roughvisc.topography.inspection import MOST_SPIKES, RESOLVED, Inspection, Noise
from roughvisc.views.console.tables import readable

#: What is to be done where nothing is.
_NOTHING = "no action needed"
#: Kurtosis of heights that may be Gaussian: that of a patch scatters. [-]
_GAUSSIAN = (2.4, 4.0)
#: Root mean square slope above which a unit or the spacing is mostly wrong. [-]
_STEEP = 1.0


def advice_table(found: Inspection) -> Group:
    """What is seen in a scan, each with what follows from it.

    Parameters
    ----------
    found : Inspection
        Of :func:`~roughvisc.topography.inspection.inspect_scan`.
    """
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for what, seen, do in advice(found):
        table.add_row(what, Text(seen))
        table.add_row("", Text(f"-> {do}", style="" if do == _NOTHING else "bold"))
    return Group(Text("Findings and recommendations", style="bold"), table)


def advice(found: Inspection) -> Iterator[tuple[str, str, str]]:
    """What is looked at, what is seen, and what to do, of a scan."""
    if found.holes or "crop" in found.steps:
        yield "Holes", *_holes(found)
    yield "Missing points", *_missing(found)
    yield "Spikes", *_spikes(found)
    yield "Tilt", *_tilt(found)
    yield "Form", *_form(found)
    yield "Borders", *_borders(found)
    yield "Slope", *_slope(found)
    yield "Heights", *_heights(found)
    if found.noise is None:
        yield "Noise", "not known: the scan is flat, smaller than 16 points, or mostly missing", _NOTHING
    else:
        yield "Noise", *_noise(found, found.noise)
        yield "Resolution", *_resolution(found, found.noise)


def _holes(found: Inspection) -> tuple[str, str]:
    seen = f"{100 * found.holes:.2g} % of the scan lies in holes wider than a few points"
    if "crop" not in found.steps:
        return seen, "too small to crop; fill them with the other missing points"
    nx, ny = found.shape
    return seen, (
        f"crop to the largest part without holes, {nx} x {ny} points (the findings below refer to it); or keep "
        'the whole scan with missing = "absent" if there is no material in the holes'
    )


def _missing(found: Inspection) -> tuple[str, str]:
    if not found.missing:
        return "none", _NOTHING
    seen = f"{found.missing} ({100 * found.missing / found.points:.2g} %)"
    return seen, 'fill = "harmonic"; the result marks the filled points'


def _spikes(found: Inspection) -> tuple[str, str]:
    if not found.spikes:
        return "none", _NOTHING
    points = "point" if found.spikes == 1 else "points"
    share = f"{found.spikes} {points} ({100 * found.spikes / found.points:.2g} %)"
    if found.spikes > MOST_SPIKES * found.points:
        do = "too many to be spikes: check the picture; set outliers = true only if the surface has no such features"
        return f"{share} differ strongly from their neighbours", do
    effect = f"Sq is {_height(found.rms_levelled)} with and {_height(found.rms_despiked)} without them"
    return f"{share}: {effect}", "outliers = true; otherwise the spikes carry the load"


def _tilt(found: Inspection) -> tuple[str, str]:
    angles = " and ".join(f"{_angle(slope)} along {axis}" for slope, axis in zip(found.tilt, "xy", strict=True))
    effect = f"Sq is {_height(found.rms_raw)} before and {_height(found.rms_levelled)} after levelling"
    order = found.steps["level"]
    do = f"level = {order} subtracts the plane{' too' if order > 1 else ''}"
    if order == 0:
        do = "level = 0 subtracts the mean only; subtracting a plane would break the periodicity"
    return f"{angles}: {effect}", do


def _form(found: Inspection) -> tuple[str, str]:
    seen = f"a quadratic form accounts for {100 * found.form_share:.2g} % of Sq squared"
    if found.steps["level"] != 2:
        return seen, _NOTHING
    do = 'level = 2 for the roughness alone; level = 1 and boundary = "free" to press the form as well'
    return f"{seen}; Sq is {_height(found.rms_flat)} without it", do


def _borders(found: Inspection) -> tuple[str, str]:
    (x, y), (nx, ny) = found.borders.of_rms, found.borders.of_neighbours
    seen = (
        f"opposite borders differ by {x:.2g} Sq along x and {y:.2g} Sq along y: {nx:.2g} and {ny:.2g} times the "
        "difference of neighbouring rows"
    )
    if not found.borders.jumps:
        return seen, 'boundary = "periodic"'
    return seen, 'boundary = "mirror"; with "periodic" the step at the seam carries load'


def _slope(found: Inspection) -> tuple[str, str]:
    seen = f"the rms slope is {found.rms_slope:.2g} after these steps"
    if found.rms_slope <= _STEEP:
        return seen, _NOTHING
    return f"{seen}, which is steeper than 45°, unlike almost any measured surface", (
        "check the spacing and the units of x, y and height: one of them is probably wrong; if all are right, the "
        "half-space model does not hold, since it assumes small slopes"
    )


def _heights(found: Inspection) -> tuple[str, str]:
    seen = f"their kurtosis is {found.kurtosis:.2g} (3: Gaussian)"
    low, high = _GAUSSIAN
    if not found.kurtosis < low and not found.kurtosis > high:
        return seen, _NOTHING
    why = "plateaus, or few long waves" if found.kurtosis < low else "summits or pits that stand out"
    do = "realisations = 24 in [sweep] compares the scan with random surfaces of the same spectrum"
    return f"{seen}: {why}; the spectrum alone may not give its contact", do


def _noise(found: Inspection, noise: Noise) -> tuple[str, str]:
    if not noise.floor:
        return f"no noise floor down to two cells; noise is below {_height(noise.rms)} rms", _NOTHING
    seen = (
        f"noise floor of {_height(noise.rms)} rms; wavelengths below {_height(noise.wavelength)} are noise "
        f"and make {100 * noise.noisy_slopes:.2g} % of the mean square slope"
    )
    return seen, "filter out these wavelengths" if "filter" in found.steps else _NOTHING


def _resolution(found: Inspection, noise: Noise) -> tuple[str, str]:
    seen = (
        f"the shortest resolved wavelength is {_height(noise.wavelength)}; wavelengths below {RESOLVED} cells make "
        f"{100 * noise.fine_slopes:.2g} % of the mean square slope"
    )
    if noise.fine_slopes > 0.5 and "filter" not in found.steps:
        return seen, "contact spots will be about one cell wide: set grid_error = true, or filter to longer wavelengths"
    return seen, _NOTHING


def _height(value: float) -> str:
    return readable(value, "m")


def _angle(slope: float) -> str:
    degrees = math.degrees(math.atan(abs(slope)))
    return f"{degrees:.2g}°" if degrees >= 1e-3 else "less than 0.001°"
