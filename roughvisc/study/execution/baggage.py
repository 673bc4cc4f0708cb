"""Input files of cases, copied to where every Dask worker can read them."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from pathlib import Path
from typing import Any

from roughvisc.errors import ChangedError, InputError
from roughvisc.study.statement.case import Case
from roughvisc.study.storage.links import refuse_link
from roughvisc.study.storage.store import atomic_write
from roughvisc.topography.cards import read_toml
from roughvisc.topography.readers import sha256

#: Folder of the copies, in that of the results.
INPUTS = "inputs"


def serialize_with_inputs(case: Case, folder: Path) -> str:
    """JSON of a case whose files are copies in a folder; its key is the same, since files count by their content.

    Parameters
    ----------
    case : Case
        What to compute.
    folder : Path
        Where the copies go, each in a folder of its own named by its content; made if need be.
    """
    stated = json.loads(case.to_json())
    for table in ("surface", "material"):
        if table in stated:
            stated[table] = _moved(stated[table], folder)
    return json.dumps(stated)


def _moved(stated: Any, folder: Path) -> Any:
    if isinstance(stated, list):
        return [_moved(entry, folder) for entry in stated]
    if not isinstance(stated, dict):
        return stated
    return {
        key: str(_copy(Path(value), folder)) if key == "file" and isinstance(value, str) else _moved(value, folder)
        for key, value in stated.items()
    }


def _copy(path: Path, folder: Path) -> Path:
    """Copy of a file, and of the scan that it names if it is a card, as they lie to each other."""
    path = path.absolute()
    named = _named_by(path)
    files = [path] if named is None else [path, Path(os.path.normpath(path.parent / named))]
    root = Path(os.path.commonpath([file.parent for file in files]))
    digests = {file.relative_to(root): sha256(file) for file in files}
    whole = "".join(f"{place}\0{digest}\0" for place, digest in digests.items())
    there = folder / hashlib.sha256(whole.encode()).hexdigest()[:16]
    for place, digest in digests.items():
        copy = there / place
        for above in (folder, *(one for one in reversed(copy.parents) if folder in one.parents)):
            refuse_link(above, "a folder of copied inputs")
        if not copy.is_file() or sha256(copy) != digest:
            with atomic_write(copy) as temporary:
                shutil.copyfile(root / place, temporary)
                if sha256(temporary) != digest:
                    raise ChangedError(f"{root / place}: was changed while it was copied: run the study again")
    return there / path.relative_to(root)


def _named_by(path: Path) -> str | None:
    """Relative path of the scan that a surface card names."""
    if path.suffix.lower() != ".toml":
        return None
    try:
        named = read_toml(path, "a surface card in TOML").get("file")
    except InputError:
        return None  # it is refused where it is opened
    return named if isinstance(named, str) and not Path(named).is_absolute() else None
