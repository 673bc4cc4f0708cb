"""Seals: a result whose bytes are not those that were written is named, set aside and computed anew."""

import os
import shutil
import struct
import zlib

import netCDF4
import numpy as np
import pytest
import xarray as xr
from sample_results import hertz_creep
from support import BALL

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.study.execution.sweep import sweep
from roughvisc.study.statement.case import read_cases, read_study
from roughvisc.study.storage import files as trust
from roughvisc.study.storage.files import checksum_error, is_sealed, unsealed
from roughvisc.study.storage.store import open_result, write_result
from roughvisc.study.storage.upkeep import verify

TWO_LOADS = BALL.replace("[24, 21]", "[12, 9]") + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'


@pytest.fixture
def result(tmp_path):
    return write_result(hertz_creep((12, 9), 3), tmp_path / "result.nc")


def test_seal__is_the_length_and_the_checksum_of_what_is_before_it(result):
    content, sealed = result.read_bytes()[:-24], result.read_bytes()[-24:]
    assert struct.unpack("<8sQI", sealed[:20]) == (b"rvseal1\n", len(content), zlib.crc32(content))
    assert is_sealed(result)
    assert checksum_error(result) == ""
    assert unsealed(result) == content


def test_seal__is_no_matter_to_readers_and_goes_with_what_another_program_writes(result):
    h5py = pytest.importorskip("h5py")
    with h5py.File(result) as file:
        np.testing.assert_array_equal(file["pressure"], open_result(result)["pressure"])
    with netCDF4.Dataset(result, "a") as file:
        file.note = "mine"
    assert checksum_error(result) == ""
    assert not is_sealed(result)
    assert open_result(result).attrs["note"] == "mine"


def test_changed_by_another_program__is_served_with_one_warning(tmp_path, caplog, capfd, invoke):
    path = tmp_path / "ball.toml"
    path.write_text(TWO_LOADS)
    cases, out = read_cases(path), tmp_path / "out"
    sweep(cases, out, workers=0, progress=False)
    changed = out / f"{cases[0].key}.nc"
    with netCDF4.Dataset(changed, "a") as file:  # as ncatted does
        file["force"][:] = 7.0
    rewritten = out / f"{cases[1].key}.nc"
    with xr.open_dataset(rewritten, decode_timedelta=False) as ds:
        whole = ds.load()
    whole.to_netcdf(rewritten)
    both = {f"{one}: {trust.UNSEALED}" for one in (changed, rewritten)}

    def warned_by(act):
        caplog.clear()
        act()
        return [one.getMessage() for one in caplog.records if "has no checksum" in one.getMessage()]

    assert warned_by(lambda: open_result(changed)) == [f"{changed}: {trust.UNSEALED}"]
    assert open_result(changed).force.values.tolist() == [7.0, 7.0, 7.0]
    assert warned_by(lambda: rv.run(cases[0], out, progress=False)) == []
    assert warned_by(lambda: rv.run(cases[1], out, progress=False)) == [f"{rewritten}: {trust.UNSEALED}"]
    assert warned_by(lambda: rv.open_results(out)) == []
    trust._warned.clear()  # another process, which reads the index
    said = warned_by(lambda: [rv.open_results(out), rv.open_results(out, ragged=True)])
    assert (len(said), set(said)) == (2, both)
    capfd.readouterr()
    sweep(cases, out, workers=0, progress=False)
    first = capfd.readouterr().err
    assert first == f"roughvisc: {changed} and 1 more: {trust.UNSEALED}\n"
    status, said, err = invoke("verify", out)
    assert (status, said) == (0, "2 of 2 files intact, 2 of them without a checksum\n")
    assert set(err.splitlines()) == {f"roughvisc: {one}" for one in both}


def test_damaged_result__is_warned_of_once(tmp_path, caplog):
    path = tmp_path / "ball.toml"
    path.write_text(TWO_LOADS)
    cases, out = read_cases(path), tmp_path / "out"

    def warned_by(act):
        sweep(cases, out, workers=0, progress=False)
        result = out / f"{cases[0].key}.nc"
        content = bytearray(result.read_bytes())
        content[-3000] ^= 4
        result.write_bytes(content)
        caplog.clear()
        act()
        return [one.getMessage() for one in caplog.records if f"{result}: is damaged" in one.getMessage()]

    (message,) = warned_by(lambda: rv.run(cases[0], out, progress=False))
    assert message.endswith(f"; it is renamed to {cases[0].key}.nc.damaged and computed again")
    assert len(warned_by(lambda: [rv.open_results(out), rv.open_results(out), rv.to_table(out)])) == 1
    (message,) = warned_by(lambda: sweep(cases, out, workers=0, progress=False))
    assert message.endswith(f"; it is renamed to {cases[0].key}.nc.damaged and computed again")


def test_seal__tells_every_changed_bit_and_every_cut(result):
    whole = np.fromfile(result, np.uint8)
    rng = np.random.default_rng(17)
    for at in [0, 8, 30, *(-1 - np.arange(24)), *rng.integers(len(whole), size=60)]:
        damaged = whole.copy()
        damaged[at] ^= 1 << rng.integers(8)
        damaged.tofile(result)
        with pytest.raises(InputError, match=r"result\.nc: is (damaged|not a NetCDF file, or is damaged)"):
            open_result(result)
    for length in rng.integers(len(whole), size=20):
        whole[:length].tofile(result)
        with pytest.raises(InputError, match=r"result\.nc: is (damaged|not a NetCDF file, or is damaged)"):
            open_result(result)
    whole[:-24].tofile(result)  # all but the seal: every value is there
    with open_result(result) as ds:
        assert ds.sizes["time"] == 3


def test_run__sets_a_damaged_result_aside_and_computes_it_anew(tmp_path, caplog):
    path = tmp_path / "ball.toml"
    path.write_text(BALL.replace("[24, 21]", "[12, 9]"))
    first = rv.run(path, progress=False).load()
    result = tmp_path / "results" / "ball" / f"{read_study(path).key}.nc"
    damaged = bytearray(result.read_bytes())
    damaged[-3000] ^= 4
    result.write_bytes(damaged)
    again = rv.run(path, progress=False)
    xr.testing.assert_equal(again.drop_vars("wall_time"), first.drop_vars("wall_time"))
    assert (result.parent / f"{result.name}.damaged").read_bytes() == damaged
    assert f"{result}: is damaged: its bytes are not those that were written" in caplog.text
    assert "is renamed to" in caplog.text


def test_sweep__computes_a_damaged_result_anew(tmp_path):
    path = tmp_path / "ball.toml"
    path.write_text(TWO_LOADS)
    cases = read_cases(path)
    first = sweep(cases, tmp_path / "out", workers=0, progress=False).load()
    result = tmp_path / "out" / f"{cases[1].key}.nc"
    damaged = bytearray(result.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    result.write_bytes(damaged)
    again = sweep(cases, tmp_path / "out", workers=0, progress=False)
    xr.testing.assert_equal(again.drop_vars("wall_time"), first.drop_vars("wall_time"))
    assert [p.name for p in (tmp_path / "out").glob("*.damaged")] == [f"{cases[1].key}.nc.damaged"]


def test_open_results__names_the_file_whose_chunk_is_broken(tmp_path):
    whole = hertz_creep((40, 33), 9)
    whole["pressure"].values[:, :, 3:] = 0.0
    for key in ("0" * 16, "1" * 16):
        path = write_result(whole.assign_attrs(case="{}", case_key=key), tmp_path / f"{key}.nc")
    results = rv.open_results(tmp_path)
    with netCDF4.Dataset(path) as file:
        assert file["pressure"].filters()["zlib"]
    content = bytearray(path.read_bytes())
    for at in range(8000, len(content) - 24, 16):  # behind the heads, of which the library keeps its own checksums
        content[at] ^= 255
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf"{path.name}: is damaged: its bytes are not those that were written"):
        results["pressure"].compute(scheduler="sync")
    path.write_bytes(content[:-24])  # without its checksum
    with pytest.raises(InputError, match=rf"{path.name}: its pressure cannot be read .*: the file is damaged"):
        results["pressure"].compute(scheduler="sync")


@pytest.mark.parametrize("kept", [True, False], ids=["time of change kept", "time of change new"])
def test_fields__are_held_against_the_checksum_when_they_are_read(tmp_path, kept):
    """Of a file that was damaged since it was opened, or since the index of its folder was made."""
    path = write_result(hertz_creep((6, 5), 3).assign_attrs(case="{}", case_key="0" * 16), tmp_path / f"{'0' * 16}.nc")
    whole = rv.open_results(tmp_path).load()
    single, several, times = open_result(path), rv.open_results(tmp_path), path.stat()
    content = bytearray(path.read_bytes())
    at = content.index(whole["pressure"].values[0, 2].tobytes())
    content[at + 6] ^= 8  # a number a little larger, which nothing but the checksum tells of
    path.write_bytes(content)
    if kept:  # a disk that forgets tells nobody
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    for read in (single.load, several.load):
        with pytest.raises(InputError, match=rf"{path.name}: is damaged: its bytes are not those that were written"):
            read()
    if kept:
        with pytest.raises(InputError, match=rf"{path.name}: is damaged"):
            rv.open_results(tmp_path).load()


def test_fields__of_a_file_that_lost_its_checksum_since_are_warned_of(tmp_path, caplog):
    path = write_result(hertz_creep((6, 5), 3), tmp_path / "result.nc")
    opened = open_result(path)
    path.write_bytes(path.read_bytes()[:-24])
    opened.load()
    assert f"{path}: {trust.UNSEALED}" in caplog.text


def test_verify__names_what_is_damaged(tmp_path, invoke):
    folder = tmp_path / "out"
    for name in "abc":
        write_result(hertz_creep((6, 5), 2), folder / f"{name}.nc")
    assert [(v.path.name, v.flaw, v.sealed) for v in verify(folder)] == [(f"{n}.nc", "", True) for n in "abc"]
    content = (folder / "a.nc").read_bytes()
    (folder / "a.nc").write_bytes(content[:-24])
    (folder / "b.nc").write_bytes(content[:3000] + b"?" + content[3001:])
    status, out, err = invoke("verify", folder)
    assert status == 1
    assert out == "2 of 3 files intact, 1 of them without a checksum\n"
    assert err.splitlines()[0] == f"roughvisc: {folder / 'b.nc'}: is damaged: its bytes are not those that were written"
    (folder / "b.nc").unlink()
    assert invoke("verify", folder)[0] == 0
    (folder / "a.nc").write_bytes(content[:4000])
    assert "it cannot be read" in invoke("verify", folder / "a.nc")[2]
    shutil.rmtree(folder)
    assert invoke("verify", folder)[0] == 2
