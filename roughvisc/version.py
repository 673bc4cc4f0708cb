"""Version of the program and of its numbers."""

from functools import cache
from importlib import metadata

#: Incremented whenever the numbers of an unchanged case change.
NUMERICS_REVISION = 62


@cache
def program_version() -> str:
    """Return name and version of this program, and the revision of its numbers.

    Examples
    --------
    >>> program_version()  # doctest: +SKIP
    'roughvisc 0.1.dev493+g9bdb14a83 (numerics 15)'
    """
    return f"roughvisc {metadata.version('roughvisc')} (numerics {NUMERICS_REVISION})"
