"""Upkeep of a folder of results: what is whole, which version computed what, what killed runs have left."""

from __future__ import annotations

import re
import shutil
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from roughvisc.errors import InputError, InUseError
from roughvisc.study.statement.case import Case
from roughvisc.study.statement.identity import NUMERICS_REVISION, program_version
from roughvisc.study.storage.checkpoint import checkpoint_version
from roughvisc.study.storage.files import checksum_error, is_sealed, require_folder
from roughvisc.study.storage.index import Entry, Index, index_of
from roughvisc.study.storage.lock import lock_case, lock_path
from roughvisc.study.storage.store import NETCDF, result_path, results_at
from roughvisc.variables import RESULT_FORMAT


def version_of(attributes: Mapping[Any, Any]) -> str:
    """Version that computed a result, by its attributes.

    Examples
    --------
    >>> version_of({"source": "roughvisc 0.1", "numerics_revision": 15})
    'roughvisc 0.1 (numerics 15)'
    >>> version_of({"source": "roughvisc 0.1"})
    'roughvisc 0.1 (numerics not stated)'
    """
    revision = attributes.get("numerics_revision", "not stated")
    return f"{attributes.get('source', 'an unknown program')} (numerics {revision})"


def counted_versions(entries: Iterable[Entry]) -> str:
    """How many results which versions computed, in words."""
    counts = Counter(version_of(entry.attributes) for entry in entries)
    return ", ".join(f"{count} by {version}" for version, count in counts.items())


def superseded_results(entries: Iterable[Entry]) -> dict[str, str]:
    """Results of another revision of the numerics, which no case of today finds.

    Returns
    -------
    dict
        Key of the result -> key that its case has today.
    """
    found = {}
    for entry in entries:
        if entry.attributes.get("numerics_revision") != NUMERICS_REVISION and (key := _key_today(entry)) != entry.key:
            found[entry.key] = key
    return found


def _key_today(entry: Entry) -> str:
    """Key that the case of a result has in this version; empty where that cannot be told, as its scan is gone."""
    try:
        return Case.from_json(str(entry.attributes["case"])).key
    except InputError:
        return "" if "numerics_revision" in entry.attributes else entry.key


def checkpoints(folder: Path) -> dict[Path, tuple[int, int]]:
    """Folders of unfinished runs whose checkpoints nothing in this version goes on from: their numerics and format."""
    found = {place: checkpoint_version(place) for place in sorted(folder.glob(".*.unfinished"))}
    return {place: version for place, version in found.items() if version is not None and version != _today()}


def _today() -> tuple[int, int]:
    return NUMERICS_REVISION, RESULT_FORMAT


def upgrade_note(folder: Path, cases: Sequence[Case], index: Index | None = None) -> str:
    """What to say before some cases are computed that another version has computed in the same folder.

    Parameters
    ----------
    folder : Path
        Of the results; it need not exist.
    cases : sequence of Case
        Those that are to be computed if they are not finished.
    index : Index, optional
        Of the folder, if that is known.

    Returns
    -------
    str
        Empty if there is nothing to say.
    """
    if not folder.is_dir():
        return ""
    index = index or index_of(folder, warn=False)
    todo = {case.key: case for case in cases if case.key not in index.entries}
    if not todo:
        return ""
    surfaces = {case.surface_sha256 for case in todo.values()}
    # a recipe may have come by more keys since, and another checksum with them
    alike = [
        entry
        for entry in index.entries.values()
        if entry.attributes.get("surface_sha256") in surfaces or "recipe" in entry.attributes
    ]
    again = [index.entries[key] for key, today in superseded_results(alike).items() if today in todo]
    left = checkpoints(folder)
    told = []
    if again:
        results, cases_told = (
            ("1 result here is", "its case is")
            if len(again) == 1
            else (f"{len(again)} results here are", "their cases are")
        )
        told.append(
            f"{results} of another version ({counted_versions(again)}); this is {program_version()}, whose numerics "
            f"may give other numbers: {cases_told} computed again, and the old files are kept"
        )
    if left:
        runs = "1 unfinished run" if len(left) == 1 else f"{len(left)} unfinished runs"
        revisions = ", ".join(map(str, sorted({revision for revision, _ in left.values()})))
        told.append(f"the checkpoints of {runs} are of numerics {revisions}: nothing goes on from them here")
    return f"{folder}: {'; '.join(told)} (roughvisc clean {folder} says more)" if told else ""


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
    former = [place for place, version in checkpoints(folder).items() if version < _today()] if outdated else []
    removed = [one for key, paths in of_cases.items() for one in _of_case(folder, key, paths, everything, former)]
    removed += [path for path in others if _removed(path)]
    if superseded:
        entries = index_of(folder, warn=False).entries
        again = [key for key, today in superseded_results(entries.values()).items() if today in entries]
        removed += [path for key in again if (path := _result_of(folder, key))]
    return removed


def _result_of(folder: Path, key: str) -> Path | None:
    """Remove the result of a case, unless a run is at work on it; its path if it is gone."""
    with suppress(InUseError, OSError), lock_case(lock_path(folder, key), patience=0.0):
        path = result_path(folder, key)
        return path if _removed(path) else None
    return None


def kept_of_other_versions(folder: Path) -> list[str]:
    """What a folder holds of other versions of roughvisc, a line each kind."""
    entries = index_of(folder, warn=False).entries
    former = superseded_results(entries.values())
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
    return told + [
        f"{place.name}: a checkpoint of a later version (numerics {version[0]})"
        for place, version in checkpoints(folder).items()
        if version > _today()
    ]


def _is_abandoned(path: Path) -> bool:
    try:
        return time.time() - path.lstat().st_mtime > _ABANDONED
    except OSError:  # gone meanwhile
        return False


def _of_case(folder: Path, key: str, paths: list[Path], everything: bool, outdated: list[Path]) -> list[Path]:
    """Remove what is of no use of one case, while its lock is held; with it checkpoints that are outdated."""
    lock, result = lock_path(folder, key), result_path(folder, key)
    if lock.is_symlink():  # nobody's lock
        return [path for path in [lock] if _removed(path)]
    finished = everything or (result.exists() and not checksum_error(result))
    needed = [
        path
        for path in paths
        if path.suffix == ".unfinished"
        and not path.is_symlink()
        and any(path.glob("checkpoint.*"))
        and not finished
        and path not in outdated
    ]
    if needed == paths:
        return []
    with suppress(InUseError, OSError), lock_case(lock, patience=0.0):
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
