"""Heights as arguments: every public function converts them to metres or refuses them."""

import numpy as np
import pint
import pytest
import xarray as xr

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.topography.grid import checked, spacing
from roughvisc.topography.inspection import inspection_of

UNITS = pint.UnitRegistry()
H = rv.self_affine((24e-6, 27e-6), (12, 9), hurst=0.8, rms_slope=0.1, seed=4)
H = rv.fill(H.where(H.max() > H))


def stated_in(unit, h=H):
    """The same heights in another unit, as a user's file would have them."""
    scale = float(UNITS.Quantity(1, "m").to(unit).magnitude)
    there = (h * scale).assign_coords({axis: h[axis] * scale for axis in ("x", "y")}).assign_attrs(h.attrs, units=unit)
    for axis in ("x", "y"):
        there[axis].attrs["units"] = unit
    return there


SAME = {
    "um": lambda: stated_in("um"),
    "inch": lambda: stated_in("inch"),
    "heights alone": lambda: stated_in("mm").assign_coords(x=H.x, y=H.y),
    "coordinates alone": lambda: H.assign_coords(x=stated_in("nm").x),
    "no unit": lambda: H.drop_attrs(),
    "transposed": lambda: H.T,
    "in chunks": lambda: H.chunk(y=5),
    "big-endian": lambda: H.astype(">f8"),
}


@pytest.mark.parametrize("form", SAME)
def test_heights__are_metres_however_they_are_stated(form):
    found = checked(SAME[form](), "test")
    assert (found.dims, found.dtype, type(found.data)) == (("x", "y"), np.dtype(float), np.ndarray)
    np.testing.assert_allclose(found, H, rtol=1e-14)
    np.testing.assert_allclose(spacing(SAME[form]()), (2e-6, 3e-6), rtol=1e-14)
    assert {found.attrs["units"], found.x.attrs.get("units", "m"), found.y.attrs.get("units", "m")} == {"m"}


REFUSED = {
    "kelvin": lambda: H.assign_attrs(units="K"),
    "nonsense": lambda: H.assign_attrs(units="bananas"),
    "empty": lambda: H.assign_attrs(units=""),
    "coordinate in s": lambda: H.assign_coords(y=H.y.assign_attrs(units="s")),
    "held by pint": lambda: H.copy(data=UNITS.Quantity(H.values, "m")),
    "complex": lambda: H + 0j,
    "durations": lambda: (H * 1e9).astype("timedelta64[s]"),
    "objects": lambda: H.astype(object),
    "yes and no": lambda: H > 0,
    "a Dataset": lambda: xr.Dataset({"height": H}),
    "frames": lambda: H.expand_dims("time"),
    "an array": lambda: H.values,
    "other dimensions": lambda: H.rename(x="a", y="b"),
    "no coordinates": lambda: H.drop_vars(("x", "y")),
    "uneven": lambda: H.assign_coords(x=np.arange(12.0) ** 2),
}


@pytest.mark.parametrize("form", REFUSED)
def test_heights__that_are_none_are_refused(form):
    with pytest.raises(InputError, match="test: "):
        checked(REFUSED[form](), "test")


DOORS = {
    "level": rv.level,
    "mask_outliers": rv.mask_outliers,
    "fill": rv.fill,
    "gaussian_filter": lambda h: rv.gaussian_filter(h, 9e-6),
    "resample": lambda h: rv.resample(h, (6, 3)),
    "crop": lambda h: rv.crop(h, x=(2e-6, 15e-6)),
    "rotate90": rv.rotate90,
    "invert": rv.invert,
    "combine": lambda h: rv.combine(H, h),
    "combine, below": lambda h: rv.combine(h, H),
    "mirror": rv.mirror,
    "parameters": rv.parameters,
    "psd": rv.psd,
}
#: Steps that make other cells, on which no point is marked as filled.
OTHER_CELLS = ("resample", "rotate90", "combine", "combine, below", "mirror")


@pytest.mark.parametrize("door", DOORS)
def test_door__gives_the_same_in_any_unit(door):
    asked = stated_in("um").T
    before = asked.copy(deep=True)
    found, expected = (DOORS[door](h) for h in (asked, H))
    xr.testing.assert_identical(asked, before)
    if isinstance(found, xr.DataArray):
        assert found.attrs["history"].startswith(H.attrs["history"] + "\n")
        assert (found.dims, found.name) == (("x", "y"), "height")
        assert door in OTHER_CELLS or found.filled.dtype == bool
        found.to_netcdf()  # attributes that can be written
        found, expected = (h.to_dataset(name="height") for h in (found, expected))
    for name, variable in found.variables.items():
        if variable.dtype.kind in "fiu" and "wall_time" not in name:
            size = float(abs(expected[name]).max())
            np.testing.assert_allclose(variable, expected[name].variable, rtol=1e-9, atol=1e-9 * size, err_msg=name)
            assert variable.attrs.get("units") == expected[name].attrs.get("units"), name


def turned(h):
    """The map read with x and y exchanged."""
    return h.rename(x="y", y="x").transpose("x", "y")


#: Function of heights, and the function that does the same on the transpose.
BOTH_WAYS = {
    "level": lambda h: rv.level(h, 2 if min(h.shape) > 2 else 1),
    "mask_outliers": rv.mask_outliers,
    "fill": rv.fill,
    "gaussian_filter": lambda h: rv.gaussian_filter(h, 3.2 * max(spacing(h))),
    "resample": (lambda h: rv.resample(h, (6, 3)), lambda h: rv.resample(h, (3, 6))),
    "resample, periodic": (
        lambda h: rv.resample(rv.fill(h), (5, 30), periodic=True),
        lambda h: rv.resample(rv.fill(h), (30, 5), periodic=True),
    ),
    "without_short_waves": lambda h: rv.without_short_waves(rv.fill(h), 9e-6),
    "crop": (lambda h: rv.crop(h, x=(0, 17e-6)), lambda h: rv.crop(h, y=(0, 17e-6))),
    "rotate90": (rv.rotate90, lambda h: rv.rotate90(h, -1)),
    "combine": (
        lambda h: rv.combine(h, 2 * h, "x", offset=(1e-6, 0.0)),
        lambda h: rv.combine(h, 2 * h, "y", offset=(0.0, 1e-6)),
    ),
    "mirror": rv.mirror,
    "parameters": rv.parameters,
    "psd": lambda h: rv.psd(rv.fill(h), "hann"),
}


@pytest.mark.parametrize(
    ("shape", "cells"),
    [((24, 9), (1e-6, 4e-6)), ((17, 20), (4e-6, 1e-6)), ((40, 2), (1e-6, 4e-6)), ((2, 40), (9e-6, 1e-6))],
)
def test_door__gives_the_transpose_of_the_transpose(shape, cells):
    h = rv.from_array(1e-7 * np.random.default_rng(0).normal(size=shape).cumsum(0).cumsum(1), cells)
    h[shape[0] // 3, shape[1] // 2] = np.nan
    for door, ways in BOTH_WAYS.items():
        if min(shape) == 2 and door in ("without_short_waves", "combine"):  # too narrow
            continue
        direct, exchanged = ways if isinstance(ways, tuple) else (ways, ways)
        found, expected = exchanged(turned(h)), direct(h)
        if isinstance(found, xr.DataArray):
            found = turned(found)
            np.testing.assert_allclose(found.values, expected.values, rtol=0, atol=1e-15, err_msg=door)
            np.testing.assert_allclose(spacing(found), spacing(expected), rtol=1e-12, err_msg=door)
        else:
            for name, values in expected.items():
                np.testing.assert_allclose(found[name], values, rtol=1e-9, atol=1e-30, err_msg=f"{door}: {name}")
    found, expected = inspection_of(turned(h)), inspection_of(h)
    assert (found.steps, found.boundary) == (expected.steps, expected.boundary)
    assert found.rms_slope == pytest.approx(expected.rms_slope, rel=1e-9)
    assert found.area == pytest.approx(expected.area, rel=1e-12)
    for name in ("slopes", "of_neighbours"):
        finding = "Borders" if name == "of_neighbours" else "Tilt and form"
        one, other = (each.findings[finding].values[name] for each in (found, expected))
        np.testing.assert_allclose(one, other[::-1], rtol=1e-9, err_msg=name)
