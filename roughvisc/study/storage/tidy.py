"""What runs that were killed have left in a folder of results."""

from __future__ import annotations

import re
import shutil
import time
from contextlib import suppress
from pathlib import Path

from roughvisc.errors import InputError, InUseError
from roughvisc.study.storage.lock import held
from roughvisc.study.storage.seal import flaw
from roughvisc.study.storage.store import result_path

_OF_A_CASE = re.compile(r"\.([0-9a-f]{16})\.(lock|unfinished|(failed\.)?[0-9a-f]{8}\.part(\.\w+)?)")
_PART = re.compile(r"\..+\.[0-9a-f]{8}\.part(\.\w+)?")
#: A file that nobody has written to for so long, and that no lock tells of, is not being written. [s]
_ABANDONED = 3600.0


def tidy(folder: str | Path, *, everything: bool = False) -> list[Path]:
    """Remove what is of no use to anybody: torn files, locks of dead runs, checkpoints of finished cases.

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
    if not folder.is_dir():
        raise InputError(f"{folder}: {'is a file' if folder.exists() else 'does not exist'}: expected a results folder")
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
    """Remove what is of no use of one case, while its lock is held."""
    lock, result = folder / f".{key}.lock", result_path(folder, key)
    if lock.is_symlink():  # nobody's lock
        return [path for path in [lock] if _removed(path)]
    finished = everything or (result.exists() and not flaw(result))
    needed = [
        path
        for path in paths
        if path.suffix == ".unfinished" and not path.is_symlink() and any(path.glob("checkpoint.*")) and not finished
    ]
    if needed == paths:
        return []
    with suppress(InUseError, OSError), held(lock, patience=0.0):
        return [path for path in paths if path not in needed and _removed(path)]
    return []


def _removed(path: Path) -> bool:
    with suppress(OSError):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()
        return True
    return False
