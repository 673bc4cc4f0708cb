"""What can go wrong, as exceptions with one readable message each.

Every error that roughvisc raises on purpose is a :class:`RoughviscError`; the command line prints its message
without a traceback.
"""

import unicodedata

#: The longest line of a message.
_LONGEST = 1000


class RoughviscError(Exception):
    """Base of all errors raised on purpose by roughvisc."""


class InputError(RoughviscError, ValueError):
    """The input is wrong: the message names the file, the key or the point, what was found and what was expected."""


class EdgeContactError(InputError):
    """Contact reached the border of a free-space domain that cannot grow."""


class ConvergenceError(RoughviscError, RuntimeError):
    """A step did not reach its tolerance: the message names the time, the residual and what to try."""


class HinderedError(RoughviscError, RuntimeError):
    """Something outside the case was in its way: nothing is recorded against the case, and the same command goes on."""


class InUseError(HinderedError):
    """Another run is at work on the same thing: the message names it."""


class FolderError(InputError, HinderedError):
    """A folder cannot be made or written to."""


class DiskFullError(HinderedError):
    """No space is left for what a case has to write."""


class TooLargeError(InputError, HinderedError):
    """A case takes more memory than there is here: the message says how much, and what would fit."""


class ChangedError(HinderedError):
    """A file was changed after the case that names it was read."""


def printable(text: str) -> str:
    """A text as a terminal can show it: what would steer the terminal is spelt out, and a long line is cut.

    Examples
    --------
    >>> printable("red \\x1b[31m")
    'red \\\\x1b[31m'
    """
    return "\n".join(_cut("".join(map(_spelt, line))) for line in text.split("\n"))


def _spelt(sign: str) -> str:
    return sign.encode("unicode_escape").decode() if unicodedata.category(sign) in ("Cc", "Cf", "Cs") else sign


def _cut(line: str) -> str:
    if len(line) <= _LONGEST:
        return line
    half = _LONGEST // 2
    return f"{line[:half]} ... ({len(line) - 2 * half} characters left out) ... {line[-half:]}"
