"""Which version computed what in a folder of results, and what an upgrade leaves behind there.

The key of a case counts the revision of the numerics. So a result of an earlier revision stays under its own key, and
no case of today finds it; nor does any go on from a checkpoint of that revision.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from roughvisc.errors import InputError
from roughvisc.study.statement.case import Case
from roughvisc.study.statement.identity import NUMERICS_REVISION, program_version
from roughvisc.study.storage.checkpoint import checkpoint_version
from roughvisc.study.storage.index import Entry, Index, index_of
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


def outdated(entries: Iterable[Entry]) -> dict[str, str]:
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


def checkpoints(folder: Path) -> dict[Path, int]:
    """Folders of unfinished runs whose checkpoints nothing in this version goes on from, and the numerics of each."""
    today = NUMERICS_REVISION, RESULT_FORMAT
    found = {place: checkpoint_version(place) for place in sorted(folder.glob(".*.unfinished"))}
    return {place: version[0] for place, version in found.items() if version is not None and version != today}


def is_later(place: Path) -> bool:
    """Whether the checkpoint of an unfinished run is of a later version than this one, which will go on from it."""
    version = checkpoint_version(place)
    return version is not None and version > (NUMERICS_REVISION, RESULT_FORMAT)


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
    if index is None:
        index = index_of(folder, warn=False) if folder.is_dir() else Index({})
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
    again = [index.entries[key] for key, today in outdated(alike).items() if today in todo]
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
        revisions = ", ".join(map(str, sorted(set(left.values()))))
        told.append(f"the checkpoints of {runs} are of numerics {revisions}: nothing goes on from them here")
    return f"{folder}: {'; '.join(told)} (roughvisc clean {folder} says more)" if told else ""
