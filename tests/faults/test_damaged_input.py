"""Damaged studies, tables and scans: refused in one sentence, or read; nothing else, and in time."""

import contextlib
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from damage import attempt, damaged_bytes, damaged_study
from scan_files import write_sdf, write_x3p
from support import BALL, ROUGH

import roughvisc as rv
from roughvisc.study.execution.run import compute
from roughvisc.study.statement.case import read_cases
from roughvisc.tables import Wanted, read_table

#: How many of each the small suite takes, and the large.
STUDIES, SCANS, TABLES = (60, 2500), (60, 800), (60, 500)
_PATIENCE = 20.0
#: Cells beyond which a surface is made and not pressed.
_LARGE = 20_000
_SWEEP = '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'
TEXTS = (BALL.replace("[24, 21]", "[12, 9]"), BALL.replace("[24, 21]", "[12, 9]") + _SWEEP, ROUGH)


def amounts(pair):
    return [pair[0], pytest.param(pair[1], marks=pytest.mark.long)]


class Enough(Exception):
    """A run has come as far as this test asks for."""


def begin(path):
    """Read a study and take some steps of its first two cases."""
    steps = []

    def reached(now, end):
        steps.append(now)
        if len(steps) > 20:
            raise Enough

    for case in read_cases(path)[:2]:
        if case.height().size > _LARGE:  # takes its time
            continue
        with contextlib.suppress(Enough):
            compute(case, progress=reached)
    return steps


def assert_some_of_each(found, part):
    """Damage that is always refused, or never, tests little."""
    refused = sum(one is None for one in found)
    assert part * len(found) < refused < (1 - part) * len(found)


@pytest.mark.parametrize("count", amounts(STUDIES))
def test_studies(tmp_path, count):
    rng, found = np.random.default_rng(17), []
    path = tmp_path / "study.toml"
    for number in range(count):
        text = damaged_study(rng, TEXTS[rng.integers(len(TEXTS))])
        path.write_text(text, errors="replace")
        read, message = attempt(lambda: begin(path), _PATIENCE, f"study {number}:\n{text}\n")
        assert read is not None or 0 < len(message) < 4000
        found.append(read)
    assert_some_of_each(found, 0.1)


@pytest.fixture
def scans(tmp_path):
    """A scan in each of some formats, and how it is opened."""
    heights = np.add.outer(1e-6 * np.arange(12.0), 1e-7 * np.arange(9.0) ** 2)
    np.save(tmp_path / "a.npy", heights)
    rv.save_scan(rv.from_array(heights, 1e-6), tmp_path / "a.nc")
    np.savetxt(tmp_path / "a.csv", heights * 1e6, delimiter=";")
    plain = {"unit": "um", "spacing": 1e-6}
    return [
        (tmp_path / "a.npy", plain),
        (tmp_path / "a.csv", plain),
        (tmp_path / "a.nc", {}),
        (write_x3p(tmp_path / "a.x3p"), {}),
        (write_sdf(tmp_path / "a.sdf"), {}),
    ]


@pytest.mark.parametrize("count", amounts(SCANS))
def test_scans(scans, count):
    rng, found = np.random.default_rng(18), []
    whole = {path: path.read_bytes() for path, _ in scans}
    for number in range(count):
        path, options = scans[number % len(scans)]
        path.write_bytes(damaged_bytes(rng, whole[path]))
        read, message = attempt(partial(rv.open_scan, path, **options), _PATIENCE, f"scan {number}, {path.name}")
        if read is None:
            assert path.name in message
        else:
            assert read.dims == ("x", "y")
            assert np.isfinite(read.values).any()
        found.append(read)
    assert_some_of_each(found, 0.05)


@pytest.mark.parametrize("count", amounts(SCANS))
def test_scans__of_classic_netcdf(tmp_path, count):
    """In a process of their own: netCDF's library does not survive every one of them."""
    script, seed = Path(__file__).with_name("opening.py"), "21"
    heights = rv.from_array(np.add.outer(1e-6 * np.arange(12.0), 1e-7 * np.arange(9.0) ** 2), 1e-6)
    paths = [tmp_path / f"{version}.nc" for version in ("NETCDF3_CLASSIC", "NETCDF3_64BIT")]
    for path in paths:
        heights.to_netcdf(path, engine="netcdf4", format=path.stem)
        xr.testing.assert_allclose(rv.open_scan(path), heights)
    done = subprocess.run([sys.executable, script, str(count), seed, *paths], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for line in done.stdout.splitlines():
        read, refused, grown = map(int, line.split())
        assert (read + refused, read > 0, refused > 0) == (count, True, True)
        assert grown < 1 << 26


@pytest.mark.parametrize("count", amounts(TABLES))
def test_tables(tmp_path, count):
    rng, found = np.random.default_rng(19), []
    rows = "".join(f"{0.1 * i:.3g};{np.sin(i):.6g};{i}\n" for i in range(20))
    whole = f"Time [s];Force (mN);n\n{rows}".encode()
    path = tmp_path / "table.csv"
    readers = (
        lambda: tuple(read_table(path, {"time": Wanted("time", "s"), "force": Wanted("force", "N")})[0].values()),
        lambda: tuple(
            read_table(path, {"time": Wanted("time", "s"), "load": Wanted("force", "N")}, exported=True)[0].values()
        ),
    )
    for number in range(count):
        path.write_bytes(damaged_bytes(rng, whole))
        read, message = attempt(readers[number % 2], _PATIENCE, f"table {number}: {path.read_bytes()!r}")
        if read is None:
            assert path.name in message
        else:
            assert len(read[0]) == len(read[1])
            assert np.isfinite(read).all()
        found.append(read)
    assert_some_of_each(found, 0.05)
