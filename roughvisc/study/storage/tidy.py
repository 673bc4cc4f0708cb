"""What runs that were killed have left in a folder of results."""

from __future__ import annotations

import re
import shutil
import time
from contextlib import suppress
from pathlib import Path

from roughvisc.errors import InputError, InUseError
from roughvisc.study.storage.index import index_of
from roughvisc.study.storage.lock import held, lock_path
from roughvisc.study.storage.seal import checksum_error
from roughvisc.study.storage.store import result_path
from roughvisc.study.storage.versions import checkpoints, counted_versions, is_later
from roughvisc.study.storage.versions import outdated as former_results

_OF_A_CASE = re.compile(r"\.([0-9a-f]{16})\.(lock|unfinished|(failed\.)?[0-9a-f]{8}\.part(\.\w+)?)")
_PART = re.compile(r"\..+\.[0-9a-f]{8}\.part(\.\w+)?")
#: A file that nobody has written to for so long, and that no lock tells of, is not being written. [s]
_ABANDONED = 3600.0


def clean_folder(
    folder: str | Path, *, everything: bool = False, outdated: bool = False, superseded: bool = False
) -> list[Path]:
    """Remove what is of no use to anybody: torn files, locks of dead runs, checkpoints of finished cases.

    Parameters
    ----------
    folder : path
        Of results. A case that a run is at work on is left alone. Of a link the link itself is removed at most, never
        what it leads to.
    everything : bool
        Also remove the checkpoints of unfinished cases, which then begin again, damaged results that were set aside,
        and records of failures.
    outdated : bool
        Also remove the checkpoints of earlier versions, from which nothing in this one goes on. Those of later ones
        stay, and so do they all where a sweep tidies up: somebody may go back to the version that wrote them.
    superseded : bool
        Also remove results of other revisions of the numerics whose cases this one has computed again.

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
    removed = [one for key, paths in of_cases.items() for one in _of_case(folder, key, paths, everything, outdated)]
    removed += [path for path in others if _removed(path)]
    if superseded:
        entries = index_of(folder, warn=False).entries
        again = [key for key, today in former_results(entries.values()).items() if today in entries]
        removed += [path for key in again if (path := _result_of(folder, key))]
    return removed


def _result_of(folder: Path, key: str) -> Path | None:
    """Remove the result of a case, unless a run is at work on it; its path if it is gone."""
    with suppress(InUseError, OSError), held(lock_path(folder, key), patience=0.0):
        path = result_path(folder, key)
        return path if _removed(path) else None
    return None


def kept_of_other_versions(folder: Path) -> list[str]:
    """What a folder holds of other versions of roughvisc, a line each kind."""
    entries = index_of(folder, warn=False).entries
    former = former_results(entries.values())
    again = [entries[key] for key, today in former.items() if today in entries]
    alone = [entries[key] for key, today in former.items() if today not in entries]
    told = []
    for found, what in (
        (again, "computed again by this version; --superseded removes them"),
        (alone, "not computed by this version, which would compute their cases again"),
    ):
        if found:
            size = f"{sum(entry.stamp[0] for entry in found) / 1e6:.3g} MB"
            results = "1 result" if len(found) == 1 else f"{len(found)} results"
            told.append(f"{results} ({counted_versions(found)}), {size}: {what}")
    later = [place for place in checkpoints(folder) if is_later(place)]
    return told + [
        f"{place.name}: a checkpoint of a later version (numerics {checkpoints(folder)[place]})" for place in later
    ]


def _is_abandoned(path: Path) -> bool:
    try:
        return time.time() - path.lstat().st_mtime > _ABANDONED
    except OSError:  # gone meanwhile
        return False


def _of_case(folder: Path, key: str, paths: list[Path], everything: bool, outdated: bool) -> list[Path]:
    """Remove what is of no use of one case, while its lock is held."""
    lock, result = lock_path(folder, key), result_path(folder, key)
    if lock.is_symlink():  # nobody's lock
        return [path for path in [lock] if _removed(path)]
    former = [path for path in checkpoints(folder) if not is_later(path)] if outdated else []
    finished = everything or (result.exists() and not checksum_error(result))
    needed = [
        path
        for path in paths
        if path.suffix == ".unfinished"
        and not path.is_symlink()
        and any(path.glob("checkpoint.*"))
        and not finished
        and not (outdated and path in former)
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
