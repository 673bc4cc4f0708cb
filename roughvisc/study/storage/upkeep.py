"""Upkeep of a folder of results: verification of files, and removal of leftovers of killed runs."""

from __future__ import annotations

import re
import shutil
import time
from contextlib import suppress
from pathlib import Path

import netCDF4

from roughvisc.errors import InputError
from roughvisc.study.storage.checkpoint import STATE
from roughvisc.study.storage.folder import (
    checkpoint_path,
    lock_case,
    lock_path,
    require_file,
    require_folder,
    result_path,
    results_at,
)
from roughvisc.study.storage.netcdf import ERRORS, NETCDF, open_result

#: Hidden files of a case: its lock, its checkpoint, and incomplete files.
_OF_A_CASE = re.compile(r"\.([0-9a-f]{16})\.")
#: Age of an incomplete file that belongs to no case, above which the file counts as a leftover. [s]
_ABANDONED = 3600.0


def verify(place: str | Path) -> dict[Path, str]:
    """Read results to their last byte and compare every block with its checksum.

    Parameters
    ----------
    place : path
        A result, or a folder of results.

    Returns
    -------
    dict
        File -> description of its damage, which is empty for an undamaged file; sorted by name.

    Raises
    ------
    InputError
        If there are no results.
    """
    place, flaws = Path(place), {}
    if not place.exists():
        raise InputError(f"{place}: does not exist: expected a result, or a folder of results")
    for path in results_at(place):
        flaws[path] = ""
        try:
            require_file(path)
            with NETCDF, netCDF4.Dataset(path) as file:
                for group in (file, *file.groups.values()):
                    for variable in group.variables.values():
                        for first in range(0, len(variable), 16) if variable.ndim else ():
                            variable[first : first + 16]
        except InputError as error:
            flaws[path] = str(error)
        except ERRORS as error:
            flaws[path] = f"{path}: is damaged: {error}"
    return flaws


def clean_folder(folder: str | Path, *, everything: bool = False) -> list[Path]:
    """Remove incomplete files, locks of dead runs, and checkpoints of finished cases.

    Parameters
    ----------
    folder : path
        Results folder. Files of running cases are kept.
    everything : bool
        Also remove renamed damaged results, records of failures, and the checkpoints of unfinished cases, which then
        start again.

    Returns
    -------
    list of Path
        Removed files and folders.

    Raises
    ------
    InputError
        If the folder does not exist.
    """
    folder = Path(folder)
    require_folder(folder)
    of_cases: dict[str, list[Path]] = {}
    removed: list[Path] = []

    def remove(path: Path) -> None:
        with suppress(OSError):  # removed in the meantime, or the folder is not writable
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink()
            removed.append(path)

    for path in sorted(folder.iterdir()):
        if matched := _OF_A_CASE.match(path.name):
            of_cases.setdefault(matched[1], []).append(path)
        elif path.match(".*.part*"):
            with suppress(OSError):
                if time.time() - path.lstat().st_mtime > _ABANDONED:
                    remove(path)
        elif everything and (path.match("*.nc.damaged") or path.match("*.failed.json")):
            remove(path)
    for key, paths in of_cases.items():
        checkpoint, lock = checkpoint_path(folder, key), lock_path(folder, key)
        if (checkpoint / STATE).exists() and not everything:
            try:
                open_result(result_path(folder, key)).close()
            except InputError:  # the case is not finished
                paths.remove(checkpoint)
        if paths:
            with suppress(OSError), lock_case(lock, patience=0.0):
                for path in paths:
                    remove(path) if path != lock else removed.append(lock)
    return removed
