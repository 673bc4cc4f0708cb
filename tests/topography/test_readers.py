"""Reading of scans: heights and positions from instrument files, grid files and surface cards."""

import hashlib
import io
import json
import random
import re
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scan_files import CELL, ROOT, SCANS, SHAPE, TABLE, card, file_card, real, refusal, tilted, write_x3p
from support import refused

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.topography import formats
from roughvisc.topography.formats import Channel, ScanFile, add_format, supported_formats
from roughvisc.topography.grid import spacing
from roughvisc.topography.readers import from_array
from roughvisc.topography.scans import open_scan

# -- every row of the table beside the real files ----------------------------------------------------------------------


@real
@pytest.mark.parametrize("name", TABLE)
def test_real_scan__is_read_as_the_table_says(name):
    shape, size, missing = TABLE[name]
    h = open_scan(SCANS / name)
    assert (h.shape, h.dims, h.name, h.dtype) == (shape, ("x", "y"), "height", np.float64)
    for axis, d, n, side in zip(("x", "y"), spacing(h), shape, size, strict=True):
        assert n * d == pytest.approx(side, rel=1e-3)
        np.testing.assert_allclose(h[axis], (np.arange(n) + 0.5) * d, rtol=1e-9)
    assert float(np.isnan(h).mean()) == pytest.approx(missing, abs=6e-4 if missing else 0)
    assert h.attrs["source_sha256"] == hashlib.sha256((SCANS / name).read_bytes()).hexdigest()
    assert h.attrs["source_file"] == name
    assert name in h.attrs["history"]
    h.to_netcdf()


@real
def test_real_scan__heights_are_in_metres():
    al3d = open_scan(SCANS / "al3d-1.al3d")
    assert float(al3d.mean()) == pytest.approx(7.63e-2, rel=1e-3)
    assert float(al3d.max() - al3d.min()) == pytest.approx(40e-6, rel=0.2)
    assert 1e-9 < float(open_scan(SCANS / "stp-1.stp").std()) < 1e-8


@real
@pytest.mark.parametrize("name", ["x3p-2.x3p", "sdf-1.sdf"])
def test_real_scan__libraries_agree_on_orientation_and_scale(name):
    io = pytest.importorskip("SurfaceTopography.IO")
    h = open_scan(SCANS / name)
    theirs = io.read_topography(str(SCANS / name), format=h.attrs["format"]).to_unit("m")
    np.testing.assert_allclose(h, np.ma.filled(theirs.heights(), np.nan), rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(spacing(h), np.array(theirs.physical_sizes) / h.shape, rtol=1e-9)


@real
@pytest.mark.parametrize("suffix", ["001", "005", "017", "999", "SPM"])
def test_real_scan__is_recognised_by_the_number_that_an_instrument_counts(suffix, tmp_path):
    (tmp_path / f"scan.{suffix}").write_bytes((SCANS / "di-3.di").read_bytes())
    h = open_scan(tmp_path / f"scan.{suffix}")
    assert h.attrs["format"] == "di"
    np.testing.assert_array_equal(h, open_scan(SCANS / "di-3.di"))


class Stub:
    """Reader of SurfaceTopography with one channel, whose heights differ along x and y."""

    def __init__(self, path):
        self.channels = [SimpleNamespace(**CHANNEL | json.loads(Path(path).read_text()))]
        self.close = lambda: None


CHANNEL = {
    "channel_id": "z",
    "nb_grid_pts": (13, 9),
    "physical_sizes": (26.0, 27.0),
    "unit": "um",
    "data_unit": None,
    "is_height_channel": True,
    "dim": 2,
    "is_uniform": True,
    "info": {},
    "topography": lambda **_: SimpleNamespace(heights=lambda: 1e6 * tilted()),
}


@pytest.mark.parametrize(
    ("change", "is_read"),
    [
        ({}, True),
        ({"is_uniform": None}, True),
        ({"unit": None, "data_unit": "um"}, False),
        ({"is_height_channel": False}, False),
        ({"dim": 1}, False),
        ({"unit": "V"}, False),
        ({"data_unit": "V"}, False),
        ({"unit": ["um", None]}, False),
        ({"is_uniform": False}, False),
    ],
    ids=str,
)
def test_channel__of_a_library_is_a_height_only_if_all_conditions_hold(change, is_read, tmp_path, monkeypatch):
    library = pytest.importorskip("SurfaceTopography.IO")
    monkeypatch.setitem(library.lookup_reader_by_format, "stub", Stub)
    path = tmp_path / "scan.stub"
    path.write_text(json.dumps(change))
    if not is_read:
        refusal(path, format="stub")
        return
    h = open_scan(path, format="stub")
    np.testing.assert_allclose(h, tilted(), rtol=1e-12)
    np.testing.assert_allclose(spacing(h), CELL, rtol=1e-12)


# -- round trips and orientation ---------------------------------------------------------------------------------------


def test_netcdf__units_are_converted_and_descending_axes_turned(tmp_path):
    h = from_array(tilted(), CELL)
    for name, step in (("scan.nc", (-1, 1)), ("scan.h5", (1, -1)), ("both.nc", (-1, -1))):
        micro = (h * 1e9).assign_coords(x=h.x * 1e6, y=h.y * 1e6)[:: step[0], :: step[1]].assign_attrs(units="nm")
        micro.x.attrs["units"] = micro.y.attrs["units"] = "um"
        micro.to_netcdf(tmp_path / name, engine="netcdf4")
        xr.testing.assert_allclose(open_scan(tmp_path / name), h, atol=1e-20)


def test_netcdf__refuses_what_is_no_grid(tmp_path):
    h = from_array(tilted(), CELL)

    def saved(array):
        array.to_netcdf(tmp_path / "scan.nc")
        return tmp_path / "scan.nc"

    refusal(saved(h.drop_attrs()))
    np.testing.assert_allclose(open_scan(saved(h.drop_attrs()), unit="mm"), tilted() * 1e-3)
    refusal(saved(h.assign_coords(x=("x", np.geomspace(1e-6, 1e-5, 13), {"units": "m"}))))
    refusal(saved(h.rename(x="lon")))
    assert "expected one unit" in refusal(saved(h.assign_coords(x=h.x.assign_attrs(units="um"))))
    refusal(saved(h.assign_attrs(units="V")))
    assert "spacing" in refusal(saved(h.drop_vars("x")))
    assert open_scan(saved(h.drop_vars("x")), spacing=CELL).shape == SHAPE


def test_x3p__wrong_checksum_is_a_warning_of_ours(tmp_path):
    good = write_x3p(tmp_path / "good.x3p")
    bad = tmp_path / "bad.x3p"
    with zipfile.ZipFile(good) as source, zipfile.ZipFile(bad, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name.endswith("md5checksum.hex"):
                content = b"0" * 32 + content[32:]
            target.writestr(name, content)
    with pytest.warns(UserWarning, match=r"bad\.x3p: its checksum is wrong"):
        h = open_scan(bad)
    np.testing.assert_array_equal(h, tilted())


# -- refusals ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "content", [b"", b"This is a letter, and no scan.\n" * 200, random.Random(0).randbytes(7000)], ids=len
)
def test_refusal__of_what_only_poses_as_a_scan_of_any_suffix(content, tmp_path):
    known = {suffix for suffixes in supported_formats().values() for suffix in suffixes}
    assert len(known) > 50
    for suffix in known:
        path = tmp_path / f"posing.{suffix.partition(' ')[0]}"  # "000 to 999"
        path.write_bytes(content)
        refusal(path)


@pytest.mark.parametrize("suffix", ["obj", "png", "JPG", "h5-jpk", "topostats", "xls", "xlsx"])
def test_refusal__of_files_without_a_map_says_what_to_export(suffix, tmp_path):
    (tmp_path / f"a.{suffix}").write_bytes(b"solid own")
    with refused("format", f".{suffix}") as caught:
        open_scan(tmp_path / f"a.{suffix}")
    assert "expected" in str(caught.value)


@pytest.mark.parametrize("suffix", ["sur", "sdf", "csv", "dat", "opd", "tmd", "ply"])
def test_refusal__of_another_suffix_names_the_format_of_the_content(suffix, tmp_path):
    contents = {"x3p": (Path(__file__).parent / "misread" / "micron_5.x3p").read_bytes()}
    heights = io.BytesIO()
    np.save(heights, tilted())
    contents["npy"] = heights.getvalue()
    path = tmp_path / f"scan.{suffix}"
    for format in ("x3p", "npy"):
        path.write_bytes(contents[format])
        with refused("format", f".{suffix}") as caught:
            open_scan(path)
        assert repr(format) in str(caught.value)
    assert open_scan(path, format="npy", spacing=CELL, unit="m").size == tilted().size


@real
def test_refusal__of_digital_surf_with_intensities_names_their_unit(tmp_path):
    content = bytearray((SCANS / "sur-2.sur").read_bytes())
    for place in (212, 260):  # units of the step of z, and of z
        content[place : place + 16] = b"%".ljust(16)
    (tmp_path / "intensity.sur").write_bytes(content)
    assert "'%'" in refusal(tmp_path / "intensity.sur")


def test_refusal__all_points_are_missing(tmp_path):
    from_array(tilted(), CELL).copy(data=np.full(SHAPE, np.nan)).to_netcdf(tmp_path / "scan.nc")
    assert "all 117 points are missing" in refusal(tmp_path / "scan.nc")


def test_supported_formats__names_those_of_all_libraries():
    known = supported_formats()
    assert {"x3p", "sdf", "nc", "al3d", "sur", "frt", "opd", "di", "wsxm", "asc", "xyz", "nms"} <= set(known)
    assert known["wsxm"] == ("cur", "stp", "tom", "top")
    assert known["jpk"] == ("jpk", "jpk-qi-image")
    assert len(known) >= 40


def test_from_array__labels_and_refuses():
    h = from_array(np.ma.masked_greater(tilted(missing=False), 1.3e-5), CELL)
    assert int(np.isnan(h).sum()) == int((tilted(missing=False) > 1.3e-5).sum()) > 0
    np.testing.assert_allclose(spacing(h), CELL)
    for wrong in (np.zeros(5), np.zeros((1, 5)), "text", [[1, 2], [3]], np.zeros((2, 2, 2))):
        with pytest.raises(InputError, match="heights"):
            from_array(wrong, 1e-6)
    with refused("spacing", -1):
        from_array(np.zeros((3, 3)), -1)
    data = np.zeros((3, 3))
    from_array(data, 1e-6)[0, 0] = 1.0
    assert data[0, 0] == 0  # a copy


# -- surface cards -----------------------------------------------------------------------------------------------------


BALL = 'generate = "sphere"\nradius = 1\nsize = 1e-6\nshape = 4\n'


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "generate"),
        ("generate = ", "TOML"),
        ('generate = "sphere"\nfile = "a"', "file"),
        ('generate = "cube"', "generate"),
        (BALL + "slope = 3", "slope"),
        (BALL + "title = 3", "title"),
        (BALL + "smooth = 1", "smooth"),
        ('file = "card.toml"\nmagic = 3', "expected a scan file"),
        (BALL + "magic = 3", "magic"),
        ("conditioning = 3\n" + BALL, "conditioning"),
    ],
)
def test_card__refuses_and_names_card_and_key(text, named, tmp_path):
    assert named in refusal(card(tmp_path, text))


def test_card__checksum_counts_in_any_case_and_must_be_that_of_the_file(tmp_path):
    path = file_card(tmp_path)
    expected, text = open_scan(path), path.read_text()
    (sha,) = re.findall('sha256 = "(.*)"', text)
    path.write_text(text.replace(sha, sha.upper()))
    np.testing.assert_array_equal(open_scan(path), expected)
    wrong = sha[::-1]
    path.write_text(text.replace(sha, wrong))
    with refused("sha256", wrong):
        open_scan(path)


def test_card__every_step_acts(tmp_path):
    steps = """
resample = [12, 10]
filter = { cutoff = "12 um", keep = "short" }
fill = true
outliers = { window = 5, threshold = 9 }
level = 2
invert = true
rotate90 = 1
crop = { x = ["0 um", "22 um"] }
"""
    h = open_scan(file_card(tmp_path, steps))
    lines = [line.split()[0].rstrip(":") for line in h.attrs["history"].splitlines()]
    order = "read cropped rotated inverted levelled outliers filled Gaussian resampled"
    assert lines == order.split()
    assert h.shape == (12, 10)
    off = steps.replace("resample = [12, 10]", "resample = false").replace("invert = true", "invert = false")
    assert open_scan(file_card(tmp_path, off)).shape == (9, 11)


@pytest.mark.parametrize("path", sorted((ROOT / "surfaces").glob("*.toml")), ids=lambda p: p.stem)
def test_shipped_card__opens_with_title_and_licence(path):
    h = open_scan(path)
    assert h.attrs["title"]
    assert h.attrs["licence"] == "MIT"
    assert np.isfinite(h).all()


def test_add_format__is_read_by_suffix_and_by_name(tmp_path, monkeypatch):
    monkeypatch.setattr(formats, "READERS", dict(formats.READERS))
    heights = np.arange(12.0).reshape(4, 3) * 1e-6

    def read(path):
        channel = Channel("height", lambda: heights, "m", "m", (1e-6, 2e-6))
        return ScanFile("ours", [channel])

    add_format("ours", [".TXT", "our"], read)
    for name, format in (("a.our", None), ("a.txt", None), ("a.csv", "ours")):
        (tmp_path / name).write_text("x")
        assert np.array_equal(open_scan(tmp_path / name, format=format).values, heights)
    (tmp_path / "a.bin").write_text("x")
    assert "the suffix '.bin' is not known: expected format" in refusal(tmp_path / "a.bin")
    with refused("format", "magic"):
        open_scan(tmp_path / "a.our", format="magic")
    assert supported_formats()["ours"] == ("txt", "our")
    add_format("ours", "our", read)
    assert supported_formats()["ours"] == ("our",)
    add_format("ours", [], read)
    assert supported_formats()["ours"] == ()


def test_topography_of_surface_topography__is_the_file_read_here_and_comes_back(tmp_path):
    from SurfaceTopography import Topography, read_topography

    heights = np.random.default_rng(1).normal(size=(7, 5))
    Topography(heights, (14.0, 15.0), unit="um").to_matrix(str(tmp_path / "map.asc"))
    opened, other = rv.open_scan(tmp_path / "map.asc"), read_topography(tmp_path / "map.asc")
    for found in (rv.from_topography(other), rv.from_topography(rv.to_topography(opened, unit="um"))):
        for name, values in {"height": found.values, "x": found.x.values, "y": found.y.values}.items():
            np.testing.assert_allclose(values, opened.values if name == "height" else opened[name].values, rtol=1e-12)
    with refused("topography"):
        rv.from_topography(opened)


def test_surface_of_surfalize__has_lines_from_the_top_in_micrometres():
    top_first = SimpleNamespace(data=np.array([[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]]), step_x=0.5, step_y=2.0)
    expected = rv.from_array(1e-6 * np.array([[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]]), ("0.5 um", "2 um"))
    xr.testing.assert_allclose(rv.from_topography(top_first), expected)
