"""Rubber friction by Persson's theory from a spectrum: closed limits, heat of sliding, spectra, and steady sliding."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import erf

import roughvisc as rv
from roughvisc.mechanics.friction_integrals import contact_integral
from roughvisc.mechanics.heating import MovingSpot, surface_rise

#: Relaxation from 5 MPa to 1 MPa in 1 ms; in shear. The contact modulus is four times as large.
RELAXED, RELAXING, TIME = 1e6, 4e6, 1e-3
RUBBER = rv.from_relaxation(RELAXED, [RELAXING], [TIME])
ROAD = rv.psd_table([1e3, 1e4, 1e6], [1e-18, 1e-18, 1e-25], convention="persson")
TREAD = rv.Heating(
    lambda temperature: rv.arrhenius(temperature, 300.0, 80e3),
    temperature=300.0,
    density=1.2e3,
    heat_capacity=1.5e3,
    heat_conductivity=0.3,
    spot_radius=2e-3,
)


def slope_of(spectrum):
    q = np.geomspace(*spectrum.wavevector.values[[0, -1]], 100_001)
    density = np.exp(np.interp(np.log(q), np.log(spectrum.wavevector), np.log(spectrum.psd)))
    return math.sqrt(np.trapezoid(q**4 * density, np.log(q)) / (2 * math.pi))


@pytest.mark.parametrize("speed", [1e-6, 1e-2, 1.0, 1e4])
def test_waves_of_one_length__in_full_contact(speed):
    """mu = q^2 h^2 <cos Im E*> / 2 p, and the mean over directions is E (1 - 1 / sqrt(1 + x^2)) / x at x = q V tau."""
    q, height, pressure, width = 1e4, 1e-6, 1e9, 1e-4
    density = 2 * math.pi * height**2 / (2 * width * q**2)
    ring = rv.psd_table(q * np.array([1 - width, 1 + width]), [density, density], convention="psd")
    ds = rv.friction_theory(ring, RUBBER, speeds=speed, pressure=pressure)
    x = q * speed * TIME
    loss = 4 * RELAXING * (x / 2 if x < 1e-4 else (1 - 1 / math.sqrt(1 + x**2)) / x)
    assert ds.friction_coefficient[0] == pytest.approx(q**2 * height**2 * loss / (2 * pressure), rel=1e-5)
    assert ds.contact_fraction[0] == 1


@pytest.mark.parametrize(("speed", "modulus", "power"), [(1e-9, RELAXED, 1), (1e9, RELAXED + RELAXING, -1)])
def test_slow_and_fast__are_elastic_contacts(speed, modulus, power):
    """A = erf(sqrt(2) p / E* h'), and friction is proportional to the speed or to its inverse."""
    pressure = 1e6
    ds = rv.friction_theory(ROAD, RUBBER, speeds=[speed, 2 * speed], pressure=pressure)
    fraction = erf(math.sqrt(2) * pressure / (4 * modulus * slope_of(ROAD)))
    assert ds.contact_fraction.values == pytest.approx([fraction] * 2, rel=1e-4)
    slow, fast = ds.friction_coefficient.values
    assert fast / slow == pytest.approx(2.0**power, rel=1e-4)
    assert ds.rms_slope == pytest.approx(slope_of(ROAD), rel=1e-3)


def test_elastic_body__has_no_friction():
    ds = rv.friction_theory(ROAD, rv.elastic(1e6), speeds=[1e-3, 1.0], pressure=1e5, heating=TREAD)
    assert not ds.friction_coefficient.any()
    assert ds.temperature.values.tolist() == [TREAD.temperature] * 2


@pytest.mark.parametrize("factor", [0.0, 0.5, 1.0])
def test_integral_of_the_contact__by_quadrature(factor):
    variance = np.geomspace(1e-6, 1e8, 15)
    found = np.diff(contact_integral(variance, factor))
    for low, high, one in zip(variance, variance[1:], found, strict=False):
        g = np.geomspace(low, high, 20_001)
        contact = erf(0.5 / np.sqrt(g))
        assert one == pytest.approx(
            np.trapezoid(contact * (factor + (1 - factor) * contact**2) * g, np.log(g)), rel=1e-6
        )


def test_dissipation_factor__is_linear_and_reduces_friction():
    frictions = [
        float(rv.friction_theory(ROAD, RUBBER, speeds=0.1, pressure=1e5, dissipation_factor=g).friction_coefficient[0])
        for g in (0.0, 0.25, 1.0)
    ]
    assert frictions[1] == pytest.approx(0.75 * frictions[0] + 0.25 * frictions[2], rel=1e-12)
    assert frictions[0] < 0.5 * frictions[2]


def test_power__is_the_heat_at_the_temperatures_found():
    """Also in full contact from the stress: power = integral of the squared stress times loss compliance and rate."""
    speeds = [0.03, 0.1, 3.0]
    ds = rv.friction_theory(ROAD, RUBBER, speeds=speeds, pressure=3e6, heating=TREAD)
    power = ds.friction_coefficient * ds.nominal_pressure * ds.speed
    assert ds.heat_flux.values == pytest.approx(power.values, rel=1e-6)
    assert ds.friction_of_waves.sum("wavelength").values == pytest.approx(ds.friction_coefficient.values, rel=1e-12)
    assert (ds.temperature > TREAD.temperature + 0.5).all()
    assert (ds.temperature_of_waves.diff("wavelength").values > 0).all(), "the heat of all waves meets at the surface"

    full = rv.friction_theory(ROAD, RUBBER, speeds=0.1, pressure=1e9)
    q = np.geomspace(1e3, 1e6, 4001)[:, None]
    angle = (np.arange(720) + 0.5) * 2 * math.pi / 720
    density = np.exp(np.interp(np.log(q), np.log(ROAD.wavevector), np.log(ROAD.psd)))
    frequency = q * 0.1 * np.cos(angle)
    modulus = 4 * (RELAXED + RELAXING * 1j * frequency * TIME / (1 + 1j * frequency * TIME))
    stress = np.abs(modulus * q / 2) ** 2 * density  # of each wave vector
    dissipated = stress * (2 / q) * -(1 / modulus).imag * frequency
    heat = np.trapezoid((q**2).ravel() * dissipated.mean(axis=1) * 2 * math.pi, np.log(q.ravel())) / (2 * math.pi) ** 2
    assert full.heat_flux[0] == pytest.approx(heat, rel=1e-3)


def test_moving_spot__has_the_limits_of_jaeger_and_of_no_diffusion():
    radius, conductivity, capacity, flux = 2e-3, 0.3, 1.8e6, 1e4
    slow = surface_rise(flux, radius, 1e-9, conductivity, capacity)
    assert slow == pytest.approx(8 / (3 * math.pi) * flux * radius / conductivity, rel=1e-4)
    fast = surface_rise(flux, radius, 1e3, conductivity, capacity)
    peclet = 1e3 * radius * capacity / conductivity
    # mean over the disc of 2 Q sqrt(t / pi k rho c) at the time t since the spot arrived
    mean = 2 / math.sqrt(math.pi) * 2**1.5 / 1.5 / math.pi * math.gamma(1.75) * math.gamma(0.5) / math.gamma(2.25)
    assert fast == pytest.approx(mean * flux * radius / conductivity / math.sqrt(peclet), rel=1e-4)
    depths = np.array([3e3, 1e4])
    rise = MovingSpot(radius, 0.5, 1e-12, capacity, depths).rise(np.array([0.0, flux]))
    lasting = 8 * radius / (3 * math.pi * 0.5)  # mean time since the spot arrived
    assert rise == pytest.approx(flux * lasting / capacity * 2 * depths * 1e4 / (depths + 1e4), rel=1e-4)


def test_join__of_parts_is_the_whole():
    whole = np.geomspace(1e3, 1e6, 61)
    density = 1e-9 * whole**-3.6
    parts = [rv.psd_table(whole[a:b], density[a:b], convention="psd") for a, b in ((30, 61), (0, 40))]
    joined = rv.join_psd(*parts)
    assert joined.wavevector.values == pytest.approx(whole)
    assert joined.psd.values == pytest.approx(density, rel=1e-9)
    assert joined.mismatch == pytest.approx(1.0)
    direct = rv.friction_theory(rv.psd_table(whole, density, convention="psd"), RUBBER, speeds=0.1, pressure=1e5)
    joined = rv.friction_theory(parts, RUBBER, speeds=0.1, pressure=1e5)
    assert joined.friction_coefficient[0] == pytest.approx(float(direct.friction_coefficient[0]), rel=1e-9)
    with pytest.warns(UserWarning, match="differ"):
        assert rv.join_psd(parts[0], parts[1].assign(psd=4 * parts[1].psd)).mismatch == pytest.approx(4.0)


def test_scans__have_the_friction_of_their_spectrum():
    """A long and a fine scan of one road, which neither resolves alone: the window and the rings add some per cent."""
    q = np.geomspace(1e4, 6e5, 50)
    density = 1e-22 * (q / 1e5) ** -3.6
    table = {"wavevectors": q, "densities": density, "convention": "psd", "amplitudes": "gaussian"}
    scans = [rv.from_spectrum(side, 128, **table, seed=seed) for side, seed in ((1.2e-3, 1), (3e-4, 2))]
    scans = [one.drop_attrs() for one in scans]  # neither is known to be periodic
    settings = {"speeds": [1e-3, 0.1], "pressure": 1e6}
    found = rv.friction_theory(scans, RUBBER, shortest="12 um", **settings)
    expected = rv.friction_theory(rv.psd_table(q, density, convention="psd"), RUBBER, shortest="12 um", **settings)
    assert found.friction_coefficient.values == pytest.approx(expected.friction_coefficient.values, rel=0.15)


def test_cut_off__by_slope_is_that_of_its_wavelength():
    by_slope = rv.friction_theory(ROAD, RUBBER, speeds=0.1, pressure=1e5, slope=0.5 * slope_of(ROAD))
    assert by_slope.rms_slope == pytest.approx(0.5 * slope_of(ROAD), rel=1e-3)
    shortest = float(by_slope.shortest_wavelength[-1])
    same = rv.friction_theory(ROAD, RUBBER, speeds=0.1, pressure=1e5, shortest=shortest)
    assert same.friction_coefficient[0] == pytest.approx(float(by_slope.friction_coefficient[0]), rel=1e-9)


@pytest.mark.parametrize(
    ("key", "changed"),
    [
        ("spectrum", {"spectrum": 3.0}),
        ("speeds", {"speeds": [0.1, -1.0]}),
        ("pressure", {"pressure": 0.0}),
        ("shortest", {"shortest": "1 nm"}),
        ("slope", {"slope": 100.0}),
        ("slope", {"slope": 0.1, "shortest": 1e-5}),
        ("dissipation_factor", {"dissipation_factor": 1.5}),
        ("material", {"material": rv.sheet(RUBBER, 1e-3)}),
        ("heating", {"heating": 300.0}),
        ("heating.spot_radius", {"heating": replace(TREAD, spot_radius=None)}),
        ("shift(300 K)", {"heating": replace(TREAD, shift=lambda temperature: -1.0)}),
    ],
)
def test_wrong_input__is_named(key, changed):
    given = {"spectrum": ROAD, "material": RUBBER, "speeds": 0.1, "pressure": 1e5} | changed
    with pytest.raises(rv.InputError) as caught:
        rv.friction_theory(**given)
    assert caught.value.key == key


@pytest.mark.parametrize(
    ("key", "wavevectors", "densities", "convention"),
    [
        ("convention", [1, 2], [1, 1], "iso"),
        ("wavevectors[1]", [2, 1], [1, 1], "psd"),
        ("densities[0]", [1, 2], [-1, 1], "psd"),
        ("densities", [1, 2], [1, 1, 1], "psd"),
        ("densities", [1, 2], [0, 0], "psd"),
    ],
)
def test_wrong_spectrum__is_named(key, wavevectors, densities, convention):
    with pytest.raises(rv.InputError) as caught:
        rv.psd_table(wavevectors, densities, convention=convention)
    assert caught.value.key == key


def test_gap_between_spectra__is_refused():
    parts = [rv.psd_table(q, [1.0, 1.0], convention="psd") for q in ([1, 2], [3, 4])]
    with pytest.raises(rv.InputError) as caught:
        rv.join_psd(*parts)
    assert caught.value.key == "spectra"


@pytest.fixture(scope="module")
def rough():
    q = np.geomspace(2e4, 1.2e5, 20)
    spectrum = rv.psd_table(q, q**-3.6, convention="psd")
    return spectrum.assign(psd=spectrum.psd * (0.2 / slope_of(spectrum)) ** 2)


def surface(spectrum, cells=48, seed=1):
    table = {"wavevectors": spectrum.wavevector.values, "densities": spectrum.psd.values, "convention": "psd"}
    return rv.from_spectrum((1e-3, 1e-3), cells, **table, seed=seed)


def test_surface_of_a_spectrum__has_it(rough):
    """Each wave has the density over the area as its mean square; a finer grid has the same waves."""
    height = surface(rough)
    waves = np.abs(np.fft.fft2(height) / height.size) ** 2 * 1e-6
    q = np.fft.fftfreq(48, 1e-3 / 48) * 2 * np.pi
    length = np.hypot(q[:, None], q)
    inside = (length > 2e4) & (length < 1.2e5)
    expected = np.exp(np.interp(np.log(length[inside]), np.log(rough.wavevector), np.log(rough.psd)))
    assert waves[inside] == pytest.approx(expected, rel=1e-9)
    assert waves[~inside].max() < 1e-20 * waves.max()
    assert rv.resample(surface(rough, 96), 48).values == pytest.approx(height.values, abs=1e-12 * float(height.max()))


def test_theory_and_grid__meet_in_nearly_full_contact(rough):
    """Within the few per cent by which the sum over the waves of this small surface differs from the integral."""
    height = surface(rough)
    settings = {"speeds": [0.003, 0.1], "pressure": 3e6}
    grid = rv.friction(height, RUBBER, **settings, progress=False, grid_error=False)
    theory = rv.friction_theory(rough, RUBBER, **settings)
    assert (grid.contact_fraction > 0.9).all()
    assert theory.contact_fraction.values == pytest.approx(grid.contact_fraction.values, rel=0.05)
    assert theory.friction_coefficient.values == pytest.approx(grid.friction_coefficient.values, rel=0.08)


def test_heat_of_a_sliding_surface__shifts_its_material(rough):
    """The curve is that of the material at the temperature, which the heat in the mean spot makes."""
    height = 30 * surface(rough, 24).assign_coords(x=lambda one: 30 * one.x, y=lambda one: 30 * one.y)
    settings = {"pressure": 1e6, "speeds": 3.0, "boundary": "periodic", "progress": False, "grid_error": False}
    warm = rv.friction(height, RUBBER, heating=TREAD, fields=["pressure"], **settings)
    rise = float(warm.temperature[0]) - TREAD.temperature
    assert rise > 1
    shifted = rv.shift(RUBBER, TREAD.shift(TREAD.temperature + rise))
    same = rv.friction(height, shifted, **settings)
    assert warm.friction_coefficient[0] == pytest.approx(float(same.friction_coefficient[0]), rel=2e-3)
    assert warm.friction_coefficient[0] != pytest.approx(
        float(rv.friction(height, RUBBER, **settings).friction_coefficient[0]), rel=0.02
    )
    heat = {"heat_conductivity": 0.3, "volumetric_heat_capacity": 1.8e6}
    assert rv.audit(warm.drop_vars("temperature"), **heat).sel(assumption="heating").number == pytest.approx(
        rise, rel=5e-3
    )
    assert rv.audit(warm).sel(assumption="heating").verdict == "holds"


def test_study__takes_a_spectrum_from_a_file(tmp_path):
    """In the units of its heading, from the table of the surface."""
    (tmp_path / "road.csv").write_text("wavevector [1/um], density [um^4]\n0.02, 3\n0.2, 0.001\n")
    (tmp_path / "study.toml").write_text(
        '[surface]\ngenerate = "spectrum"\nfile = "road.csv"\nconvention = "persson"\nsize = 2e-4\nshape = 16\n'
        'seed = 1\n[material]\nmodel = "elastic"\nshear_modulus = 1e6\n[friction]\nload = 1e-3\nspeeds = 0.1\n'
    )
    table = {"wavevectors": [2e4, 2e5], "densities": [3e-24, 1e-27], "convention": "persson"}
    same = rv.from_spectrum(2e-4, 16, **table, seed=1)
    assert rv.read_study(tmp_path / "study.toml").height().values == pytest.approx(same.values, rel=1e-9)
