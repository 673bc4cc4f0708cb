"""Derived quantities against cases small enough to count by hand."""

import inspect
import re

import dask.array
import numpy as np
import pytest
import sample_results as made
import xarray as xr

import roughvisc as rv
from roughvisc import observables
from roughvisc.errors import InputError
from roughvisc.observables import connectivity
from roughvisc.variables import VARIABLES

CHECKERBOARD = np.indices((6, 8)).sum(axis=0) % 2 == 0
RING = np.array(
    [
        [0, 0, 0, 0, 0],
        [0, 1, 1, 1, 0],
        [0, 1, 0, 1, 0],
        [0, 1, 1, 1, 0],
        [0, 0, 0, 0, 0],
    ],
    dtype=bool,
)


def from_maps(*maps, boundary="free", spacing=(2e-6, 3e-6), **histories):
    """A result whose pressure is 1 Pa where the maps are true, and the gap 1 m elsewhere."""
    maps = np.array(maps, dtype=float)
    fields = {"pressure": (("time", "x", "y"), maps), "gap": (("time", "x", "y"), 1.0 - maps)}
    fields |= {name: ("time", np.asarray(values, dtype=float)) for name, values in histories.items()}
    axes = {name: (np.arange(n) + 0.5) * d for name, n, d in zip("xy", maps.shape[1:], spacing, strict=True)}
    return xr.Dataset(fields, coords={"time": np.arange(1.0, 1 + len(maps)), **axes}, attrs={"boundary": boundary})


def histories(time, **values):
    return xr.Dataset({name: ("time", np.asarray(v, dtype=float)) for name, v in values.items()}, {"time": time})


@pytest.mark.parametrize(
    ("mask", "periodic", "corners", "count"),
    [
        (CHECKERBOARD, False, 4, 24),
        (CHECKERBOARD, True, 4, 24),
        (CHECKERBOARD, False, 8, 1),
        (RING, False, 4, 1),
        (~RING, False, 4, 2),
        (~RING, True, 8, 2),
        (np.zeros((3, 4)), True, 4, 0),
        (np.ones((3, 4)), True, 4, 1),
        (np.eye(4), False, 8, 1),
        (np.eye(4)[:, ::-1], True, 8, 1),
    ],
)
def test_label_clusters__counted_by_hand(mask, periodic, corners, count):
    labels, found = connectivity.label_clusters(mask, periodic, corners)
    assert found == count
    assert set(np.unique(labels)) <= set(range(count + 1))
    assert np.array_equal(labels > 0, np.asarray(mask, dtype=bool))


def test_label_clusters__corners_across_both_borders():
    mask = np.zeros((5, 4), dtype=bool)
    mask[[0, 0, -1, -1], [0, -1, 0, -1]] = True
    assert connectivity.label_clusters(mask)[1] == 4
    assert connectivity.label_clusters(mask, periodic=True)[1] == 1
    mask[0, 0] = mask[-1, -1] = False
    assert connectivity.label_clusters(mask, periodic=True)[1] == 2
    assert connectivity.label_clusters(mask, periodic=True, connectivity=8)[1] == 1


@pytest.mark.parametrize("corners", [4, 8])
def test_label_clusters__periodic_is_blind_to_shifts(corners):
    mask = np.random.default_rng(3).random((13, 18)) < 0.45
    _, count = connectivity.label_clusters(mask, True, corners)
    sizes = connectivity.cluster_sizes(mask, True, corners)
    for shift in ((5, 0), (0, 7), (6, 11)):
        rolled = np.roll(mask, shift, (0, 1))
        assert connectivity.label_clusters(rolled, True, corners)[1] == count
        assert np.array_equal(connectivity.cluster_sizes(rolled, True, corners), sizes)
        assert connectivity.percolates(rolled, True, corners) == connectivity.percolates(mask, True, corners)


def test_label_clusters__refuses_an_unknown_connectivity():
    with pytest.raises(InputError, match="expected 4 or 8"):
        connectivity.label_clusters(RING, connectivity=6)


def test_percolates__diagonal_band_winds_around_both_ways():
    n = 6
    i, j = np.indices((n, n))
    band = (i - j) % n < 2
    assert connectivity.percolates(band, periodic=True) == (True, True)
    assert connectivity.percolates(band & (i != 3), periodic=True) == (False, False)
    assert connectivity.percolates((i - j) % n < 1, periodic=True, connectivity=8) == (True, True)
    assert connectivity.percolates((i - j) % n < 1, periodic=True, connectivity=4) == (False, False)


def test_percolates__touching_both_borders_is_not_yet_a_way_around():
    step = np.zeros((4, 5), dtype=bool)
    step[:2, 0] = step[1, :3] = step[1:, 2] = True  # leaves at another y than it entered
    assert connectivity.percolates(step) == (True, False)
    assert connectivity.percolates(step, periodic=True) == (False, False)
    step[3, :3] = True
    assert connectivity.percolates(step, periodic=True) == (True, False)


def test_percolates__straight_lines_and_rings():
    line = np.zeros((4, 7), dtype=bool)
    line[:, 2] = True
    for periodic in (False, True):
        assert connectivity.percolates(line, periodic) == (True, False)
        assert connectivity.percolates(line.T, periodic) == (False, True)
        assert connectivity.percolates(~line, periodic) == (True, False)
        assert connectivity.percolates(RING, periodic) == (False, False)
        assert connectivity.percolates(~RING, periodic) == (True, True)
        assert connectivity.percolates(np.ones((3, 2)), periodic) == (True, True)
        assert connectivity.percolates(np.zeros((3, 2)), periodic) == (False, False)


def test_clusters__number_and_areas():
    two = np.zeros((5, 5), dtype=bool)
    two[0, 1:4] = two[-1, 2] = True
    ds = from_maps(two, RING, np.zeros((5, 5)))
    found = observables.clusters(ds)
    assert found["cluster_count"].values.tolist() == [2, 1, 0]
    np.testing.assert_allclose(found["cluster_area_mean"], [12e-12, 48e-12, np.nan])
    np.testing.assert_allclose(found["cluster_area_largest"], [18e-12, 48e-12, np.nan])
    assert found["cluster_area_mean"].attrs["units"] == "m^2"
    areas = observables.cluster_areas(ds)["cluster_area"]
    assert areas.dims == ("time", "cluster")
    np.testing.assert_allclose(areas, [[18e-12, 6e-12], [48e-12, np.nan], [np.nan, np.nan]])
    around = observables.clusters(ds.assign_attrs(boundary="periodic"))
    assert around["cluster_count"].values.tolist() == [1, 1, 0]


def test_clusters__without_pressure_the_gap_tells():
    ds = from_maps(CHECKERBOARD)
    assert int(observables.clusters(ds.drop_vars("pressure"))["cluster_count"][0]) == 24
    with pytest.raises(InputError, match="holds no 'gap'"):
        observables.clusters(ds.drop_vars(["pressure", "gap"]))


def test_percolation__is_of_the_region_out_of_contact():
    wall = np.zeros((4, 5), dtype=bool)
    wall[2] = True
    found = observables.percolation(from_maps(wall, RING[1:, :], np.ones((4, 5))))
    assert found["percolates_x"].values.tolist() == [0, 1, 0]
    assert found["percolates_y"].values.tolist() == [1, 1, 0]
    assert found["percolates_x"].dtype == np.int8


def test_pressure_distribution__integrates_to_one_over_the_contact():
    ds = made.rough_creep()
    found = observables.pressure_distribution(ds, bins=37)
    width = np.diff(found["pressure_bin"])[0]
    np.testing.assert_allclose(found["pressure_density"].sum("pressure_bin") * width, 1.0)
    flat = observables.pressure_distribution(from_maps(RING, 0 * RING), bins=[0.0, 0.5, 2.0])
    np.testing.assert_allclose(flat["pressure_density"], [[0.0, 1 / 1.5], [np.nan, np.nan]])
    np.testing.assert_allclose(flat["pressure_bin"], [0.25, 1.25])


def test_gap_distribution__leaves_out_absent_cells_and_contact():
    ds = from_maps(RING)
    ds["gap"][0, 0, :] = np.nan
    ds["gap"][0, -1, :] = 3.0
    found = observables.gap_distribution(ds, bins=[0.0, 2.0, 4.0])
    np.testing.assert_allclose(found["gap_density"], [[7 / 12 / 2, 5 / 12 / 2]])


@pytest.mark.parametrize("bins", [[1.0], [0.0, 2.0, 1.0]])
def test_distributions__refuse_bad_edges(bins):
    with pytest.raises(InputError, match="increase"):
        observables.gap_distribution(from_maps(RING), bins=bins)


def test_gap_statistics__over_present_cells():
    ds = from_maps(RING, RING)
    ds["gap"][0, 0, :] = np.nan
    ds["gap"][1] = np.nan
    found = observables.gap_statistics(ds)
    np.testing.assert_allclose(found["gap_mean"], [12 / 20, np.nan])
    np.testing.assert_allclose(found["gap_median"], [1.0, np.nan])


def test_area_growth__of_a_power_law_is_its_exponent():
    time = np.concatenate([[0.0], np.geomspace(0.3, 40.0, 9)])
    ds = histories(time, contact_area=5e-8 * (time - 0.1).clip(0) ** 0.37)
    found = observables.area_growth(ds, since=0.1)["area_growth_exponent"]
    assert np.isnan(found[0])
    np.testing.assert_allclose(found[1:], 0.37, rtol=1e-12)


def test_area_growth__is_not_that_of_the_count():
    time = np.array([1.0, 2.0, 4.0])
    ds = histories(time, contact_area_counted=time, contact_area=time**2)
    np.testing.assert_allclose(observables.area_growth(ds)["area_growth_exponent"], 2.0)


def test_secant_stiffness__of_hertz_converges_at_order_two():
    def error(count):
        approach = np.linspace(0.5, 1.0, count) ** 2
        ds = histories(np.arange(count), force=approach**1.5, approach=approach)
        found = observables.secant_stiffness(ds)["secant_stiffness"].values
        return np.abs(found / (1.5 * approach**0.5) - 1)[1:-1].max()

    assert np.log2(error(21) / error(41)) > 1.9


def test_secant_stiffness__turning_and_standing_still():
    ds = histories(np.arange(5), force=[0.0, 2.0, 1.0, 1.0, 0.5], approach=[0.0, 1.0, 0.5, 0.5, 0.5])
    found = observables.secant_stiffness(ds)["secant_stiffness"]
    np.testing.assert_allclose(found, [2.0, 2.0, 2.0, np.nan, np.nan])
    assert found.attrs["units"] == "N/m"
    assert np.isnan(observables.secant_stiffness(ds.isel(time=[0]))["secant_stiffness"]).all()


def test_work__of_a_closed_loop_is_the_area_in_it():
    ds = histories(np.arange(5), force=[0.0, 0.0, 2.0, 2.0, 0.0], approach=[0.0, 3.0, 3.0, 0.0, 0.0])
    np.testing.assert_allclose(observables.work(ds)["trapezoidal_work"], [0.0, 0.0, 0.0, -6.0, -6.0])
    ramp = histories(np.arange(3), force=[0.0, 1.0, 2.0], approach=[0.0, 1.0, 2.0])
    np.testing.assert_allclose(observables.work(ramp)["trapezoidal_work"], [0.0, 0.5, 2.0])


@pytest.mark.parametrize("make", [made.hertz_creep, made.rough_creep, made.hertz_cycle, made.one_frame])
def test_observe__everything_lazily_and_alike_on_dask(make):
    ds = make()
    eager = observables.observe(ds)
    lazy = observables.observe(ds.chunk(time=2, x=20))
    assert all(isinstance(lazy[name].data, dask.array.Array) for name in lazy.data_vars)
    xr.testing.assert_allclose(lazy.compute(scheduler="synchronous"), eager)
    expected = {"cluster_count", "percolates_x", "gap_median", "secant_stiffness", "trapezoidal_work"}
    assert expected <= set(eager.data_vars)
    for name in eager.data_vars:
        assert eager[name].attrs["long_name"]


ROUGH = rv.self_affine(1e-3, (20, 17), hurst=0.8, rms_slope=0.1, seed=1)
CYCLES = rv.Program.cycle(mean=0.02, amplitude=0.01, period=0.1, cycles=1)
RUBBER = rv.zener(3e6, 1e6, 1e5)
PRESSED = {
    "elastic": (rv.sphere(1e-2, 2e-3, (16, 15)), rv.elastic(3e6), {}),
    "viscoelastic": (rv.sphere(1e-2, 2e-3, (16, 15)), RUBBER, {}),
    "periodic": (ROUGH, RUBBER, {"boundary": "periodic"}),
    "absent": (rv.flat_punch(5e-4, 2e-3, (16, 15)), RUBBER, {"missing": "absent"}),
}


@pytest.mark.parametrize("kind", PRESSED)
def test_observables__merge_with_their_result(kind):
    height, material, options = PRESSED[kind]
    ds = rv.simulate(height, material, CYCLES, times=11, tolerance=1e-2, progress=False, **options)
    found = [
        rv.observables.observe(ds),
        rv.observables.cycle_energy(ds, program=CYCLES),
        rv.observables.cluster_areas(ds),
        rv.observables.pressure_distribution(ds),
        rv.observables.gap_distribution(ds),
    ]
    assert set(ds.variables) < set(xr.merge([ds, found[0]]).variables), "as the docstring says, without options"
    merged = xr.merge([ds, *found], compat="no_conflicts", join="exact", combine_attrs="override")
    for name in ds.variables:
        xr.testing.assert_identical(merged[name].variable, ds[name].variable)
    for one in found:
        assert not set(one.data_vars) & set(ds.data_vars), "a name means one thing"
        for name in one.data_vars:
            assert merged[name].attrs == VARIABLES[str(name)].attributes()
            assert merged[name].dims == VARIABLES[str(name)].dims
    assert float(merged.cluster_count.max()) >= 1


def test_observables__are_public_functions_with_docstrings():
    assert "observables" in dir(rv)
    assert dir(rv.observables) == sorted(rv.observables.__all__)
    for name in rv.observables.__all__:
        function = getattr(rv.observables, name)
        assert inspect.isfunction(function)
        assert function.__module__.startswith("roughvisc.observables")
        for section in ("Parameters", "Returns", "Raises"):
            assert re.search(rf"^ *{section}\n *-+$", function.__doc__, re.MULTILINE), f"{name}: no {section}"


def test_observe__passes_a_leading_dimension_through():
    ds = xr.concat([from_maps(RING), from_maps(CHECKERBOARD[:5, :5])], dim="case", combine_attrs="override")
    found = observables.observe(ds.assign_coords(case=["ring", "board"]))
    assert found["cluster_count"].dims == ("case", "time")
    assert found["cluster_count"].values.ravel().tolist() == [1, 13]
    with pytest.raises(InputError, match="choose one case"):
        observables.cluster_areas(ds)


def test_hertz__one_cluster_that_grows_and_leaks():
    found = observables.observe(made.hertz_creep())
    assert (found["cluster_count"] == 1).all()
    assert (found["percolates_x"] == 1).all()
    assert (found["area_growth_exponent"][1:-1] > -1e-12).all()
