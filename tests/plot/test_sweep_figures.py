"""Figures of sweeps by their artists: where the values lie, on which scale, and how lines and panels are named."""

import itertools

import numpy as np
import pytest
import sample_results as made
import scipy.stats
import xarray as xr
from click.testing import CliRunner
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from support import BALL, refused

import roughvisc as rv
from roughvisc import plot
from roughvisc.cli import main
from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.plot.save import results_of_sweep, save_figures_of_files, save_sweep_figures
from roughvisc.plot.sweep import sweep_figures
from roughvisc.runs.run import run_case

LOADS = np.array([0.01, 0.02, 0.04])
VISCOSITIES = [1e3, 1e4, 1e5, 1e6]
TIMES = np.array([0.1, 1.0, 10.0])
UNITS = {"load": "N", "kelvin_viscosity": "Pa s"}


def stacked(area, **values):
    """All combinations of some keys (``__`` for dots), with an area that grows in time to the stated one [m2]."""
    rows = np.array(list(itertools.product(*values.values())))
    last = area(**{key.rpartition("__")[2]: column for key, column in zip(values, rows.T, strict=True)})
    on_case = {
        key.replace("__", "_"): (
            "case",
            column,
            {"long_name": key.replace("__", "."), "units": UNITS[key.rpartition("__")[2]]},
        )
        for key, column in zip(values, rows.T, strict=True)
    }
    data = {
        "contact_area": (("case", "time"), last[:, None] * np.array([0.25, 0.5, 1.0])),
        "force": (("case", "time"), np.ones((len(rows), 3))),
    }
    return label(xr.Dataset(data, {"time": TIMES, **on_case}))


def by_load(load):
    return 1e-6 * load**0.9


def by_both(load, kelvin_viscosity):
    return 1e-6 * load**0.9 * np.log10(kelvin_viscosity)


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_sweep__of_one_key_has_a_line_for_each_time():
    ds = stacked(by_load, program__0__load=LOADS[[2, 0, 1]])
    figure = plot.sweep(ds, times=[1.2, -1])
    (ax,) = figure.axes
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Load [mN]", "Contact area [mm²]")
    assert legend(figure) == ["t = 1 s", "t = 10 s"]
    for line, share in zip(ax.lines, (0.5, 1.0), strict=True):
        np.testing.assert_allclose(line.get_xdata(), [10, 20, 40])
        np.testing.assert_allclose(line.get_ydata(), share * LOADS**0.9)
    assert legend(plot.sweep(ds)) == ["t = 10 s"]
    with refused():
        plot.sweep(ds.assign(contact_area=np.nan * ds.contact_area))


def test_sweep__of_two_keys_has_a_panel_for_each_time():
    ds = stacked(by_both, program__0__load=LOADS, material__kelvin_viscosity=VISCOSITIES)
    figure = plot.sweep(ds, along="program.0.load", times=[1.0, -1])
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["t = 1 s", "t = 10 s"]
    assert legend(figure) == ["1", "10", "100", "1000"]
    assert figure.legends[0].get_title().get_text() == "Kelvin viscosity [kPa s]"
    looks = [(line.get_marker(), line.get_lw()) for line in figure.axes[0].lines]
    assert len(set(looks)) == 4, "lines are told apart without their colours, and equal ones by their widths"
    for ax, share in zip(figure.axes, (0.5, 1.0), strict=True):
        for line, power in zip(ax.lines, (3, 4, 5, 6), strict=True):
            np.testing.assert_allclose(line.get_ydata(), share * power * LOADS**0.9)


def test_sweep__along_words_and_an_infinite_number_draws_every_case():
    ds = stacked(by_load, program__0__load=LOADS)
    thickness = xr.DataArray([1e-3, 2e-3, np.inf], dims="case", attrs={"units": "m", "long_name": "material.thickness"})
    (ax,) = plot.sweep(ds.drop_vars("program_0_load").assign_coords(material_thickness=thickness)).axes
    assert [text.get_text() for text in ax.get_xticklabels()] == ["1 mm", "2 mm", "half-space"]
    np.testing.assert_allclose(ax.lines[0].get_ydata(), LOADS**0.9)


@pytest.mark.parametrize("count", [2, 100])
def test_sweep__over_time_has_a_line_for_each_case_and_names_some(count):
    loads = np.geomspace(0.01, 1.0, count)
    figure = plot.sweep(stacked(by_load, program__0__load=loads), along="time")
    (ax,) = figure.axes
    assert len(ax.lines) == count
    for line, load in zip(ax.lines, loads, strict=True):
        np.testing.assert_allclose(line.get_ydata() / line.get_ydata()[-1], [0.25, 0.5, 1.0])
        assert line.get_ydata()[-1] / ax.lines[0].get_ydata()[-1] == pytest.approx((load / loads[0]) ** 0.9)
    assert figure.legends[0].get_title().get_text() == "Load [mN]"
    step = 1 if count == 2 else 9
    assert legend(figure) == [f"{1e3 * load:.4g}" for load in loads[::step]]
    assert len({tuple(to_rgba(line.get_color())) for line in ax.lines}) == count


def test_sweep__in_several_rows_labels_the_outer_panels():
    loads, viscosities = np.geomspace(0.01, 0.02, 5), np.geomspace(1e3, 1e5, 6)
    ds = stacked(by_both, program__0__load=loads, material__kelvin_viscosity=viscosities)
    axes = plot.sweep(ds, along="time").axes
    assert [ax.get_xlabel() for ax in axes] == ["", "", "Time [s]", "Time [s]", "Time [s]"], "the last place is empty"
    assert [ax.get_ylabel() for ax in axes] == ["Contact area [mm²]", "", "", "Contact area [mm²]", ""]


def test_sweep__keeps_long_file_names_apart():
    names = [f"{'a_flank_of_a_gear_' * 3}{number}.sur" for number in range(3)]
    files = xr.DataArray(names, dims="case", attrs={"long_name": "surface.file"})
    ds = stacked(by_load, program__0__load=LOADS).drop_vars("program_0_load").assign_coords(surface_file=files)
    (ax,) = plot.sweep(ds).axes
    np.testing.assert_allclose(ax.lines[0].get_ydata(), LOADS**0.9)
    assert [text.get_text()[-5:] for text in ax.get_xticklabels()] == ["0.sur", "1.sur", "2.sur"]


def test_sweep__refuses_what_cannot_be_drawn():
    ds = stacked(by_load, program__0__load=LOADS)
    for options in ({"quantity": "pressure"}, {"along": "surface.seed"}, {"along": "speed"}, {"times": range(13)}):
        with pytest.raises(InputError):
            plot.sweep(ds, **options)
    for wrong in (ds.isel(case=0), made.one_frame(), [ds], ds.isel(case=[0])):
        with pytest.raises(InputError):
            plot.sweep(wrong)


# -------------------------------------------------------------------------------------------------- realisations

FACTORS = np.array([3.0, 0.8, 0.9, 1.1, 1.25])


def patches(first=0):
    """A sweep of loads for five realisations from a number on; the area follows one factor for each."""
    over = ("case", "realisation", "time")
    area = 1e-7 * LOADS[:, None, None] * FACTORS[:, None] * (1 + np.log10(TIMES / TIMES[0]))
    on_case = {"program_0_load": ("case", LOADS, {"long_name": "program.0.load", "units": "N"})}
    coords = {"time": TIMES, "realisation": np.arange(first, first + 5), **on_case}
    return label(xr.Dataset({"contact_area": (over, area)}, coords))


def interval(values):
    """Interval of one more log-normal value."""
    x = np.log(values)
    half = scipy.stats.t.ppf(0.975, len(x) - 1) * x.std(ddof=1) * np.sqrt(1 + 1 / len(x))
    return np.exp(x.mean() - half), np.exp(x.mean() + half)


def band_at_end(ax, number):
    """Return the ends of a band at its largest abscissa."""
    corners = [one for one in ax.collections if isinstance(one, PolyCollection)][number].get_paths()[0].vertices
    at_end = corners[corners[:, 0] == corners[:, 0].max()][:, 1]
    return at_end.min(), at_end.max()


@pytest.mark.parametrize("along", [None, "time"])
def test_figures__draw_the_mean_of_the_realisations_their_band_and_the_scan(along):
    figure = plot.sweep(patches(), along=along)
    (ax,) = figure.axes
    assert legend(figure)[-2:] == ["mean and 95 % prediction interval, 4 realisations", "measured scan"]
    top = 1e-7 * LOADS[-1] * 3 * (1e12 if "µm²" in ax.get_ylabel() else 1e6)
    assert band_at_end(ax, -1) == pytest.approx([top * end for end in interval(FACTORS[1:])])
    ends = [line.get_ydata()[-1] for line in ax.lines]
    for factor in (FACTORS[1:].mean(), FACTORS[0]):
        assert np.isclose(ends, top * factor).any(), factor


def test_sweep__of_realisations_alone_is_over_time():
    (ax,) = plot.sweep(patches().isel(case=[0])).axes
    assert ax.get_xlabel() == "Time [s]"
    np.testing.assert_allclose(ax.lines[0].get_xdata(), TIMES)


def test_figures__a_realisation_without_a_result_does_not_count():
    ds = patches(1)
    hole = (ds["program_0_load"] == LOADS[1]) & (ds["realisation"] == 3)
    (ax,) = plot.sweep(ds.where(~hole), along="time").axes
    top = 1e-7 * LOADS[1] * 3 * (1e12 if "µm²" in ax.get_ylabel() else 1e6)
    assert band_at_end(ax, 1) == pytest.approx([top * end for end in interval(FACTORS[[0, 1, 3, 4]])])


# ------------------------------------------------------------------------------------------------- from a folder

STUDY = (
    BALL.replace("over = 0", 'over = "50 ms"').replace(
        'fields = ["pressure", "displacement"]\ntimes = [0, "0.1 s", "200 ms"]', "fields = []\ntimes = 4"
    )
    + '[sweep]\n"program.0.load" = ["1 mN", "5 mN", "10 mN"]\n"program.1.hold" = ["0.1 s", "0.2 s"]\n'
)


def test_sweep__of_cases_with_times_of_their_own(tmp_path, coarse_pictures):
    (tmp_path / "bumps.toml").write_text(STUDY)
    for case in rv.read_cases(tmp_path / "bumps.toml"):
        run_case(case, tmp_path / "results")
    results = results_of_sweep(tmp_path / "results")
    assert results.contact_area.dims == ("case", "row")
    (ax,) = plot.sweep(results, "approach", along="program.0.load").axes
    assert ax.get_xlabel() == "Load [mN]"
    assert ax.get_title(loc="left") == "at the end"
    held = results.sel(case=results.program_1_hold == 0.1).sortby("program_0_load")
    at_end = [float(one[int(rows) - 1]) for one, rows in zip(held.approach, held.rows, strict=True)]
    scale = {"µm": 1e6, "nm": 1e9}[ax.get_ylabel()[-3:-1]]
    np.testing.assert_allclose(ax.lines[0].get_ydata(), scale * np.array(at_end))
    panels = plot.sweep(results, "approach", along="time").axes
    assert [len(ax.lines) for ax in panels] == [3, 3], "a panel for each hold"
    steps = held.isel(case=0).roughvisc.steps
    line = panels[0].lines[0]
    np.testing.assert_allclose(line.get_ydata() / line.get_ydata()[-1], steps.approach / steps.approach[-1])
    assert len(line.get_markevery()) == int(held.rows[0]) < steps.sizes["step"], "markers are the kept times"
    names = [name for name, _, _ in sweep_figures(results)]
    assert names == ["contact_area-time", "contact_area", "approach"], "the force is known"
    written = save_sweep_figures(results, tmp_path / "figures")
    assert [path.name for path in written] == [f"sweep-{name}.png" for name in names]
    assert sorted((tmp_path / "figures").iterdir()) == sorted(written)
    command = ["plot", str(tmp_path / "results"), "--out", str(tmp_path / "vector"), "--format", "svg"]
    assert CliRunner().invoke(main, command).exit_code == 0
    assert {path.name for path in (tmp_path / "vector").iterdir()} == {f"sweep-{name}.svg" for name in names}
    assert results_of_sweep(tmp_path) is None
    paths = sorted((tmp_path / "results").glob("*.nc"))
    every = [path.stem.rpartition("-")[2] for path in save_figures_of_files(paths, tmp_path / "cases")]
    assert every.count("surface") == 1, "all cases have this surface"
    assert every.count("history") == len(paths)
