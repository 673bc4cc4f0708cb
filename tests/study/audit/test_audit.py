"""What an audit says, held against closed forms, against runs that model what was left out, and by its own table."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from support import BALL

import roughvisc as rv
from roughvisc import closed_forms as cf
from roughvisc.errors import InputError
from roughvisc.study.audit.limits import LIMITS, STATED, VERDICTS, Finding
from roughvisc.study.execution.run import run_case
from roughvisc.study.statement.case import Case, read_cases, read_study, vary
from roughvisc.study.storage.store import open_result

RADIUS, MODULUS, LOAD = 1e-2, 4e6, 5e-3
#: Radius and modulus make E* = 2 G / (1 - nu) = 4 MPa.
RUBBER = rv.elastic(1e6)
QUICK = {"progress": False, "tolerance": 1e-2, "times": 2}


@pytest.fixture(scope="module")
def ball():
    """A sphere on an incompressible half-space, in steps of load."""
    heights = rv.sphere(RADIUS, 8e-4, (33, 30))
    return rv.simulate(heights, RUBBER, rv.Program().load(LOAD, over=1.0).hold(1.0), **QUICK)


@pytest.fixture(scope="module")
def rough():
    """A rough surface, periodic, on a rubber that creeps."""
    heights = rv.self_affine((1e-3, 9e-4), (40, 36), hurst=0.8, rms_slope=0.1, rolloff=5e-4, seed=3)
    program = rv.Program().pressure(2e4, over=0.05).hold(0.5)
    return rv.simulate(
        heights, rv.zener(3e6, 1e6, 1e5), program, boundary="periodic", **QUICK | {"times": [0.05, 0.55]}
    )


def test_table__has_limits_that_ascend_with_sources():
    for name, limit in LIMITS.items():
        assert 0 < limit.doubtful < limit.broken, name
        assert limit.source
        assert limit.number
        assert [limit.verdict(x) for x in (0, limit.doubtful, limit.broken, math.nan)] == list(VERDICTS)


def test_limits__of_adhesion_are_those_of_jkr():
    """A tenth more contact area, and twice as much, by the radius of the sphere's contact with adhesion."""
    for name, area in (("doubtful", 1.1), ("broken", 2.0)):
        grown = float(cf.adhesive_load(1.0, getattr(LIMITS["adhesion"], name))) ** (2 / 3)
        assert grown == pytest.approx(area, abs=0.02)


def test_limits__of_coupling_are_those_of_a_punch_that_sticks():
    assert cf.dundurs_coupling([1.0], [0.0]) == LIMITS["coupling"].doubtful
    assert cf.sticking_stiffness(0.0) == pytest.approx(1.1, abs=0.01)


def test_limits__of_yielding_are_mean_pressures_of_hertz():
    """1.1 times the strength on average is 1.65 at the centre."""
    contact = cf.hertz(1.0, 1.0, 1e-3)
    mean = contact.force / (np.pi * contact.radius**2)
    assert 1.1 * contact.peak_pressure / mean == pytest.approx(LIMITS["yielding"].doubtful, rel=0.04)


def test_adhesion__of_a_sphere_is_its_pull_off_force(ball):
    w = 2e-4
    found = rv.audit(ball, work_of_adhesion=w)["adhesion"]
    assert found.number == pytest.approx(1.5 * math.pi * w * RADIUS / LOAD, rel=1e-3)
    assert "One spot of radius 10 mm" in found.sentence
    assert "JKR" in found.sentence


def test_adhesion__of_a_stiff_sphere_is_that_of_dmt():
    tip = rv.sphere(1e-8, 8e-10, (20, 21))
    stiff = rv.simulate(tip, rv.elastic(4e10), rv.Program().load(5e-11, over=1.0), **QUICK)
    found = rv.audit(stiff, work_of_adhesion=1e-3)["adhesion"]
    tabor = cf.tabor_parameter(1e-8, 1.6e11, 1e-3, 3e-10)
    assert tabor < 0.01
    assert found.number == pytest.approx(2 * math.pi * 1e-3 * 1e-8 / 5e-11, rel=2e-3)
    assert "DMT" in found.sentence


@pytest.mark.parametrize("name", ["doubtful", "broken"])
def test_adhesion__flips_where_the_table_says(ball, name):
    at = getattr(LIMITS["adhesion"], name) * LOAD / (1.5 * math.pi * RADIUS)
    verdicts = [rv.audit(ball, work_of_adhesion=part * at)["adhesion"].verdict for part in (0.99, 1.01)]
    assert verdicts == (["holds", "doubtful"] if name == "doubtful" else ["doubtful", "broken"])


def test_adhesion__that_is_not_given_says_what_would_be_harmless(ball):
    sentence = rv.audit(ball)["adhesion"].sentence
    value, unit = re.search(r"up to (.*)\.$", sentence)[1].split()
    for part, verdict in ((0.97, "holds"), (1.03, "doubtful")):
        found = rv.audit(ball, work_of_adhesion=f"{part * float(value)} {unit}")["adhesion"]
        assert found.verdict == verdict


def test_gel__that_is_smooth_and_soft_is_adhesive():
    heights = rv.self_affine((2e-5, 2e-5), 48, hurst=0.8, rms_height=5e-8, rolloff=1e-5, shortcut=2e-6, seed=1)
    for pressure in (20.0, 2000.0):
        gel = rv.simulate(
            heights, rv.elastic(2.5e3), rv.Program().pressure(pressure, over=1.0), boundary="periodic", **QUICK
        )
        found = rv.audit(gel, work_of_adhesion="50 mJ/m^2")
        assert found["stickiness"].verdict == "broken"
        assert "Persson" in found["stickiness"].sentence
        assert found["adhesion"].verdict == ("broken" if pressure < 100 else "not known")


def test_stickiness__of_stiff_roughness_is_that_of_pastewka_and_robbins():
    heights = rv.self_affine((1e-7, 1e-7), 48, hurst=0.8, rms_slope=0.1, rolloff=5e-8, shortcut=8e-9, seed=1)
    stiff = rv.simulate(heights, rv.elastic(4e10), rv.Program().pressure(1e8, over=1.0), boundary="periodic", **QUICK)
    measures = rv.parameters(heights, periodic=True)
    found = rv.audit(stiff, work_of_adhesion=0.01)["stickiness"]
    expected = cf.rough_attraction(float(measures.Sdq), 2 * float(measures.rms_curvature), 1.6e11, 0.01, 3e-10)
    assert found.number == pytest.approx(expected, rel=1e-3)
    assert "Pastewka" in found.sentence


def test_stickiness__of_a_wave_is_its_energy_of_full_contact():
    wave = rv.wavy(1e-6, 1e-4, (1e-4, 2e-5), (64, 5), waves=1)
    ds = rv.simulate(wave, RUBBER, rv.Program().load(1e-6, over=1.0), boundary="periodic", **QUICK)
    energy = MODULUS * 2 * np.pi / 1e-4 * 1e-12 / 8
    assert rv.audit(ds, work_of_adhesion=energy)["stickiness"].number == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(("poisson", "base"), [(0.3, "bonded"), (0.4, "bonded"), (0.5, "bonded"), (0.3, "slipping")])
@pytest.mark.parametrize("width", [0.5, *(pytest.param(one, marks=pytest.mark.long) for one in (0.1, 1.5))])
def test_thickness__predicts_what_the_sheet_makes_of_a_sphere(poisson, base, width):
    """Run with and without the sheet, over contact radii of a tenth to one and a half thicknesses."""
    a = 2e-4
    load = 4 * 2e6 / (1 - poisson) * a**3 / (3 * RADIUS)
    heights, material, program = (
        rv.sphere(RADIUS, 5.2e-4, 26),
        rv.elastic(1e6, poisson),
        rv.Program().load(load, over=1.0),
    )
    on_base = rv.sheet(material, a / width, base)
    half_space, sheet = (rv.simulate(heights, body, program, **QUICK) for body in (material, on_base))
    as_deep = rv.Program().approach(float(half_space.approach[-1]), over=1.0)
    there = rv.simulate(heights, on_base, as_deep, **QUICK)
    deeper = 1 - float(sheet.approach[-1] / half_space.approach[-1])
    weaker = 1 - float(half_space.force[-1] / there.force[-1])
    assert weaker > deeper
    found = rv.audit(half_space, thickness=a / width, base=base)["thickness"]
    assert found.number == pytest.approx(weaker, rel=0.05)
    told = [float(one) for one in re.findall(r"([\d.]+) % (?:smaller|too small)", found.sentence)]
    assert told == pytest.approx([100 * deeper, 100 * weaker], rel=0.25)
    assert rv.audit(sheet)["thickness"].verdict == "holds"
    assert "Modelled" in rv.audit(sheet)["thickness"].sentence


@pytest.mark.parametrize("thickness", [3e-4, 1e-4])
def test_thickness__predicts_what_the_sheet_makes_of_a_rough_surface(thickness):
    heights = rv.self_affine((1e-3, 1e-3), 48, hurst=0.8, rms_slope=0.1, rolloff=5e-4, shortcut=1e-4, seed=2)
    program = rv.Program().pressure(2e4, over=1.0)
    half_space, sheet = (
        rv.simulate(heights, body, program, boundary="periodic", **QUICK)
        for body in (RUBBER, rv.sheet(RUBBER, thickness))
    )
    true = 1 - float(sheet.approach[-1] / half_space.approach[-1])  # incompressible: no compression of its own
    assert 0.5 * true < rv.audit(half_space, thickness=thickness)["thickness"].number < 2 * true


def test_thickness__counts_the_force():
    """At a/h = 0.94 approach alone would be doubtful, and more than half of the force is missing."""
    a = 2e-4
    half_space = rv.simulate(
        rv.sphere(RADIUS, 5.2e-4, (27, 26)),
        rv.elastic(1e6, 0.3),
        rv.Program().approach(a**2 / RADIUS, over=1.0),
        **QUICK,
    )
    found = rv.audit(half_space, thickness=a / 0.94, base="slipping")["thickness"]
    assert cf.half_space_excess(cf.Sheet(a / 0.94, 0.3, "slipping"), 0.35e-6, *_last(half_space)) < 0.5
    assert (found.verdict, "too small" in found.sentence) == ("broken", True)


def _last(dataset):
    return float(dataset.force[-1]), float(dataset.approach[-1])


def test_thickness__of_a_flat_punch_is_by_its_approach():
    """Its force is proportional to the approach, so that both are off by the same part."""
    punch = rv.simulate(rv.flat_punch(2e-4, 5e-4, 27), RUBBER, rv.Program().load(1e-3, over=1.0), **QUICK)
    found = rv.audit(punch, thickness=1e-3)["thickness"]
    assert found.number == pytest.approx(cf.half_space_excess(cf.Sheet(1e-3), 1 / MODULUS, *_last(punch)), rel=1e-12)
    assert "force" not in found.sentence


def test_thickness__that_would_be_enough_is_where_the_verdict_flips(ball, rough):
    for result in (ball, rough):
        told = re.search(r"from (\S+ .m) on", rv.audit(result)["thickness"].sentence)[1]
        value = float(told.split()[0])
        thick, thin = (rv.audit(result, thickness=f"{part * value} {told.split()[1]}") for part in (1.05, 0.9))
        assert (thick["thickness"].verdict, thin["thickness"].verdict) == ("holds", "doubtful")


def test_thickness__that_is_not_that_of_the_sheet_is_told():
    heights, program = rv.sphere(RADIUS, 4e-4, 16), rv.Program().load(1e-4, over=1.0)
    ds = rv.simulate(heights, rv.sheet(RUBBER, 1e-3), program, **QUICK)
    assert rv.audit(ds, thickness="1 mm")["thickness"].verdict == "holds"
    other = rv.audit(ds, thickness="2 mm")["thickness"]
    assert (other.verdict, "1 mm, and 2 mm is stated" in other.sentence) == ("not known", True)


def test_adhesion__is_that_of_the_contact_when_it_has_crept(rough):
    """At the last time under the largest load, where spots have grown together."""
    again = rv.audit(rough.isel(time=[-1]), work_of_adhesion=0.01)["adhesion"]
    early = rv.audit(rough.isel(time=[0]), work_of_adhesion=0.01)["adhesion"]
    assert rv.audit(rough, work_of_adhesion=0.01)["adhesion"] == again != early


def test_yielding__is_by_the_largest_pressure(ball):
    peak = cf.hertz(RADIUS, MODULUS, LOAD).peak_pressure
    found = rv.audit(ball, yield_strength=peak)["yielding"]
    assert found.number == pytest.approx(1.0, rel=5e-3)
    assert found.verdict == "holds"
    assert rv.audit(ball, yield_strength=peak / 3.1)["yielding"].verdict == "broken"


def test_slope_and_strain__of_a_sphere_are_the_contact_radius_over_its_own(ball):
    a = cf.hertz(RADIUS, MODULUS, LOAD).radius
    found = rv.audit(ball, linear_strain=0.01)
    assert found["slope"].number == pytest.approx(a / RADIUS, rel=0.06)
    assert found["strain"].number == pytest.approx(a / RADIUS / 0.01, rel=0.06)
    assert rv.audit(ball)["strain"].verdict == "not known"


def test_inertia__is_by_waves_over_the_program(ball):
    a = cf.hertz(RADIUS, MODULUS, LOAD).radius
    found = rv.audit(ball, density="1000 kg/m^3")["inertia"]
    assert found.number == pytest.approx(0.85 * a * math.sqrt(1000 / 1e6) / 1.0, rel=0.1)  # by cells
    assert rv.audit(ball)["inertia"].verdict == "holds"  # no solid is dense enough
    fast = rv.simulate(rv.sphere(RADIUS, 8e-4, 24), RUBBER, rv.Program().load(LOAD, over=2e-6), **QUICK)
    assert rv.audit(fast)["inertia"].verdict == "not known"
    assert rv.audit(fast, density=1000)["inertia"].verdict == "broken"


@pytest.mark.parametrize(
    ("program", "scale"),
    [
        (rv.Program().load(2.0, over=0.05).hold(5.0).load(0.0, over=0.5), 0.05),
        (rv.Program().load(2.0, over=0).hold(5.0), 5.0),
        (rv.Program.cycle(2.0, 1.0, 0.3, 4), 3.0 / (2 * np.pi / 0.3)),
        (rv.Program().approach(1e-6, over=0.1).hold(10.0), 0.1),
        (rv.Program.table([0, 1, 2, 2.5], [0, 1, 4, 4]), 4 / 3),
        (rv.Program().hold(1.0), np.inf),
    ],
)
def test_time_scale__is_that_of_the_fastest_change(program, scale):
    assert program.time_scale == pytest.approx(scale, rel=1e-12)


def test_coupling__is_dundurs_constant_of_one_body_or_two():
    heights, program = rv.sphere(RADIUS, 4e-4, 16), rv.Program().load(1e-4, over=1.0)
    one = rv.simulate(heights, rv.elastic(1e6, 0.3), program, **QUICK)
    assert rv.audit(one)["coupling"].number == pytest.approx(0.4 / 1.4, rel=1e-12)
    two = rv.simulate(heights, rv.pair(rv.elastic(1e6, 0.3), rv.elastic(1e6, 0.3)), program, **QUICK)
    assert rv.audit(two)["coupling"].verdict == "not known"  # a result of simulate does not tell its bodies
    assert rv.audit(two, thickness=1e-3)["thickness"].verdict == "not known"


def test_resolution__is_what_the_last_octave_adds(rough, ball):
    """Of heights that no recipe states."""
    found = rv.audit(rough.assign_attrs(recipe=""))["resolution"]
    coarse = rough.height.values
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(40, 2.5e-5)[:, None], np.fft.fftfreq(36, 2.5e-5))
    squares = q**2 * np.abs(np.fft.fft2(coarse)) ** 2
    order = np.argsort(q, axis=None)
    sums = np.cumsum(squares.ravel()[order])
    last = q.ravel()[order][np.searchsorted(sums, 0.99 * sums[-1])]
    assert found.number == pytest.approx(1 - math.sqrt(squares[q <= last / 2].sum() / squares.sum()), rel=1e-9)
    assert rv.audit(ball)["resolution"].number == 0


def test_resolution__of_a_ball_that_was_measured_is_that_of_its_form(ball):
    measured = rv.from_array(ball.height.values, spacing=2.5e-5)
    ds = rv.simulate(measured, RUBBER, rv.Program().load(1e-3, over=1.0), boundary="free", **QUICK)
    found = rv.audit(ds, work_of_adhesion=0.05)
    assert found["resolution"].verdict == "holds"
    assert "Only form" in found["resolution"].sentence
    assert "stickiness" not in [one.name for one in found]


def test_rows__are_of_the_assumptions_that_the_scene_makes(ball, rough):
    pressed = [name for name in LIMITS if name not in ("heating", STATED)]
    assert [one.name for one in rv.audit(rough)] == pressed
    assert [one.name for one in rv.audit(ball)] == [name for name in pressed if name not in ("stickiness", "border")]
    with pytest.raises(KeyError, match="'border': expected one of adhesion, yielding"):
        rv.audit(ball)["border"]


def pressed(heights, boundary="periodic"):
    program = rv.Program().approach(1e-7, over=1.0)
    return rv.simulate(
        heights, RUBBER, program, boundary=boundary, progress=False, tolerance=0.1, times=1, edge="accept"
    )


def generated(shortcut, shape=(48, 40), **settings):
    """On cells of 10 um."""
    size = (shape[0] * 1e-5, shape[1] * 1e-5)
    return rv.self_affine(size, shape, hurst=0.8, rms_slope=0.1, shortcut=shortcut, seed=3, **settings)


@pytest.mark.parametrize(
    ("cells", "verdict"),
    [(None, "broken"), (3.9, "broken"), (4, "doubtful"), (7.9, "doubtful"), (8, "holds"), (12, "holds")],
)
@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_resolution__of_a_generated_surface_is_by_cells_in_its_shortest_wave(cells, verdict, boundary):
    found = rv.audit(pressed(generated(cells and cells * 1e-5), boundary))["resolution"]
    assert found.verdict == verdict
    assert found.number == pytest.approx(1 / (cells or 2), rel=1e-12)
    assert found.sentence.startswith(f"The shortest wavelength of the generator, {(cells or 2) * 10:g} µm, has")
    assert ("smaller cells" in found.sentence) == (verdict != "holds")


def test_resolution__of_a_texture_is_along_the_axis_of_its_shortest_waves():
    """Four times longer along x: waves of 12 cells on average are of 24 along x and 6 along y."""
    found = rv.audit(pressed(generated(1.2e-4, anisotropy=4.0)))["resolution"]
    assert found.number == pytest.approx(1 / 6, rel=1e-12)


@pytest.mark.parametrize(("waves", "number"), [(1, 1 / 5), (2, 1 / 3)])
def test_resolution__of_a_regular_wave_is_by_its_cells(waves, number):
    """Five cells a wave along x, three along y, where the first of both does not change."""
    wave = rv.wavy(1e-6, 1e-4, (3e-4, 2e-4), (15, 6), waves=waves)
    assert rv.audit(pressed(wave))["resolution"].number == pytest.approx(number, rel=1e-12)


def test_resolution__of_heights_that_are_no_longer_the_recipe_s_is_by_the_last_octave():
    """Finer by interpolation it is still the recipe's surface; with noise, or cut, it is not."""
    surface = generated(8e-5)
    noise = 1e-7 * np.random.default_rng(1).standard_normal(surface.shape)
    for other in (surface.copy(data=surface.values + noise), surface.isel(x=slice(0, 31))):
        assert "recipe" in other.attrs
        found = rv.audit(pressed(other))["resolution"]
        assert "add" in found.sentence
        assert found.judged_by == ""
    copied = surface.copy(data=3.0 * np.roll(surface.values, 5, axis=0))
    assert rv.audit(pressed(copied))["resolution"].number == pytest.approx(1 / 8, rel=1e-12)


def test_limits__of_stated_waves_are_what_a_straight_line_between_cells_leaves():
    limit = LIMITS[STATED]
    lost = [f"{100 * (1 - math.cos(math.pi * one)):.0f} %" for one in (limit.doubtful, limit.broken)]
    assert [one in limit.meaning for one in lost] == [True, True]


def test_limits__of_heating_are_those_of_retardation_times():
    """By the universal constants of Williams, Landel and Ferry."""
    times = [rv.wlf_shift(300.0 + LIMITS["heating"].doubtful * k, 300.0, c1=8.86, c2=101.6) for k in (1, 10)]
    assert 1 - times[0] == pytest.approx(0.2, abs=0.03)
    assert 1 / times[1] == pytest.approx(6, rel=0.05)
    assert LIMITS["heating"].broken == 10 * LIMITS["heating"].doubtful


SPEED, RUBBING = 0.5, {"heat_conductivity": 0.2, "volumetric_heat_capacity": "1.8 MJ/m^3/K"}


def rubbed(speed, **settings):
    """A wave that slides by a period."""
    wave = rv.wavy(2e-6, 1e-3, (1e-3, 5e-4), (24, 11), waves=1)
    program = rv.Program().pressure(1e5, over=0).hold(0.1).slide(1e-3, speed=speed).hold(0.1)
    asked = {"fields": ("pressure",), "times": [0.1, 0.1 + 1e-3 / speed], **settings}
    return rv.simulate(wave, SLIPPERY, program, boundary="periodic", tolerance=1e-2, progress=False, **asked)


SLIPPERY = rv.zener(1e6, 0.3e6, 0.3e3)
#: After endless creep. [Pa]
SHEAR = 1 / (1 / 1e6 + 1 / 0.3e6)


def test_inertia__of_a_slide_is_by_its_speed_over_that_of_waves():
    density = 1100.0
    wave = math.sqrt(SHEAR / density)
    verdicts = [rv.audit(rubbed(part * wave), density=density)["inertia"].verdict for part in (0.1, 0.5, 0.85, 1.0)]
    assert verdicts == ["holds", "doubtful", "broken", "broken"]
    fast = rv.audit(rubbed(1e3))["inertia"]
    assert fast.verdict == "broken", "of any solid"
    assert "slides at 1 km/s, faster than waves along the surface" in fast.sentence
    half = rv.audit(rubbed(0.5 * wave), density=density)["inertia"]
    assert half.number == pytest.approx(cf.moving_load_excess(0.5, 1.0, 1.0, 0.5), rel=1e-2)
    unsure = rv.audit(rubbed(0.5 * wave))["inertia"]
    assert unsure.verdict == "not known"
    most = float(re.search(r"up to ([\d.]+) kg", unsure.sentence)[1])
    for part, verdict in ((0.9, "holds"), (1.1, "doubtful")):
        assert rv.audit(rubbed(0.5 * wave), density=part * most)["inertia"].verdict == verdict


def test_heating__is_that_of_the_friction_power_in_the_spots():
    """A wave in full contact: one spot of the whole surface, and the power is force times speed."""
    ds = rubbed(SPEED, fields=("pressure",))
    force, area = float(rv.observables.history(ds).friction_force.max()), float(ds.contact_area[-1])
    found = rv.audit(ds, **RUBBING)["heating"]
    rise = cf.flash_temperature(force * SPEED / area, math.sqrt(area / math.pi), SPEED, 0.2, 1.8e6)
    assert found.number == pytest.approx(rise, rel=1e-9)
    assert "one spot" in found.sentence.lower()
    capable = rv.audit(ds, heat_conductivity=1e-6, volumetric_heat_capacity=1.0)["heating"]
    assert capable.verdict == "broken"


def test_heating__that_is_not_known_says_what_to_give():
    ds = rubbed(SPEED)
    found = rv.audit(ds, heat_conductivity=0.2)["heating"]
    assert found.verdict == "not known"
    assert "Give volumetric_heat_capacity: " in found.sentence
    assert "Give heat_conductivity and volumetric_heat_capacity: " in rv.audit(ds)["heating"].sentence
    assert 'fields = ["pressure"]' in rv.audit(ds.drop_vars("pressure"), **RUBBING)["heating"].sentence


def test_slide_of_a_case__is_audited_before_it_runs(tmp_path):
    path = tmp_path / "study.toml"
    audited = '[audit]\ndensity = "1100 kg/m^3"\nheat_conductivity = 0.2\nvolumetric_heat_capacity = "1.8 MJ/m^3/K"\n'
    slide = '[[program]]\npressure = 1e4\nover = 0\n[[program]]\nslide = "1 mm"\nspeed = "1 km/s"\n'
    surface = '[surface]\ngenerate = "wavy"\namplitude = 1e-6\nwavelength = 1e-3\nsize = 1e-3\nshape = [24, 11]\n'
    material = '[material]\nmodel = "zener"\nshear_modulus = 1e6\nkelvin_modulus = 3e5\nkelvin_viscosity = 300\n'
    path.write_text(surface + material + slide + '[solve]\nboundary = "periodic"\n' + audited)
    found = rv.audit(read_study(path))
    assert found["inertia"].verdict == "broken"
    assert (found["heating"].verdict, found["heating"].sentence[:20]) == ("not known", "Known after the run,")


def test_border__says_what_the_note_of_the_result_says(rough):
    assert rv.audit(rough)["border"].verdict == "holds"
    heights = rough.height + 2e-5 * rough.x / 1e-3
    ds = rv.simulate(heights, RUBBER, rv.Program().pressure(2e4, over=1.0), boundary="periodic", **QUICK)
    assert "border:" in ds.attrs.get("warnings", "")
    assert rv.audit(ds)["border"].verdict in ("doubtful", "broken")
    mirrored = rv.simulate(
        rv.mirror(heights), RUBBER, rv.Program().pressure(2e4, over=1.0), boundary="periodic", **QUICK
    )
    assert rv.audit(mirrored)["border"].number == 0


def test_audit__is_the_same_of_a_lazy_result(rough):
    given = {"work_of_adhesion": 0.05, "thickness": 1e-4, "yield_strength": 1e7}
    whole, lazy = rv.audit(rough, **given), rv.audit(rough.chunk(time=1, x=20), **given)
    assert [one.number for one in whole] == [one.number for one in lazy]


def test_audit__without_fields_says_what_to_keep(rough):
    found = rv.audit(rough.drop_vars(["pressure", "gap"]), work_of_adhesion=0.05, yield_strength=1e7, thickness=1e-3)
    for name in ("adhesion", "yielding", "thickness"):
        assert found[name].verdict == "not known"
        assert 'fields = ["pressure"]' in found[name].sentence
    assert found["stickiness"].number > 0
    without = rv.audit(rough.drop_vars(["pressure", "height"]), work_of_adhesion=0.05)
    assert {without[name].verdict for name in ("slope", "resolution", "border", "stickiness")} == {"not known"}


def test_audit__of_a_result_that_never_touched():
    program = rv.Program().approach(-1e-6, over=1.0)
    ds = rv.simulate(rv.sphere(RADIUS, 4e-4, 16), RUBBER, program, **QUICK)
    found = rv.audit(ds, work_of_adhesion=0.05, yield_strength=1e6, thickness=1e-3, density=1000)
    assert {found[name].verdict for name in ("adhesion", "yielding", "thickness", "inertia")} == {"not known"}


def test_audit__of_absent_points_and_a_flat_punch():
    punch = rv.flat_punch(2e-4, 5e-4, 32)
    ds = rv.simulate(punch, RUBBER, rv.Program().load(1e-3, over=1.0), **QUICK)
    found = rv.audit(ds, work_of_adhesion=1e-6)["adhesion"]
    a = math.sqrt(float(ds.contact_area[-1]) / math.pi)
    assert found.number == pytest.approx(cf.punch_pull_off(a, MODULUS, 1e-6) / 1e-3, rel=1e-9)
    assert "Kendall" in found.sentence


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"work_of_adhesion": "50 mN"}, r"work_of_adhesion: found '50 mN', which is in millinewton: expected a number"),
        ({"work_of_adhesion": -1}, "work_of_adhesion: found -1: expected a number in J/m.2.* at least 0"),
        ({"yield_strength": 0}, "yield_strength: found 0: expected"),
        ({"density": "light"}, "density: found 'light', which is no quantity"),
        ({"linear_strain": math.nan}, "linear_strain: found nan"),
        ({"heat_conductivity": "0.2 W"}, "heat_conductivity: found '0.2 W', which is in watt"),
        ({"volumetric_heat_capacity": 0}, "volumetric_heat_capacity: found 0: expected"),
        ({"base": "bonded"}, "base is 'bonded' without a thickness: expected both, or neither"),
        ({"thickness": 1e-3, "base": "glued"}, "base is 'glued': expected 'bonded' or 'slipping'"),
    ],
)
def test_audit__refuses_what_is_no_such_quantity(ball, given, message):
    with pytest.raises(InputError, match=message):
        rv.audit(ball, **given)


def test_audit__refuses_what_is_no_result_of_one_case(ball):
    with pytest.raises(InputError, match="found str: expected a result"):
        rv.audit("result.nc")
    with pytest.raises(InputError, match="found a dimension 'case': expected the result of one case"):
        rv.audit(ball.expand_dims("case"))
    with pytest.raises(InputError, match="the result holds no 'force'"):
        rv.audit(ball.drop_vars("force"))


def test_curve_of_friction__is_judged_by_its_speeds():
    """Waves by the largest speed, heat where most is dissipated, moduli by the longest wave at the lowest speed."""
    wave, rubber = rv.wavy(1e-6, 1e-3, (1e-3, 1e-4), (24, 3), waves=1), rv.zener(3e6, 1e6, 1e3)
    wave = wave.roll(x=12)  # the crest in the middle
    given = {"density": 1000.0, "heat_conductivity": 0.2, "volumetric_heat_capacity": 2e6}
    slow, fast = (
        rv.friction(wave, rubber, pressure=5e4, speeds=speeds, fields=["pressure"], progress=False)
        for speeds in ([1e-3, 0.1], [1e-3, 0.1, 100.0])
    )
    for ds, verdict in ((slow, "holds"), (fast, "broken")):
        assert rv.audit(ds, **given)["inertia"].verdict == verdict
    assert "slides at 100 m/s" in rv.audit(fast, **given)["inertia"].sentence
    hot = int(slow.dissipated_power.values.argmax())
    row, power = slow.isel(speed=hot), float(slow.dissipated_power.max())
    radius = math.sqrt(float(row.contact_area) / math.pi)  # of one crest, one spot
    rise = cf.flash_temperature(power / float(row.contact_area), radius, 0.1, 0.2, 2e6)
    assert rv.audit(slow, **given)["heating"].number == pytest.approx(rise)
    passing = float(np.ptp(wave.x.values)) / 1e-3
    assert slow.attrs["compliance_at_end"] == rubber.contact_compliance(passing)


def test_audit__takes_units_and_shows_itself(ball):
    one = rv.audit(ball, work_of_adhesion="50 mJ/m^2", yield_strength="40 MPa", thickness="1 mm", density="1.1 g/cm^3")
    two = rv.audit(ball, work_of_adhesion=0.05, yield_strength=4e7, thickness=1e-3, density=1100)
    assert repr(one) == repr(two)
    assert max(map(len, repr(one).splitlines())) <= 98
    assert one._repr_html_().count("<tr>") == len(one) == 8
    table = one.to_dataset()
    assert table.verdict.sel(assumption="adhesion") == one["adhesion"].verdict
    assert float(table.broken_from.sel(assumption="yielding")) == 3
    assert one.warning.startswith("broken: adhesion (")


# ------------------------------------------------------------------------------------------------ studies

AUDITED = BALL + '[audit]\nwork_of_adhesion = "50 mJ/m^2"\nthickness = "1 mm"\n'


def test_study__audit_leaves_the_key_and_the_result_as_they_are(tmp_path):
    path = tmp_path / "study.toml"
    keys = set()
    for text in (BALL, AUDITED, AUDITED.replace('thickness = "1 mm"', 'thickness = "2 mm"')):
        path.write_text(text)
        keys.add(read_study(path).key)
    assert len(keys) == 1
    first = run_case(read_study(path), tmp_path)
    made = first.stat().st_mtime_ns
    path.write_text(BALL)
    assert run_case(read_study(path), tmp_path) == first
    assert first.stat().st_mtime_ns == made, "as a title, what an audit is told stays that of the run"
    with open_result(first) as ds:
        found = rv.audit(ds)
        assert "2 mm" in found["thickness"].sentence
        assert found["adhesion"].number > 0
        assert rv.audit(ds, thickness="3 mm")["thickness"].number < found["thickness"].number
    assert "audit" not in json.loads(read_study(path).to_json())


def test_study__audit_is_checked_as_everything_else(tmp_path):
    path = tmp_path / "study.toml"
    for line, message in (
        ('work_of_adhesion = "5 N"', "audit.work_of_adhesion: found '5 N'"),
        ('base = "bonded"', "audit.base: found without a thickness"),
        ("hardness = 3", "audit.hardness: unknown key"),
    ):
        path.write_text(f"{BALL}[audit]\n{line}\n")
        with pytest.raises(InputError, match=re.escape(message)):
            read_study(path)


def test_case__is_audited_before_it_runs(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(AUDITED)
    found = rv.audit(read_study(path))
    assert found["coupling"].verdict == "holds"
    assert {found[name].verdict for name in ("adhesion", "yielding", "thickness")} == {"not known"}
    costs = rv.plan(path)
    assert "thickness" in str(costs.audit.values[0]) or not str(costs.audit.values[0])


def test_plan__tells_of_the_thickness_that_a_run_then_finds(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(AUDITED.replace('thickness = "1 mm"', 'thickness = "0.1 mm"'))
    planned = str(rv.plan(path).audit.values[0])
    foreseen = float(re.search(r"thickness \(([\d.]+)\)", planned)[1])
    with open_result(run_case(read_study(path), tmp_path)) as ds:
        assert foreseen == pytest.approx(rv.audit(ds)["thickness"].number, rel=0.1)


def test_pair__of_a_study_has_both_bodies(tmp_path):
    path = tmp_path / "study.toml"
    head, rest = BALL.split("[material]")
    table = '[material]\nmodel = "pair"\n'
    table += 'a = { model = "elastic", shear_modulus = 1e6, poisson = 0.3 }\n'
    table += 'b = { model = "elastic", shear_modulus = 1e6, poisson = 0.3 }\n'
    path.write_text(f"{head}{table}[[program]]{rest.split('[[program]]', 1)[1]}")
    assert rv.audit(read_study(path))["coupling"].number == 0
    with open_result(run_case(read_study(path), tmp_path)) as ds:
        assert rv.audit(ds)["coupling"].number == 0


def test_result__of_before_is_audited_by_its_case(tmp_path):
    """Without the attributes that simulate leaves for an audit."""
    path = tmp_path / "study.toml"
    path.write_text(AUDITED)
    with open_result(run_case(read_study(path), tmp_path)) as ds:
        known = ds.attrs
        old = ds.drop_attrs(deep=False).assign_attrs({name: known[name] for name in ("case", "boundary", "recipe")})
        assert [one.number for one in rv.audit(old)] == pytest.approx([o.number for o in rv.audit(ds)], nan_ok=True)


def test_sweep__over_the_audit_is_one_run(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(AUDITED + '[sweep]\n"audit.thickness" = ["1 mm", "2 mm"]\n')
    cases = read_cases(path)
    assert len({case.key for case in cases}) == 1
    assert Case.from_json(cases[1].to_json()).settings.audit.thickness == 2e-3
    assert vary(cases[0], {"audit.density": "1000 kg/m^3"}).settings.audit.density == 1000


def test_finding__without_a_number_shows_none():
    assert Finding("slope", math.nan, "").shown == ""
    assert replace(Finding("slope", 0.123, ""), number=0.5).verdict == "doubtful"
