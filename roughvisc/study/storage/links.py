"""Links in a results folder: none is followed where a run writes, since what a link leads to is somebody else's.

The folder itself may be a link. Results may be links, too: they are read, and a link whose name is written to gives way
to the file, by a rename (:func:`roughvisc.study.storage.store.atomic_write`), which touches nothing else.
"""

from __future__ import annotations

import os
from pathlib import Path

from roughvisc.errors import FolderError


def refuse_link(path: Path, expected: str) -> None:
    """Refuse a link in place of a file or folder that a run writes to, or deletes from.

    Parameters
    ----------
    path : Path
        The file or folder, which need not exist.
    expected : str
        What it should be.

    Raises
    ------
    FolderError
        If it is a link.
    """
    if path.is_symlink():
        raise FolderError(f"{path}: is a link: expected {expected}, or nothing; remove it, and what it leads to stays")


def open_unlinked(path: str | Path, flags: int, expected: str) -> int:
    """Descriptor of a file that is made if need be, and that is no link.

    Parameters
    ----------
    path : path
        The file.
    flags : int
        As :func:`os.open` takes them.
    expected : str
        What the file should be.

    Raises
    ------
    FolderError
        If it is a link.
    OSError
        If it cannot be opened, or became a link just now.
    """
    refuse_link(Path(path), expected)
    return os.open(path, flags | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
