"""Upkeep of a folder of results: verify the files, and remove what killed runs have left."""

from __future__ import annotations

import re
import shutil
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from roughvisc.errors import InputError, InUseError
from roughvisc.study.storage.files import checksum_error, is_sealed, require_folder
from roughvisc.study.storage.lock import lock_case, lock_path
from roughvisc.study.storage.store import NETCDF, result_path, results_at


@dataclass(frozen=True)
class Verdict:
    """What is known of one file.

    Attributes
    ----------
    path : Path
        The file.
    flaw : str
        What is wrong with it; empty if nothing was found.
    sealed : bool
        Whether it states a checksum. One that does not, of an earlier version or changed by another program, was read
        to its end all the same.
    """

    path: Path
    flaw: str
    sealed: bool


def verify(place: str | Path) -> list[Verdict]:
    """Read results to their last byte and hold them against their checksums.

    Parameters
    ----------
    place : path
        A result, or a folder of them.

    Returns
    -------
    list of Verdict
        One a file, in order of their names.

    Raises
    ------
    InputError
        If there is nothing to read.
    """
    place = Path(place)
    if not place.exists():
        raise InputError(f"{place}: does not exist: expected a result, or a folder of results")
    return [_verdict(path) for path in results_at(place)]


def _verdict(path: Path) -> Verdict:
    try:
        found = checksum_error(path, again=True)
        return Verdict(path, found or _unreadable(path), is_sealed(path))
    except OSError as error:
        return Verdict(path, f"it cannot be read: {error.strerror or error}", False)


def _unreadable(path: Path) -> str:
    """What the library cannot read of a file; empty if nothing."""
    import netCDF4

    try:
        with NETCDF, netCDF4.Dataset(path) as file:
            for group in (file, *file.groups.values()):
                for variable in group.variables.values():
                    for first in range(0, len(variable), 16) if variable.ndim else ():
                        variable[first : first + 16]
    except (OSError, RuntimeError, LookupError, AttributeError, ValueError) as error:
        return f"it cannot be read: {error}"
    return ""


_OF_A_CASE = re.compile(r"\.([0-9a-f]{16})\.(lock|unfinished|(failed\.)?[0-9a-f]{8}\.part(\.\w+)?)")
_PART = re.compile(r"\..+\.[0-9a-f]{8}\.part(\.\w+)?")
#: A file that nobody has written to for so long, and that no lock tells of, is not being written. [s]
_ABANDONED = 3600.0


def clean_folder(folder: str | Path, *, everything: bool = False) -> list[Path]:
    """Remove incomplete files, locks of dead runs, and checkpoints of finished cases.

    Parameters
    ----------
    folder : path
        Of results. A case that a run is at work on is left alone. Of a link the link itself is removed at most, never
        what it leads to.
    everything : bool
        Also remove the checkpoints of unfinished cases, which then begin again, damaged results that were set aside,
        and records of failures.

    Returns
    -------
    list of Path
        What was removed.

    Raises
    ------
    InputError
        If there is no such folder.
    """
    folder = Path(folder)
    require_folder(folder)
    of_cases: dict[str, list[Path]] = {}
    others = []
    for path in sorted(folder.glob(".*")):
        if matched := _OF_A_CASE.fullmatch(path.name):
            of_cases.setdefault(matched[1], []).append(path)
        elif _PART.fullmatch(path.name) and _is_abandoned(path):
            others.append(path)
    if everything:
        others += [*sorted(folder.glob("*.nc.damaged")), *sorted(folder.glob("*.failed.json"))]
    removed = [one for key, paths in of_cases.items() for one in _of_case(folder, key, paths, everything)]
    return removed + [path for path in others if _removed(path)]


def _is_abandoned(path: Path) -> bool:
    try:
        return time.time() - path.lstat().st_mtime > _ABANDONED
    except OSError:  # gone meanwhile
        return False


def _of_case(folder: Path, key: str, paths: list[Path], everything: bool) -> list[Path]:
    """Remove what no run of one case can use, while its lock is held."""
    lock, result = lock_path(folder, key), result_path(folder, key)
    if lock.is_symlink():  # nobody's lock
        return [path for path in [lock] if _removed(path)]
    finished = everything or (result.exists() and not checksum_error(result))
    needed = [
        path
        for path in paths
        if path.suffix == ".unfinished" and not path.is_symlink() and any(path.glob("checkpoint.*")) and not finished
    ]
    if needed == paths:
        return []
    with suppress(InUseError, OSError), lock_case(lock, patience=0.0):
        return [path for path in paths if path not in needed and (path == lock or _removed(path))]
    return []


def _removed(path: Path) -> bool:
    with suppress(OSError):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()
        return True
    return False
