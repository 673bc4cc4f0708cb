"""Files and options of ``roughvisc trade``."""

from __future__ import annotations

import logging
import math
import os
from collections.abc import Iterable
from pathlib import Path

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.study.execution.run import result_folder
from roughvisc.study.statement.case import Case
from roughvisc.study.trade.recommend import require_same
from roughvisc.units import quantity

log = logging.getLogger("roughvisc")


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
    with xr.open_dataset(path, engine="netcdf4", decode_timedelta=False) as file:
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


def budgets_in(folder: Path, names: Iterable[str], case: Case) -> list[xr.Dataset]:
    """Budgets of a case that ``roughvisc budget`` has left in a folder; one of another scene is left out, and told."""
    found = []
    for path in (folder / f"budget-{name}.nc" for name in names):
        if not path.is_file():
            continue
        try:
            one = _read(path)
            require_same(one, case)
        except (OSError, ValueError, RuntimeError) as error:  # an InputError is a ValueError
            log.warning("%s: does not count: %s", path, error)
        else:
            found.append(one)
    return found


def is_trade(path: str | Path) -> bool:
    """Whether a file is one that ``roughvisc trade`` wrote, as far as its variables tell."""
    try:
        with xr.open_dataset(path, engine="netcdf4", decode_timedelta=False) as file:
            return _holds_a_trade(file)
    except (OSError, ValueError, RuntimeError):
        return False


def part_of_one(text: str, name: str) -> float:
    """A part of one from ``1%``, ``0.1 %`` or ``0.01``.

    Examples
    --------
    >>> part_of_one("1%", "--apply"), part_of_one("0.02", "--apply")
    (0.01, 0.02)
    """
    try:
        part = quantity(text, "1")
    except InputError:
        part = math.nan
    if not 0 < part < 1:
        raise InputError(f"{name}: found {text!r}: expected a part such as 1% or 0.01, above 0 and below 1")
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
        raise InputError(f"{name}: found {text!r}: expected a time such as '5 min' or 90 (seconds), above 0")
    return time


def check_writable(path: Path) -> None:
    """Refuse, before anything is measured, a study that could not be written back."""
    if not (os.access(path, os.W_OK) and os.access(path.resolve().parent, os.W_OK)):
        raise InputError(f"{path}: is not writable: --apply needs write permission for it and its folder")
