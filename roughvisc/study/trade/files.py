"""Files and options of ``roughvisc trade``."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.study.case import Case
from roughvisc.study.execution.run import result_folder
from roughvisc.study.storage.store import NETCDF


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
