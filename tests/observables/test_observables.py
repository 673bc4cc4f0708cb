"""Derived quantities against cases small enough to count by hand."""

from functools import partial

import dask.array
import numpy as np
import pytest
import sample_results as made
import xarray as xr
from samples import RUBBER
from support import refused

import roughvisc as rv
from roughvisc import observables
from roughvisc.errors import InputError
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


@pytest.mark.parametrize(
    ("mask", "periodic", "count"),
    [
        (CHECKERBOARD, False, 24),
        (CHECKERBOARD, True, 24),
        (RING, False, 1),
        (~RING, False, 2),
        (~RING, True, 2),
        (np.zeros((3, 4)), True, 0),
        (np.ones((3, 4)), True, 1),
    ],
)
def test_clusters__counted_by_hand(mask, periodic, count):
    found = observables.clusters(from_maps(mask, boundary="periodic" if periodic else "free"))
    assert found["cluster_count"].values.tolist() == [count]


def test_clusters__of_a_periodic_map_are_independent_of_its_origin():
    mask = np.random.default_rng(3).random((13, 18)) < 0.45
    found = observables.clusters(from_maps(mask, boundary="periodic"))
    for shift in ((5, 0), (0, 7), (6, 11)):
        rolled = from_maps(np.roll(mask, shift, (0, 1)), boundary="periodic")
        xr.testing.assert_equal(observables.clusters(rolled), found)


def test_clusters__number_and_areas():
    two = np.zeros((5, 5), dtype=bool)
    two[0, 1:4] = two[-1, 2] = True
    ds = from_maps(two, RING, np.zeros((5, 5)))
    found = observables.clusters(ds)
    assert found["cluster_count"].values.tolist() == [2, 1, 0]
    np.testing.assert_allclose(found["cluster_area_mean"], [12e-12, 48e-12, np.nan])
    np.testing.assert_allclose(found["cluster_area_largest"], [18e-12, 48e-12, np.nan])
    assert found["cluster_area_mean"].attrs["units"] == "m^2"
    around = observables.clusters(ds.assign_attrs(boundary="periodic"))
    assert around["cluster_count"].values.tolist() == [1, 1, 0]


def test_clusters__without_pressure_the_gap_tells():
    ds = from_maps(CHECKERBOARD)
    assert int(observables.clusters(ds.drop_vars("pressure"))["cluster_count"][0]) == 24
    with pytest.raises(InputError, match="holds no 'gap'"):
        observables.clusters(ds.drop_vars(["pressure", "gap"]))


def test_pressure_distribution__integrates_to_one_over_the_contact():
    ds = made.rough_creep()
    found = observables.distribution(ds, "pressure", bins=37)
    width = np.diff(found["pressure_bin"])[0]
    np.testing.assert_allclose(found["pressure_density"].sum("pressure_bin") * width, 1.0)
    flat = observables.distribution(from_maps(RING, 0 * RING), bins=[0.0, 0.5, 2.0])
    np.testing.assert_allclose(flat["pressure_density"], [[0.0, 1 / 1.5], [np.nan, np.nan]])
    np.testing.assert_allclose(flat["pressure_bin"], [0.25, 1.25])


def test_gap_distribution__leaves_out_absent_cells_and_contact():
    ds = from_maps(RING)
    ds["gap"][0, 0, :] = np.nan
    ds["gap"][0, -1, :] = 3.0
    found = observables.distribution(ds, "gap", bins=[0.0, 2.0, 4.0])
    np.testing.assert_allclose(found["gap_density"], [[7 / 12 / 2, 5 / 12 / 2]])


@pytest.mark.parametrize(("key", "found"), [("bins", [1.0]), ("bins", [0.0, 2.0, 1.0]), ("name", "height")])
def test_distribution__refuses(key, found):
    with refused(key, found):
        observables.distribution(from_maps(RING), **{"name": "gap", key: found})


@pytest.mark.parametrize("make", [made.hertz_creep, made.rough_creep, made.one_frame])
@pytest.mark.parametrize(
    "observe",
    [
        observables.clusters,
        observables.distribution,
        partial(observables.distribution, name="gap"),
        partial(observables.conductance, resistivity=(1, 1)),
    ],
    ids=["clusters", "pressure", "gap", "conductance"],
)
def test_observables__are_lazy_on_dask_and_the_same(make, observe):
    ds = make()
    lazy = observe(ds.chunk(time=2, x=20))
    assert all(isinstance(lazy[one].data, dask.array.Array) for one in lazy.data_vars)
    xr.testing.assert_allclose(lazy.compute(scheduler="synchronous"), observe(ds))


ROUGH = rv.self_affine(1e-3, (20, 17), hurst=0.8, rms_slope=0.1, seed=1)
CYCLES = rv.Program.cycle(mean=0.02, amplitude=0.01, period=0.1, cycles=1)
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
        rv.observables.clusters(ds),
        rv.observables.cycle_work(ds),
        rv.observables.distribution(ds),
        rv.observables.distribution(ds, "gap"),
    ]
    assert set(ds.variables) < set(xr.merge([ds, found[0]]).variables), "as the docstring says, without options"
    merged = xr.merge([ds, *found], compat="no_conflicts", join="exact", combine_attrs="override")
    for name in ds.variables:
        xr.testing.assert_identical(merged[name].variable, ds[name].variable)
    for one in found:
        assert not set(one.data_vars) & set(ds.data_vars), "a name means one thing"
        for name in one.data_vars:
            assert merged[name].attrs == VARIABLES[str(name)].attributes
            assert merged[name].dims == VARIABLES[str(name)].over("time")
    assert float(merged.cluster_count.max()) >= 1
