"""``[material]``: every model, columns of files, pairs, layers and temperatures; what is refused, and at which key."""

import pytest
from samples import RUBBER
from support import refused

import roughvisc as rv
from roughvisc.mechanics.materials import MODELS
from roughvisc.study.case import Case, vary

MODULI = {"frequency_unit": "Hz", "frequencies": [1, 10], "kind": "shear"}
HEADING = "time [s], compliance [1/Pa]\n"
#: Coating on rubber.
COAT = {"model": "elastic", "shear_modulus": "1 GPa", "poisson": 0.35, "thickness": "20 um"}
ZENER = {"model": "zener", "shear_modulus": "3 MPa", "kelvin_modulus": "1 MPa", "kelvin_viscosity": "0.1 MPa s"}
STIFF, SOFT = {"model": "elastic", "shear_modulus": 8e10}, {"model": "maxwell", "shear_modulus": 1e6, "viscosity": 1e6}
WLF = {"temperature": "30 degC", "reference_temperature": 293.15, "wlf_c1": 8.0, "wlf_c2": "90 K"}
ARRHENIUS = {"temperature": 303.15, "reference_temperature": "20 °C", "activation_energy": "80 kJ/mol"}


@pytest.mark.parametrize(
    ("model", "stated"),
    [
        ("elastic", {"shear_modulus": 1e6}),
        ("maxwell", {"shear_modulus": 1e6, "viscosity": "2 kPa s", "poisson": 0.3}),
        ("kelvin_voigt", {"shear_modulus": 1e6, "viscosity": 1}),
        ("zener", {"shear_modulus": "3 MPa", "kelvin_modulus": 1e6, "kelvin_viscosity": "1 kPa s"}),
        ("from_relaxation", {"equilibrium": 0, "moduli": ["1 MPa", 2e6], "times": ["1 ms", 1]}),
        ("from_relaxation", {"instantaneous": "3 kPa", "ratios": [0.5], "times": [1], "bulk_modulus": "2 kPa"}),
        ("prony", {"glassy": "1 GPa^-1", "compliances": [1e-6], "times": [1]}),
        ("prony", {"glassy": 1e-9}),
        ("power_law", {"glassy": 0, "coefficient": "1 MPa^-1", "exponent": 0.4, "time_scale": "2 h"}),
        (
            "fractional_zener",
            {"instantaneous": "1 GPa", "equilibrium": "1 MPa", "relaxation_time": "1 ms", "exponent": 0.5},
        ),
        ("creep_table", {"times": [0, "2 min"], "compliances": [1, 2], "noise": 0.01, "kind": "tensile"}),
        ("relaxation_table", {"times": [0, 1], "moduli": ["3 MPa", 2e6], "poisson": 0.3, "kind": "shear"}),
        ("dynamic_table", MODULI | {"storage": [2, 3], "loss": [1, "1 Pa"]}),
    ],
)
def test_model__is_that_of_its_function(read_one, model, stated):
    assert read_one(material={"model": model, **stated}).material == MODELS[model](**stated)


@pytest.mark.parametrize(
    "rows",
    [
        f"{HEADING}0, 1e-7\n60, 2e-7\n3600, 5e-7\n",
        "# rheometer\ncompliance (1/MPa),time [min]\n0.1,0\n0.2,1\n0.5,60",
    ],
)
def test_creep__from_a_file_is_that_from_lists(read_one, tmp_path, rows):
    (tmp_path / "creep.csv").write_text(rows)
    case = read_one(material={"model": "creep_table", "file": "creep.csv", "kind": "shear"})
    listed = read_one(
        material={"model": "creep_table", "times": [0, 60, 3600], "compliances": [1e-7, 2e-7, 5e-7], "kind": "shear"},
    )
    assert case.material == listed.material == rv.creep_table((0.0, 60.0, 3600.0), (1e-7, 2e-7, 5e-7), kind="shear")
    assert case.key == listed.key, "the content counts, not the path or the units"
    (tmp_path / "creep.csv").unlink()
    again = Case.from_json(case.to_json())
    assert again == case, "a stored case needs its CSV file no longer"
    assert vary(again, {"material.noise": 0.1}).tables["material"]["noise"] == 0.1


@pytest.mark.parametrize(
    "rows",
    [
        "frequency [Hz], storage [MPa], loss [MPa]\n1, 3, 1\n10, 5, 2",
        "storage [MPa], frequency, loss [MPa]\n3, 1, 1\n5, 10, 2",
        "frequency, storage [MPa], loss [kPa], shift_factor\n2, 3, 1000, 0.5\n2, 5, 2000, 5",
    ],
)
def test_dynamic_table__from_a_file(read_one, tmp_path, rows):
    (tmp_path / "dma.csv").write_text(rows)
    table = {"model": "dynamic_table", "file": "dma.csv", "kind": "shear"}
    material = read_one(material=table | {"frequency_unit": "Hz"}).material
    assert material == rv.dynamic_table((1, 10), (3e6, 5e6), (1e6, 2e6), frequency_unit="Hz", kind="shear")
    if "[Hz]" not in rows:
        assert read_one(material=table | {"frequency_unit": "rad/s"}).material != material


def test_pair__is_varied_within(read_one, tmp_path):
    (tmp_path / "creep.csv").write_text(f"{HEADING}0, 1\n1, 2")
    bodies = {
        "a": {"model": "elastic", "shear_modulus": 1},
        "b": {"model": "creep_table", "file": "creep.csv", "kind": "shear"},
    }
    case = read_one(material={"model": "pair", **bodies})
    assert Case.from_json(case.to_json()).key == case.key
    changed = vary(case, {"material.a.shear_modulus": "2 Pa"})
    assert changed.key != case.key
    assert changed.material == rv.pair(rv.elastic(2.0), rv.creep_table((0, 1), (1, 2), kind="shear"))


def test_on__makes_a_layer_and_nests(read_one):
    coating = rv.elastic(1e9, poisson=0.35)
    layer = read_one(material=COAT | {"on": ZENER})
    assert layer.body == rv.layer(coating, 2e-5, on=RUBBER)
    steel = {"model": "elastic", "shear_modulus": "80 GPa", "poisson": 0.3}
    nested = read_one(material=COAT | {"on": ZENER | {"thickness": "1 mm", "on": steel}})
    assert nested.body == rv.layer(coating, 2e-5, on=rv.layer(RUBBER, 1e-3, on=rv.elastic(80e9, poisson=0.3)))
    assert vary(layer, {"material.thickness": float("inf")}).body == rv.Body(coating)
    assert vary(layer, {"material.on.shear_modulus": "3e6 Pa"}).key == layer.key
    assert vary(layer, {"material.on.shear_modulus": "4 MPa"}).key != layer.key


def test_temperature__wlf_arrhenius_and_their_factor_state_the_same(read_one):
    # 10 K above the reference: log10 a = -8 * 10 / 100; the series is that of a Zener solid of 0.1 s
    case, warm = read_one(), read_one(material=ZENER | WLF)
    assert warm.material.times == pytest.approx((0.1 * 10**-0.8,))
    assert warm.material.at("20 °C") == case.material
    assert read_one(material=ZENER | {"shift_factor": 10**-0.8}).material.times == pytest.approx(warm.material.times)
    assert warm.key != case.key
    arrhenius = read_one(material=ZENER | ARRHENIUS).material
    assert arrhenius.times == pytest.approx((0.1 * rv.arrhenius(303.15, 293.15, 8e4),))
    again = Case.from_json(warm.to_json())
    assert (again.key, again.material) == (warm.key, warm.material)
    assert read_one(material=ZENER | WLF | {"temperature": "20 degC"}).material == case.material
    assert read_one(material=ZENER | {"shift_factor": 1}).material == case.material


def test_temperature__both_bodies_of_a_pair_or_one(read_one):
    two = read_one(material={"model": "pair", "a": STIFF, "b": SOFT})
    both = read_one(material={"model": "pair", "a": STIFF, "b": SOFT, **WLF})
    one = read_one(material={"model": "pair", "a": STIFF, "b": SOFT | WLF})
    assert both.material == one.material != two.material
    assert both.material.fluidity == pytest.approx(two.material.fluidity * 10**0.8)


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({"model": "creep_table", "file": "gone.csv"}, "material.file"),
        ({"model": "creep_table", "file": "creep.csv", "times": [0, 1]}, "material.file"),
        ({"model": "creep_table", "file": "bare.csv"}, "material.file"),
        ({"model": "creep_table", "times": [0, 1], "compliances": [1, 2]}, "material.kind"),
        ({"model": "creep_table", "file": "falling.csv", "noise": "1 %", "kind": "shear"}, "material"),
        ({"model": "dynamic_table", "file": "creep.csv", "kind": "shear"}, "material.file"),
        ({"model": "dynamic_table", "file": "creep.csv", "frequency_unit": "1/s"}, "material.frequency_unit"),
        ({"model": "creep_table", "columns": {"time": "t"}, "times": [0, 1], "kind": "shear"}, "material.columns"),
        (
            {"model": "creep_table", "times": [0, 1], "compliances": [1, 2], "kind": "shear", "vertical": "none"},
            "material.vertical",
        ),
        ({"model": "pair", "a": STIFF | {"shear_modulus": -1}, "b": {"model": "pair"}}, "material.a.shear_modulus"),
        (COAT | {"on": ZENER, "thickness": None}, "material.thickness"),
        (COAT | {"on": ZENER, "base": "bonded"}, "material.base"),
        (COAT | {"on": ZENER | {"model": "zenner"}}, "material.on.model"),
        (COAT | {"on": ZENER | {"model": "pair"}}, "material.on.shear_modulus"),
        (COAT | {"on": ZENER | {"thickness": "1 mm"}}, "material.on"),
        (COAT | {"on": ZENER | {"poisson": -0.2}}, "material.on"),
        (COAT | {"on": ZENER, "poisson": -0.1}, "material"),
        (ZENER | {"temperature": 300}, "material.reference_temperature"),
        (ZENER | {"wlf_c1": 3}, "material.temperature"),
        (ZENER | {"temperature": 300, "reference_temperature": 290}, "material.wlf_c1"),
        (ZENER | WLF | {"wlf_c2": "90 degC"}, "material.wlf_c2"),
        (ZENER | WLF | {"activation_energy": 8e4}, "material.wlf_c1"),
        (ZENER | WLF | {"temperature": "-75 degC"}, "material.temperature"),
        (ZENER | ARRHENIUS | {"temperature": 25}, "material.temperature"),
        (ZENER | ARRHENIUS | {"shift_factor": 2}, "material.temperature"),
        (ZENER | {"shift_factor": -2}, "material.shift_factor"),
    ],
)
def test_material__is_refused_at_the_key(read, tmp_path, table, key):
    (tmp_path / "creep.csv").write_text(f"{HEADING}0, 1\n1, 2")
    (tmp_path / "falling.csv").write_text(f"{HEADING}0, 2\n1, 1")
    (tmp_path / "bare.csv").write_text("time, compliance\n0, 1\n1, 2")
    with refused(key):
        read(material={name: value for name, value in table.items() if value is not None})


@pytest.mark.parametrize(("modulus", "count"), [(3, 1), ("3 Pa", 0), (3e6, 0)])
def test_number_without_a_unit__of_a_very_soft_body_warns(read, caplog, modulus, count):
    read(material={"model": "elastic", "shear_modulus": modulus})
    assert sum("material.shear_modulus" in record.getMessage() for record in caplog.records) == count
