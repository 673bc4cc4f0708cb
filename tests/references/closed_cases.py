"""Contacts with closed-form solutions: surface, closed form, and the error that the method explains.

All in units of their own: lengths in contact radii or wavelengths, moduli and times of order one; the solver is
neutral to units. Each case yields rows ``(what is compared, error, expected error)``. The expected ones are sums of

* the tolerance, on pressure (L1, over the largest force) and on the approach (over the largest one);
* the grid, whose cells have side ``h``, on a contact of radius ``a``:

  - a cell stands for ``r^2 / (2 R)`` by its value at the centre, which is ``h^2 / (12 R)`` below its mean, and for a
    round maximum of pressure likewise: ``(h/a)^2 / 12`` of approach and largest pressure, whether the number of cells
    is odd or even, since the undeformed gap counts from the apex; with an even number the largest pressure is that
    of cells ``h / sqrt(2)`` off the apex, for ``(h/a)^2 / 4`` in place of that;
  - the outline is right to half a cell. Pressure vanishes there as a square root, so a ring of that width holds the
    part ``(h/a)^(3/2)`` of the force under a sphere, and ``0.42 (h/b)^(3/2)`` under a strip of half-width ``b``;
  - the area of counted cells is corrected by 0.088 times the outline, known to 0.008: ``0.02 h/a``; what is counted
    within a circle scatters about its area as the number of lattice points does, by about ``(h/a)^(3/2)``;
  - a punch of cells has a radius right to half a cell, and all that is singular at its edge: ``h / (2 a)``.
"""

import math
from typing import get_args

import numpy as np

import roughvisc as rv
from references.half_space import Paraboloid, StepLoad, lee_radok_step, punch_approach, punch_dissipation, punch_force
from references.layered import ElasticLayer, OnSheet
from roughvisc.mechanics import closed_forms
from roughvisc.mechanics.sheet import Base, Sheet
from roughvisc.topography.grid import spacing

_TOLERANCE = 1e-3
_UNIT = rv.elastic(0.25)  # contact modulus 1
_ZENER = rv.zener(0.25, 0.125, 0.125)  # contact modulus 1, relaxes to a third; retardation time 1
_MAXWELL = rv.maxwell(0.25, 0.25)
_BASES = {"softer": rv.zener(0.025, 0.0125, 0.0125, 0.3), "stiffer": rv.zener(2.5, 1.25, 1.25, 0.3)}  # creep as _ZENER
_SIZE = 2.6  # of the grid, in contact radii
_ROUND, _SLOPE = 10.0, 0.1  # radius of the spheres, in contact radii; slope of the cone


def _press(height, body, program, **settings):
    return rv.simulate(height, body, program, **{"tolerance": _TOLERANCE, "progress": False, **settings})


def _distance(dataset):
    """Distance of each cell from the middle of the grid. [m]"""
    x, y = (dataset[axis] - dataset[axis].mean() for axis in ("x", "y"))
    return np.hypot(x, y).values


def _radius(dataset):
    return np.sqrt(dataset["contact_area"].values / np.pi)


def _pressure_error(dataset, exact, beyond=0.0):
    """Largest L1 error over the largest force, outside of a distance from the axis."""
    distance = _distance(dataset)
    here = distance > beyond
    errors = [
        np.sum(np.abs(frame[here] - exact(distance[here], t)))
        for frame, t in zip(dataset["pressure"].values, dataset["time"].values.tolist(), strict=True)
    ]
    return float(np.max(errors)) * math.prod(spacing(dataset)) / float(dataset["force"].max())


def _relative(found, exact):
    """Largest deviation over the largest exact value."""
    found, exact = np.asarray(found, dtype=float), np.asarray(exact, dtype=float)
    return float(np.max(np.abs(found - exact)) / np.max(np.abs(exact)))


def _approach_error(cells, a=1.0):
    """Expected error of the approach of a sphere or a cone to a contact radius of ``a``."""
    return (_SIZE / cells / a) ** 2 / 12 + _TOLERANCE


def _radius_error(h, a):
    """Expected error of a contact radius from the corrected area."""
    return 0.01 * h / a + 0.5 * (h / a) ** 1.5


# ----------------------------------------------------------------------------------------------------------------
# elastic


def _both_parities(rows):
    """The rows of a grid whose apex lies in the middle of a cell, and of one where it lies between four."""

    def both(cells):
        for count in (cells, cells + 1):
            for what, error, expected in rows(count):
                yield f"{what}, {'odd' if count % 2 else 'even'} grid", error, expected

    return both


def hertz(cells):
    exact, h = closed_forms.hertz(_ROUND, 1.0, 4 / 3 / _ROUND), _SIZE / cells
    ds = _press(rv.sphere(_ROUND, _SIZE, cells), _UNIT, rv.Program().load(4 / 3 / _ROUND, over=0))
    yield "approach", _relative(ds.approach[0], exact.approach), _approach_error(cells)
    yield "contact radius", _relative(_radius(ds), exact.radius), _radius_error(h, 1) + _TOLERANCE
    peak = h**2 / (12 if cells % 2 else 4) + _TOLERANCE
    yield "largest pressure", _relative(ds.pressure.max(), exact.peak_pressure), peak
    yield "pressure (L1)", _pressure_error(ds, lambda r, _: exact.pressure(r)), h**1.5 + _TOLERANCE


def sneddon(cells):
    """The pressure is infinite at the apex: the cells about it are left out."""
    exact, h = closed_forms.cone(_SLOPE, 1.0, np.pi / 2 * _SLOPE), _SIZE / cells
    ds = _press(rv.cone(_SLOPE, _SIZE, cells), _UNIT, rv.Program().load(np.pi / 2 * _SLOPE, over=0))
    yield "approach", _relative(ds.approach[0], exact.approach), _approach_error(cells)
    yield "contact radius", _relative(_radius(ds), exact.radius), _radius_error(h, 1) + _TOLERANCE
    yield "pressure (L1)", _pressure_error(ds, lambda r, _: exact.pressure(r), 2 * h), h**1.5 + _TOLERANCE


def punch(cells):
    exact, h = closed_forms.flat_punch(1.0, 1.0, 2.0), _SIZE / cells
    ds = _press(rv.flat_punch(1.0, _SIZE, cells), _UNIT, rv.Program().load(2.0, over=0))
    yield "approach", _relative(ds.approach[0], exact.approach), h / 2 + _TOLERANCE
    middle = _distance(ds) < 0.5
    inside = exact.pressure(_distance(ds)[middle])
    yield "pressure within a / 2", _relative(ds.pressure.values[0][middle], inside), h / 2 + _TOLERANCE


def westergaard(cells):
    """The profile is even in y: three cells across."""
    amplitude, across = 1e-3, 3 / cells
    full = math.pi * amplitude
    surface = rv.wavy(amplitude, 1.0, (1.0, across), (cells, 3), waves=1)
    for ratio in (0.3, 0.7, 1.5):
        exact = closed_forms.westergaard(amplitude, 1.0, 1.0, ratio * full)
        ds = _press(surface, _UNIT, rv.Program().load(ratio * full * across, over=0), boundary="periodic")
        pressure = exact.pressure(ds.x.values)
        error = float(np.sum(np.abs(ds.pressure.values[0, :, 1] - pressure)) / np.sum(pressure))
        edges = 0.42 * (1 / cells / exact.half_width) ** 1.5 if ratio < 1 else 0.0
        yield f"pressure (L1) at {ratio} p*", error, edges + _TOLERANCE
        if ratio < 1:  # an edge on either side of the crest
            at = f"contact fraction at {ratio} p*"
            yield at, abs(float(ds.contact_fraction[0]) - exact.contact_fraction), 2 / cells


def crossed_waves(cells):
    """Limits: the next term in the shape of a crest is ``(k a)^2 / 8`` of the first, on average over directions."""
    full = math.sqrt(2) * math.pi * 1e-3
    surface = rv.wavy(1e-3, 1.0, 1.0, cells)
    for ratio, limit in ((0.01, "low"), (0.97, "high")):
        exact = float(closed_forms.johnson_greenwood_higginson(ratio, limit))
        ds = _press(surface, _UNIT, rv.Program().load(ratio * full, over=0), boundary="periodic")
        round_area = exact if limit == "low" else 1 - exact  # two in each period
        radius = np.sqrt(round_area / 2 / np.pi)
        error = abs(float(ds.contact_area[0]) - exact) / round_area
        shape = (2 * np.pi * radius) ** 2 / 8
        what = "contact area" if limit == "low" else "area of the gaps"
        yield f"{what} at {ratio} p*", error, shape + 2 * _radius_error(1 / cells, radius) + _TOLERANCE
    ds = _press(surface, _UNIT, rv.Program().load(1.2 * full, over=0), boundary="periodic")
    wave = full * np.cos(2 * np.pi * ds.x.values)[:, None] * np.cos(2 * np.pi * ds.y.values)
    error = float(np.mean(np.abs(ds.pressure.values[0] - 1.2 * full - wave)) / (1.2 * full))
    yield "pressure (L1) at 1.2 p*", error, _TOLERANCE


# ----------------------------------------------------------------------------------------------------------------
# viscoelastic: contacts that grow, shrink, and stay


def _lee_radok(material):
    """A load applied at once on a sphere and kept, to a contact radius of one; at first rigid if it has no modulus."""

    def rows(cells):
        load, h = 4 / 3 / _ROUND / float(material.contact_compliance(4.0)), _SIZE / cells
        times = [0.0, 0.5, 1.0, 2.0, 4.0][material.glassy == 0 :]
        ds = _press(rv.sphere(_ROUND, _SIZE, cells), material, rv.Program().load(load, over=0).hold(4.0), times=times)
        exact = lee_radok_step(_ROUND, material, load)
        smallest = float(exact.radius(times[0]))
        yield "approach", _relative(ds.approach, exact.approach(ds.time)), _approach_error(cells)
        yield "contact radius", _relative(_radius(ds), exact.radius(ds.time)), _radius_error(h, smallest) + _TOLERANCE
        if material.glassy:
            yield "pressure (L1)", _pressure_error(ds, exact.pressure), (h / smallest) ** 1.5 + _TOLERANCE

    return rows


def _on(bodies):
    """A ball on what is as thick as the contact comes to be wide; the base takes as much of the grid's error as of it.

    The bodies by name, each as it is solved and as the closed form takes it.
    """

    def rows(cells):
        for name, (body, layer) in bodies.items():
            on = OnSheet(Paraboloid(_ROUND), layer)
            load = float(on.scaled_force(1.0)) / float(_ZENER.contact_compliance(4.0))
            exact = StepLoad(on, _ZENER, load)
            program, times = rv.Program().load(load, over=0).hold(4.0), [0.0, 0.5, 1.0, 2.0, 4.0]
            ds = _press(rv.sphere(_ROUND, _SIZE, cells), body, program, times=times)
            smallest = float(exact.radius(0.0))
            yield f"approach, {name}", _relative(ds.approach, exact.approach(ds.time)), _approach_error(cells)
            radius = _radius_error(_SIZE / cells, smallest) + _TOLERANCE
            yield f"contact radius, {name}", _relative(_radius(ds), exact.radius(ds.time)), radius

    return rows


def loaded_punch(cells):
    program = rv.Program().load(2.0, over=1.0).hold(1.0).load(0.5, over=0.5).hold(1.0)
    times = [0.5, 1.0, 2.0, 2.5, 3.5]
    ds = _press(rv.flat_punch(1.0, _SIZE, cells), _ZENER, program, times=times)
    exact = punch_approach(1.0, _ZENER, program, times)
    yield "approach", _relative(ds.approach, exact), _SIZE / cells / 2 + _TOLERANCE
    # whatever the outline of the punch, its approach has one course in time
    found, expected = ds.approach.values / float(ds.approach[1]), exact / exact[1]
    yield "course of the approach", _relative(found, expected), 2 * _TOLERANCE


def cycled_punch(cells):
    period, amplitude, mean = 3.0, 0.2, 1.0
    program = rv.Program().approach(mean, over=0.5) + rv.Program.cycle(mean, amplitude, period, 4, control="approach")
    ends = 0.5 + period * np.arange(5)
    ds = _press(rv.flat_punch(1.0, _SIZE, cells), _ZENER, program, times=ends, fields=())
    found = float(np.diff(ds.work.values)[-1])
    exact = punch_dissipation(1.0, _ZENER, amplitude, period)
    # the force of the start has relaxed by four cycles; its error, of the largest force, acts over the whole path
    largest = punch_force(1.0, _ZENER, rv.Program().approach(mean, over=0.5), 0.5)
    path = 4 * amplitude * float(largest) / exact
    yield "dissipation in a cycle", _relative(found, exact), _SIZE / cells / 2 + _TOLERANCE * path


_SHEETS = {base: (rv.sheet(_ZENER, 1.0, base), Sheet(1.0, _ZENER.poisson, base)) for base in get_args(Base)}
_LAYERS = {
    f"{name} base": (
        rv.layer(_ZENER, 1.0, on=base),
        ElasticLayer(1.0, _ZENER.poisson, base.poisson, base.glassy / _ZENER.glassy),
    )
    for name, base in _BASES.items()
}
#: name -> (what is pressed on what, its rows for a number of cells)
CASES = {
    "Hertz": ("sphere, elastic (Hertz)", _both_parities(hertz)),
    "Sneddon": ("cone, elastic (Sneddon)", _both_parities(sneddon)),
    "Boussinesq": ("flat punch, elastic (Boussinesq)", punch),
    "Westergaard": ("wave, periodic, elastic (Westergaard)", westergaard),
    "Johnson": ("crossed waves, periodic, elastic (Johnson, Greenwood, Higginson)", crossed_waves),
    "Maxwell": ("sphere, step load, Maxwell (Lee, Radok)", _lee_radok(_MAXWELL)),
    "Zener": ("sphere, step load, Zener (Lee, Radok)", _lee_radok(_ZENER)),
    "Kelvin-Voigt": ("sphere, step load, Kelvin-Voigt (Lee, Radok)", _lee_radok(rv.kelvin_voigt(0.25, 0.25))),
    "sheet": ("sphere on a sheet, step load, Zener (Fredholm equation; Lee, Radok)", _on(_SHEETS)),
    "layer": ("sphere on a layer, step load, Zener (Fredholm equation; Lee, Radok)", _on(_LAYERS)),
    "punch": ("flat punch, loaded and unloaded, Zener", loaded_punch),
    "cycles": ("flat punch, cycles of approach, Zener", cycled_punch),
}


# `PYTHONPATH=tests python -m references.closed_cases` prints the errors of docs/verification.md, with their bounds
if __name__ == "__main__":
    for title, compare in CASES.values():
        for row, (what, error, expected) in enumerate(compare(129)):
            print(f"| {'' if row else title} | {what} | {error:.1e} | {expected:.1e} |")
