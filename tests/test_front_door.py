"""What a user meets first: the public names, and arguments that are text with a unit."""

import inspect
import re
import subprocess
import sys
from functools import cache

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.units import in_si, quantities, quantity

MODULES = (rv, rv.plot, rv.observables, rv.closed_forms)


@pytest.mark.parametrize("module", MODULES, ids=lambda one: one.__name__)
def test_completion__shows_what_users_call_and_nothing_else(module):
    shown = dir(module)
    assert len(shown) > 15
    for name in set(shown) - {"__version__"}:
        one = getattr(module, name)
        assert not name.startswith("_")
        if inspect.ismodule(one):
            assert (module, name) in {(rv, "plot"), (rv, "observables"), (rv, "closed_forms")}
        else:
            assert callable(one), name
            assert one.__module__.startswith("roughvisc."), f"{name} comes from elsewhere"


def test_completion__is_whole_before_anything_is_used():
    code = "import roughvisc; print(*dir(roughvisc))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == dir(rv)


def test_case__is_what_read_study_returns(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(
        '[surface]\ngenerate = "sphere"\nradius = 1e-3\nsize = 1e-4\nshape = 8\n'
        '[material]\nmodel = "elastic"\nshear_modulus = 1e6\n[[program]]\nload = 1e-4\nover = 0\n'
    )
    case = rv.read_study(path)
    assert isinstance(case, rv.Case)
    assert all(isinstance(one, rv.Case) for one in rv.read_cases(path))
    assert inspect.signature(rv.read_study).return_annotation == "Case"


def public():
    """What users call, by name: functions, classes that they make, and the parts of a program."""
    holders = (*MODULES, rv.Program)
    found = {f"{one.__name__.rpartition('.')[2]}.{name}": getattr(one, name) for one in holders for name in dir(one)}
    return {name: one for name, one in found.items() if callable(one) and not name.rpartition(".")[2].startswith("_")}


def parameters(text):
    """Names, type and description of each entry of the parameters of a docstring."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?=\n\n\w+\n-+\n|\Z)", text, re.M | re.S)
    entries = re.split(r"^(\w+(?:, \w+)*) : (.+)$", section[1] if section else "", flags=re.M)[1:]
    return [(names.split(", "), kind, about) for names, kind, about in zip(*[iter(entries)] * 3, strict=True)]


def stated_quantities(function):
    """Parameter, type and unit of each quantity with a dimension that a docstring states."""
    for names, kind, about in parameters(inspect.getdoc(function) or ""):
        units = re.findall(r"\[([^\[\]`]+)\]", about)
        if units and not kind.startswith(NO_QUANTITY):
            units = units if len(units) == len(names) else [units[-1]] * len(names)
            yield from ((name, kind, unit) for name, unit in zip(names, units, strict=True) if unit != "-")


def declared(function):
    """Argument -> unit, as the decorator of a function or of a class was given them."""
    return getattr(function.__init__ if isinstance(function, type) else function, "quantities", {})


#: Types of arguments that are no quantities, but hold some.
NO_QUANTITY = ("xarray", "callable", "bool or callable", "ndarray", "array_like, shape", "mapping", "Program")
#: Classes that functions return: users read them, and do not make them.
RETURNED = {
    *("AxisymmetricContact", "ContactHistory", "ContactRelaxation", "FlatPunchContact", "GrowingContact"),
    *("KelvinVoigtStep", "PowerLawRamp", "SingleMaximum", "SlidingCylinder", "StepLoad", "WavyContact"),
}
#: Quantities that a function takes as numbers alone, and why.
NUMBERS = {
    ("closed_forms.power_law_ramp", "coefficient"): "its unit depends on the exponent",
    ("closed_forms.power_law_ramp", "exponent"): "it has none",
    ("plot.animate", "rate"): "a number of pictures",
    ("plot.animate", "dpi"): "a number of points",
}


@cache
def pressed():
    """A result of few cells."""
    ball, rubber = rv.sphere("1 mm", "0.2 mm", 9), rv.zener("3 MPa", "1 MPa", "0.1 MPa s")
    return rv.simulate(ball, rubber, rv.Program().load("0.1 mN", over=0).hold("1 s"), times=3, progress=False)


PRESS = rv.Program().load(1.0, over=1.0)
#: Functions that convert text themselves, each with one argument changed.
CALLS = {
    "Program.load": lambda **one: rv.Program().load(**{"value": 2.0, "over": 0.05, **one}),
    "Program.pressure": lambda **one: rv.Program().pressure(**{"value": 2.0, "over": 0.05, **one}),
    "Program.approach": lambda **one: rv.Program().approach(**{"value": 2.0, "over": 0.05, **one}),
    "Program.hold": lambda **one: PRESS.hold(**one),
    "Program.slide": lambda **one: PRESS.slide(**{"distance": 2.0, **({} if "over" in one else {"speed": 1.0}), **one}),
    "Program.table": lambda **one: rv.Program.table(
        **{"times": [0.0, 1.0], "values": [0.0, 1.0], **{name: [0.0, text] for name, text in one.items()}}
    ),
    "Program.cycle": lambda **one: rv.Program.cycle(
        **{"mean": 2.0, "amplitude": 0.5, "period": 1.0, "cycles": 2, **one}
    ),
    "roughvisc.read_program": lambda **one: rv.read_program("table.csv", **one),
    "roughvisc.wlf_shift": lambda **one: rv.wlf_shift(313.0, 293.0, c1=8.86, **one),
    "roughvisc.Numerics": rv.Numerics,
    "roughvisc.simulate": lambda times: rv.simulate(
        rv.sphere(1e-3, 2e-4, 9), rv.elastic(1e6), PRESS, times=[times], progress=False
    ),
    "roughvisc.audit": lambda **one: rv.audit(pressed(), **one),
    "plot.maps": lambda **one: rv.plot.maps(pressed(), **one),
    "observables.leakage": lambda **one: rv.observables.leakage(pressed(), **one),
    "observables.conductance": lambda resistivity: rv.observables.conductance(pressed(), [resistivity, 0.0]),
    "observables.incremental_stiffness": lambda **one: rv.observables.incremental_stiffness(pressed(), **one),
}
STATED = [
    pytest.param(name, *stated, id=f"{name}-{stated[0]}")
    for name, one in sorted(public().items())
    if name.rpartition(".")[2] not in RETURNED
    for stated in stated_quantities(one)
    if (name, stated[0]) not in NUMBERS
]


@pytest.mark.parametrize(("name", "parameter", "kind", "unit"), STATED)
def test_every_quantity__may_be_text(name, parameter, kind, unit, tmp_path, monkeypatch):
    """As the docstrings state them: each is declared with that unit, or the function refuses text of another one."""
    function = public()[name]
    assert re.search(r"\bstr\b", kind), f"{name}: {parameter} : {kind}"
    if parameter in declared(function):
        written = re.sub(r"(?<=[a-z])(?=\d)", "^", unit)  # m3
        assert quantity(f"1 {declared(function)[parameter]}", written) == 1.0
        return
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.csv").write_text("time [s];load [N]\n0;0\n1;2\n")
    with pytest.raises(InputError, match=r"'1 kat'.*(in katal|expected)"):
        CALLS[name](**{parameter: "1 kat"})


def test_stated_quantities__are_found():
    names = {(one.values[0], one.values[1]) for one in STATED}
    assert len(names) > 120
    assert {("roughvisc.zener", "kelvin_modulus"), ("roughvisc.sphere", "size"), ("Program.hold", "duration")} <= names
    assert not CALLS.keys() - {name for name, _ in names}
    assert not {name for name, _ in NUMBERS} - public().keys()


@pytest.mark.parametrize("name", sorted(name for name, one in public().items() if declared(one)))
def test_declared_quantities__are_arguments_with_a_unit_in_the_docstring(name):
    function = public()[name]
    documented = {parameter for names, _, _ in parameters(inspect.getdoc(function)) for parameter in names}
    assert declared(function).keys() <= inspect.signature(function).parameters.keys() & documented


def test_text__is_the_number():
    h = rv.self_affine("1 mm", 32, hurst=0.8, rms_height="1 um", rolloff="0.5 mm", shortcut="100 um", seed=1)
    same = rv.self_affine(1e-3, 32, hurst=0.8, rms_height=1e-6, rolloff=5e-4, shortcut=1e-4, seed=1)
    assert h.identical(same)
    assert rv.sphere(radius="1 mm", size=("200 um", 3e-4), shape=9).identical(rv.sphere(1e-3, (2e-4, 3e-4), 9))
    assert rv.crop(h, x=("0.2 mm", 6e-4)).identical(rv.crop(h, x=(2e-4, 6e-4)))
    assert rv.gaussian_filter(h, "0.2 mm").identical(rv.gaussian_filter(h, 2e-4))
    assert rv.from_array(h.values, "10 um").identical(rv.from_array(h.values, 1e-5))
    rubber = rv.zener(shear_modulus="3 MPa", kelvin_modulus="1 MPa", kelvin_viscosity="0.1 MPa s")
    assert rubber == rv.zener(3e6, 1e6, 1e5)
    assert rv.sheet(rubber, "1 mm") == rv.sheet(rubber, 1e-3)
    assert rv.Prony("0.3 1/MPa", times=["1 min"], compliances=["1 1/MPa"]) == rv.Prony(3e-7, 0.0, (1e-6,), (60.0,))
    assert rv.PowerLaw("0 1/Pa", "2 1/GPa", 0.3, "1 h") == rv.PowerLaw(0.0, 2e-9, 0.3, 3600.0)
    assert rv.Tabulated(["1 ms", 1.0], ["1 1/MPa", 2e-6]) == rv.Tabulated((1e-3, 1.0), (1e-6, 2e-6))
    assert rv.from_relaxation("1 MPa", ["2 MPa"], ["10 ms"]) == rv.from_relaxation(1e6, [2e6], [0.01])
    assert rv.wlf_shift("40 degC", "20 degC", 8.86, "101.6 K") == rv.wlf_shift(313.15, 293.15, 8.86, 101.6)
    assert rv.closed_forms.hertz("1 mm", "4 MPa", "1 mN") == rv.closed_forms.hertz(1e-3, 4e6, 1e-3)
    wave = rv.wavy("1 um", "1 mm", ("1 mm", "0.1 mm"), (24, 3), waves=1)
    told, plain = (
        rv.friction(wave, rubber, pressure=pressure, speeds=speeds, progress=False)
        for pressure, speeds in (("50 kPa", ["1 mm/s", 0.1]), (5e4, [1e-3, 0.1]))
    )
    assert np.array_equal(told.friction_coefficient, plain.friction_coefficient)


def test_in_si__leaves_alone_what_is_no_text():
    for value in (None, 2, 2.5, np.arange(3), [1.0, 2.0], (1.0, None), True, {1.0}):
        assert in_si(value, "m", "size") is value
    assert in_si([("1 mm", 2.0), "3 m"], "m", "size") == [(1e-3, 2.0), 3.0]
    with pytest.raises(InputError, match=r"^size\[1\]\[0\] is '1 s', which is in second: expected a number in m"):
        in_si([1.0, ("1 s",)], "m", "size")


def test_quantities__hand_on_what_they_do_not_name():
    @quantities(length="m", time="s")
    def function(length, count=1, *more, time=0.0, **rest):
        return length, count, more, time, rest

    assert function("1 mm", "2", "3", time="1 ms", length2="4") == (1e-3, "2", ("3",), 1e-3, {"length2": "4"})
    assert function(length="1 mm") == (1e-3, 1, (), 0.0, {})
    with pytest.raises(TypeError, match="missing 1 required"):
        function()
    with pytest.raises(InputError, match=r"^time is '2', a text without a unit: expected a number in s"):
        function(1.0, time="2")


@pytest.mark.parametrize(
    ("build", "springs", "rest"),
    [
        (rv.elastic, ["shear_modulus"], {}),
        (rv.maxwell, ["shear_modulus"], {"viscosity": 1e5}),
        (rv.kelvin_voigt, ["shear_modulus"], {"viscosity": 1e5}),
        (rv.zener, ["shear_modulus", "kelvin_modulus"], {"kelvin_viscosity": 1e5}),
    ],
)
def test_springs__are_stated_by_either_modulus(build, springs, rest):
    names = {"shear_modulus": "young_modulus", "kelvin_modulus": "kelvin_young_modulus"}
    for poisson in (None, 0.3, 0.0, -0.5):
        factor = 2 * (1 + (0.5 if poisson is None else poisson))  # E = 2 G (1 + nu)
        shear = build(**dict.fromkeys(springs, 2e6), **rest, poisson=poisson)
        young = build(**dict.fromkeys((names[one] for one in springs), 2e6 * factor), **rest, poisson=poisson)
        for t in (0.0, 0.1, 10.0):
            assert young.contact_compliance(t) == pytest.approx(float(shear.contact_compliance(t)), rel=1e-14)
    for spring in springs:
        others = {one: 2e6 for one in springs if one != spring} | rest
        with pytest.raises(InputError, match=f"^{spring} is None and {names[spring]} is None: expected one of them$"):
            build(**others)
        with pytest.raises(InputError, match=f"^{spring} is 1.0 and {names[spring]} is 2.0: expected one of them$"):
            build(**others, **{spring: 1.0, names[spring]: 2.0})
        with pytest.raises(InputError, match=f"^{names[spring]} is -1.0: expected a positive number"):
            build(**others, **{names[spring]: -1.0})
        with pytest.raises(InputError, match=f"^{names[spring]} is 1.0 and bulk_modulus is 2.0: expected {spring}"):
            build(**others, **{names[spring]: 1.0}, bulk_modulus=2.0)


def test_tensile_relaxation__is_that_in_shear_times_two_and_a_poisson_ratio():
    young = rv.from_relaxation("2.6 MPa", ["5.2 MPa", 1.3e6], [0.1, 1.0], 0.3, kind="tensile")
    shear = rv.from_relaxation(1e6, [2e6, 5e5], [0.1, 1.0], 0.3)
    t = np.array([0.0, 0.05, 1.0, 100.0])
    np.testing.assert_allclose(young.creep_compliance(t), shear.creep_compliance(t), rtol=1e-13)
    with pytest.raises(InputError, match="kind is 'stretch'"):
        rv.from_relaxation(1e6, [2e6], [0.1], kind="stretch")
    with pytest.raises(InputError, match=r"kind is 'tensile' and bulk_modulus is 1000000000\.0"):
        rv.from_relaxation(1e6, [2e6], [0.1], kind="tensile", bulk_modulus="1 GPa")


STUDY = """[surface]
generate = "sphere"
radius = 1e-3
size = 1e-4
shape = 8
[material]
{}
[[program]]
load = 1e-4
over = 0
"""


@pytest.mark.parametrize(
    ("by_shear", "by_young"),
    [
        ('model = "elastic"\nshear_modulus = "3 MPa"', 'model = "elastic"\nyoung_modulus = "9 MPa"'),
        (
            'model = "zener"\npoisson = 0.25\nshear_modulus = 4e6\nkelvin_modulus = 2e6\nkelvin_viscosity = 1e5',
            'model = "zener"\npoisson = 0.25\nyoung_modulus = 1e7\nkelvin_young_modulus = 5e6\nkelvin_viscosity = 1e5',
        ),
    ],
)
def test_study__of_a_material_by_either_modulus_is_one_case(by_shear, by_young, tmp_path):
    cases = []
    for text in (by_shear, by_young):
        (tmp_path / "study.toml").write_text(STUDY.format(text))
        cases.append(rv.read_study(tmp_path / "study.toml"))
    assert cases[0].key == cases[1].key
    assert cases[0].material() == cases[1].material()
    assert "young_modulus" in cases[1].to_json()
    assert rv.vary(cases[1], {"material.young_modulus": "12 MPa"}).key != cases[1].key


def test_study__of_relaxation_in_tension_is_told_from_one_in_shear(tmp_path):
    def case(more, factor=1):
        moduli = f"equilibrium = {factor * 1e6}\nmoduli = [{factor * 2e6}]"
        (tmp_path / "study.toml").write_text(
            STUDY.format(f'model = "from_relaxation"\n{moduli}\ntimes = [1.0]\n{more}')
        )
        return rv.read_study(tmp_path / "study.toml")

    usual = case("")
    assert usual.key == case('kind = "shear"').key
    assert "kind" not in usual.settings.material.content(), "the keys of former cases stay"
    assert case('kind = "tensile"').key != usual.key
    assert case('kind = "tensile"', 3).material() == usual.material()
