"""What a user meets first: the public names, and arguments that are text with a unit."""

import ast
import inspect
import operator
import re
import subprocess
import sys
import textwrap
from functools import partial

import numpy as np
import pytest
from support import refused

import roughvisc as rv


@pytest.mark.parametrize(
    "module", [rv, rv.plot, rv.observables, rv.closed_forms, rv.materials, rv.surfaces], ids=lambda one: one.__name__
)
def test_completion__shows_what_users_call_and_nothing_else(module):
    shown = dir(module)
    for name in set(shown) - {"__version__"}:
        one = getattr(module, name)
        assert not name.startswith("_")
        if inspect.ismodule(one):
            assert (module, name) in {
                (rv, part) for part in ("plot", "observables", "closed_forms", "materials", "surfaces")
            }
        else:
            assert callable(one), name
            assert one.__module__.startswith("roughvisc."), f"{name} comes from elsewhere"


def test_completion__is_whole_before_anything_is_used():
    code = "import roughvisc; print(*dir(roughvisc))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == dir(rv)


def public():
    """Every public function and class, once, under the name that a user writes."""
    names = {}
    for module in (rv, rv.plot, rv.observables, rv.closed_forms, rv.materials, rv.surfaces):
        for name in set(dir(module)) - {"__version__"}:
            value = getattr(module, name)
            if not inspect.ismodule(value):
                names.setdefault(value, f"{module.__name__}.{name}")
    return names


def raises_on_its_own(value):
    """Whether the code of a function, or of a class apart from its methods, raises InputError."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(value))))
    body = [one for one in ast.walk(tree) if isinstance(one, ast.Raise) and one.exc is not None]
    return not inspect.isclass(value) and any("InputError" in ast.unparse(one) for one in body)


def test_docstring__has_an_example_its_relatives_and_its_errors():
    """The examples are run by the collection of doctests."""
    missing = {}
    for value, name in public().items():
        text = inspect.getdoc(value)
        is_error = inspect.isclass(value) and issubclass(value, rv.RoughviscError)
        sections = ["Examples", "See Also"]
        if (
            not is_error
            and inspect.signature(value).parameters
            and (inspect.isclass(value) or raises_on_its_own(value))
        ):
            sections.append("Raises")
        lacking = [one for one in sections if f"{one}\n{'-' * len(one)}" not in text]
        lacking += ["an example that runs"] if "+SKIP" in text else []
        if lacking:
            missing[name] = lacking
    assert not missing


def test_docstring__names_relatives_that_exist():
    for value, name in public().items():
        related = inspect.getdoc(value).partition("See Also\n--------\n")[2].partition("\n\n")[0]
        for dotted in re.findall(r"roughvisc\.([\w.]+)", related):
            assert operator.attrgetter(dotted)(rv) is not value, f"{name}: {dotted}"


WAVE = rv.wavy("1 um", "1 mm", ("1 mm", "0.1 mm"), (24, 3), waves=1)
RUBBER = rv.zener(shear_modulus="3 MPa", kelvin_modulus="1 MPa", kelvin_viscosity="0.1 MPa s")


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (lambda text: rv.sphere(radius=text, size=1e-3, shape=9), "radius"),
        (lambda text: rv.crop(WAVE, x=(0.0, text)), "x[1]"),
        (lambda text: rv.zener(3e6, text, 1e5), "kelvin_modulus"),
        (lambda text: rv.sheet(RUBBER, text), "thickness"),
        (lambda text: rv.Program().load(1.0, over=1.0).hold(text), "hold"),
        (lambda text: rv.friction(WAVE, RUBBER, pressure=1e4, speeds=[1.0, text], progress=False), "speeds[1]"),
    ],
    ids=lambda one: one if isinstance(one, str) else "",
)
def test_quantity__in_a_unit_of_another_kind_is_refused(call, key):
    with refused(key, "1 kat"):
        call("1 kat")


ROWS = {"times": [0.0, 1.0, 2.0], "kind": "shear", "poisson": 0.4}
PRESS = rv.Program().load(1.0, over=1.0)
SCENE = {"height": WAVE, "material": RUBBER, "progress": False}
CALLS = [
    (rv.simulate, SCENE | {"program": PRESS, "boundary": "periodic", "times": 2, "fields": ("gap",)}),
    (rv.friction, SCENE | {"speeds": [1.0], "pressure": 1e4, "fields": "gap"}),
    (rv.elastic, {"shear_modulus": 1e6, "poisson": 0.4}),
    (rv.maxwell, {"shear_modulus": 1e6, "viscosity": 1e5, "poisson": 0.4}),
    (rv.power_law, {"glassy": 1e-7, "coefficient": 1e-6, "exponent": 0.5, "poisson": 0.4}),
    (rv.Prony, {"glassy": 1e-6, "compliances": (1e-6,), "times": (1.0,), "poisson": 0.4}),
    (rv.from_relaxation, {"equilibrium": 1e6, "moduli": [1e6], "times": [1.0], "poisson": 0.4}),
    (rv.from_relaxation, {"instantaneous": 1e6, "ratios": [0.5], "times": [1.0]}),
    (rv.creep_table, ROWS | {"compliances": [1e-6, 2e-6, 3e-6], "noise": 0.1}),
    (rv.relaxation_table, ROWS | {"moduli": [3e6, 2e6, 1e6]}),
    (
        partial(rv.dynamic_table, frequency_unit="Hz", kind="shear"),
        {"frequencies": [1, 10], "storage": [1e6, 2e6], "loss": [1e5, 2e5], "shift_factors": 1.0, "poisson": 0.4},
    ),
    (rv.Program.table, {"times": [0], "values": [1]}),
    (rv.Program.cycle, {"mean": 1.0, "amplitude": 0.5, "period": 1.0, "cycles": 2.0}),
    (rv.run, {"case": None}),
    (rv.trade, {"case": None}),
    (rv.budget, {"case": None}),
    (partial(rv.vary, changes={}), {"case": None}),
    (rv.plan, {"cases": None}),
    (rv.sweep, {"cases": None}),
    (rv.observe, {"cases": None}),
    (rv.over_realisations, {"values": None}),
]


@pytest.mark.parametrize(("function", "arguments"), CALLS)
def test_wrong_type__is_refused_at_the_argument(function, arguments):
    for name in arguments.keys() - {"progress", "height", "material"}:
        for wrong in (object(), b"1", [object()], rv.Case, ["1 kat"], [True]):
            with pytest.raises(rv.InputError) as caught:
                function(**{**arguments, name: wrong})
            assert caught.value.key.partition("[")[0].partition(".")[0] == name, wrong


def test_case__has_the_settings_of_simulate():
    case, simulate = (list(inspect.signature(one).parameters.values()) for one in (rv.Case, rv.simulate))
    own = {"surface", "program", "title", "observe", "audit"}
    of_simulate = [one for one in simulate if one.name not in ("height", "program", "threads", "progress")]
    assert [str(one) for one in case if one.name not in own] == [str(one) for one in of_simulate]


SMALL = rv.Case(rv.sphere(1e-3, 2e-4, 9), rv.elastic(1e6), rv.Program().load(1e-6, over=0), title="small")


@pytest.mark.parametrize("wrong", [-1, "2", 1.5, True])
@pytest.mark.parametrize("name", ["workers", "threads"])
def test_number_of_processes_or_threads__is_refused_at_the_argument(name, wrong, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    functions = [rv.run, rv.sweep, rv.plan, rv.trade, rv.budget, rv.audit, rv.report, rv.simulate]
    for function in functions:
        parameters = inspect.signature(function).parameters
        if name in parameters:
            given = {
                rv.sweep: ([SMALL],),
                rv.report: (WAVE.to_dataset(name="height"), "page.html"),
                rv.simulate: (WAVE, RUBBER, PRESS),
            }.get(function, (SMALL,))
            quiet = {"progress": False} if "progress" in parameters else {}
            with refused(name, wrong):
                function(*given, **quiet, **{name: wrong})
    assert not list(tmp_path.rglob("*.nc"))


def test_missing_argument__names_the_function():
    with pytest.raises(TypeError, match=r"^maxwell\(\).*'G'"):
        rv.maxwell(G=1e6, viscosity=1e5)
    with pytest.raises(TypeError, match=r"^Prony\(\).*'glassy'"):
        rv.Prony(times=[1.0])


def test_text__is_the_number():
    h = rv.self_affine("1 mm", 32, hurst=0.8, rms_height="1 um", rolloff="0.5 mm", shortcut="100 um", seed=1)
    same = rv.self_affine(1e-3, 32, hurst=0.8, rms_height=1e-6, rolloff=5e-4, shortcut=1e-4, seed=1)
    assert h.identical(same)
    assert rv.sphere(radius="1 mm", size=("200 um", 3e-4), shape=9).identical(rv.sphere(1e-3, (2e-4, 3e-4), 9))
    assert rv.crop(h, x=("0.2 mm", 6e-4)).identical(rv.crop(h, x=(2e-4, 6e-4)))
    assert rv.gaussian_filter(h, "0.2 mm").identical(rv.gaussian_filter(h, 2e-4))
    assert rv.from_array(h.values, "10 um").identical(rv.from_array(h.values, 1e-5))
    assert rv.zener(3e6, 1e6, 1e5) == RUBBER
    assert rv.sheet(RUBBER, "1 mm") == rv.sheet(RUBBER, 1e-3)
    assert rv.Prony("0.3 1/MPa", times=["1 min"], compliances=["1 1/MPa"]) == rv.Prony(3e-7, 0.0, (1e-6,), (60.0,))
    assert rv.power_law("0 1/Pa", "2 1/GPa", 0.3, "1 h") == rv.power_law(0.0, 2e-9, 0.3, 3600.0)
    assert rv.creep_table(["1 ms", 1.0], ["1 1/MPa", 2e-6], kind="shear") == rv.creep_table(
        (1e-3, 1.0), (1e-6, 2e-6), kind="shear"
    )
    assert rv.from_relaxation("1 MPa", ["2 MPa"], ["10 ms"]) == rv.from_relaxation(1e6, [2e6], [0.01])
    assert rv.wlf("40 degC", "20 degC", 8.86, "101.6 K") == rv.wlf(313.15, 293.15, 8.86, 101.6)
    assert rv.closed_forms.hertz("1 mm", "4 MPa", "1 mN") == rv.closed_forms.hertz(1e-3, 4e6, 1e-3)
    told, plain = (
        rv.friction(WAVE, RUBBER, pressure=pressure, speeds=speeds, progress=False)
        for pressure, speeds in (("50 kPa", ["1 mm/s", 0.1]), (5e4, [1e-3, 0.1]))
    )
    assert np.array_equal(told.friction_coefficient, plain.friction_coefficient)


def test_elastic__is_stated_by_either_modulus():
    for poisson in (0.5, 0.3, 0.0, -0.5):
        young = rv.elastic(young_modulus=2e6 * 2 * (1 + poisson), poisson=poisson)  # E = 2 G (1 + nu)
        assert young.glassy == pytest.approx(rv.elastic(2e6, poisson).glassy, rel=1e-14)
    with refused("shear_modulus", None):
        rv.elastic()
    with refused("young_modulus", 2.0):
        rv.elastic(shear_modulus=1.0, young_modulus=2.0)
    with refused("young_modulus", -1.0):
        rv.elastic(young_modulus=-1.0)


def test_tensile_relaxation__is_that_in_shear_times_two_and_a_poisson_ratio():
    young = rv.from_relaxation("2.6 MPa", ["5.2 MPa", 1.3e6], [0.1, 1.0], 0.3, kind="tensile")
    shear = rv.from_relaxation(1e6, [2e6, 5e5], [0.1, 1.0], 0.3)
    t = np.array([0.0, 0.05, 1.0, 100.0])
    np.testing.assert_allclose(young.creep_compliance(t), shear.creep_compliance(t), rtol=1e-13)
    with refused("kind", "stretch"):
        rv.from_relaxation(1e6, [2e6], [0.1], kind="stretch")
