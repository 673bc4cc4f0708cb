"""Compressed JSON files: written whole or not at all, and compared with a checksum when they are read."""

from __future__ import annotations

import gzip
import json
import zlib
from contextlib import suppress
from pathlib import Path
from typing import Any

from roughvisc.errors import InputError
from roughvisc.study.storage.files import atomic_write

#: Errors of reading such a file, or of finding other values in it than were written.
DAMAGED = (OSError, EOFError, ValueError, LookupError, TypeError, AttributeError, RecursionError, zlib.error)


def write_json(path: Path, value: Any) -> None:
    """Write a value to a file; if that is impossible, the file is not changed."""
    with suppress(OSError, InputError), atomic_write(path) as temporary:
        temporary.write_bytes(gzip.compress(json.dumps(value).encode(), compresslevel=1, mtime=0))


def read_json(path: Path) -> Any:
    """Read the value of a file; one of :data:`DAMAGED` is raised if that is impossible."""
    return json.loads(gzip.decompress(path.read_bytes()))
