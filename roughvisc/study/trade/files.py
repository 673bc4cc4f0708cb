"""Files and options of ``roughvisc trade``."""

from __future__ import annotations

import math
from pathlib import Path

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.study.execution.run import result_folder
from roughvisc.study.statement.case import Case
from roughvisc.study.storage.store import NETCDF
from roughvisc.units import quantity


def trade_folder(case: Case, out: str | Path | None) -> Path:
    """Folder of a study's trade: beside that of its results, which holds results alone.

    Raises
    ------
    InputError
        If nothing could be written there.
    """
    if out is not None:
        return result_folder(case, out)
    folder = result_folder(case)
    return result_folder(case, folder.with_name(f"{folder.name}-trade"))


def _read(path: str | Path) -> xr.Dataset:
    with NETCDF, xr.open_dataset(path, engine="netcdf4", decode_timedelta=False, lock=False) as file:
        return file.load()


def _holds_a_trade(dataset: xr.Dataset) -> bool:
    return "run_time" in dataset and "quantity" in dataset.dims


def open_trade(path: str | Path) -> xr.Dataset:
    """Open what ``roughvisc trade`` wrote.

    Raises
    ------
    InputError
        If the file is absent or is something else.
    """
    try:
        dataset = _read(path)
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(f"{path}: cannot be opened: {error}: expected a trade of roughvisc (.nc)") from error
    if not _holds_a_trade(dataset):
        raise InputError(f"{path}: is not a trade: expected a file that roughvisc trade wrote")
    return dataset


def is_trade(path: str | Path) -> bool:
    """Whether a file is one that ``roughvisc trade`` wrote, as far as its variables tell."""
    try:
        with NETCDF, xr.open_dataset(path, engine="netcdf4", decode_timedelta=False, lock=False) as file:
            return _holds_a_trade(file)
    except (OSError, ValueError, RuntimeError):
        return False


def part_of_one(text: str, name: str) -> float:
    """A part of one from ``1%``, ``0.1 %`` or ``0.01``.

    Examples
    --------
    >>> part_of_one("1%", "--accuracy"), part_of_one("0.02", "--accuracy")
    (0.01, 0.02)
    """
    try:
        part = quantity(text, "1")
    except InputError:
        part = math.nan
    if not 0 < part < 1:
        raise InputError(key=name, found=text, expected="a part such as 1% or 0.01, above 0 and below 1")
    return part


def seconds(text: str, name: str) -> float:
    """A length of time from ``5 min``, ``90 s`` or a number of seconds. [s]

    Examples
    --------
    >>> seconds("5 min", "--budget"), seconds("90", "--budget")
    (300.0, 90.0)
    """
    try:
        time = quantity(float(text) if text.strip().replace(".", "", 1).isdecimal() else text, "s")
    except InputError:
        time = math.nan
    if not 0 < time < math.inf:
        raise InputError(key=name, found=text, expected="a time such as '5 min' or 90 (seconds), above 0")
    return time
