"""What goes wrong with scan files in practice, where no real file is at hand to show it."""

import random
import re
import zipfile

import numpy as np
import pytest
import xarray as xr
from scan_files import CELL, refusal, survive, tilted, write_sdf, write_text, write_x3p
from support import refused

from roughvisc.topography.grid import spacing
from roughvisc.topography.readers import from_array
from roughvisc.topography.scans import open_scan


def write_xyz(path):
    """Points in any order, one a line: x and y in the file decide."""
    z = tilted(missing=False)
    lines = [f"{i * 2e-6:.6e} {j * 3e-6:.6e} {z[i, j]:.9e}" for i, j in np.ndindex(z.shape)]
    random.Random(3).shuffle(lines)
    path.write_text("\n".join(lines) + "\n")
    return path


# -- headings ----------------------------------------------------------------------------------------------------------

POINTS = [(0.5 * i, 0.25 * j, 0.125 * i + 0.5 * j) for j in range(4) for i in range(6)]
MATRIX = [[0.125 * i + 0.5 * j for i in range(6)] for j in range(4)]


def write_rows(path, heading, rows, separator):
    lines = [separator.join(map(str, row)) for row in rows]
    path.write_text("\n".join(["# by hand", heading.replace(";", separator), *lines]) + "\n")
    return path


@pytest.mark.parametrize("separator", [",", "; ", "\t", " "])
@pytest.mark.parametrize("heading", ["x [mm];y [mm];z [um]", "X (mm);Y (mm);Height (um)"])
def test_points__have_the_units_of_their_heading(tmp_path, separator, heading):
    for name in ("scan.xyz", "scan.csv", "scan.txt"):
        h = open_scan(write_rows(tmp_path / name, heading, POINTS, separator))
        np.testing.assert_allclose(h, 1e-6 * np.array(MATRIX).T, rtol=1e-12)
        np.testing.assert_allclose([h.x[1] - h.x[0], h.y[1] - h.y[0]], [5e-4, 2.5e-4], rtol=1e-12)


@pytest.mark.parametrize("heading", ["x [mm];y [um];z [um]", "y [mm];x [mm];z [um]", "x [mm];z [um];y [mm]"])
def test_points__with_another_heading_are_refused_with_the_heading_to_write(tmp_path, heading):
    assert "x [mm], y [mm], z [um]" in refusal(write_rows(tmp_path / "scan.csv", heading, POINTS, ","), unit="mm")


@pytest.mark.parametrize("separator", [",", "; ", "\t", " "])
def test_matrix__has_the_unit_of_its_heading(tmp_path, separator):
    path = write_rows(tmp_path / "scan.txt", "height [nm]", MATRIX, separator)
    np.testing.assert_allclose(open_scan(path, spacing=CELL), 1e-9 * np.array(MATRIX).T, rtol=1e-12)
    assert "nm" in refusal(path, spacing=CELL, unit="um")


# -- channels, units, sizes --------------------------------------------------------------------------------------------


def test_several_heights__the_chosen_one_is_named_and_the_others_listed(tmp_path):
    h = from_array(tilted(), CELL)
    channels = {"forward": h, "z": 2 * h, "phase": h.assign_attrs(units="degree")}
    xr.Dataset({name: c.assign_attrs({"units": "m", **c.attrs}) for name, c in channels.items()}).to_netcdf(
        tmp_path / "scan.nc"
    )
    found = open_scan(tmp_path / "scan.nc")
    assert (found.attrs["channel"], found.attrs["other_channels"]) == ("forward", "z, phase")
    assert "channel 'forward'" in found.attrs["history"]
    np.testing.assert_array_equal(open_scan(tmp_path / "scan.nc", channel="z"), 2 * tilted())
    for wrong in ("phase", "backward"):
        assert wrong in refusal(tmp_path / "scan.nc", channel=wrong)


def test_points__that_state_no_unit_need_one(tmp_path):
    path = write_xyz(tmp_path / "scan.xyz")
    assert "expected unit" in refusal(path)
    (tmp_path / "card.toml").write_text('file = "scan.xyz"\nunit = "mm,um"\n')
    ways = [{"unit": "mm", "height_scale": 1e-3}, {"unit": "mm, um"}, {"unit": ("mm", "um")}, {"unit": ["mm", "um"]}]
    for h in (open_scan(tmp_path / "card.toml"), *(open_scan(path, **options) for options in ways)):
        np.testing.assert_allclose(h, 1e-6 * tilted(missing=False), rtol=1e-9)
        np.testing.assert_allclose(spacing(h), np.multiply(CELL, 1e-3))
    with refused("unit", "1 s"):
        open_scan(path, unit="s")
    for wrong in ("", "mm,", "mm,um,um", (), ("mm", 3), 3):
        with refused("unit", wrong):
            open_scan(path, unit=wrong)


def test_unit__in_a_grid_file_counts_where_it_states_none(tmp_path):
    h = from_array(tilted(), CELL)
    path = tmp_path / "scan.nc"
    bare = xr.DataArray(h.values, dims=("x", "y"), coords={axis: 1e3 * h[axis].values for axis in "xy"}, name="height")
    bare.to_netcdf(path)
    found = open_scan(path, unit="mm", height_scale=1e-3)
    np.testing.assert_allclose(found, 1e-6 * tilted())
    np.testing.assert_allclose(spacing(found), CELL)
    bare.assign_attrs(units="um").to_netcdf(path)
    np.testing.assert_allclose(open_scan(path, unit="mm"), 1e-6 * tilted())
    np.testing.assert_allclose(open_scan(path, unit="mm,um"), 1e-6 * tilted())
    with refused("unit", "mm,nm"):
        open_scan(path, unit="mm,nm")
    h.to_netcdf(path)
    assert "height_scale = 1e-06" in refusal(path, unit="um")
    for unit in ("m", "m,m"):
        np.testing.assert_array_equal(open_scan(path, unit=unit), h)
    for wrong in ("um,m", "m,um"):
        with refused("unit", wrong):
            open_scan(path, unit=wrong)


def test_header__that_states_the_unit_of_x_and_y_alone(tmp_path):
    """26 um and 27 um stay what they are, whatever unit the heights have."""
    path = write_text(tmp_path / "scan.txt", header="# Width: 26 µm\n# Height: 27.0 µm\n")
    h = open_scan(path, unit="nm")
    np.testing.assert_allclose(spacing(h), CELL, rtol=1e-12)
    np.testing.assert_allclose(h, 1e-9 * tilted(missing=False), rtol=1e-9)
    path.write_text(path.read_text().replace(".", ",").replace("26 ", "26,0 "))
    np.testing.assert_array_equal(open_scan(path, unit="nm"), h)
    path = write_text(tmp_path / "scan.txt", header="# Width: 0.026 mm\n# Height: 27.0 µm\n")
    np.testing.assert_array_equal(open_scan(path, unit="nm"), h)
    np.testing.assert_allclose(spacing(open_scan(path, unit="nm")), CELL, rtol=1e-12)
    path.write_text("# Width: 2,5 µm\n# Height: 7,5 µm\n" + "1 2 3 4 5\n" * 5)  # the header alone has decimals
    np.testing.assert_allclose(spacing(open_scan(path, unit="nm")), (5e-7, 1.5e-6), rtol=1e-12)


@pytest.mark.parametrize("separator", [";", ",", "\t", " "])
@pytest.mark.parametrize(
    ("line", "broken"),
    [
        (3, lambda row: f"{row}1.5{row}"),  # two rows run together, a number with two points between them
        (2, lambda row: row[:20] + "\x01\x7f#?" + row[24:]),
        (2, lambda row: "***"),
        (1, lambda row: f"0.1x{row[3:]}"),
        (5, lambda row: row[:5]),  # cut short
    ],
)
def test_matrix__with_a_damaged_row_is_refused_and_not_read_without_it(separator, line, broken, tmp_path):
    rows = [separator.join(f"{x + 0.1 * y:.3f}" for x in range(8)) for y in range(5)]
    rows[line - 1] = broken(rows[line - 1])
    path = tmp_path / "scan.csv"
    path.write_text("# made\n" + "\n".join(rows) + "\n")
    assert f"line {line + 1}" in refusal(path, unit="um", spacing=1e-6)


def test_matrix__of_which_a_row_is_missing_as_a_whole_keeps_it(tmp_path):
    for name, row in (("scan.csv", ";;;"), ("scan.txt", "nan nan nan nan")):
        separator = row[0] if row[0] == ";" else " "
        lines = [separator.join("1234"), row, separator.join("5678"), row]
        (tmp_path / name).write_text("\n".join(lines) + "\n")
        h = open_scan(tmp_path / name, unit="um", spacing=1e-6)
        np.testing.assert_array_equal(np.isnan(h), np.broadcast_to([False, True, False, True], (4, 4)))


def test_axes__on_no_regular_grid_are_refused(tmp_path):
    good = write_x3p(tmp_path / "good.x3p")
    with zipfile.ZipFile(good) as old, zipfile.ZipFile(tmp_path / "bad.x3p", "w") as new:
        for name in old.namelist():
            content = re.sub(rb"(<CX>.*?<AxisType>)I", rb"\1A", old.read(name), flags=re.DOTALL)
            places = np.geomspace(1e-6, 1e-5, 117).tobytes() if name.endswith("data.bin") else b""
            new.writestr(name, places + content)
    assert "absolute axes" in refusal(tmp_path / "bad.x3p")


@pytest.mark.parametrize("width", [2.0, 1e-10])
@pytest.mark.parametrize("kind", ["x3p", "sdf", "nc"])
def test_too_wide_or_fine__is_refused_and_spacing_mends_it(kind, width, tmp_path):
    path, cell = tmp_path / f"scan.{kind}", width / 13
    if kind == "nc":
        from_array(tilted(), (cell, 1e-6)).to_netcdf(path)
    else:
        library = pytest.importorskip(f"{kind}io")
        library.write(path, tilted().T, x_scale=cell, y_scale=1e-6)
    assert "expected another unit or spacing" in refusal(path)
    np.testing.assert_allclose(spacing(open_scan(path, spacing=CELL)), CELL)


# -- profiles, damage -------------------------------------------------------------------------------------------------


def write_nc(path, h=None, **options):
    h = from_array(tilted(), CELL) if h is None else h
    h.to_netcdf(path, engine="netcdf4", **options)
    return path


PROFILES = {
    "x3p": lambda path: pytest.importorskip("x3pio").write(path, tilted()[:, 0], x_scale=1e-6),
    "sdf": lambda path: write_sdf(path, tilted()[:, :1]),
    "txt": lambda path: path.write_text("0 1\n1 2\n2 5\n3 2\n"),
    "nc": lambda path: write_nc(path, from_array(tilted(), CELL).isel(y=[0])),
}


@pytest.mark.parametrize("kind", PROFILES)
def test_profile__is_refused(kind, tmp_path):
    PROFILES[kind](tmp_path / f"profile.{kind}")
    refusal(tmp_path / f"profile.{kind}", **({"unit": "um"} if kind == "txt" else {}))


WRITERS = {
    "x3p": write_x3p,
    "sdf": write_sdf,
    "sdf text": lambda path: write_sdf(path, format=pytest.importorskip("sdfio").FileFormat.ASCII),
    "nc": lambda path: write_nc(path, encoding={"height": {"zlib": True}}),
    "nc classic": lambda path: write_nc(path, format="NETCDF3_CLASSIC"),
    "npy": lambda path: np.save(path, tilted()),
    "txt": write_text,
    "asc": write_text,
    "xyz": write_xyz,
    "csv": write_xyz,
}
OPTIONS = {"npy": {"unit": "m", "spacing": CELL}, "xyz": {"unit": "m"}, "csv": {"unit": "m"}}


@pytest.mark.parametrize("kind", WRITERS)
def test_damaged_file__gives_heights_or_is_refused(kind, tmp_path):
    path = tmp_path / f"scan.{kind.split()[0]}"
    WRITERS[kind](path)
    survive(path, path.read_bytes(), **OPTIONS.get(kind, {}))
