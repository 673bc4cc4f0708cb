"""Rates of rows that state too little error, on random scenes with closed forms or sharp references.

    python workflows/benchmarks/closed_forms.py [KIND ...] [--scenes N] [--seed S] [--worst N]

A row is one number of a result with its true and its stated error. Kinds:

- ``cells-many``, ``cells-one``, ``cells-all``: force of one cell after a jump of the approach, with twenty kept times,
  with one early kept time and the end, and with every step kept; closed form.
- ``waves``: pressure of full contact after a jump of the load, then held, ramped or cycled, on half-spaces, sheets and
  layers, with many kept times or one; closed form.
- ``slides``, ``slides-friction``: pressure and friction of programs that slide waves in full contact; closed form.
- ``work-approach``, ``work-load``: work on one cell, under a given approach and a given load; closed form.
- ``friction``: pressure and friction of waves that slide in full contact, on half-spaces, sheets and layers; closed
  form.
- ``channels``: leak rate of channels in series and in parallel, over up to five decades of the gap; closed form.
- ``grid``: error of the grid of line contacts, at rest (Westergaard, finest grid of 1,536 cells) and sliding (16 times
  the cells).
- ``area``: contact area and approach of balls, cones and crossed waves, compared with a tolerance 100 times tighter.

The seed is the date unless given, so that each day draws other scenes. Prints by kind the number of rows; those without
a stated error; those beyond the tolerance; those that are bad: beyond 1.5 tolerances and 1.5 times the stated error
(work: half a tolerance); the median of stated over true error, where errors below a thousandth and below a hundredth of
the tolerance count as that; and the convolutions. The tolerance of ``grid`` is the noise of its references. The error
of a friction force of ``slides-friction`` is relative to the largest one of the program. 100 scenes of a kind take half
a minute on one core, those of ``channels`` a second.
"""

import argparse
import datetime
import functools
import logging
import math
import time
import warnings
from typing import NamedTuple

import numpy as np
from scipy.special import gamma

import roughvisc as rv
from roughvisc.mechanics.layer import effective_compliance
from roughvisc.mechanics.transport import flow

#: A row is bad if its error exceeds both the tolerance and the stated error by this factor. Errors of the work are
#: usually far below the tolerance: they count from the second factor on.
BAD, BAD_WORK = 1.5, 0.5
#: Errors below a fraction of the tolerance count as this fraction in the ratio of stated over true error. With the
#: second one, exact rows and rows that are far more accurate than asked do not decide the median.
SMALL, SMALL_HUNDREDTH = 1e-3, 1e-2


class Row(NamedTuple):
    """One number of a result: relative errors, tolerance, and the convolutions that no other row counts.

    A row may be bad only if its error exceeds the tolerance by the factor `least`.
    """

    true: float
    stated: float
    tolerance: float
    convolutions: int
    scene: str = ""
    least: float = BAD


def scale(rng, low, high):
    """Return a number that is uniform in its decimal logarithm."""
    return float(10 ** rng.uniform(low, high))


def run_quietly(scene, solve, *arguments, **options):
    """Return the result of a run, or None after a printed refusal."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return solve(*arguments, progress=False, **options)
    except rv.RoughviscError as error:
        print(f"{scene}: {type(error).__name__}: {str(error)[:110]}", flush=True)
        return None


def convolutions(ds):
    """Return the number of convolutions of a run over time."""
    return int(ds.roughvisc.steps.convolutions.sum())


def digits(numbers):
    """Return numbers as short text."""
    return " ".join(f"{number:.2g}" for number in numbers)


# ------------------------------------------------------------------------------------------------------------ friction


def sliding_material(rng, poisson):
    """Return a material with instantaneous compliance, and its shear compliance at complex rates. [1/Pa]"""
    if rng.random() < 0.5:
        count = int(rng.integers(1, 5))
        glassy, terms = 1e-6 * scale(rng, -1.5, 0.5), np.array([1e-6 * scale(rng, -3, 1) for _ in range(count)])
        times = np.array([scale(rng, -4, 4) for _ in range(count)])
        series = rv.Prony(glassy, 0.0, tuple(terms), tuple(times), poisson)
        return series, lambda s: glassy + (terms / (1 + np.asarray(s)[..., None] * times)).sum(-1)
    glassy, coefficient, exponent = 1e-6 * scale(rng, -1, 1), 1e-6 * scale(rng, -4, 0), float(rng.uniform(0.1, 0.9))
    law = rv.power_law(glassy, coefficient, exponent, 1.0, poisson)
    return law, lambda s: glassy + coefficient * gamma(1 + exponent) * np.asarray(s) ** -exponent


def sheet_over_half_space(x, poisson, base):
    """Return the displacement of a sheet over that of a half-space, for wave number times thickness (Johnson 5.8)."""
    x = np.minimum(x, 300)
    if base == "slipping":
        return (np.cosh(2 * x) - 1) / (np.sinh(2 * x) + 2 * x)
    k = 3 - 4 * poisson
    return (k * np.sinh(2 * x) - 2 * x) / (k * np.cosh(2 * x) + 2 * x**2 + 5 - 12 * poisson + 8 * poisson**2)


def scenes_of_friction(rng, count):
    """Yield rows of pressure (L1) and friction of random waves in full contact, at nine speeds over eight decades."""
    for number, draw in enumerate(rng.spawn(count)):
        poisson = float(draw.choice([0.5, 0.3]))
        material, law = sliding_material(draw, poisson)
        cells, side = int(draw.integers(6, 25)), 1e-3
        height = draw.standard_normal((cells, 1)) * 1e-6 * np.ones((1, 2))
        kind, base = str(draw.choice(["half-space", "sheet", "layer"])), str(draw.choice(["bonded", "slipping"]))
        thickness = side / (2 * math.pi) * scale(draw, -2, 1)
        below, law_below = sliding_material(draw, 0.5)
        tolerance = float(draw.choice([1e-2, 1e-3, 1e-4]))
        beyond = 1.1 if draw.random() < 0.5 else 1.1 * scale(draw, 0, 3.5)
        speeds = np.geomspace(1e-4, 1e4, 9) * side / (2 * math.pi)
        waves = np.fft.fft(height[:, 0])
        qx = 2 * math.pi * np.fft.fftfreq(cells, side / cells)
        q = np.where(qx == 0, 1.0, np.abs(qx))
        body = material
        if kind == "sheet":
            body = rv.sheet(material, thickness, base)
        elif kind == "layer":
            body = rv.layer(material, thickness, on=below)
        exact = []
        for speed in speeds:
            rate = 1j * np.where(qx == 0, 1e-30, -qx * speed)
            if kind == "layer":
                compliance = effective_compliance(q, (thickness,), (poisson, 0.5), [law(rate), law_below(rate)])
            else:
                compliance = (1 - poisson) / 2 * law(rate)
                if kind == "sheet":
                    compliance = compliance * sheet_over_half_space(q * thickness, poisson, base)
            pressed = np.where(qx == 0, 0, waves * q / 2 / compliance)
            if cells % 2 == 0:  # the sine of the shortest wave vanishes at the centres of the cells
                half = cells // 2
                pressed[half] = waves[half] * q[half] / 2 / compliance[half].real
            seen = np.abs(np.fft.fftfreq(cells)) < 0.4999
            force = abs((np.conj(pressed) * 1j * qx * waves)[seen].sum().real) / cells**2
            exact.append((np.fft.ifft(pressed).real, force))
        mean = beyond * max(-float(pressure.min()) for pressure, _ in exact)
        scene = f"friction {number} {kind} pressure {beyond:.3g} tolerance {tolerance:g}"
        surface = rv.from_array(height, side / cells)
        options = {"speeds": speeds, "pressure": mean, "tolerance": tolerance, "fields": ("pressure",)}
        ds = run_quietly(scene, rv.friction, surface, body, **options)
        for row, (pressure, force) in enumerate(exact if ds is not None else []):
            stated, where = float(ds.stated_error[row]), f"{scene} speed {row}"
            off = np.abs(ds.pressure.values[row, :, 0] - pressure - mean).mean() / mean
            yield Row(float(off), stated, tolerance, int(ds.convolutions[row]), f"{where} pressure")
            off = abs(float(ds.friction_coefficient[row]) * mean / force - 1)
            yield Row(off, stated, tolerance, 0, f"{where} friction")


# --------------------------------------------------------------------------------------------------------------- cells


def relaxation(glassy, terms, times):
    """Return rates [1/s] and parts of ``R(t) / R(0) = 1 - sum(parts * (1 - exp(-rates * t)))`` of a Prony series."""
    root = np.sqrt(terms / glassy / times)
    rates, modes = np.linalg.eigh(np.diag(1 / times) + np.outer(root, root))
    return rates, (modes.T @ root) ** 2 / rates


def random_series(rng, count, glassy, retarded, times):
    """Return a Prony series with its glassy compliance, its terms [1/Pa] and its times [s], from ranges in decades."""
    first = 1e-6 * scale(rng, *glassy)
    terms = np.array([1e-6 * scale(rng, *retarded) for _ in range(count)])
    retardation = np.array([scale(rng, *times) for _ in range(count)])
    return rv.Prony(first, 0.0, tuple(terms), tuple(retardation)), first, terms, retardation


@functools.cache
def one_cell():
    """Return a surface with one cell in contact, and its force times shear compliance over the approach. [N/Pa/m]"""
    surface, elastic = rv.flat_punch(3e-4, (1e-3, 1e-3), (3, 3)), rv.Prony(1e-6, 0.0, (), ())
    ds = rv.simulate(surface, elastic, rv.Program().approach(1e-6, over=0.0), tolerance=1e-8, progress=False)
    return surface, float(ds.force[-1])


def kept_times(draw, duration, kept):
    """Return many kept times, one and the end, or None to keep every step. [s]"""
    early = duration * scale(draw, -4, 0)
    return {"all": None, "one": [early, duration], "many": list(np.geomspace(1e-4 * duration, duration, 20))}[kept]


def scenes_of_cells(rng, count, kept):
    """Yield rows of the force of one cell whose approach jumps and is held: the relaxation function."""
    surface, stiffness = one_cell()
    for number, draw in enumerate(rng.spawn(count)):
        body, glassy, terms, times = random_series(draw, int(draw.integers(1, 6)), (-1.5, 0), (-1, 1), (-4, 3))
        duration, tolerance = scale(draw, -1, 3), float(draw.choice([1e-2, 1e-3, 1e-4]))
        program = rv.Program().approach(1e-6, over=0.0).hold(duration)
        options = {"times": kept_times(draw, duration, kept), "tolerance": tolerance, "grid_error": False}
        scene = f"cells-{kept} {number} tolerance {tolerance:g} duration {duration:.3g} terms {digits(terms / glassy)}"
        scene += f" times {digits(times)}"
        ds = run_quietly(scene, rv.simulate, surface, body, program, **options)
        if ds is None:
            continue
        rates, parts = relaxation(glassy, terms, times)
        left = 1 + (parts * np.expm1(-rates * ds.time.values[:, None])).sum(1)
        exact = stiffness * 1e-6 / glassy * left
        off = np.abs(ds.force.values - exact) / np.maximum.accumulate(exact)
        for row in range(off.size):
            where = f"{scene} row {row} of {off.size} time {float(ds.time[row]):.3g} F/F0 {left[row]:.2g}"
            yield Row(float(off[row]), float(ds.stated_error[row]), tolerance, convolutions(ds) * (row == 0), where)


# --------------------------------------------------------------------------------------------------------------- waves

#: Contour of the inverse Laplace transform of the relaxation functions of layers: points and weights (Weideman 2006).
_ANGLES = np.arange(1, 32, 2) * math.pi / 32
_COT, _SIN = 1 / np.tan(0.6407 * _ANGLES), np.sin(0.6407 * _ANGLES)
CONTOUR = 32 * (-0.4814 + 0.6122 * _ANGLES * _COT + 0.2645j * _ANGLES)
WEIGHTS = 2 * np.exp(CONTOUR) * (0.6122 * _COT - 0.6122 * 0.6407 * _ANGLES / _SIN**2 + 0.2645j)


def relaxing_material(rng, poisson):
    """Return a material with instantaneous compliance, and its shear compliance at complex rates. [1/Pa]"""
    kind = str(rng.choice(["series", "series", "power law", "fluid", "elastic"]))
    if kind == "series":
        body, glassy, terms, times = random_series(rng, int(rng.integers(1, 5)), (-1.5, 0.5), (-1, 1), (-3.5, 3.5))
        body = rv.Prony(body.glassy, body.fluidity, body.compliances, body.times, poisson)
        return body, lambda s: glassy + (terms / (1 + np.asarray(s)[..., None] * times)).sum(-1)
    if kind == "power law":
        glassy, coefficient = 1e-6 * scale(rng, -1.5, 0.5), 1e-6 * scale(rng, -1, 1)
        exponent = float(rng.uniform(0.1, 0.9))
        law = rv.power_law(glassy, coefficient, exponent, 1.0, poisson)
        return law, lambda s: glassy + coefficient * gamma(1 + exponent) * np.asarray(s) ** -exponent
    if kind == "fluid":
        glassy, fluidity, retarded = 1e-6 * scale(rng, -1, 0.5), 1e-6 * scale(rng, -2, 2), scale(rng, -2, 2)
        fluid = rv.Prony(glassy, fluidity, (1e-6,), (retarded,), poisson)
        return fluid, lambda s: glassy + fluidity / s + 1e-6 / (1 + np.asarray(s) * retarded)
    glassy = 1e-6 * scale(rng, -2, 2)
    return rv.Prony(glassy, 0.0, (), (), poisson), lambda s: glassy + 0 * np.asarray(s)


def body_of_waves(draw, q, side):
    """Return a body, and its relaxing stiffness at a time, for wave numbers `q`, shape (nx, ny). [Pa/m over q/2]"""
    kind, poisson = str(draw.choice(["half-space", "sheet", "layer"])), float(draw.choice([0.5, 0.3, 0.45]))
    material, law = relaxing_material(draw, poisson)
    numbers, inverse = np.unique(np.round(q.ravel(), 6), return_inverse=True)
    if kind == "layer":
        laws, poissons, materials = [law], [poisson], [material]
        thicknesses = [side / (2 * math.pi) * scale(draw, -2, 1) for _ in range(int(draw.choice([1, 1, 2])))]
        for _ in thicknesses:
            poissons.append(float(draw.choice([0.5, 0.3])))
            below, law_below = relaxing_material(draw, poissons[-1])
            materials.append(below)
            laws.append(law_below)
        body = materials[-1]
        for above, thickness in zip(materials[-2::-1], thicknesses[::-1], strict=True):
            body = rv.layer(above, thickness, on=body)

        def compliance(s):
            shear = [one(s) for one in laws]
            return effective_compliance(numbers[:, None] * np.ones(len(s)), tuple(thicknesses), poissons, shear)
    else:
        body, of_sheet = material, np.ones(numbers.size)
        if kind == "sheet":
            thickness, base = side / (2 * math.pi) * scale(draw, -2, 1), str(draw.choice(["bonded", "slipping"]))
            body = rv.sheet(material, thickness, base)
            of_sheet = sheet_over_half_space(numbers * thickness, poisson, base)

        def compliance(s):
            return (1 - poisson) / 2 * law(s) * of_sheet[:, None]

    def stiffness(time):
        if time == 0:  # a rate beyond all others
            return np.real(1 / compliance(np.array([1e30]))[:, 0])[inverse].reshape(q.shape)
        return ((1 / compliance(CONTOUR / time) / CONTOUR) @ WEIGHTS).imag[inverse].reshape(q.shape)

    return f"{kind} {body!r:.200}", body, stiffness


def scenes_of_waves(rng, count):
    """Yield rows of the pressure (L1) of full contact, after a jump of the load: each wave relaxes by itself."""
    for number, draw in enumerate(rng.spawn(count)):
        cells, side = (int(draw.integers(4, 13)), int(draw.integers(2, 9))), 1e-3
        spacing = (side / cells[0], side / cells[0] * float(draw.uniform(0.5, 2)))
        height = draw.standard_normal(cells) * 1e-6
        if draw.random() < 0.4:
            height = 1e-6 * np.cos(2 * math.pi * (np.arange(cells[0]) + 0.5) / cells[0])[:, None] * np.ones(cells)
        wave_numbers = [2 * math.pi * np.fft.fftfreq(*of_axis) for of_axis in zip(cells, spacing, strict=True)]
        q = np.hypot(wave_numbers[0][:, None], wave_numbers[1][None])
        waves = np.fft.fft2(height) * q / 2
        text, body, stiffness = body_of_waves(draw, np.where(q > 0, q, 2 * math.pi / side), side)
        duration, tolerance = scale(draw, -1, 2), float(draw.choice([1e-2, 1e-3, 1e-4]))

        def pressed(time, waves=waves, stiffness=stiffness):
            return np.fft.ifft2(waves * stiffness(time)).real

        times = [0.0, *np.geomspace(1e-7 * duration, duration, 15)]
        area = math.prod(cells) * math.prod(spacing)
        load = 1.05 * area * max(-float(pressed(time).min()) for time in times)
        kind, kept = str(draw.choice(["hold", "ramp", "cycle"])), str(draw.choice(["many", "one"]))
        jump = rv.Program().load(load, over=0.0)
        program = {
            "hold": jump.hold(duration),
            "ramp": jump.load(2 * load, over=duration / 2).load(load, over=duration / 2),
            "cycle": jump.cycle(mean=1.5 * load, amplitude=0.4 * load, period=duration / 4, cycles=4),
        }[kind]
        options = {"boundary": "periodic", "tolerance": tolerance, "fields": ("pressure",), "grid_error": False}
        options["times"] = kept_times(draw, duration, kept)
        scene = f"waves {number} {kind} {kept} tolerance {tolerance:g} duration {duration:.3g} {text}"
        ds = run_quietly(scene, rv.simulate, rv.from_array(height, spacing), body, program, **options)
        if ds is None:
            continue
        force, largest = ds.force.values, np.maximum.accumulate(ds.force.values)
        for row in range(force.size):
            off = np.abs(ds.pressure.values[row] - pressed(float(ds.time[row])) - force[row] / area)
            true, stated = float(off.sum()) * math.prod(spacing) / largest[row], float(ds.stated_error[row])
            where = f"{scene} row {row} of {force.size} time {float(ds.time[row]):.3g}"
            yield Row(true, stated, tolerance, convolutions(ds) * (row == 0), where)


# -------------------------------------------------------------------------------------------------------------- slides


def sliding_wave(time, wave_number, corners, path, rates, parts):
    """Return the pressure of a wave over its instantaneous one, complex, in the frame of the profile.

    The profile follows a path [m], linear between corners [s]. Before the first one there is no contact.
    """
    total = np.exp(-1j * wave_number * np.interp(time, corners, path))
    for start, end, here, there in zip(corners, corners[1:], path, path[1:], strict=False):
        last = min(end, time)
        if last <= start:
            break
        turning = 1j * wave_number * (there - here) / (end - start)
        left = np.exp(-turning * (last - start) - rates * (time - last)) - np.exp(-rates * (time - start))
        total -= np.exp(-1j * wave_number * here) * (parts * rates * left / (rates - turning)).sum()
    return total * np.exp(1j * wave_number * np.interp(time, corners, path))


def scenes_of_slides(rng, count, quantity):
    """Yield rows of the pressure (L1) or the friction of one or two waves: held, slid, perhaps slid back, and held."""
    side, amplitudes, phases = 1e-3, np.array([1e-6, 0.4e-6]), np.array([0.0, 0.7])
    for number, draw in enumerate(rng.spawn(count)):
        cells, waves = int(draw.integers(8, 49)), int(draw.choice([1, 1, 2]))
        body, glassy, terms, times = random_series(draw, int(draw.integers(1, 4)), (-1.5, 0.3), (-1, 1), (-3, 3))
        speed, rest = side / (2 * math.pi) * scale(draw, -4, 4), scale(draw, -3, 2)
        tolerance, returns = float(draw.choice([1e-2, 1e-3])), bool(draw.random() < 0.4)
        steps = max(round(cells * float(draw.choice([0.25, 0.5, 1, 2]))), 1)
        distance = steps * side / cells
        lasting = distance / speed
        corners, path = [0.0, rest, rest + lasting], [0.0, 0.0, distance]
        q = 2 * math.pi / side * np.arange(1, waves + 1)
        unit = amplitudes[:waves] * q / 2 / (glassy / 4)
        x = (np.arange(cells) + 0.5) * side / cells
        angles = q[:, None] * x + phases[:waves, None]
        height = (amplitudes[:waves, None] * np.cos(angles)).sum(0)[:, None] * np.ones((1, 2))
        area = 2 * side * side / cells
        load = 2.05 * float(unit.sum()) * area
        program = rv.Program().load(load, over=0.0).hold(rest).slide(distance, speed=speed)
        if returns:
            program = program.slide(distance, speed=speed, direction="-x")
            corners, path = [*corners, corners[-1] + lasting], [*path, 0.0]
        program, corners, path = program.hold(lasting), [*corners, corners[-1] + lasting], [*path, path[-1]]
        options = {"boundary": "periodic", "times": 25, "tolerance": tolerance, "fields": ("pressure",)}
        scene = f"slides {number} {cells} cells {waves} waves {steps} steps returns {returns} tolerance {tolerance:g}"
        surface = rv.from_array(height, side / cells)
        ds = run_quietly(scene, rv.simulate, surface, body, program, grid_error=False, **options)
        if ds is None:
            continue
        rates, parts = relaxation(glassy, terms, times)
        scene += f" V q tau {digits(speed * q[0] * times)}"
        scene += f" terms {digits(terms / glassy)}"
        row_times, used = ds.time.values, convolutions(ds)
        pressed = [unit * [sliding_wave(now, one, corners, path, rates, parts) for one in q] for now in row_times]
        if quantity == "pressure":
            for row in np.flatnonzero(ds.force.values > 0):
                exact = (pressed[row][:, None] * np.exp(1j * angles)).real.sum(0) + load / area
                off = float(np.abs(ds.pressure.values[row, :, 0] - exact).mean()) * area / load
                where = f"{scene} (t - rest) / slide {(row_times[row] - rest) / lasting:.3g}"
                yield Row(off, float(ds.stated_error[row]), tolerance, used * (row == 1), where)
            continue
        forward = np.where(returns & (row_times > corners[2] * (1 + 1e-12)), -1, 1)
        force = np.array([-0.5 * area * (one.imag * amplitudes[:waves] * q).sum() for one in pressed]) * forward
        moved, largest = np.flatnonzero(row_times > rest * (1 + 1e-7)), float(np.abs(force).max())
        for row in moved:
            off = abs(float(ds.friction_force[row]) - force[row]) / largest
            stated, where = float(ds.friction_force_error[row]) / largest, f"{scene} (t - rest) / slide "
            where += f"{(row_times[row] - rest) / lasting:.3g}"
            yield Row(off, stated, max(tolerance, 1e-3), used * (row == moved[0]), where)


# ---------------------------------------------------------------------------------------------------------------- work


def exact_work(segments, marks, rates, parts, control):
    """Return the work at given times of a body of one mode set, and the least answer after the first segment.

    The given quantity x, in units of its first value, is linear in each segment (duration, value). The other one is
    ``y = x + sum(parts * z)`` with ``z' = rates * (x - z)``. The work is the integral of the force over the approach.
    """
    began, x, z, work, least, works = 0.0, 0.0, np.zeros(rates.size), 0.0, math.inf, {}
    for duration, value in segments:
        if duration == 0:
            work += 0.5 * (value**2 - x**2) + (value - x) * float((parts * z).sum()) * (control == "approach")
            x = value
            continue
        slope, behind = (value - x) / duration, x - z
        inside = [mark - began for mark in marks if began < mark <= began + duration * (1 + 1e-9)]
        ages = np.unique([*np.geomspace(1e-7 * duration, duration, 40), *inside])
        steady = slope / rates
        left = (behind - steady) * np.exp(-rates * ages[:, None])
        given = x + slope * ages
        z_later = given[:, None] - steady - left
        y = given + z_later @ parts
        of_given = x * ages + slope * ages**2 / 2
        lag = steady * ages[:, None] - (behind - steady) * np.expm1(-rates * ages[:, None]) / rates
        area = slope * (of_given + (of_given[:, None] - lag) @ parts)  # integral of y over x
        if control == "load":
            area = given * y - x * (x + float((parts * z).sum())) - area
        for age in inside:
            works[began + age] = work + float(area[np.searchsorted(ages, age)])
        least = min(least, float(y.min())) if began > 0 or x > 0 else least
        began, x, z, work = began + duration, value, z_later[-1], work + float(area[-1])
    return works, least


def scenes_of_work(rng, count, control):
    """Yield rows of the work on one cell: a jump or a ramp, a hold, triangles and a hold."""
    surface, stiffness = one_cell()
    for number, draw in enumerate(rng.spawn(count)):
        body, glassy, terms, times = random_series(draw, int(draw.integers(1, 4)), (-1.5, 0.3), (-2, 1), (-3, 3))
        period, triangles, amplitude = scale(draw, -2, 2), int(draw.integers(1, 6)), float(draw.uniform(0.02, 0.3))
        tolerance, kept = float(draw.choice([1e-2, 1e-3, 1e-4])), int(draw.choice([1, 5, 20]))
        ramp = 0.0 if draw.random() < 0.5 else period * scale(draw, -2, 1)
        unit = 1e-6 if control == "approach" else 1e-3
        program = getattr(rv.Program(), control)(unit, over=ramp).hold(period)
        segments = [(ramp, 1.0), (period, 1.0)]
        for value in [1 - amplitude, 1.0] * triangles:
            program = getattr(program, control)(value * unit, over=period / 2)
            segments.append((period / 2, value))
        program, segments = program.hold(period), [*segments, (period, 1.0)]
        marks = np.linspace(0, program.duration, kept + 1)[1:].tolist()
        rates, parts = 1 / times, terms / glassy
        if control == "approach":
            rates, parts = relaxation(glassy, terms, times)
            parts = -parts
        works, least = exact_work(segments, marks, rates, parts, control)
        if least <= 0:  # contact is lost
            continue
        scene = f"work-{control} {number} tolerance {tolerance:g} {kept} kept {triangles} triangles of {amplitude:.2g}"
        scene += f" ramp/period {ramp / period:.2g} times/period {digits(times / period)}"
        scene += f" terms {digits(terms / glassy)}"
        options = {"times": marks, "tolerance": tolerance, "grid_error": False}
        ds = run_quietly(scene, rv.simulate, surface, body, program, **options)
        if ds is None:
            continue
        size = unit**2 * (stiffness / glassy if control == "approach" else glassy / stiffness)
        exact, largest = size * np.array(list(works.values())), 0.0
        for row in range(exact.size):
            largest = max(largest, abs(exact[row]))
            off, stated = abs(float(ds.work[row]) - exact[row]) / largest, float(ds.work_error[row]) / largest
            where = f"{scene} time/period {marks[row] / period:.3g}"
            yield Row(off, stated, tolerance, convolutions(ds) * (row == 0), where, BAD_WORK)


# ------------------------------------------------------------------------------------------------------------ channels


def scenes_of_channels(rng, count):
    """Yield rows of the leak rate of gaps that change along the flow, across it, or in separate channels."""
    for number, draw in enumerate(rng.spawn(count)):
        nx, ny = int(draw.integers(2, 90)), int(draw.integers(1, 90))
        dx, decades = scale(draw, -7, -4), draw.uniform(0, 6)
        dy = dx * scale(draw, -1.5, 1.5)
        kind, wrap = str(draw.choice(["series", "parallel", "separate", "closed"])), bool(draw.random() < 0.5)
        along = 1e-6 * 10 ** (decades * draw.uniform(-1, 0, nx))
        across = 1e-6 * 10 ** (decades * draw.uniform(-1, 0, ny))
        if kind == "parallel":
            gap, exact = np.repeat(across[None], nx, axis=0), float((across**3).sum()) * dy / (12 * nx * dx)
        elif kind == "separate":  # channels of one column between walls
            gap, exact = np.zeros((nx, ny)), 0.0
            for column in range(0, ny, 2):
                gap[:, column] = 1e-6 * 10 ** (decades * draw.uniform(-1, 0, nx))
                exact += dy / dx / float((12 / gap[:, column] ** 3).sum())
            wrap = wrap and ny % 2 == 0
        else:
            gap, exact = np.repeat(along[:, None], ny, axis=1), ny * dy / dx / float((12 / along**3).sum())
            if kind == "closed":
                gap[int(draw.integers(nx))], exact = 0.0, 0.0
        found = flow(gap, (dx, dy), wrap=wrap)
        size = exact or 1e-300
        scene = f"channels {number} {kind} {nx} x {ny} dy/dx {dy / dx:.3g} decades {decades:.2g}"
        yield Row(abs(found.conductance - exact) / size, found.error / size, 1e-9, 0, scene)


# ---------------------------------------------------------------------------------------------------------------- grid


def line(profile, cells):
    """Return a surface of period one that is uniform along y, from a function of x."""
    x = (np.arange(cells) + 0.5) / cells
    return rv.from_array(profile(x)[:, None] * np.ones((1, 2)), (1 / cells, 1 / cells))


def scenes_of_grid(rng, count):
    """Yield rows of the error of the grid, of line contacts at rest and sliding in turn."""
    for number, draw in enumerate(rng.spawn(count)):
        yield from (_sliding if number % 2 else _resting)(draw, f"grid {number}")


def _resting(draw, scene):
    """Yield the errors of the grid of a wave at rest, from the smallest contact to beyond full contact."""
    cells, waves, amplitude = int(draw.integers(12, 80)), int(draw.choice([1, 1, 2, 3])), 1e-3
    part = scale(draw, -3, 0) if draw.random() < 0.5 else float(1 - scale(draw, -4, -0.3))
    if draw.random() < 0.15:
        part = float(draw.uniform(1, 2))
    phase, elastic = float(draw.random()), rv.elastic(0.25)

    def profile(x):
        return amplitude * np.cos(2 * math.pi * waves * (x - phase))

    def solve(count, **options):
        program = rv.Program().load(part * math.pi * amplitude * waves * 2 / count, over=0.0)
        options |= {"boundary": "periodic", "tolerance": 1e-5, "fields": ("pressure",)}
        return run_quietly(scene, rv.simulate, line(profile, count), elastic, program, **options)

    scene = f"{scene} at rest {cells} cells {waves} waves p/p* {part:.5g} phase {phase:.3g}"
    ds, fine = solve(cells, grid_error=True), solve(1536)
    if ds is None or fine is None:
        return
    area = rv.closed_forms.westergaard(amplitude, 1 / waves, 1.0, part * math.pi * amplitude * waves).contact_fraction
    exact = {"area": area * 2 / cells, "approach": float(fine.approach[0]), "gap": float(fine.mean_gap[0])}
    names = {"area": "contact_area", "approach": "approach", "gap": "mean_gap"}
    for quantity, name in names.items():
        value, stated = float(ds[name][0]), float(ds[f"grid_error_{quantity}"][0])
        size = max(abs(value), 1e-3 * amplitude if quantity == "gap" else 1e-12)
        yield Row(abs(value - exact[quantity]) / size, stated, 2e-5, 0, f"{scene} {quantity}")


def _sliding(draw, scene):
    """Yield the errors of the grid of a sliding wave, two waves or a parabola, at five speeds."""
    cells, phase, part = int(draw.integers(12, 100)), float(draw.random()), float(draw.uniform(0.1, 0.6))
    kind, second, terms = str(draw.choice(["wave", "two", "parabola"])), float(draw.random()), int(draw.integers(1, 4))
    compliances, times = (
        tuple(1e-6 * scale(draw, -1, 1) for _ in range(terms)),
        (scale(draw, -2, 2) for _ in [0] * terms),
    )
    rubber = rv.Prony(1e-6 * scale(draw, -1.5, 0.3), 0.0, compliances, tuple(times))
    pressure = math.pi * 1e-6 / float(rubber.contact_compliance(math.inf)) * scale(draw, -2, 0.3)
    speeds = np.geomspace(1e-4, 1e4, 5) * float(draw.uniform(0.5, 2)) / (2 * math.pi)

    def profile(x):
        x = (x - phase) % 1
        if kind == "parabola":
            return -((x - 0.5) ** 2) * 4e-6
        return 1e-6 * np.cos(2 * math.pi * x) + (kind == "two") * part * 1e-6 * np.cos(6 * math.pi * (x - second))

    def solve(count, **options):
        options |= {"speeds": speeds, "pressure": pressure, "tolerance": 1e-4}
        return run_quietly(scene, rv.friction, line(profile, count), rubber, **options)

    scene = f"{scene} sliding {kind} {cells} cells"
    ds, fine = solve(cells, grid_error=True), solve(16 * cells, grid_error=False)
    if ds is None or fine is None:
        return
    names = {"friction": "friction_coefficient", "area": "contact_fraction", "approach": "approach", "gap": "mean_gap"}
    for row in range(len(speeds)):
        for quantity, name in names.items():
            value, exact = float(ds[name][row]), float(fine[name][row])
            off, stated = abs(value - exact) / max(abs(value), 1e-300), float(ds[f"grid_error_{quantity}"][row])
            used = int(ds.convolutions[row]) * (quantity == "friction")
            yield Row(off, stated, 2e-4, used, f"{scene} speed {row} {quantity}")


# ---------------------------------------------------------------------------------------------------------------- area


def scenes_of_area(rng, count):
    """Yield rows of contact area and approach: loaded, held and unloaded, at a tolerance and at a hundredth of it."""
    for number, draw in enumerate(rng.spawn(count)):
        cells, kind = int(draw.integers(12, 40)), str(draw.choice(["ball", "cone", "crossed waves"]))
        boundary = "periodic" if kind == "crossed waves" else "free"
        surface = {
            "ball": rv.sphere(1e-2, 1e-3, cells),
            "cone": rv.cone(0.02, 1e-3, cells),
            "crossed waves": rv.wavy(2e-6, 1e-3, (1e-3, 1e-3), (cells, cells)),
        }[kind]
        if draw.random() < 0.4:
            material = rv.elastic(0.25e6)
        else:
            material = rv.zener(3e6, scale(draw, 5, 7), scale(draw, 4, 6))
        compliance, radius = float(material.contact_compliance(1.0)), 3e-4 * draw.uniform(0.2, 1)
        load = {
            "ball": 4 / 3 * radius**3 / 1e-2 / compliance,
            "cone": math.pi / 2 * 0.02 * radius**2 / compliance,
            "crossed waves": 1e-6 * math.sqrt(2) * math.pi * 2e-3 / compliance * draw.uniform(0.01, 1.1),
        }[kind]
        program = rv.Program().load(load, over=float(draw.choice([0, 0.1]))).hold(0.5)
        program = program.load(load * draw.uniform(0.1, 1), over=0.3)
        tolerance, times = float(draw.choice([1e-2, 1e-3])), [0.2, 0.5, 0.7, program.duration]
        options = {"boundary": boundary, "times": times, "fields": (), "grid_error": False}
        options["edge"] = "accept" if boundary == "free" else "error"
        scene = f"area {number} {kind} {cells} cells tolerance {tolerance:g}"
        pair = [
            run_quietly(scene, rv.simulate, surface, material, program, tolerance=limit, **options)
            for limit in (tolerance, tolerance / 100)
        ]
        if any(ds is None for ds in pair):
            continue
        ds, sharp = pair
        for name in ("contact_area", "approach"):
            largest = float(sharp[name].max())
            off = np.abs(ds[name].values - sharp[name].values) / largest
            stated = (ds[f"{name}_error"].values + sharp[f"{name}_error"].values) / largest
            for row in range(off.size):
                used = convolutions(ds) * (row == 0 and name == "approach")
                yield Row(float(off[row]), float(stated[row]), tolerance, used, f"{scene} row {row} {name}")


# --------------------------------------------------------------------------------------------------------------- rates

KINDS = {
    "cells-many": functools.partial(scenes_of_cells, kept="many"),
    "cells-one": functools.partial(scenes_of_cells, kept="one"),
    "cells-all": functools.partial(scenes_of_cells, kept="all"),
    "waves": scenes_of_waves,
    "slides": functools.partial(scenes_of_slides, quantity="pressure"),
    "slides-friction": functools.partial(scenes_of_slides, quantity="friction"),
    "work-approach": functools.partial(scenes_of_work, control="approach"),
    "work-load": functools.partial(scenes_of_work, control="load"),
    "friction": scenes_of_friction,
    "channels": scenes_of_channels,
    "grid": scenes_of_grid,
    "area": scenes_of_area,
}


def is_bad(row):
    """Return whether a row is beyond its tolerance and beyond its stated error; without a statement it is not."""
    return row.true > row.least * row.tolerance and row.true > BAD * row.stated


def rates(rows):
    """Return the rates of rows of one kind, by name."""

    def median_ratio(small):
        floor = [small * row.tolerance for row in rows]
        ratios = [max(row.stated, least) / max(row.true, least) for row, least in zip(rows, floor, strict=True)]
        ratios = [ratio for ratio in ratios if math.isfinite(ratio)]
        return float(np.median(ratios)) if ratios else math.nan

    return {
        "rows": len(rows),
        "not stated": sum(math.isnan(row.stated) for row in rows),
        "beyond": sum(row.true > row.tolerance for row in rows),
        "bad": sum(map(is_bad, rows)),
        "stated/true": median_ratio(SMALL),
        "from 1 % of the tolerance": median_ratio(SMALL_HUNDREDTH),
        "convolutions": sum(row.convolutions for row in rows),
    }


def main(kinds=(), scenes=100, seed=None, worst=5):
    """Print the rates of some kinds, all of them by default, and their worst rows; return the rates by kind."""
    logging.getLogger("roughvisc").setLevel(logging.ERROR)
    seed = int(f"{datetime.date.today():%Y%m%d}") if seed is None else seed
    found = {}
    print(f"{scenes} scenes of each kind, seed {seed}")
    for kind in kinds or KINDS:
        began = time.perf_counter()
        rows = [Row(*row) for row in KINDS[kind](np.random.default_rng([seed, *kind.encode()]), scenes)]
        found[kind] = rates(rows)
        text = ", ".join(f"{name} {value:.3g}" if isinstance(value, float) else f"{name} {value}"
                         for name, value in found[kind].items())  # fmt: skip
        print(f"{kind}: {text}, {time.perf_counter() - began:.0f} s", flush=True)
        for row in sorted(filter(is_bad, rows), key=lambda row: row.true / max(row.stated, 1e-300))[::-1][:worst]:
            print(f"    true {row.true:.1e} stated {row.stated:.1e}: {row.scene}", flush=True)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--seed", type=int, help="the date by default")
    parser.add_argument("--worst", type=int, default=5, help="number of bad rows to print")
    given = parser.parse_args()
    for kind in given.kinds:
        if kind not in KINDS:
            parser.error(f"found {kind!r}: expected some of {', '.join(KINDS)}")
    main(given.kinds, given.scenes, given.seed, given.worst)
