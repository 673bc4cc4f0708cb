"""Figures of sweeps by their artists: what lies where, on which scale, and that any number of cases stays legible."""

import itertools

import numpy as np
import pytest
import sample_results as made
import xarray as xr

import roughvisc as rv
from roughvisc import plot
from roughvisc.errors import InputError
from roughvisc.plot.save import results_of_sweep
from roughvisc.plot.sweep import sweep_figures
from roughvisc.study.execution.run import run_case

LOADS = [0.01, 0.02, 0.04]
DECADES = np.geomspace(1e-4, 1.0, 9).tolist()
VISCOSITIES = [1e3, 1e4, 1e5, 1e6]


def product(**values):
    """Every combination, as ``__`` for the dots of keys."""
    rows = list(itertools.product(*values.values()))
    return {key.replace("__", "."): [row[i] for row in rows] for i, key in enumerate(values)}


def stacked(parameters, area=lambda values: 1e-6):
    """A sweep as ``open_results`` gives it, with a contact area [m2] that grows in time to the one given."""
    times = np.array([0.0, 0.1, 1.0, 10.0])
    rows = [dict(zip(parameters, row, strict=True)) for row in zip(*parameters.values(), strict=True)]
    last = np.array([area(row) for row in rows])
    data = {
        "contact_area": (("case", "time"), last[:, None] * np.array([0.25, 0.5, 0.75, 1.0])),
        "force": (("case", "time"), np.ones((len(rows), 4))),
        "status": (("case", "time"), np.zeros((len(rows), 4), dtype="int8")),
    }
    on_case = {key: ("case", np.array(values)) for key, values in parameters.items()}
    ds = xr.Dataset(data, {"time": times, "case_key": ("case", [f"{i:016x}" for i in range(len(rows))]), **on_case})
    return ds.assign(contact_area=ds.contact_area.assign_attrs(units="m^2", long_name="real contact area"))


def by_load(values):
    return 1e-6 * values["program.0.load"] ** 0.9


SWEEPS = {
    "loads": product(program__0__load=LOADS),
    "hundred": product(program__0__load=np.geomspace(1e-3, 1, 100).tolist()),
    "two": product(program__0__load=LOADS, material__kelvin_viscosity=VISCOSITIES),
    "grid": product(program__0__load=DECADES, material__kelvin_viscosity=VISCOSITIES),
    "three": product(surface__seed=[1, 2, 3], program__0__load=LOADS, surface__hurst=[0.6, 0.8]),
}


def test_sweep__of_one_parameter_has_a_line_for_each_time():
    ds = stacked(product(program__0__load=[0.04, 0.01, 0.02]), by_load)
    (ax,) = plot.sweep(ds, times=[1.2, -1]).axes
    assert ax.get_xlabel() == "Load [mN]"
    assert ax.get_ylabel() == "Contact area [mm²]"
    assert [text.get_text() for text in ax.figure.legends[0].get_texts()] == ["t = 1 s", "t = 10 s"]
    for line, share in zip(ax.lines, (0.75, 1.0), strict=True):
        x, y = line.get_data()
        np.testing.assert_allclose(x, [10, 20, 40])
        np.testing.assert_allclose(y, share * np.array(LOADS) ** 0.9)
    assert ax.get_xscale() == ax.get_yscale() == "linear"
    assert len(plot.sweep(ds).axes[0].lines) == 4, "all four times by default"


def test_sweep__along_two_keys_is_a_map():
    ds = stacked(SWEEPS["grid"], lambda v: by_load(v) * v["material.kelvin_viscosity"])
    figure = plot.sweep(ds.isel(case=slice(1, None)), along=("program.0.load", "material.kelvin_viscosity"))
    ax = figure.axes[0]
    cells = np.ma.masked_invalid(ax.images[0].get_array())
    expected = ds.set_index(case=list(SWEEPS["grid"])).unstack().contact_area.isel(time=-1)
    expected = expected.transpose(..., "program.0.load").values
    assert np.ma.getmaskarray(cells).sum() == 1, "the case that was left out"
    assert np.ma.getmaskarray(cells)[0, 0]
    np.testing.assert_allclose(
        cells.filled(np.nan).ravel()[1:] / cells[-1, -1], expected.ravel()[1:] / expected[-1, -1]
    )
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Load [mN]", "Kelvin viscosity [kPa s]")
    assert [text.get_text() for text in ax.get_yticklabels()] == ["1", "10", "100", "1000"]
    turned = plot.sweep(ds, along=["material.kelvin_viscosity", "program.0.load"]).axes[0]
    assert turned.get_xlabel() == "Kelvin viscosity [kPa s]"


def test_sweep__of_two_parameters_as_a_family_of_lines():
    ds = stacked(SWEEPS["two"], lambda v: by_load(v) * np.log10(v["material.kelvin_viscosity"]))
    figure = plot.sweep(ds, along="program.0.load", times=[0.1, -1])
    titles = [ax.get_title(loc="left").partition("  ")[2] for ax in figure.axes]
    assert titles == ["t = 100 ms", "t = 10 s"]
    (legend,) = figure.legends
    named = [text.get_text() for text in legend.get_texts()]
    assert named == ["1 kPa s", "10 kPa s", "100 kPa s", "1 MPa s"]
    for ax, share in zip(figure.axes, (0.5, 1.0), strict=True):
        assert len(ax.lines) == 4
        for line, power in zip(ax.lines, (3, 4, 5, 6), strict=True):
            np.testing.assert_allclose(line.get_ydata(), share * power * np.array(LOADS) ** 0.9)


def test_sweep__refuses_what_cannot_be_drawn():
    ds = stacked(SWEEPS["loads"])
    for options in (
        {"quantity": "pressure"},
        {"along": "surface.seed"},
        {"times": range(13)},
    ):
        with pytest.raises(InputError):
            plot.sweep(ds, **options)
    for wrong in (ds.isel(case=0), made.one_frame(), [ds], ds.isel(case=[0]), ds.isel(case=[0, 0])):
        with pytest.raises(InputError):
            plot.sweep(wrong)


# ------------------------------------------------------------------------------------------ histories of all cases


def test_history_of_a_sweep__a_line_each_with_a_legend_or_a_bar():
    ds = stacked(product(program__0__load=[0.01, 0.02]), by_load)
    figure = plot.history(ds)
    (ax,) = figure.axes
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["10 mN", "20 mN"]
    for line, load in zip(ax.lines, (0.01, 0.02), strict=True):
        np.testing.assert_allclose(line.get_ydata(), np.array([0.25, 0.5, 0.75, 1.0]) * load**0.9)
    figure = plot.history(stacked(SWEEPS["hundred"], by_load))
    assert len(figure.axes[0].lines) == 100
    assert not figure.legends
    assert figure.axes[1].get_yscale() == "log"
    assert figure.axes[1].get_ylabel() == "Load [mN]"


def test_sweep__of_surfaces_of_several_sizes_is_in_parts_of_them():
    ds = stacked(product(surface__file=["a.sur", "b.sur"], material__poisson=[0.3, 0.4]), lambda row: 1e-6)
    size = xr.DataArray([1e-5, 1e-5, 4e-6, 4e-6], dims="case")
    part, pressure = (ds.contact_area / size).assign_attrs(units="1"), (ds.force / size).assign_attrs(units="Pa")
    ds = ds.assign(contact_fraction=part, nominal_pressure=pressure)
    figures = {name: figure for name, _, figure in sweep_figures(ds)}
    assert list(figures) == ["area", "histories", "nominal_pressure"]
    assert figures["area"].axes[0].get_ylabel() == "Contact fraction [%]"
    assert figures["histories"].axes[0].get_ylabel() == "Contact fraction [%]"
    alike = ds.assign(contact_fraction=ds.contact_area / 1e-5, nominal_pressure=ds.force / 1e-5)
    assert plot.sweep(alike).axes[0].get_ylabel().startswith("Contact area [")


# ------------------------------------------------------------------------------------------------- from a folder

STUDY = """
title = "Bumps"
[surface]
generate = "wavy"
amplitude = "1 um"
wavelength = "50 um"
size = "0.1 mm"
shape = 16
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
load = "1 mN"
over = "50 ms"
[[program]]
hold = "0.2 s"
[solve]
boundary = "periodic"
tolerance = 1e-2
[keep]
fields = []
times = "all"
[sweep]
"program.0.load" = ["1 mN", "5 mN", "10 mN"]
"program.1.hold" = ["0.1 s", "0.2 s"]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of a sweep, whose cases keep different times."""
    out = tmp_path_factory.mktemp("sweep")
    study = out / "bumps.toml"
    study.write_text(STUDY)
    for case in rv.read_cases(study):
        run_case(case, out / "results")
    return out / "results"


def test_sweep__of_cases_with_times_of_their_own(folder):
    results = results_of_sweep(folder)
    assert results.contact_area.dims == ("case", "row")
    (ax, *_) = plot.sweep(results, "approach", along="program.0.load").axes
    assert ax.get_xlabel() == "Load [mN]"
    assert ax.figure.get_supxlabel().strip() == "At the end."
    held = results.sel(case=results.program_1_hold == 0.1).sortby("program_0_load")
    at_end = [float(one[int(rows) - 1]) for one, rows in zip(held.approach, held.rows, strict=True)]
    scale = {"µm": 1e6, "nm": 1e9}[ax.get_ylabel()[-3:-1]]
    np.testing.assert_allclose(ax.lines[0].get_ydata(), [scale * value for value in at_end])
    assert [len(ax.lines) for ax in plot.history(results, "approach").axes] == [3, 3], "a panel for each hold"


def test_files__of_a_folder(folder, tmp_path):
    assert [name for name, _, _ in sweep_figures(results_of_sweep(folder))] == ["area", "histories", "approach"]
    written = plot.save_sweep_figures(results_of_sweep(folder), tmp_path, dpi=40)
    assert [path.name for path in written] == ["sweep-area.png", "sweep-histories.png", "sweep-approach.png"]
    assert sorted(tmp_path.iterdir()) == sorted(written)
    assert results_of_sweep(tmp_path) is None
