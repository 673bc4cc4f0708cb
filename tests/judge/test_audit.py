"""Checks of the assumptions of the model, compared with closed forms and with runs that model what was left out."""

import cmath
import math

import numpy as np
import pytest
from scipy import special
from support import BALL, refused

import roughvisc as rv
from roughvisc import closed_forms as cf
from roughvisc.judge.audit import LIMITS, VERDICTS, Finding, audit_of
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.run import run_case
from roughvisc.study.case import read_study
from roughvisc.topography.inspection import inspection_of

RADIUS, MODULUS, LOAD = 1e-2, 4e6, 5e-3
#: Radius and modulus make E* = 2 G / (1 - nu) = 4 MPa.
RUBBER = rv.elastic(1e6)
QUICK = {"progress": False, "tolerance": 1e-2, "times": 2}


@pytest.fixture(scope="module")
def ball():
    """A sphere on an incompressible half-space."""
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


# ----------------------------------------------------------------------------------------------------------------
# the limits


def test_limits__ascend_and_have_a_source():
    for name, limit in LIMITS.items():
        assert 0 < limit.doubtful < limit.broken, name
        assert limit.source
        numbers = (0, limit.doubtful, limit.broken, math.nan)
        assert [Finding(name, number, "", limit).verdict for number in numbers] == list(VERDICTS)


def test_limits_of_adhesion__are_contact_areas_of_jkr():
    """The load that presses a sphere without adhesion to the same radius: Johnson, Kendall, Roberts (1971)."""
    for name, area in (("doubtful", 1.1), ("broken", 2.0)):
        pull_off = getattr(LIMITS["adhesion"], name)
        load = 1 + 2 * pull_off + 2 * math.sqrt(pull_off + pull_off**2)
        assert load ** (2 / 3) == pytest.approx(area, abs=0.02)


def test_limit_of_yielding__is_a_mean_pressure_of_hertz():
    contact = cf.hertz(1.0, 1.0, 1e-3)
    mean = contact.force / (np.pi * contact.radius**2)
    assert 1.1 * contact.peak_pressure / mean == pytest.approx(LIMITS["yielding"].doubtful, rel=0.04)


def test_limits_of_heating__are_retardation_times_by_the_universal_constants_of_wlf():
    times = [rv.wlf(300.0 + LIMITS["heating"].doubtful * k, 300.0, wlf_c1=8.86, wlf_c2=101.6) for k in (1, 10)]
    assert 1 - times[0] == pytest.approx(0.2, abs=0.03)
    assert 1 / times[1] == pytest.approx(6, rel=0.05)
    assert LIMITS["heating"].broken == 10 * LIMITS["heating"].doubtful


# ----------------------------------------------------------------------------------------------------------------
# adhesion


def test_adhesion__of_a_sphere_is_its_pull_off_force_by_jkr(ball):
    """Also of a cap that touches most of its square: it stands alone."""
    cap = rv.simulate(rv.sphere(RADIUS, 5e-4, 26), RUBBER, rv.Program().load(LOAD, over=1.0), **QUICK)
    assert cap.contact_fraction[-1] > 0.5
    for ds in (ball, cap):
        found = audit_of(ds, work_of_adhesion=2e-4)["adhesion"]
        assert found.number == pytest.approx(1.5 * math.pi * 2e-4 * RADIUS / LOAD, rel=1e-3)
    assert audit_of(ball)["adhesion"].verdict == "not known"


def test_adhesion__of_waves_is_that_of_their_crests_until_these_merge():
    """From 0.076 of the area on; the mean curvature of a spot is a little less than that of its summit."""
    waves = rv.wavy(2e-6, 1e-3, (1e-3, 1e-3), 24).roll(x=6, y=6, roll_coords=False)
    program = rv.Program().pressure(2e4, over=1.0)
    ds = rv.simulate(waves, RUBBER, program, boundary="periodic", **QUICK | {"times": 20})
    curvature = 2e-6 * (2 * math.pi / 1e-3) ** 2
    numbers = {}
    for row in range(1, 20):
        number = audit_of(ds.isel(time=slice(row + 1)), work_of_adhesion=1e-3)["adhesion"].number
        numbers[float(ds.contact_fraction[row])] = (
            number * float(ds.force[row]) / (2 * 1.5 * math.pi * 1e-3 / curvature)
        )
    assert 1 < numbers[min(numbers)] < 1.25
    assert {fraction for fraction, one in numbers.items() if math.isnan(one)} == {x for x in numbers if x > 0.5}
    assert min(abs(x - 0.5) for x in numbers) < 0.03


# ----------------------------------------------------------------------------------------------------------------
# the body


@pytest.mark.parametrize(("poisson", "base"), [(0.3, "bonded"), (0.4, "bonded"), (0.5, "bonded"), (0.3, "slipping")])
@pytest.mark.parametrize("width", [0.5, *(pytest.param(one, marks=pytest.mark.long) for one in (0.1, 0.8))])
def test_thickness__predicts_the_approach_on_the_sheet(poisson, base, width):
    """Run with and without the sheet, over contact radii of 0.1 to 0.8 thicknesses."""
    a = 2e-4
    program = rv.Program().load(4 * 2e6 / (1 - poisson) * a**3 / (3 * RADIUS), over=1.0)
    heights, material = rv.sphere(RADIUS, 5.2e-4, 26), rv.elastic(1e6, poisson)
    half_space = rv.simulate(heights, material, program, **QUICK)
    sheet = rv.simulate(heights, rv.sheet(material, a / width, base), program, **QUICK)
    found = audit_of(half_space, thickness=a / width, base=base)["thickness"]
    assert found.number == pytest.approx(1 - float(sheet.approach[-1] / half_space.approach[-1]), rel=0.25)
    assert audit_of(sheet)["thickness"].verdict == "holds"


@pytest.mark.parametrize("thickness", [3e-4, 1e-4])
def test_thickness__predicts_the_approach_of_a_rough_surface(thickness):
    heights = rv.self_affine((1e-3, 1e-3), 48, hurst=0.8, rms_slope=0.1, rolloff=5e-4, shortcut=1e-4, seed=2)
    program = rv.Program().pressure(2e4, over=1.0)
    half_space, sheet = (
        rv.simulate(heights, body, program, boundary="periodic", **QUICK)
        for body in (RUBBER, rv.sheet(RUBBER, thickness))
    )
    true = 1 - float(sheet.approach[-1] / half_space.approach[-1])  # incompressible: no compression of its own
    assert 0.5 * true < audit_of(half_space, thickness=thickness)["thickness"].number < 2 * true


def test_yielding__is_by_the_largest_pressure_of_all_times(ball):
    """On a rubber, that before it creeps."""
    rubber, program = rv.zener(3e6, 1e6, 1e5), rv.Program().load(LOAD, over=0).hold(1.0)
    creeping = rv.simulate(rv.sphere(RADIUS, 8e-4, (33, 30)), rubber, program, **QUICK)
    for ds, modulus in ((ball, MODULUS), (creeping, 12e6)):
        peak = cf.hertz(RADIUS, modulus, LOAD).peak_pressure
        assert audit_of(ds, yield_strength=peak)["yielding"].number == pytest.approx(1.0, rel=5e-3)


def test_slope__of_a_sphere_is_the_contact_radius_over_its_own(ball):
    a = cf.hertz(RADIUS, MODULUS, LOAD).radius
    assert audit_of(ball)["slope"].number == pytest.approx(a / RADIUS, rel=0.06)


def test_inertia__is_by_waves_over_the_program(ball):
    a = cf.hertz(RADIUS, MODULUS, LOAD).radius
    found = audit_of(ball, density="1000 kg/m^3")["inertia"]
    assert found.number == pytest.approx(0.85 * a * math.sqrt(1000 / 1e6) / 1.0, rel=0.1)  # by cells
    fast = rv.simulate(rv.sphere(RADIUS, 8e-4, 24), RUBBER, rv.Program().load(LOAD, over=2e-6), **QUICK)
    assert audit_of(fast)["inertia"].verdict == "not known"
    assert audit_of(fast, density=1000)["inertia"].verdict == "broken"


@pytest.mark.parametrize(
    ("program", "scale"),
    [
        (rv.Program().load(2.0, over=0.05).hold(5.0).load(0.0, over=0.5), 0.05),
        (rv.Program().load(2.0, over=0).hold(5.0), 5.0),
        (rv.Program.cycle(2.0, 1.0, 0.3, 4), 3.0 / (2 * np.pi / 0.3)),
        (rv.Program.table([0, 1, 2, 2.5], [0, 1, 4, 4]), 4 / 3),
        (rv.Program().hold(1.0), np.inf),
    ],
)
def test_time_scale__is_that_of_the_fastest_change(program, scale):
    assert program.time_scale == pytest.approx(scale, rel=1e-12)


# ----------------------------------------------------------------------------------------------------------------
# slides

#: After endless creep. [Pa]
SHEAR = 1 / (1 / 1e6 + 1 / 0.3e6)


def rubbed(speed):
    """A wave that slides by a period."""
    wave = rv.wavy(2e-6, 1e-3, (1e-3, 5e-4), (24, 11), waves=1)
    program = rv.Program().pressure(1e5, over=0).hold(0.1).slide(1e-3, speed=speed).hold(0.1)
    asked = {"fields": ("pressure",), "times": [0.1, 0.1 + 1e-3 / speed]}
    return rv.simulate(
        wave, rv.zener(1e6, 0.3e6, 0.3e3), program, boundary="periodic", tolerance=1e-2, progress=False, **asked
    )


def moving_compliance(speed, shear, density, poisson):
    """Displacement of the wave ``exp(ik(x - Vt))``, times ``k``, under a unit pressure: Navier's equations, solved.

    Potentials ``phi = A exp(-k a z)`` and ``psi = B exp(-k b z)``: the surface carries normal and no shear stress.
    """
    lame = 2 * shear * poisson / (1 - 2 * poisson)
    fast, slow = (lame + 2 * shear) / density, shear / density
    a, b = (cmath.sqrt(1 - speed**2 / square) for square in (fast, slow))
    # u = phi_x - psi_z, w = phi_z + psi_x, at z = 0 with k = 1
    normal = [lame * (a**2 - 1) + 2 * shear * a**2, -2j * shear * b]
    shearing = [-2j * shear * a, -shear * (1 + b**2)]
    potentials = np.linalg.solve(np.array([normal, shearing]), [-1.0, 0.0])
    return (-a * potentials[0] + 1j * potentials[1]).real


def test_inertia__of_a_slide_is_by_its_speed_over_that_of_waves():
    density = 1100.0
    wave = math.sqrt(SHEAR / density)
    found = {part: audit_of(rubbed(part * wave), density=density)["inertia"] for part in (0.1, 0.5, 0.85, 1.01)}
    assert [one.verdict for one in found.values()] == ["holds", "doubtful", "broken", "broken"]
    still, moving = (moving_compliance(part * wave, SHEAR, density, 0.499) for part in (1e-3, 0.5))
    assert 1 < found[0.5].number / (moving / still - 1) < 1.4


def exact_flash(peclet):
    """Mean over the spot, over ``q a / k``, by the Fourier transforms of a disk and of a moving source."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    angles, weights = (nodes + 1) * math.pi / 4, weights * math.pi / 4
    s = np.concatenate([np.geomspace(1e-8, 0.5, 600), np.linspace(0.5, 100, 6000)[1:]])
    # beyond the last node J1^2 is 1 / (pi s) on average, and the motion does not matter
    around = 4 * np.sum(weights / np.sqrt(s[:, None] ** 2 + 1j * s[:, None] * np.cos(angles) * peclet), axis=1).real
    return np.trapezoid(special.j1(s) ** 2 / s * around, s) / math.pi + 1 / (math.pi * 100**2)


@pytest.mark.parametrize("conductivity", [0.2, 2.0, 2e4])
def test_heating__is_that_of_the_friction_power_in_the_spots(conductivity):
    """A wave in full contact: one spot of the whole surface, and the power is force times speed."""
    ds, capacity = rubbed(0.5), 1.8e6
    force, area = float(rv.observables.history(ds).friction_force.max()), float(ds.contact_area[-1])
    radius = math.sqrt(area / math.pi)
    exact = force * 0.5 / area * radius / conductivity * exact_flash(0.5 * radius * capacity / conductivity)
    given = {"heat_conductivity": conductivity, "volumetric_heat_capacity": "1.8 MJ/m^3/K"}
    assert 0.96 * exact < audit_of(ds, **given)["heating"].number <= 1.001 * exact
    assert audit_of(ds, heat_conductivity=0.2)["heating"].verdict == "not known"


def test_friction_curve__is_judged_by_its_speeds():
    """Waves by the largest speed, and heat where most is dissipated."""
    wave, rubber = rv.wavy(1e-6, 1e-3, (1e-3, 1e-4), (24, 3), waves=1), rv.zener(3e6, 1e6, 1e3)
    wave = wave.roll(x=12)  # the crest in the middle
    given = {"density": 1000.0, "heat_conductivity": 0.2, "volumetric_heat_capacity": 2e6}
    slow, fast = (
        rv.friction(wave, rubber, pressure=5e3, speeds=speeds, fields=["pressure"], progress=False)
        for speeds in ([1e-3, 3.0], [1e-3, 3.0, 100.0])
    )
    assert slow.contact_area[0] > 2 * slow.contact_area[1]
    assert [audit_of(ds, **given)["inertia"].verdict for ds in (slow, fast)] == ["holds", "broken"]
    powers = slow.friction_force * slow.speed
    row, power = slow.isel(speed=int(powers.values.argmax())), float(powers.max())
    radius = math.sqrt(float(row.contact_area) / math.pi)  # of one crest, one spot
    rise = power / float(row.contact_area) * radius / 0.2 * exact_flash(3.0 * radius * 2e6 / 0.2)
    assert audit_of(slow, **given)["heating"].number == pytest.approx(rise, rel=0.04)


# ----------------------------------------------------------------------------------------------------------------
# the surface


def pressed(heights, boundary="periodic"):
    program = rv.Program().approach(1e-7, over=1.0)
    return rv.simulate(
        heights, RUBBER, program, boundary=boundary, progress=False, tolerance=0.1, times=1, edge="accept"
    )


def generated(shortcut, shape=(48, 40), **settings):
    """On cells of 10 um."""
    size = (shape[0] * 1e-5, shape[1] * 1e-5)
    return rv.self_affine(size, shape, hurst=0.8, rms_slope=0.1, shortcut=shortcut, seed=3, **settings)


def test_resolution__is_what_the_last_octave_adds_to_the_slope(rough):
    """Of heights that no recipe states."""
    found = audit_of(rough.assign(height=rough.height.assign_attrs(recipe="")))["resolution"]
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(40, 2.5e-5)[:, None], np.fft.fftfreq(36, 2.5e-5))
    squares = q**2 * np.abs(np.fft.fft2(rough.height.values)) ** 2
    order = np.argsort(q, axis=None)
    sums = np.cumsum(squares.ravel()[order])
    last = q.ravel()[order][np.searchsorted(sums, 0.99 * sums[-1])]
    assert found.number == pytest.approx(1 - math.sqrt(squares[q <= last / 2].sum() / squares.sum()), rel=1e-9)


def test_resolution__of_a_measured_ball_is_that_of_its_form(ball):
    measured = rv.from_array(ball.height.values, spacing=2.5e-5)
    ds = rv.simulate(measured, RUBBER, rv.Program().load(1e-3, over=1.0), boundary="free", **QUICK)
    assert audit_of(ds)["resolution"].verdict == "holds"


@pytest.mark.parametrize("sides", [(5e-7, 5e-7), (5e-7, 2e-6), (2e-6, 5e-7)])
def test_resolution__of_a_regular_texture_holds_with_and_without_the_filter_that_scan_recommends(sides):
    """A line of the spectrum near the cut-off is not unresolved roughness; noise, and noise under a filter, are."""
    longest = max(sides)
    x, y = (np.arange(0.5 * side, length * longest, side) for length, side in zip((105, 69), sides, strict=True))
    along_x, along_y = np.sin(2 * np.pi * x / (18.6 * longest)), np.sin(2 * np.pi * y / (26 * longest))
    texture, noise = np.outer(along_x, along_y), np.random.default_rng(0).standard_normal((x.size, y.size))

    def verdict(heights, cutoff=None):
        surface = rv.from_array(1e-6 * heights, sides)
        surface = rv.gaussian_filter(surface, cutoff) if cutoff else surface
        return audit_of(pressed(surface, "mirror"))["resolution"].verdict

    for heights in (texture, np.outer(along_x, np.ones(y.size)), texture + np.add.outer(x, y) / (100 * longest)):
        for cells in (10, 15):
            assert verdict(heights, cells * longest) == "holds"
    noisy = texture + 0.04 * noise
    recommended = inspection_of(rv.from_array(1e-6 * noisy, sides)).steps["filter"]
    assert verdict(noisy, recommended) == "holds"
    cut = rv.without_short_waves(rv.from_array(noise, sides), 8 * longest).values  # of equal power up to a limit
    for rough in (noise, noise + texture, cut):
        for cutoff in (None, 4 * longest):
            assert verdict(rough, cutoff) != "holds"


def test_resolution__of_heights_that_are_no_longer_the_recipe_s_is_by_the_last_octave():
    surface = generated(8e-5)
    noise = 1e-7 * np.random.default_rng(1).standard_normal(surface.shape)
    for other in (surface.copy(data=surface.values + noise), surface.isel(x=slice(0, 31))):
        assert "recipe" in other.attrs
        assert audit_of(pressed(other))["resolution"].number > 0.01
    assert audit_of(pressed(surface))["resolution"].number == 0


def test_border__is_broken_by_a_tilt_and_mended_by_mirror_images(rough):
    assert audit_of(rough)["border"].verdict == "holds"
    heights, program = rough.height + 2e-5 * rough.x / 1e-3, rv.Program().pressure(2e4, over=1.0)
    tilted, mirrored, unfolded = (
        audit_of(rv.simulate(one, RUBBER, program, boundary=boundary, **QUICK))["border"]
        for one, boundary in ((heights, "periodic"), (heights, "mirror"), (rv.mirror(heights), "periodic"))
    )
    assert tilted.verdict in ("doubtful", "broken")
    assert mirrored.number == unfolded.number == 0


# ----------------------------------------------------------------------------------------------------------------
# results, studies, the command


def test_rows__are_of_the_assumptions_that_the_scene_makes(ball, rough):
    usual = [name for name in LIMITS if name != "heating"]
    assert [one.name for one in audit_of(rough)] == usual
    assert [one.name for one in audit_of(ball)] == [name for name in usual if name != "border"]


def test_audit__without_fields_or_contact_knows_less(rough):
    found = audit_of(rough.drop_vars(["pressure", "gap"]), work_of_adhesion=0.05, yield_strength=1e7, thickness=1e-3)
    assert {found[name].verdict for name in ("adhesion", "yielding", "thickness")} == {"not known"}
    apart = rv.simulate(rv.sphere(RADIUS, 4e-4, 16), RUBBER, rv.Program().approach(-1e-6, over=1.0), **QUICK)
    found = audit_of(apart, work_of_adhesion=0.05, yield_strength=1e6, thickness=1e-3, density=1000)
    assert {found[name].verdict for name in ("adhesion", "yielding", "thickness", "inertia")} == {"not known"}


@pytest.mark.parametrize(
    ("given", "key"),
    [
        ({"work_of_adhesion": "50 mN"}, "work_of_adhesion"),
        ({"yield_strength": 0}, "yield_strength"),
        ({"density": "light"}, "density"),
        ({"density": math.nan}, "density"),
        ({"base": "bonded"}, "base"),
        ({"thickness": 1e-3, "base": "glued"}, "base"),
    ],
)
def test_audit__refuses_a_wrong_value(ball, given, key):
    with refused(key):
        audit_of(ball, **given)


def test_audit__refuses_what_is_no_result_of_one_case(ball):
    for wrong, named in (
        ("result.nc", "str"),
        (ball.expand_dims("case"), "'case'"),
        (ball.drop_vars("force"), "'force'"),
    ):
        with pytest.raises(rv.InputError, match=named):
            audit_of(wrong)


AUDITED = BALL + '[audit]\nwork_of_adhesion = "50 mJ/m^2"\nthickness = "0.6 mm"\n'


def test_study__states_values_that_change_no_key(tmp_path, invoke):
    path = tmp_path / "study.toml"
    keys = set()
    for text in (BALL, AUDITED):
        path.write_text(text)
        keys.add(read_study(path).key)
    assert len(keys) == 1
    with open_result(run_case(read_study(path), tmp_path / "results")) as ds:
        stated, given = (audit_of(ds, **more)["thickness"].number for more in ({}, {"thickness": "3 mm"}))
    assert given < stated
    out = invoke("audit", tmp_path / "results")[1]
    assert "600 µm" in out
    assert "heat_conductivity" not in out, "nothing slides"
    assert "--density" in out, "a missing property is named as the option"
    assert "6 mm" in invoke("audit", tmp_path / "results", "--thickness", "6 mm")[1]
    for option, found in (("density", "3 m"), ("work_of_adhesion", "sticky"), ("base", "glue")):
        name = f"--{option.replace('_', '-')}"
        status, _, err = invoke("audit", tmp_path / "results", name, found, "--thickness", "1 mm")
        assert (status, f"{option}: found '{found}'" in err) == (2, True)
    for line in ('work_of_adhesion = "5 N"', 'base = "bonded"', "hardness = 3"):
        path.write_text(f"{BALL}[audit]\n{line}\n")
        with refused(f"audit.{line.partition(' ')[0]}"):
            read_study(path)
