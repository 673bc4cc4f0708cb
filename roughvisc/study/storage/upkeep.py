"""Upkeep of a folder of results: verify the files, and remove what killed runs have left."""

from __future__ import annotations

import re
import shutil
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from roughvisc.errors import InputError
from roughvisc.study.storage.checkpoint import STATE
from roughvisc.study.storage.files import require_file, require_folder
from roughvisc.study.storage.lock import lock_case, lock_path
from roughvisc.study.storage.store import NETCDF, open_result, require_hdf5, result_path, results_at


@dataclass(frozen=True)
class Verdict:
    """What was found in one file.

    Attributes
    ----------
    path : Path
        The file.
    flaw : str
        What is wrong with it; empty if nothing.
    has_checksums : bool
        Whether all of its arrays have checksums. Those of another program may have none.
    """

    path: Path
    flaw: str
    has_checksums: bool


def verify(place: str | Path) -> list[Verdict]:
    """Read results to their last byte and compare every block with its checksum.

    Parameters
    ----------
    place : path
        A result, or a folder of them.

    Returns
    -------
    list of Verdict
        One per file, sorted by name.

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
    """Open a result as any other program does, and read all variables."""
    import netCDF4

    try:
        require_file(path)
        require_hdf5(path)
        checked = True
        with NETCDF, netCDF4.Dataset(path) as file:
            for group in (file, *file.groups.values()):
                for variable in group.variables.values():
                    checked &= not variable.ndim or bool((variable.filters() or {}).get("fletcher32"))
                    for first in range(0, len(variable), 16) if variable.ndim else ():
                        variable[first : first + 16]
    except InputError as error:
        return Verdict(path, str(error), False)
    except (OSError, RuntimeError, LookupError, AttributeError, ValueError) as error:
        return Verdict(path, f"{path}: is damaged: {error}", False)
    return Verdict(path, "", checked)


def _opens(path: Path) -> bool:
    """Return whether a file is a result, as far as opening it shows."""
    try:
        open_result(path).close()
    except InputError:
        return False
    return True


_OF_A_CASE = re.compile(r"\.([0-9a-f]{16})\.(lock|unfinished|(failed\.)?[0-9a-f]{8}\.part(\.\w+)?)")
_PART = re.compile(r"\..+\.[0-9a-f]{8}\.part(\.\w+)?")
#: A file that nobody has written to for so long, and that no lock tells of, is not being written. [s]
_ABANDONED = 3600.0


def clean_folder(folder: str | Path, *, everything: bool = False) -> list[Path]:
    """Remove incomplete files, locks of dead runs, and checkpoints of finished cases.

    Parameters
    ----------
    folder : path
        Of results. A case that a run is at work on is left alone.
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
    finished = everything or _opens(result)
    needed = [path for path in paths if path.suffix == ".unfinished" and (path / STATE).exists() and not finished]
    if needed == paths:
        return []
    with suppress(OSError), lock_case(lock, patience=0.0):
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
