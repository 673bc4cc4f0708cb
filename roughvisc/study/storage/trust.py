"""Whether a result is what was written: one that is not is refused, one of which nothing can be said is warned of."""

from __future__ import annotations

import logging
from pathlib import Path

from roughvisc.errors import InputError
from roughvisc.study.storage.seal import checksum_error, is_sealed

log = logging.getLogger("roughvisc")

#: What is wrong with a result that has no checksum.
UNSEALED = (
    "has no checksum: another program has changed it, or an early version of roughvisc has written it; "
    "whether its values are those that were computed cannot be said"
)
#: Files, as they were, and messages that were logged of them.
_warned: set[tuple[Path, tuple[int, ...], str]] = set()


def verify_checksum(path: Path) -> bool:
    """Refuse a result whose bytes are not those that were written; warn of one that nothing can be said of.

    Every read asks this, since a file may be damaged after it was opened. Once a process has looked at a file, and as
    long as the system says that nobody has written to it, that costs next to nothing.

    Returns
    -------
    bool
        Whether the result has a checksum, which it then matches.
    """
    try:
        found, sealed = checksum_error(path), is_sealed(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}: expected a result") from error
    if found:
        raise InputError(
            f"{path}: is damaged: {found}: the run that it is the result of sets it aside and computes it anew"
        )
    if not sealed:
        warn_once(path, f"{path}: {UNSEALED}")
    return sealed


def warn_once(path: Path, message: str) -> None:
    """Log a warning about a file, once as long as the file is as it is."""
    if is_news(path, message):
        log.warning("%s", message)


def is_news(path: Path, message: str) -> bool:
    """Whether nothing has said this of the file as it is now; from now on something has."""
    try:
        found = path.stat()
        stamp = (found.st_ino, found.st_size, found.st_mtime_ns)
    except OSError:
        stamp = ()
    before = len(_warned)
    _warned.add((path.absolute(), stamp, message))
    return len(_warned) > before
