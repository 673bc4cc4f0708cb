"""Results in other tools: CSV, deformed surfaces as scans, and files after the CF conventions."""

import csv
import re
from pathlib import Path

import netCDF4
import numpy as np
import pint
import pytest
import sample_results as made
from support import at_rows, refused

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.runs.netcdf import write_result
from roughvisc.variables import STATUS_MEANINGS, VARIABLES

#: Units as UDUNITS, which CF refers to, writes them.
UDUNITS = {"1", "s", "m", "m^2", "Pa", "N", "J"}
CARD = Path(__file__).parents[2] / "surfaces" / "ground_steel.toml"
SAMPLES = {"creep": made.hertz_creep, "rough": made.rough_creep, "open": made.open_contact, "one": made.one_frame}


@pytest.fixture(params=SAMPLES, scope="module")
def file(request, tmp_path_factory):
    return write_result(SAMPLES[request.param](), tmp_path_factory.mktemp("cf") / f"{request.param}.nc")


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    """A result with every field, on a card's conditioned scan."""
    scan = rv.resample(rv.open_scan(CARD), (32, 28))
    rubber = rv.zener(3e6, 1e6, 1e5)
    press = rv.Program().load(0.01, over=0.05).hold(0.2)
    fields = ("pressure", "gap", "displacement")
    options = {"boundary": "periodic", "tolerance": 1e-2, "times": 3, "fields": fields, "progress": False}
    return rv.simulate(scan, rubber, press, **options)


def test_units__are_read_by_pint():
    read = pint.UnitRegistry()
    for name, variable in VARIABLES.items():
        if variable.units:
            assert read.Unit(variable.units), name
    powers = {"contact_area": "meter ** 2", "gap_density": "1 / meter", "pressure_density": "1 / pascal"}
    assert {name: str(read.Unit(VARIABLES[name].units)) for name in powers} == powers


@pytest.mark.parametrize("use", [rv.observables.distribution, rv.plot.maps], ids=lambda use: use.__name__)
def test_result__in_other_units_is_refused(use, computed):
    converted = computed.assign(pressure=(computed.pressure / 1e6).assign_attrs(units="MPa"))
    with pytest.raises(InputError, match="MPa"):
        use(converted)


def test_csv__gives_every_history_back(computed, tmp_path):
    computed = computed.assign(status=at_rows(computed).status)  # as a friction curve has it, a word
    path = rv.to_csv(computed, tmp_path / "there" / "histories.csv")
    with open(path, newline="", encoding="utf-8") as stream:
        heading, *rows = csv.reader(stream)
    assert heading[0] == "time [s]"
    assert {"force [N]", "approach [m]", "contact_area [m^2]", "contact_fraction", "status"} <= set(heading)
    columns = dict(zip((name.partition(" ")[0] for name in heading), zip(*rows, strict=True), strict=True))
    assert set(columns) == {"time", *(n for n, v in computed.data_vars.items() if v.dims == ("time",))}
    for name, texts in columns.items():
        if name == "status":
            assert [STATUS_MEANINGS.index(text) for text in texts] == computed.status.values.tolist()
        else:
            found = [float(text) if text else np.nan for text in texts]
            np.testing.assert_array_equal(found, computed[name].values)


@pytest.mark.parametrize(
    ("read", "key"),
    [(rv.to_table, "out"), (rv.open_results, "out"), (rv.open_result, "path"), (rv.read_cases, "path")],
)
def test_result__is_no_path_of_results(computed, read, key):
    with refused(key, "Dataset"):
        read(computed)


def test_csv__is_refused_for_many_cases(computed, tmp_path):
    with pytest.raises(InputError, match="choose one case"):
        rv.to_csv(computed.expand_dims(case=2), tmp_path / "a.csv")


@pytest.mark.parametrize("suffix", [".x3p", ".sdf", ".nc"])
def test_deformed_surface__goes_to_the_instrument_and_back(computed, tmp_path, suffix):
    surface = (computed.height + computed.gap[0]).rename("height").assign_attrs(units="m")
    rv.save_scan(surface, tmp_path / f"pressed{suffix}")
    again = rv.open_scan(tmp_path / f"pressed{suffix}")
    np.testing.assert_allclose(again.values, surface.values, rtol=1e-6, atol=1e-12)
    assert np.diff(again.x).mean() == pytest.approx(np.diff(surface.x).mean())


# ------------------------------------------------------------------------------------------- the CF conventions


def test_cf__variables_and_attributes_are_what_other_programs_read(file):
    axes = ("time", "x", "y")
    with netCDF4.Dataset(file) as found:
        assert re.fullmatch(r"CF-1\.\d+", found.Conventions)
        assert found.title
        for name, variable in found.variables.items():
            assert re.fullmatch(r"[A-Za-z]\w*", name)
            assert variable.long_name
            assert variable.dimensions in (*((axis,) for axis in axes), axes[1:], axes)
            if "flag_values" not in variable.ncattrs() and name != "filled":
                assert variable.units in UDUNITS
        for name in axes:
            values = found[name][:]
            assert found[name].dimensions == (name,)
            assert not np.ma.is_masked(values)
            assert (np.diff(values) > 0).all()
            assert not {"_FillValue", "axis"} & {*found[name].ncattrs()}, "ParaView would wrap axes on a sphere"
        for holder in (found, *found.variables.values()):
            for name in holder.ncattrs():
                assert isinstance(holder.getncattr(name), str | int | float | np.number | np.ndarray), name
