"""Damaged results are noticed, set aside and computed again; what cannot be read is refused and left as it is."""

import os
import shutil
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest
import xarray as xr
from support import BALL, refused, with_steps

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.runs.netcdf import DamagedError, open_result, verify, write_result
from roughvisc.runs.run import run_case
from roughvisc.study.case import read_cases, read_study

SMALL = BALL.replace("[24, 21]", "[12, 9]")
TWO_LOADS = SMALL + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """A case and its result's file; tests copy it."""
    folder = tmp_path_factory.mktemp("sample")
    (folder / "ball.toml").write_text(SMALL)
    case = read_study(folder / "ball.toml")
    return case, run_case(case, folder / "out")


@pytest.fixture
def copied(sample, tmp_path):
    """The study, its case and a copy of its result."""
    case, original = sample
    (tmp_path / "ball.toml").write_text(SMALL)
    (tmp_path / "out").mkdir()
    return tmp_path / "ball.toml", case, Path(shutil.copy(original, tmp_path / "out"))


def with_flipped_bit(path, name, number=0):
    """Flip one bit of a stored block of a variable, the first one by default."""
    with h5py.File(path) as file:
        stored = file[name].id
        block = stored.get_chunk_info(number % stored.get_num_chunks())
    content = bytearray(path.read_bytes())
    content[block.byte_offset + block.size // 2] ^= 4
    path.write_bytes(content)


def is_noticed(path):
    """Whether reading all of a result fails."""
    try:
        ds = rv.open_result(path).load()
        _ = ds.roughvisc.steps
    except DamagedError:
        return True
    except rv.InputError:
        return True
    return False


def test_damage__is_noticed_in_any_block_of_any_array(sample, tmp_path):
    path = tmp_path / "result.nc"
    with h5py.File(sample[1]) as file:
        names = [f"{group}{name}" for group in ("", "steps/") for name in file[group or "/"]]
        arrays = [name for name in names if isinstance(file[name], h5py.Dataset) and file[name].chunks]
    assert {"pressure", "force", "steps/status", "steps/force"} <= set(arrays)
    for name in arrays:
        shutil.copy(sample[1], path)
        with_flipped_bit(path, name)
        assert is_noticed(path), name


@pytest.mark.parametrize("page", range(3))
def test_damage__of_a_page_is_noticed_whatever_it_holds(sample, tmp_path, page):
    """Groups, attributes and headers too, each of which HDF5 reports in its own way."""
    path, content = tmp_path / "result.nc", sample[1].read_bytes()
    for first in range(4096 * page, len(content), 3 * 4096):
        path.write_bytes(content[:first] + bytes(4096) + content[first + 4096 :])
        assert is_noticed(path), first


def test_opening__reads_no_field(copied):
    """A damaged field is noticed when it is read, by any program."""
    _, _, path = copied
    with_flipped_bit(path, "pressure")
    ds = rv.open_result(path)
    assert float(ds.force[-1]) == pytest.approx(5e-3)
    with pytest.raises(DamagedError) as failure:
        ds.pressure.load()
    assert failure.value.key == str(path)
    with xr.open_dataset(path) as plain, pytest.raises((RuntimeError, OSError)):
        plain.pressure.load()
    with pytest.raises(DamagedError):
        rv.open_results(path.parent).pressure.compute(scheduler="sync")


DAMAGE = {
    "truncated": lambda path: os.truncate(path, path.stat().st_size // 2),
    "empty": lambda path: os.truncate(path, 0),
    "no HDF5": lambda path: path.write_text("force [N]\n1\n"),
    "wrong bit": lambda path: with_flipped_bit(path, "force"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_run__sets_a_damaged_result_aside_and_computes_it_again(copied, sample, damage, invoke, caplog):
    study, _, path = copied
    DAMAGE[damage](path)
    content = path.read_bytes()
    assert invoke("run", study, "--out", path.parent, "-q", "--no-plots")[0] == 0
    warnings = [one.getMessage() for one in caplog.records if one.levelname == "WARNING"]
    assert sum(one.startswith(f"{path}: is damaged") for one in warnings) == 1
    assert sum("damaged" in one for one in warnings) == 1
    assert path.with_name(f"{path.name}.damaged").read_bytes() == content
    again, first = (with_steps(rv.open_result(one)) for one in (path, sample[1]))
    xr.testing.assert_equal(again, first)


def test_sweep__computes_a_damaged_result_again(tmp_path):
    (tmp_path / "ball.toml").write_text(TWO_LOADS)
    cases = read_cases(tmp_path / "ball.toml")
    first = rv.sweep(cases, tmp_path / "out", workers=0, progress=False).load()
    path = tmp_path / "out" / f"{cases[1].key}.nc"
    with_flipped_bit(path, "force")
    again = rv.sweep(cases, tmp_path / "out", workers=0, progress=False)
    xr.testing.assert_equal(again, first)
    assert [one.name for one in path.parent.glob("*.damaged")] == [f"{path.name}.damaged"]


def later(path):
    with netCDF4.Dataset(path, "a") as file:
        file.result_format = np.int64(2)


def folder(path):
    path.unlink()
    path.mkdir()


def pipe(path):
    path.unlink()
    os.mkfifo(path)


def of_another_case(path):
    with netCDF4.Dataset(path, "a") as file:
        file.case_key = "0" * 16


def weather(path):
    xr.Dataset({"temperature": ("time", [1.0])}).to_netcdf(path)


@pytest.mark.parametrize("change", [later, folder, pipe, of_another_case, weather])
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="files of POSIX")
def test_run__refuses_what_is_not_damaged_and_leaves_it(copied, change, invoke):
    study, case, path = copied
    change(path)
    before = path.lstat()
    status, _, err = invoke("run", study, "--out", path.parent, "-q", "--no-plots")
    with pytest.raises(InputError) as caught:
        run_case(case, path.parent)
    assert not isinstance(caught.value, DamagedError)
    if change is not of_another_case:
        with refused(str(path)):
            rv.open_result(path)
    assert (status, str(path) in err, "Traceback" in err) == (2, True, False)
    assert sorted(one.name for one in path.parent.iterdir()) == [path.name]
    assert (path.lstat().st_ino, path.lstat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)


@pytest.mark.parametrize("change", [later, pipe])
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="files of POSIX")
def test_sweep__names_it_and_leaves_it(copied, change, invoke):
    study, case, path = copied
    study.write_text(TWO_LOADS)
    assert case.key in [one.key for one in read_cases(study)]
    change(path)
    before = path.lstat()
    status, _, err = invoke("run", study, "--out", path.parent, "-q", "--workers", "0")
    assert (status, str(path) in err) == (1, True)
    assert (path.lstat().st_ino, path.lstat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    assert len(list(path.parent.glob("*.nc*"))) == 2, "the other case is computed"


def test_verify__names_what_is_damaged_and_changes_nothing(copied, sample, invoke):
    _, _, path = copied
    shutil.copy(path, path.with_name("a.nc"))
    with rv.open_result(path) as ds:  # many blocks of rows, of which the last one is damaged
        rows = xr.concat([ds] * 14, "time", data_vars="minimal").assign_coords(time=np.arange(14.0 * ds.sizes["time"]))
        write_result(rows, path.with_name("b.nc"))
    path.unlink()
    out = path.parent
    with_flipped_bit(out / "b.nc", "pressure", -1)
    assert {one.name: bool(flaw) for one, flaw in verify(out).items()} == {"a.nc": False, "b.nc": True}
    content = (out / "b.nc").read_bytes()
    status, said, err = invoke("verify", out)
    assert status == 1
    assert said == "1 of 2 files intact\n"
    assert str(out / "b.nc") in err
    assert (out / "b.nc").read_bytes() == content
    (out / "b.nc").unlink()
    assert invoke("verify", out)[0] == 0
    shutil.rmtree(out)
    assert invoke("verify", out)[0] == 2


def test_picture__is_not_a_damaged_result(tmp_path):
    path = tmp_path / "maps.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    with pytest.raises(InputError) as error:
        open_result(path)
    assert not isinstance(error.value, DamagedError)
    assert (error.value.key, error.value.found) == (str(path), "is not a NetCDF file")
    study = path.rename(tmp_path / "contact.toml")
    with pytest.raises(InputError) as error:
        open_result(study)
    assert (error.value.key, error.value.found) == (str(study), "is a study")
