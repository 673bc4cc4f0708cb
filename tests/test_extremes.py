"""At the ends of every axis: right to a stated tolerance, or refused with a clear message; never NaN, never endless."""

import math

import numpy as np
import pytest
import xarray as xr
from references.half_space import punch_approach
from support import assert_missing_as_declared, at_rows, refused

import roughvisc as rv
from roughvisc import closed_forms
from roughvisc.variables import STATUS_MEANINGS

thorough = pytest.mark.thorough
ELASTIC, ZENER = rv.elastic(0.25), rv.zener(0.25, 0.25, 0.25)  # contact modulus 1; retardation time 1
R, SIZE, SHAPE = 10.0, 2.6, (33, 31)
BALL = rv.sphere(R, SIZE, SHAPE)
ROUGH = rv.self_affine(1.0, (31, 29), hurst=0.8, rms_slope=0.1, seed=1)
TOLERANCE = 1e-3
#: Second order in the side of a cell over a contact radius of one: what a cell's mean lies above its centre.
GRID = (SIZE / 31) ** 2 / 12


def simulate(height, material, program, **settings):
    return rv.simulate(height, material, program, **{"progress": False, "times": 3, "tolerance": TOLERANCE, **settings})


def cells(values, side):
    """Heights on a grid of any shape, also of one cell."""
    centres = {axis: (np.arange(n) + 0.5) * side for axis, n in zip("xy", values.shape, strict=True)}
    return xr.DataArray(values, dims=("x", "y"), coords=centres)


def cell_area(ds):
    return np.prod([2 * float(ds[a][0]) if ds.sizes[a] == 1 else float(ds[a][1] - ds[a][0]) for a in ("x", "y")])


def assert_a_contact_state(ds):
    """Finite if declared, force balanced, no tension, no penetration beyond what the solver's tolerance leaves."""
    present = np.isfinite(ds.height.values)
    known = ds.assign(at_rows(ds).data_vars)
    assert_missing_as_declared(known)
    for name, values in known.variables.items():
        assert not np.isinf(values).any(), name
    assert np.isfinite(ds.gap.values[:, present]).all()
    pressure = ds.pressure.values
    assert (pressure >= 0).all()
    assert (pressure[:, ~present] == 0).all()
    assert not np.any((pressure > 0) & (ds.gap.values > 0))
    np.testing.assert_allclose(pressure.sum((1, 2)) * cell_area(ds), ds.force.values, rtol=1e-12)
    if "displacement" in ds:
        opening = np.nanmax(ds.height.values) - ds.height.values + ds.displacement.values
        opening -= ds.approach.values[:, None, None]
        scale = np.nanmax(np.abs(ds.displacement.values)) + np.ptp(ds.height.values[present])
        assert np.nanmin(opening) >= -30 * TOLERANCE * scale


def assert_follows(ds, exact):
    """The approach within tolerance and grid of the largest exact one."""
    assert np.isfinite(ds.approach.values).all()
    error = np.abs(ds.approach.values - exact).max() / np.abs(exact).max()
    assert error < TOLERANCE + GRID, error


def step_load(material, duration):
    """A load applied at once that ends on a contact radius of one, with its closed form (Lee, Radok)."""
    load = 4 / 3 / R / float(material.contact_compliance(duration))
    times = duration * np.array([0.01, 0.5, 1.0])
    ds = simulate(BALL, material, rv.Program().load(load, over=0).hold(duration), times=times)
    assert_a_contact_state(ds)
    return ds, closed_forms.lee_radok(R, material, load).approach(times)


# ----------------------------------------------------------------------------------------------------------------
# materials and times


@pytest.mark.parametrize("exponent", [-12, pytest.param(0, marks=thorough), 12])
@pytest.mark.parametrize(
    "material",
    [ZENER, *(pytest.param(one, marks=thorough) for one in (rv.maxwell(0.25, 0.25), rv.kelvin_voigt(0.25, 0.25)))],
    ids=repr,
)
def test_step_load__is_lee_and_radoks_at_any_time_over_the_retardation_time(material, exponent):
    assert_follows(*step_load(material, 10.0**exponent))


@pytest.mark.parametrize("exponent", [-8, -2, pytest.param(4, marks=thorough), 8])
def test_step_load__is_lee_and_radoks_at_any_ratio_of_the_moduli(exponent):
    kelvin = 0.25 / 10.0**exponent
    assert_follows(*step_load(rv.zener(0.25, kelvin, kelvin), 1e3))


@pytest.mark.parametrize("duration", [1e-6, pytest.param(1e6, marks=thorough)])
@pytest.mark.parametrize("exponent", [0.5, pytest.param(0.1, marks=thorough), pytest.param(0.9, marks=thorough)])
@pytest.mark.parametrize("glassy", [0.0, 1.0])
def test_step_load__is_lee_and_radoks_on_a_power_law(glassy, exponent, duration):
    assert_follows(*step_load(rv.power_law(glassy, 1.0, exponent), duration))


def test_holds_of_all_lengths_in_one_program__follow_lee_and_radok():
    """Holds from 1e-15 to 1e15 retardation times, ascending."""
    program = rv.Program().load(0.1 / R, over=0)
    for exponent in range(-15, 16, 2):
        program = program.hold(10.0**exponent)
    for material in (ZENER, rv.Prony(1.0, 0.0, (1.0, 1.0, 1.0), (1e-9, 1.0, 1e9))):
        ds = simulate(BALL, material, program, times=program.corners[1:])
        exact = closed_forms.lee_radok(R, material, 0.1 / R).approach(ds.time.values)
        smallest = float(np.sqrt(exact[0] * R))  # the contact radius: the grid is coarse for it
        assert np.abs(ds.approach.values - exact).max() < (TOLERANCE + GRID / smallest**2) * exact.max()


@pytest.mark.parametrize(
    ("program", "settings", "key", "found"),
    [
        (rv.Program().load(1e-3, over=1e15).hold(1e-15), {}, "program.1", 1e-15),
        (rv.Program().load(1e-3, over=1e200), {}, "program.0", 1e200),
        (rv.Program().load(1e-3, over=100.0), {"numerics": rv.Numerics(time_step=1e-15)}, "time_step", 1e-15),
    ],
)
def test_what_cannot_be_represented__is_refused(program, settings, key, found):
    with refused(key, found):
        simulate(ROUGH, ZENER, program, **{"edge": "accept", **settings})


# ----------------------------------------------------------------------------------------------------------------
# loads, lengths, programs


@pytest.mark.parametrize("exponent", [-300, -6])
@pytest.mark.parametrize("material", [ZENER, rv.kelvin_voigt(0.25, 0.25)], ids=["zener", "kelvin_voigt"])
@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_small_load__is_carried_by_the_highest_cell(boundary, material, exponent):
    """One cell then: the approach is the load times the compliance times the cell's own influence."""
    ramp = rv.Program().load(10.0**exponent, over=0.1).hold(1.0)
    ds = simulate(ROUGH, material, ramp, boundary=boundary, edge="accept", fields=("pressure", "gap", "displacement"))
    assert_a_contact_state(ds)
    cell = math.prod(float(ROUGH[axis][1] - ROUGH[axis][0]) for axis in ("x", "y"))
    assert at_rows(ds).contact_area_counted.values[1:] == pytest.approx(cell)
    ratio = ds.approach.values[1:] / punch_approach(0.5, material, ramp, ds.time.values[1:])  # over int C dW
    assert ratio[0] == pytest.approx(ratio[1], rel=2 * TOLERANCE)
    if boundary == "free":
        a, b = (float(ROUGH[axis][1] - ROUGH[axis][0]) for axis in ("x", "y"))
        love = (2 * a * np.arcsinh(b / a) + 2 * b * np.arcsinh(a / b)) / np.pi  # Johnson, eq. (3.25), at the centre
        assert ratio == pytest.approx(love / (a * b), rel=2 * TOLERANCE)


@pytest.mark.parametrize("scale", [1e-250, 1e250])
def test_load_and_moduli_of_any_size__leave_the_same_contact(scale):
    ball = rv.sphere(1e-2, 2e-3, 16)
    usual, scaled = (
        rv.simulate(
            ball,
            rv.zener(2e6 * size, 2e6 * size, 1e6 * size),
            rv.Program().load(size, over=0.1).hold(1.0),
            times=3,
            progress=False,
        )
        for size in (1.0, scale)
    )
    np.testing.assert_allclose(scaled.approach, usual.approach, rtol=1e-3)
    np.testing.assert_array_equal(scaled.contact_area, usual.contact_area)


@pytest.mark.parametrize("load", [1.0, 1e12])
@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_large_load__makes_full_contact_and_no_more(boundary, load):
    ds = simulate(ROUGH, ZENER, rv.Program().load(load, over=0).hold(1.0), boundary=boundary, edge="accept")
    assert_a_contact_state(ds)
    assert (ds.contact_fraction == 1).all()
    if boundary == "periodic":
        assert ds.approach.values == pytest.approx(float(ROUGH.max() - ROUGH.mean()), rel=1e-9)
        assert ds.mean_gap.values == pytest.approx(0, abs=1e-15)
    elif load > 1:  # the heights do not matter: a flat square
        flat = simulate(0 * ROUGH, ZENER, rv.Program().load(load, over=0).hold(1.0), edge="accept")
        assert ds.approach.values == pytest.approx(flat.approach.values, rel=1e-3)


@pytest.mark.parametrize("over", [0, 1.0])
@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_approach__pulls_fully_out_and_comes_back(boundary, over):
    surface, deep = (BALL, 0.06) if boundary == "free" else (ROUGH, 0.4 * float(ROUGH.max() - ROUGH.mean()))
    program = rv.Program().approach(deep, over=over).hold(0.5).approach(-deep, over=over).hold(30.0)
    program = program.approach(deep, over=over)
    times = [0.25, program.duration - 5 - over, program.duration]
    ds = simulate(surface, ZENER, program, boundary=boundary, times=times)
    assert_a_contact_state(ds)
    assert STATUS_MEANINGS[at_rows(ds).status.values[1]] == "open"
    assert float(ds.force[1]) == 0
    # after thirty retardation times nothing is left of the dent: as if from rest, from half way on
    fresh = simulate(surface, ZENER, rv.Program().approach(deep, over=over / 2), boundary=boundary, times=1)
    assert float(ds.force[-1]) == pytest.approx(float(fresh.force[0]), rel=2 * TOLERANCE)


@pytest.mark.parametrize("ratio", [1e-12, 1e12])
def test_jumps_of_any_size__leave_a_punch_at_its_exact_approach(ratio):
    """Up or down by any factor and back: a punch tells the exact approach."""
    program = rv.Program().load(1.0, over=0).hold(1.0).load(ratio, over=0).hold(1.0).load(1.0, over=0).hold(1.0)
    punch = rv.flat_punch(1.0, SIZE, SHAPE)
    ds = simulate(punch, ZENER, program, times=7)
    assert_a_contact_state(ds)
    exact = punch_approach(1.0, ZENER, program, ds.time.values)
    found = ds.approach.values / ds.approach.values[0] * exact[0]  # what the cells make of the radius apart
    assert np.abs(found - exact).max() < TOLERANCE * exact.max()


# ----------------------------------------------------------------------------------------------------------------
# grids and surfaces


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (2, 2), (31, 37), (2, 4096)], ids=str)
@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_solution__is_a_contact_state_on_a_grid_of_any_shape(shape, boundary):
    side = 1 / max(shape)
    height = cells(1e-3 * np.random.default_rng(0).standard_normal(shape), side)
    fields = ("pressure", "gap", "displacement")
    program = rv.Program().load(1e-3 * side, over=0).hold(1.0)
    ds = simulate(height, ZENER, program, boundary=boundary, edge="accept", fields=fields)
    assert_a_contact_state(ds)
    deep = 0.3 * float(height.max() - height.mean())
    program = rv.Program().approach(deep, over=0.1).hold(1.0)
    if boundary == "periodic" and deep == 0:
        with refused("program.0", 0.0):
            simulate(height, ZENER, program, boundary=boundary)
    else:
        ds = simulate(height, ZENER, program, boundary=boundary, edge="accept", fields=fields)
        assert_a_contact_state(ds)
        assert float(ds.approach[-1]) == deep


@pytest.mark.parametrize("shape", [(37, 41), (16, 256), (256, 16)], ids=str)
def test_hertz__on_cells_of_any_aspect(shape):
    ds = simulate(rv.sphere(R, SIZE, shape), ELASTIC, rv.Program().load(4 / 3 / R, over=0))
    coarse = SIZE / min(shape)
    assert abs(float(ds.approach[0]) * R - 1) < TOLERANCE + coarse**2 / 12
    assert abs(float(ds.contact_area[0]) / np.pi - 1) < 0.02 * coarse + coarse**1.5 + TOLERANCE
    assert_a_contact_state(ds)


X, Y = np.meshgrid(np.arange(32), np.arange(32), indexing="ij")
SHAPES = {
    "flat": 0.0 * X,
    "spike": np.where((X == 13) & (Y == 17), 0.1, 0.0),
    "step": np.where(X < 16, 0.0, -0.1),
    "checkerboard": 1e-2 * ((X + Y) % 2),
    "plateau": np.minimum(rv.self_affine(1.0, 32, hurst=0.8, rms_slope=0.1, seed=1).values, 0.0),
    "equal maxima": np.where((X % 8 == 4) & (Y % 8 == 4), 1e-2, 0.0),
}


@pytest.mark.parametrize("load", [1e-6, 1e-2])
@pytest.mark.parametrize("boundary", ["free", "periodic"])
@pytest.mark.parametrize("name", SHAPES)
def test_solution__is_a_contact_state_on_a_surface_of_any_shape(name, boundary, load):
    height = cells(SHAPES[name], 1 / 32)
    program = rv.Program().load(load, over=0.1).hold(1.0).load(load / 3, over=0.1)
    fields = ("pressure", "gap", "displacement")
    ds = simulate(height, ZENER, program, boundary=boundary, edge="accept", fields=fields)
    assert_a_contact_state(ds)
    if name in ("equal maxima", "checkerboard") and boundary == "periodic":
        # equal cells in equal surroundings carry equal pressure: exactly known without solving anything
        highest = SHAPES[name] == SHAPES[name].max()
        for frame in ds.pressure.values[1:]:
            assert np.ptp(frame[highest]) <= 30 * TOLERANCE * frame[highest].max()


@pytest.mark.parametrize(("slope", "warns"), [(0.25, False), (0.5, True)])
def test_slopes_that_are_not_small__warn(slope, warns):
    height = rv.self_affine(1.0, (64, 60), hurst=0.8, rms_slope=slope, shortcut=0.2, seed=1)
    ds = simulate(height, ELASTIC, rv.Program().load(0.01 * slope, over=0), boundary="periodic")
    assert ("slope:" in ds.attrs.get("warnings", "")) is warns


def test_slopes_that_are_not_loaded__do_not_warn():
    """A ball whose flanks are steep, pressed at its tip; a flat punch whose sides are absent."""
    ball = rv.sphere(1.0, 1.9, (65, 65))
    tip = simulate(ball, ELASTIC, rv.Program().load(1e-3, over=0))
    assert "slope:" not in tip.attrs.get("warnings", "")
    punch = simulate(rv.flat_punch(1.0, SIZE, SHAPE), ELASTIC, rv.Program().load(1.0, over=0))
    assert "slope:" not in punch.attrs.get("warnings", "")


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize(("load", "warns"), [(0.01, False), (0.1, True)])
def test_slopes_of_a_long_period__count_in_the_contact(load, warns, across):
    """A cylinder of radius 1 on a period of 1.9, per unit length; the contact of half-width a has the slope a."""
    x = (np.arange(190) + 0.5) * 1e-2 - 0.95
    height = cells(np.repeat(-(x[:, None] ** 2) / 2, 2, 1), 1e-2)
    height = height.transpose("y", "x").rename(x="y", y="x") if across else height
    direction, per_length = "y" if across else "x", load * 2e-2
    press = rv.Program().load(per_length, over=0)
    results = [
        rv.friction(height, ZENER, load=per_length, speeds=1.0, direction=direction, progress=False),
        simulate(height, ELASTIC, press, boundary="periodic"),
        simulate(height, ELASTIC, press, boundary="mirror"),
    ]
    for ds in results:
        assert ("slope:" in ds.attrs.get("warnings", "")) is warns
        half_width = 1.9 / 2 * float(ds.contact_fraction.max())
        number = float(rv.audit(ds).number.sel(assumption="slope"))
        assert number == pytest.approx(2 * half_width / math.sqrt(3), rel=0.05)


def test_float32_heights__differ_by_their_rounding():
    program = rv.Program().load(1e-2, over=0.1).hold(1.0)
    found, exact = (simulate(h, ZENER, program, boundary="periodic") for h in (ROUGH.astype("float32"), ROUGH))
    assert found.height.dtype == np.float64
    rounding = 2**-24 * float(abs(ROUGH).max() / exact.approach.max())
    assert found.approach.values == pytest.approx(exact.approach.values, rel=4 * rounding + 1e-3 * TOLERANCE)


# ----------------------------------------------------------------------------------------------------------------
# nothing modelled that the scene does not need


def test_constant_load__takes_few_steps_once_relaxed():
    """A hundred times the hold, hardly more steps: pairs of steps double."""
    load = rv.Program().load(0.05, over=0)
    short, longer = (simulate(BALL, ZENER, load.hold(time), times=[time]) for time in (30.0, 3000.0))
    assert longer.roughvisc.steps.sizes["step"] <= short.roughvisc.steps.sizes["step"] + 2 * math.log2(100.0)
    assert float(longer.approach[-1]) == pytest.approx(float(short.approach[-1]), rel=TOLERANCE)
