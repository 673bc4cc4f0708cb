"""Records of indentation: what is read, the material that fits, its intervals, and a prediction."""

import numpy as np
import pytest
import xarray as xr
from scipy.special import roots_jacobi

import roughvisc as rv

#: Relaxation modulus of the made records: equilibrium modulus, moduli [Pa] and times [s].
PLATEAU, MODULI, TIMES = 2e3, np.array([4e3, 2e3, 1e3]), np.array([0.03, 0.4, 5.0])
RADIUS, DEPTH, RAMP, HOLD, OFFSET = 10e-6, 1e-6, 0.2, 30.0, 50e-9
TIP = rv.sphere(RADIUS, RADIUS, 8)


def true_modulus(t):
    return PLATEAU + np.exp(-np.asarray(t)[:, None] / TIMES) @ MODULI


def made_record(rng, noise=5e-3, drift=0.0, hold=HOLD):
    """A ball is pressed in at constant speed and held; Gauss-Jacobi quadrature of the integral of Lee and Radok."""
    ramp, held = np.linspace(-0.1, RAMP, 150), RAMP + np.geomspace(0.002, hold, 250)
    t = np.concatenate([ramp, held])
    loaded = np.clip(t, 0, RAMP)
    nodes, weights = roots_jacobi(60, 0, 0.5)  # of sqrt(s) on the way
    s = loaded[:, None] * (nodes + 1) / 2
    age = t[:, None] - s
    modulus = PLATEAU + np.exp(-np.maximum(age, 0)[..., None] / TIMES) @ MODULI
    integral = (loaded / 2) ** 1.5 * (modulus @ weights)
    force = 8 * np.sqrt(RADIUS) / 1.5 * 1.5 * (DEPTH / RAMP) ** 1.5 * integral
    force = force + noise * force.max() * rng.standard_normal(t.size)
    approach = DEPTH * np.minimum(t / RAMP, 1) + OFFSET + drift * (t - t[0])
    segment = np.where(t <= RAMP, "approach", "hold")
    data = {"force": ("time", force), "approach": ("time", approach)}
    return xr.Dataset(data, {"time": t - t[0], "segment": ("time", segment)})


def test_material__is_that_of_the_record():
    fit = rv.fit_material(made_record(np.random.default_rng(1)), TIP)
    at = fit.bands.sel(time=slice(0.02, None))
    assert at.relaxation_modulus.values == pytest.approx(true_modulus(at.time.values), rel=0.02)
    assert fit.contact_point == pytest.approx(OFFSET, abs=2 * fit.contact_point_error)
    assert fit.contact_point_error < 5e-9
    assert fit.misfit == pytest.approx(5e-3, rel=0.2)
    creep = rv.from_relaxation(PLATEAU, MODULI, TIMES).creep_compliance([0.1, 1, 10])
    assert fit.material.creep_compliance([0.1, 1, 10]) == pytest.approx(creep, rel=0.02)


@pytest.mark.parametrize(
    ("trials", "drift", "least", "most"),
    [
        (8, 0.0, 0.8, 1.0),
        pytest.param(200, 0.0, 0.85, 0.95, marks=pytest.mark.long),
        pytest.param(200, 0.3e-9, 0.85, 0.95, marks=pytest.mark.long),
    ],
)
def test_intervals__cover_what_they_say(trials, drift, least, most):
    rng = np.random.default_rng(7)
    is_inside, errors = [], []
    for _ in range(trials):
        fit = rv.fit_material(made_record(rng, drift=drift * rng.standard_normal()), TIP, drift=drift)
        at = fit.bands.isel(time=slice(-25, None))  # from 20 ms on
        true = true_modulus(at.time.values)
        is_inside.append((at.relaxation_modulus_low.values < true) & (true < at.relaxation_modulus_high.values))
        errors.append(at.relaxation_modulus.values / true - 1)
    assert least <= np.mean(is_inside) <= most
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 0.02


def test_prediction__of_the_rest_of_the_hold():
    record = made_record(np.random.default_rng(3), noise=1e-3)
    fit = rv.fit_material(record.sel(time=slice(None, 10)), TIP, ["0.03 s", 0.4, 5])
    ball = rv.sphere(RADIUS, "8 um", 48)
    ds = rv.simulate(ball, fit.material, fit.program(record), times=[20, 30], fields=(), progress=False)
    measured = record.force.interp(time=ds.time.values + fit.contact_time(record))
    assert ds.force.values == pytest.approx(measured.values, rel=0.01)
    assert "known up to 9." in fit.material.note


@pytest.mark.parametrize(
    ("key", "changed", "given"),
    [
        ("contact_point", {"time": slice(0.15, None)}, {}),  # begins in contact
        ("record", {"time": slice(None, 0.12)}, {"contact_point": OFFSET}),  # ends just after the contact
        ("terms.1", {"time": slice(None, 3)}, {"terms": [0.1, "50 s"]}),
        ("poisson", {}, {"poisson": 0.7}),
        ("contact_point", {}, {"contact_point": "5 s"}),
    ],
)
def test_record__that_does_not_determine_the_material_is_refused(key, changed, given):
    with pytest.raises(rv.InputError) as error:
        rv.fit_material(made_record(np.random.default_rng(1)).sel(changed), TIP, **given)
    assert error.value.key == key


def test_noise__that_hides_the_modulus_is_refused():
    with pytest.raises(rv.InputError) as error:
        rv.fit_material(made_record(np.random.default_rng(1), noise=3.0), TIP, contact_point=OFFSET)
    assert error.value.key == "record"


def test_depth__that_is_noisy_is_refused():
    rng = np.random.default_rng(1)
    record = made_record(rng)
    record["approach"] = record.approach + 2e-3 * DEPTH * rng.standard_normal(record.sizes["time"])
    with pytest.raises(rv.InputError) as error:
        rv.fit_material(record, TIP)
    assert error.value.key == "record"


def test_creep__under_a_held_force():
    gel, force = rv.zener(6e3, 3e3, 1.5e3), 2e-8
    t = np.concatenate([np.linspace(-0.1, 0.2, 150), 0.2 + np.geomspace(0.002, 5, 250)])
    press = rv.Program().load(force, over=0.2).hold(5.0)
    approach = rv.closed_forms.lee_radok(RADIUS, gel, press).approach(np.maximum(t, 0))
    data = {"force": ("time", force * np.clip(t / 0.2, 0, 1)), "approach": ("time", approach + np.minimum(t, 0) * 1e-6)}
    record = xr.Dataset(data, {"time": t, "segment": ("time", np.where(t <= 0.2, "approach", "hold"))})
    fit = rv.fit_material(record, TIP, [0.5])
    assert fit.material.times == (0.5,)
    assert fit.material.creep_compliance([0, 1, 4]) == pytest.approx(gel.creep_compliance([0, 1, 4]), rel=0.01)
    assert fit.program(record, "load").segments[-1].end == pytest.approx(force)


@pytest.mark.parametrize("tip", [TIP + 1e-9, rv.flat_punch(1e-6, 3e-6, 9), None], ids=["moved", "punch", "none"])
def test_tip__of_another_shape_is_refused(tip):
    with pytest.raises(rv.InputError) as error:
        rv.fit_material(made_record(np.random.default_rng(1)), tip)
    assert error.value.key == "tip"


#: Depth [um] and force [nN] of a record with a hold, at whole tenths of a second.
DEPTHS = np.concatenate([np.linspace(-1, 1, 20), np.full(20, 1.0), np.linspace(0.9, -1, 20)])
FORCES = np.maximum(DEPTHS, 0) ** 1.5


def jpk_export(spring):
    rows = zip(np.arange(60) / 10, FORCES, DEPTHS + FORCES / (1e3 * spring), strict=True)
    lines = [f"{5e-6 - 1e-6 * way:.9e} {1e-9 * force:.9e} {time}" for time, force, way in rows]
    head = [
        "# springConstant: 0.05",
        "#",
        "# columns: h v t",
        '# fancyNames: "Height (measured)" "Vertical deflection" "Series Time"',
    ]
    return "\n".join([*head, "# units: m N s", "#", *lines, ""])


def optics11_export(spring):
    head = "Device:\tChiaro\nk (N/m)\t0.05\nMax load (\u00b5N)\t0.001\n\n"
    head += "Time (s)\tLoad (uN)\tIndentation (nm)\tCantilever (nm)\tPiezo (nm)\tAuxiliary\n"
    bent = FORCES / spring
    rows = zip(np.arange(60) / 10, FORCES, bent, 1e3 * DEPTHS + bent, strict=True)
    return head + "\n".join(f"{t:.6f}\t{1e-3 * f:.9f}\t0.0\t{b:.6f}\t{p:.6f}\t0.1" for t, f, b, p in rows)


def table(spring):
    rows = zip(np.arange(60) / 10, FORCES, DEPTHS, strict=True)
    return "Zeit (s);Kraft (nN);Weg (um)\n" + "\n".join(f"{t:.2f};{f:.7f};{d:.7f}" for t, f, d in rows).replace(
        ".", ","
    )


@pytest.mark.parametrize(
    ("export", "given"),
    [(jpk_export, {}), (optics11_export, {}), (table, {"time": "Zeit", "force": "Kraft", "approach": "Weg"})],
)
def test_record__of_each_export_is_read(export, given, tmp_path):
    path = tmp_path / "curve.txt"
    path.write_bytes(export(0.05).encode("cp1252"))
    record = rv.read_record(path, **given)
    assert record.approach.values == pytest.approx(1e-6 * (DEPTHS + 1), abs=1e-12)
    assert record.force.values == pytest.approx(1e-9 * FORCES, abs=1e-15)
    assert record.time.values == pytest.approx(np.arange(60) / 10)
    assert (record.segment == np.repeat(["approach", "hold", "retract"], 20)).mean() > 0.98


@pytest.mark.parametrize(
    ("key", "text", "given"),
    [
        ("spring", "time [s],force [N],z [m]\n0,0,1\n1,1,0", {"height": "z"}),
        ("force", "time [s],force [N],approach [m]\n0,0,0\n1,-1,1", {}),
        ("spring", "time [s],force [N],z [m]\n0,0,1\n1,1,0", {"height": "z", "spring": "3 N"}),
    ],
)
def test_record__without_what_it_needs_is_refused(key, text, given, tmp_path):
    (tmp_path / "curve.csv").write_text(text)
    with pytest.raises(rv.InputError) as error:
        rv.read_record(tmp_path / "curve.csv", **given)
    assert error.value.key == key


def test_record__whose_time_falls_is_refused(tmp_path):
    (tmp_path / "curve.csv").write_text("time [s],force [N],approach [m]\n0,0,0\n1,1,1\n0.5,1,1\n")
    with pytest.raises(rv.InputError) as error:
        rv.read_record(tmp_path / "curve.csv")
    assert error.value.found == 0.5
