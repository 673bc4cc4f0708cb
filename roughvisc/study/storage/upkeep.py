"""Upkeep of a folder of results: verification of files, and removal of leftovers of killed runs."""

from __future__ import annotations

import re
import shutil
import time
from contextlib import suppress
from dataclasses import dataclass
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

_OF_A_CASE = re.compile(r"\.([0-9a-f]{16})\.(lock|unfinished|(failed\.)?[0-9a-f]{8}\.part(\.\w+)?)")
_PART = re.compile(r"\..+\.[0-9a-f]{8}\.part(\.\w+)?")
#: Age of an incomplete file that belongs to no case, above which the file counts as a leftover. [s]
_ABANDONED = 3600.0


@dataclass(frozen=True)
class Verdict:
    """Integrity of one file.

    Attributes
    ----------
    path : Path
        The file.
    flaw : str
        Description of the damage; empty for an undamaged file.
    has_checksums : bool
        Whether all arrays of the file have checksums. Files of other programs may lack checksums.
    """

    path: Path
    flaw: str
    has_checksums: bool


def verify(place: str | Path) -> list[Verdict]:
    """Read results to their last byte and compare every block with its checksum.

    Parameters
    ----------
    place : path
        A result, or a folder of results.

    Returns
    -------
    list of Verdict
        One per file, sorted by name.

    Raises
    ------
    InputError
        If there are no results.
    """
    place = Path(place)
    if not place.exists():
        raise InputError(f"{place}: does not exist: expected a result, or a folder of results")
    return [_verdict(path) for path in results_at(place)]


def _verdict(path: Path) -> Verdict:
    """Return the verdict on a result, after reading all its variables with the library alone."""
    try:
        require_file(path)
        checked = True
        with NETCDF, netCDF4.Dataset(path) as file:
            for group in (file, *file.groups.values()):
                for variable in group.variables.values():
                    checked &= not variable.ndim or bool((variable.filters() or {}).get("fletcher32"))
                    for first in range(0, len(variable), 16) if variable.ndim else ():
                        variable[first : first + 16]
    except InputError as error:
        return Verdict(path, str(error), False)
    except ERRORS as error:
        return Verdict(path, f"{path}: is damaged: {error}", False)
    return Verdict(path, "", checked)


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
    unused = []
    for path in sorted(folder.glob(".*")):
        if matched := _OF_A_CASE.fullmatch(path.name):
            of_cases.setdefault(matched[1], []).append(path)
        elif _PART.fullmatch(path.name):
            with suppress(OSError):  # removed in the meantime
                unused += [path] if time.time() - path.lstat().st_mtime > _ABANDONED else []
    if everything:
        unused += [*sorted(folder.glob("*.nc.damaged")), *sorted(folder.glob("*.failed.json"))]
    removed = [path for path in unused if _remove(path)]
    for key, paths in of_cases.items():
        checkpoint, lock = checkpoint_path(folder, key), lock_path(folder, key)
        if (checkpoint / STATE).exists() and not everything:
            try:
                open_result(result_path(folder, key)).close()
            except InputError:  # the case is not finished
                paths = [path for path in paths if path != checkpoint]
        if paths:
            with suppress(OSError), lock_case(lock, patience=0.0):
                removed += [path for path in paths if path == lock or _remove(path)]
    return removed


def _remove(path: Path) -> bool:
    """Remove a file or folder; return whether that was possible."""
    with suppress(OSError):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()
        return True
    return False
