"""Every number that a figure prints is the Dataset's: titles, legends and notes, parsed and compared."""

import numpy as np
import pytest
from support import ROUGH, case_of, numbers_told

import roughvisc as rv
from roughvisc.views import plot
from roughvisc.views.figures import animate

ZENER = """model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "1 kPa s"
"""
CYCLES = """over = "50 ms"
[[program]]
cycle = { mean = "10 mN", amplitude = "4 mN", period = "20 ms", cycles = 2 }
"""
TIMES = (0.02, 0.05, 0.09)


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """A rough surface pressed, and loaded in two cycles."""
    text = ROUGH.replace('model = "maxwell"\nshear_modulus = "1 MPa"\nviscosity = "1 MPa s"\n', ZENER)
    text = text.replace('over = "50 ms"\n', CYCLES).replace('"50 ms"]', '"50 ms", "70 ms", "90 ms"]')
    text = text.replace('shortcut = "0.2 mm"', 'shortcut = "80 um"')
    folder = tmp_path_factory.mktemp("told")
    return rv.run(case_of(folder, text), folder, progress=False).load()


def first_picture(ds):
    return animate._moving(ds, None, 9)[0]


def line(ds, frame=-1):
    """Where the cut lies that carries most in a frame."""
    return float(ds.y[int(np.argmax(ds.pressure.isel(time=frame).sum("x").values))])


def work_of_the_last_cycle(ds):
    steps = rv.observables.history(ds)
    start = int(np.abs(steps.time.values - 0.07).argmin())
    assert float(steps.time[start]) == pytest.approx(0.07)
    return float(steps.work[-1] - steps.work[start])


#: figure -> how it is drawn, and the numbers that it may print, each of which it must
FIGURES = {
    "history": (plot.history, lambda ds: []),
    "hysteresis": (plot.hysteresis, lambda ds: [float(ds.work[-1]), 2, work_of_the_last_cycle(ds)]),
    "maps": (
        lambda ds: plot.maps(ds, TIMES),
        lambda ds: [*TIMES, *(float(ds.force.sel(time=t)) / 1e-6 for t in TIMES)],  # 1 mm x 1 mm
    ),
    "section": (plot.section, lambda ds: [0.09, line(ds)]),
    "surface": (
        plot.surface,
        lambda ds: [float(rv.parameters(rv.level(ds.height)).Sq), float(ds.y[ds.sizes["y"] // 2])],
    ),
    "distributions": (lambda ds: plot.distributions(ds, TIMES), lambda ds: TIMES),
    "clusters": (lambda ds: plot.contact_clusters(ds, TIMES), lambda ds: TIMES),
    "area_against_load": (plot.area_against_load, lambda ds: [0.09, 0.09]),
    "first picture of a film": (first_picture, lambda ds: [0.0, line(ds, int(np.argmax(ds.contact_area.values)))]),
}


@pytest.mark.parametrize("name", FIGURES)
def test_every_number_told__is_the_datasets(ran, name):
    draw, expected = FIGURES[name]
    found = numbers_told(draw(ran))
    assert found == pytest.approx(sorted(expected(ran)), rel=5.1e-3, abs=1e-30), "three digits of each, and no others"
