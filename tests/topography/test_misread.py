"""Exports of instruments and programs that are easily misread, each with its right value.

The heights of the small files in `misread/` are those of :func:`waves`, rounded, unless a test says otherwise.
"""

import re
import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scan_files import CELL, SCANS, real, write_x3p
from support import refused

import roughvisc as rv
from roughvisc.topography.grid import spacing
from roughvisc.topography.scans import open_scan

FILES = Path(__file__).parent / "misread"
ROUGH = np.random.default_rng(4).normal(0, 1, (20, 24))


def matrix(path, values, **options):
    pd.DataFrame(values).to_csv(path, **options)
    return path


# -- files of one maker ------------------------------------------------------------------------------------------------


#: file -> options, shape, spacing [m], missing points, and some heights by their places [m]
OF_MAKERS = {
    "wyko1.asc": ({}, (24, 16), (2e-6, 2.5e-6), 1, {(0, 0): 320.409e-9, (0, 1): 210.304e-9, (1, 0): 524.443e-9}),
    "zygo.xyz": ({}, (24, 16), (5.067e-6, 5.067e-6), 2, {(0, 0): 0.32041e-6, (1, 0): 0.52444e-6, (2, 0): 0.73719e-6}),
    "esri.asc": ({"unit": "mm"}, (30, 20), (0.5e-3, 0.5e-3), 1, {(0, -1): 1e-3, (1, -1): 1.2474e-3}),
}


@pytest.mark.parametrize("name", OF_MAKERS)
def test_file_of_a_maker__has_its_heights_in_their_places(name):
    options, shape, cell, missing, heights = OF_MAKERS[name]
    h = open_scan(FILES / name, **options)
    assert (h.shape, int(np.isnan(h).sum())) == (shape, missing)
    np.testing.assert_allclose(spacing(h), cell, rtol=1e-12)
    for place, height in heights.items():
        assert float(h[place]) == pytest.approx(height, rel=1e-12)
    if options:
        with refused("unit"):
            open_scan(FILES / name)


def test_esri__may_state_both_sides_of_its_cells(tmp_path):
    text, count = re.subn(r"(?im)^cellsize.*$", "dx 0.5\ndy 0.25", (FILES / "esri.asc").read_text())
    assert count == 1
    (tmp_path / "unequal.asc").write_text(text)
    np.testing.assert_allclose(spacing(open_scan(tmp_path / "unequal.asc", unit="mm")), (0.5e-3, 0.25e-3), rtol=1e-12)


def test_wyko__heights_in_waves(tmp_path):
    text = (
        (FILES / "wyko1.asc")
        .read_text()
        .replace("Format 0\t1\t1", "Format 0\t0\t1")
        .replace("Mult\t7\t4\t1", "Mult\t7\t4\t2")
    )
    (tmp_path / "waves.asc").write_text(text)
    np.testing.assert_allclose(
        open_scan(tmp_path / "waves.asc"), 300 * open_scan(FILES / "wyko1.asc"), rtol=1e-12
    )  # 600 nm over 2


@pytest.mark.parametrize(("resolution", "counts"), [(0, 4096), (1, 32768), (2, 131072)])
def test_zygo_ascii__phases_become_heights(resolution, counts, tmp_path):
    """Heights are phase counts times S W O / R (MetroPro Reference Guide, ASCII data format)."""
    phases = np.arange(12).reshape(3, 4) * 1000
    phases[1, 2] = 2147483640
    head = ["Zygo ASCII Data File - Format 2", '1 8 3 4 "today"', "0 0 2 2 1 255", "0 0 4 3", '""', '""', '""']
    head += ["0 0.5 6.328e-07 0 1.5 0 5e-06 1787677163", '4 3 0 0 0 0 ""', "0 0 0 0 0 0 0 0.0 1 1"]
    head += [f"{resolution} 1 20 2 0 0 0 0 0", '0 ""', "1 0", '""']
    rows = [" ".join(map(str, row)) for row in phases]
    (tmp_path / "phase.asc").write_text("\n".join([*head, "#", "7 8 9 10", "#", *rows, "#"]) + "\n")
    h = open_scan(tmp_path / "phase.asc")
    expected = np.where(phases < 2147483640, phases * 0.5 * 6.328e-7 * 1.5 / counts, np.nan).T
    np.testing.assert_allclose(h, expected, rtol=1e-12)
    np.testing.assert_allclose(spacing(h), 5e-6, rtol=1e-12)


@pytest.mark.parametrize("german", [False, True])
def test_keyence__unit_and_spacing_are_those_of_the_header(german, tmp_path):
    text = (FILES / "keyence_vk.csv").read_text()
    if german:
        text = text.replace(",", ";").replace(".", ",")
    (tmp_path / "vk.csv").write_text(text.replace('"0' + (",737" if german else ".737") + '"', '""'))
    h = open_scan(tmp_path / "vk.csv")
    assert h.shape == (24, 16)
    np.testing.assert_allclose(spacing(h), 138.9e-9, rtol=1e-12)
    assert np.argwhere(np.isnan(h.values)).tolist() == [[2, 0]]
    np.testing.assert_allclose(h[:2, 0], [0.320e-6, 0.524e-6], rtol=1e-12)
    (tmp_path / "vk.csv").write_text(text.replace("524", "five"))
    with pytest.raises(Exception, match="line 20: found '0.five'".replace(".", "[.,]")):
        open_scan(tmp_path / "vk.csv")


@pytest.mark.parametrize("comment", [b"", b"GelSight Mobile 1X", b"Created by TrueMap v6\r\n"])
def test_truemap__may_have_any_comment(comment, tmp_path):
    content = (FILES / "tmd_empty.tmd").read_bytes()
    at = content.index(b"\0") + 1
    (tmp_path / "a.tmd").write_bytes(content[:at] + comment + content[at:])
    h = open_scan(tmp_path / "a.tmd")
    assert h.shape == (12, 8)
    np.testing.assert_allclose(spacing(h), 1e-5, rtol=1e-6)
    np.testing.assert_allclose(h[0, -1], 1e-3 * struct.unpack("<f", content[57:61])[0], rtol=1e-9)  # top left
    sides = at + len(comment) + 1 + 8  # width and height in mm follow the counts of columns and rows
    longer = bytearray((tmp_path / "a.tmd").read_bytes())
    longer[sides : sides + 8] = struct.pack("<2f", 0.12, 0.16)
    (tmp_path / "a.tmd").write_bytes(longer)
    np.testing.assert_allclose(spacing(open_scan(tmp_path / "a.tmd")), (1e-5, 2e-5), rtol=1e-6)


@real
@pytest.mark.parametrize("streams", [1, 3])
def test_digital_surf__compressed_is_read_as_uncompressed(streams, tmp_path):
    content = (SCANS / "sur-2.sur").read_bytes()
    begin = 512 + sum(struct.unpack_from("<2H", content, 334))
    parts = np.array_split(np.frombuffer(content[begin : begin + 563 * 484 * 4], "u1"), streams)
    packed = [zlib.compress(part.tobytes()) for part in parts]
    sizes = b"".join(struct.pack("<2I", len(part), len(small)) for part, small in zip(parts, packed, strict=True))
    whole = b"DSCOMPRESSED" + content[12:begin] + struct.pack("<I", streams) + sizes + b"".join(packed)
    (tmp_path / "c.sur").write_bytes(whole)
    np.testing.assert_array_equal(open_scan(tmp_path / "c.sur"), open_scan(SCANS / "sur-2.sur"))
    (tmp_path / "c.sur").write_bytes(whole[:-500])
    with refused():
        open_scan(tmp_path / "c.sur")


# -- index rows and columns --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("header", "index"), [(True, True), (True, False), (False, True)])
@pytest.mark.parametrize("suffix", ["csv", "txt"])
def test_index__that_pandas_writes_is_no_height(header, index, suffix, tmp_path):
    path = matrix(tmp_path / f"m.{suffix}", ROUGH, header=header, index=index)
    with pytest.warns(UserWarning, match="taken as an index"):
        h = open_scan(path, unit="um", spacing="2 um")
    np.testing.assert_allclose(h, 1e-6 * ROUGH.T, rtol=1e-12)
    with refused("spacing"):
        open_scan(path, unit="um")


@pytest.mark.parametrize("corner", ["", "0"])
def test_index__of_lengths_is_the_spacing(corner, tmp_path):
    x, y = 0.5 * np.arange(24), 0.25 * np.arange(20)
    path = matrix(tmp_path / "m.csv", pd.DataFrame(ROUGH, y, x), index_label=corner)
    with pytest.warns(UserWarning, match="taken as coordinates"):
        h = open_scan(path, unit="um")
    np.testing.assert_allclose(h, 1e-6 * ROUGH.T, rtol=1e-12)
    np.testing.assert_allclose(spacing(h), (0.5e-6, 0.25e-6), rtol=1e-12)
    for i, j in ((-1, 1), (1, -1), (-1, -1)):  # the largest y or x first
        matrix(path, pd.DataFrame(ROUGH[::i, ::j], y[::i], x[::j]), index_label=corner)
        with pytest.warns(UserWarning, match="taken as coordinates"):
            np.testing.assert_array_equal(open_scan(path, unit="um"), h)
    centres = pd.DataFrame(ROUGH, np.arange(20) + 0.5, np.arange(24) + 0.5)
    matrix(path, centres, index_label=corner)  # in steps of one, and no index
    with pytest.warns(UserWarning, match="taken as coordinates"):
        np.testing.assert_allclose(spacing(open_scan(path, unit="um")), (1e-6, 1e-6), rtol=1e-12)


def test_index__is_not_seen_in_heights(tmp_path):
    """Planes rise by equal steps everywhere, and one smooth row does not rise by equal steps."""
    i, j = np.mgrid[:20, :24]
    for z in (i + 0.5 * j, ROUGH, np.sin(0.3 * j) + i, np.where(i + j > 5, 0.0, 1.0)):
        np.savetxt(tmp_path / "m.csv", z, delimiter=",")
        h = open_scan(tmp_path / "m.csv", unit="um", spacing="1 um")
        np.testing.assert_allclose(h, 1e-6 * z.T, rtol=1e-12, atol=1e-20)


# -- numbers for missing points, and scales ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "kind"), [(-9999.0, "csv"), (32767.0, "x3p"), (-1e6, "csv"), (-1.8e302, "npy"), (np.inf, "npy")]
)
def test_no_data__is_missing_with_a_warning(number, kind, tmp_path):
    z = ROUGH.copy()
    z[3:5, 4:9] = number
    path = tmp_path / f"m.{kind}"
    options = {"unit": "um", "spacing": "1 um"}
    if kind == "csv":
        np.savetxt(path, z, delimiter=",")
    elif kind == "npy":
        np.save(path, z)
    else:
        write_x3p(path, z.T)
        options = {"height_scale": 1e-6}
    with pytest.warns(UserWarning, match=f"10 points have the height {number:g}".replace("+", r"\+")):
        h = open_scan(path, **options)
    np.testing.assert_allclose(h, 1e-6 * np.where(z == number, np.nan, z).T, rtol=1e-12)
    if np.isfinite(number):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            np.testing.assert_array_equal(open_scan(path, **options, no_data=number), h)


@pytest.mark.parametrize(("ranges", "missing"), [(15, 10), (6, 0)])
def test_no_data__is_further_from_all_others_than_ten_times_their_range(ranges, missing, tmp_path):
    z = ROUGH * (1500 / ranges / np.ptp(ROUGH))
    z[3:5, 4:9] = -1500
    np.save(tmp_path / "m.npy", z)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        h = open_scan(tmp_path / "m.npy", unit="um", spacing="1 um")
    assert int(np.isnan(h).sum()) == missing
    assert bool(said) == bool(missing)


def test_no_data__is_not_seen_in_the_flat_pits_of_a_texture(tmp_path):
    h = rv.from_array(np.where(ROUGH > 1, -5e-6, 1e-8 * ROUGH), 1e-6)
    for suffix in ("nc", "x3p"):
        rv.save_scan(h, tmp_path / f"pits.{suffix}")
        np.testing.assert_array_equal(rv.open_scan(tmp_path / f"pits.{suffix}"), h)
    np.save(tmp_path / "flat.npy", np.where(ROUGH > 0, 1.0, 0.0))
    assert not np.isnan(open_scan(tmp_path / "flat.npy", unit="um", spacing="1 um")).any()
    np.save(tmp_path / "deep.npy", np.where(ROUGH > 1, -1e4, ROUGH))
    h = open_scan(tmp_path / "deep.npy", unit="um", spacing="1 um", no_data=1.0)
    assert not np.isnan(h).any()


def test_height_scale__opens_a_file_that_states_a_wrong_unit():
    path = FILES / "micron_5.x3p"
    with pytest.raises(Exception, match="height_scale"):
        open_scan(path)
    with pytest.raises(Exception, match="height_scale"):
        open_scan(path, spacing="0.645 um")
    h = open_scan(path, spacing="0.645 um", height_scale=1e-6)
    assert h.shape == (64, 64)
    assert 1e-6 < float(h.std()) < 1e-5
    with refused("height_scale", 0):
        open_scan(path, spacing="0.645 um", height_scale=0)


@pytest.mark.parametrize(("unit", "size"), [("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("nm", 1e-9)])
def test_text__has_the_same_heights_in_any_unit(unit, size, tmp_path):
    """A matrix with its coordinates, a matrix with a number for missing points, and points also on borders of cells."""
    x, y, z = 5e-7 * np.arange(24), 2.5e-7 * np.arange(20) + 1e-3, 1e-6 * ROUGH
    path = matrix(tmp_path / "m.csv", pd.DataFrame(z / size, y / size, x / size))
    with pytest.warns(UserWarning, match="taken as coordinates"):
        h = open_scan(path, unit=unit)
    np.testing.assert_allclose(h, z.T, rtol=1e-12)
    np.testing.assert_allclose(spacing(h), (5e-7, 2.5e-7), rtol=1e-9)
    holed = z / size
    holed[3:5, 4:9] = -9999
    np.savetxt(path, holed, delimiter=",")
    with pytest.warns(UserWarning, match="10 points have the height -9999"):
        h = open_scan(path, unit=unit, spacing="1 um")
    np.testing.assert_allclose(h, np.where(holed == -9999, np.nan, z).T, rtol=1e-12)
    on_lattice = points()
    np.savetxt(tmp_path / "p.xyz", on_lattice * 1e-6 / size)
    i, j = (on_lattice[:, :2] / (2, 3)).round().astype(int).T
    nodes = np.empty((40, 30))
    nodes[i, j] = 1e-6 * on_lattice[:, 2]
    h = open_scan(tmp_path / "p.xyz", unit=unit)
    np.testing.assert_allclose(h, nodes, rtol=1e-12)
    np.testing.assert_allclose(spacing(h), (2e-6, 3e-6), rtol=1e-9)
    i, j = np.minimum(np.arange(40) // 3, 12), np.arange(30) // 2  # the last x is the upper border of its cell
    means = [[nodes[np.ix_(i == row, j == column)].mean() for column in range(15)] for row in range(13)]
    np.testing.assert_allclose(open_scan(tmp_path / "p.xyz", unit=unit, grid="6 um"), means, rtol=1e-12)


# -- points and tables -------------------------------------------------------------------------------------------------


def points(shape=(40, 30), jitter=0.0, seed=1):
    """Points of a slowly varying surface off a lattice by a part of its steps, in any order."""
    rng = np.random.default_rng(seed)
    at = np.stack(np.mgrid[: shape[0], : shape[1]], axis=-1).reshape(-1, 2) * (2.0, 3.0)
    at = at + rng.uniform(-jitter, jitter, at.shape) * (2.0, 3.0)
    z = np.sin(0.2 * at[:, 0]) + np.cos(0.15 * at[:, 1])
    return rng.permutation(np.column_stack([at, z]))


@pytest.mark.parametrize("jitter", [0.0, 1e-6, 1e-3, 9e-3])
def test_points__near_a_lattice_are_that_lattice(jitter, tmp_path):
    np.savetxt(tmp_path / "p.xyz", points(jitter=jitter))
    h = open_scan(tmp_path / "p.xyz", unit="um")
    assert h.shape == (40, 30)
    np.testing.assert_allclose(spacing(h), (2e-6, 3e-6), rtol=1e-3 * (jitter > 0) + 1e-9)
    x, y = np.mgrid[:40, :30] * np.reshape([2.0, 3.0], (2, 1, 1))
    np.testing.assert_allclose(h, 1e-6 * (np.sin(0.2 * x) + np.cos(0.15 * y)), atol=1e-6 * jitter)


def test_points__off_any_lattice_ask_for_a_grid_and_count_empty_cells(tmp_path):
    np.savetxt(tmp_path / "p.csv", points(jitter=0.3), delimiter=",")
    with refused("grid") as caught:
        open_scan(tmp_path / "p.csv", unit="um")
    assert 'grid = "5 um"' in str(caught.value), "twice the mean distance, sqrt(6) um, in a round number"
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        h = open_scan(tmp_path / "p.csv", unit="um", grid="4 um")
    empty = int(np.isnan(h).sum())
    assert empty > 0
    assert f"{empty} of {h.size} cells" in str(said[0].message)
    np.testing.assert_allclose(spacing(h), 4e-6, rtol=1e-12)
    x, y = 1e6 * h.x.values[:, None] - 0.6, 1e6 * h.y.values - 0.9
    assert np.nanmax(np.abs(1e6 * h - np.sin(0.2 * x) - np.cos(0.15 * y))) < 0.6  # half a cell times the slope
    with pytest.warns(UserWarning, match="hold no point"):
        fine = open_scan(tmp_path / "p.csv", unit="um", grid="0.5 um")  # at most one point in a cell
    known = np.sort(fine.values[np.isfinite(fine.values)])
    np.testing.assert_allclose(known, 1e-6 * np.sort(points(jitter=0.3)[:, 2]), rtol=1e-12)


def test_points__of_which_two_have_one_place_ask_for_a_grid(tmp_path):
    np.savetxt(tmp_path / "p.xyz", np.vstack([points(), points()[0] + np.array([0, 0, 0.5])]))
    with refused("grid"):
        open_scan(tmp_path / "p.xyz", unit="um")


@pytest.mark.parametrize("options", [{}, {"grid": "6 um"}])
def test_points__without_data_are_missing_before_they_are_sorted_into_cells(options, tmp_path):
    some = points()
    some[:40, 2] = -9999
    np.savetxt(tmp_path / "p.xyz", some)
    known = np.delete(some, np.s_[:40], axis=0)
    np.savetxt(tmp_path / "known.xyz", known)
    with pytest.warns(UserWarning, match="40 points have the height -9999"):
        h = open_scan(tmp_path / "p.xyz", unit="um", **options)
    assert float(np.abs(h).max()) < 3e-6
    np.testing.assert_array_equal(h, open_scan(tmp_path / "known.xyz", unit="um", **options))
    np.testing.assert_array_equal(h, open_scan(tmp_path / "p.xyz", unit="um", no_data=-9999, **options))


def test_x3p__point_cloud_is_points_and_not_a_profile(tmp_path):
    x3pio = pytest.importorskip("x3pio")
    x3pio.write_points(tmp_path / "c.x3p", 1e-6 * points(jitter=1e-3))
    assert open_scan(tmp_path / "c.x3p").shape == (40, 30)
    x3pio.write_points(tmp_path / "c.x3p", 1e-6 * points(jitter=0.3))
    with refused("grid"):
        open_scan(tmp_path / "c.x3p")


def test_table__of_force_curves_is_no_map(tmp_path):
    table = np.random.default_rng(1).random((300, 4))
    np.savetxt(tmp_path / "fd.csv", table, delimiter=",", header="height,force,time,separation", comments="")
    with pytest.raises(Exception, match="a table of 4 columns"):
        open_scan(tmp_path / "fd.csv", unit="um", spacing="1 um")
    np.save(tmp_path / "narrow.npy", table)
    assert open_scan(tmp_path / "narrow.npy", unit="um", spacing=CELL).shape == (4, 300)
