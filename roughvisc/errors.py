"""What can go wrong, as exceptions with one readable message each.

Every error that roughvisc raises on purpose is a :class:`RoughviscError`; the command line prints its message
without a traceback.
"""

import unicodedata
from typing import Self

#: Characters of one message on the screen, at most.
ON_SCREEN = 600
#: The longest line of a message.
_LONGEST = 1000
#: No part of a line is cut below this.
_SHORTEST = 40


class RoughviscError(Exception):
    """Base of all errors raised on purpose by roughvisc.

    Parameters
    ----------
    message : str
        Complete message.
    transient : bool
        Whether the cause lies outside the case, such as a file or the memory. The case is then not recorded as failed,
        and the same command resumes it.

    Attributes
    ----------
    transient
        As given.
    """

    transient = False

    def __init__(self, message: str = "", *, transient: bool = False) -> None:
        super().__init__(message)
        self.transient = transient or self.transient


class InputError(RoughviscError, ValueError):
    """Invalid input.

    Parameters
    ----------
    message : str, optional
        Complete message. Built from the other arguments if not given.
    key : str
        Name of the argument, study key, file or point at fault.
    found : object
        The invalid value.
    expected : str
        Description of valid values.
    transient : bool
        As for :class:`RoughviscError`.

    Attributes
    ----------
    key, found, expected
        As given. Programs and tests read these and never the message.

    Examples
    --------
    >>> print(InputError(key="material.shear_modulus", found="3 N", expected="a modulus [Pa]"))
    material.shear_modulus: found '3 N': expected a modulus [Pa]
    """

    def __init__(
        self, message: str = "", *, key: str = "", found: object = None, expected: str = "", transient: bool = False
    ) -> None:
        if not message:
            text = repr(found)
            text = text if len(text) <= 60 else text[:57] + "..."
            message = f"{key}: found {text}: expected {expected}" if key else f"found {text}: expected {expected}"
        super().__init__(message, transient=transient)
        self.key, self.found, self.expected = key, found, expected

    def prefixed(self, text: str) -> Self:
        """Return this error with a file, table or key in front of its message."""
        return type(self)(
            f"{text}: {self}", key=self.key, found=self.found, expected=self.expected, transient=self.transient
        )


class EdgeContactError(InputError):
    """Contact at the border of a surface in free space."""


class TooLargeError(InputError):
    """A case needs more memory than is available: the message states how much, and what would fit."""

    transient = True  # it may fit elsewhere


class ConvergenceError(RoughviscError, RuntimeError):
    """A step did not reach its tolerance: the message names the time, the residual and what to try."""


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


def shortened(message: str, longest: int, elsewhere: str = "") -> str:
    """A message of so many characters at most: its first lines, and how many more there are.

    Of a long line the middle of its longest parts goes, so that file, key, what was found and what was expected stay.

    Parameters
    ----------
    message : str
        One problem a line, below a first line that counts them; or a single line.
    longest : int
        Characters that are left, 150 at least.
    elsewhere : str
        File that holds the whole message, if there is one.

    Examples
    --------
    >>> problems = "\\n".join(f"  key_{number}: unknown" for number in range(9))
    >>> print(shortened(f"s.toml: 9 problems\\n{problems}", 150, "sweep.log"))
    s.toml: 9 problems
      key_0: unknown
      key_1: unknown
      key_2: unknown
      key_3: unknown
      key_4: unknown
      and 4 more; all of it is in sweep.log
    """
    if len(message) <= longest:
        return message
    where = f"all of it is in {_inner(elsewhere, longest // 2)}" if elsewhere else ""
    lines = message.split("\n")
    first = min(2, len(lines))
    for kept in range(min(len(lines), longest), first - 1, -1):
        more = f"and {len(lines) - kept} more" if kept < len(lines) else ""
        last = [f"  {'; '.join(filter(None, (more, where)))}"] if more or where else []
        left = longest - sum(len(one) + 1 for one in last)
        if sum(map(len, lines[:kept])) + kept - 1 <= left:
            return "\n".join([*lines[:kept], *last])
    head = _line_of(lines[0], left if first == 1 else left // 2)
    return "\n".join([head, *(_line_of(one, left - len(head) - 1) for one in lines[1:first]), *last])


def _line_of(line: str, longest: int) -> str:
    """A line whose longest parts, between its colons, lack their middle."""
    parts = line.split(": ")
    for most in range(longest, _SHORTEST, -1):
        if sum(min(len(part), most) for part in parts) + 2 * (len(parts) - 1) <= longest:
            return ": ".join(_inner(part, most) for part in parts)
    return _inner(line, longest)


def _inner(text: str, longest: int) -> str:
    """A text without its middle where it is too long."""
    if len(text) <= longest:
        return text
    half = (longest - 5) // 2
    return f"{text[:half]} ... {text[-half:]}"
