"""Arguments of the conditioning steps, for functions, surface cards and study files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from roughvisc.errors import InputError


@dataclass(frozen=True)
class Argument:
    """What an argument may be, in words and as a test."""

    wanted: str
    allows: Callable[[Any], bool]

    def check(self, name: str, value: Any) -> None:
        """Refuse a value that is not allowed with an :class:`InputError` that names the argument."""
        if not self.allows(value):
            raise InputError(key=name, found=value, expected=self.wanted)


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _word(*words: str) -> Argument:
    return Argument(f"{', '.join(map(repr, words[:-1]))} or {words[-1]!r}", lambda value: value in words)


ORDER = Argument("0 (mean), 1 (plane), 2 or 3", lambda value: _whole(value) and 0 <= value <= 3)
WINDOW = Argument("an odd whole number of at least 3", lambda value: _whole(value) and value >= 3 and value % 2 == 1)
TURNS = Argument("a whole number of quarter turns", _whole)
FILL = _word("harmonic", "nearest")
KEEP = _word("long", "short")
