"""Exceptions with one readable message each, and text that a terminal can show.

The command line prints the message of a :class:`RoughviscError` without a traceback.
"""

import unicodedata
from collections.abc import Mapping
from typing import Self


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

    See Also
    --------
    roughvisc.InputError, roughvisc.ConvergenceError

    Examples
    --------
    >>> import roughvisc as rv
    >>> try:
    ...     rv.elastic(shear_modulus="-1 MPa")
    ... except rv.RoughviscError as error:
    ...     print(error)
    shear_modulus: found '-1 MPa': expected a number [Pa], or text with a unit, above 0
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

    See Also
    --------
    roughvisc.EdgeContactError, roughvisc.TooLargeError

    Examples
    --------
    >>> print(InputError(key="material.shear_modulus", found="3 N", expected="a modulus [Pa]"))
    material.shear_modulus: found '3 N': expected a modulus [Pa]
    """

    def __init__(
        self, message: str = "", *, key: str = "", found: object = None, expected: str = "", transient: bool = False
    ) -> None:
        if not message:
            message = f"{key}: " if key else ""
            message += f"found {short_repr(found)}: expected {expected}"
        super().__init__(message, transient=transient)
        self.key = key
        self.found = found
        self.expected = expected

    def prefixed(self, text: str) -> Self:
        """Return this error with a file, table or key in front of its message."""
        return type(self)(
            f"{text}: {self}", key=self.key, found=self.found, expected=self.expected, transient=self.transient
        )


class EdgeContactError(InputError):
    """Contact at the border of a surface in free space.

    See Also
    --------
    roughvisc.InputError

    Examples
    --------
    >>> import roughvisc as rv
    >>> block, press = rv.from_array([[0.0, 0.0], [0.0, 0.0]], spacing="1 um"), rv.Program().load("1 uN", over=0)
    >>> try:
    ...     ds = rv.simulate(block, rv.elastic(1e6), press, boundary="free", progress=False)
    ... except rv.EdgeContactError:
    ...     ds = rv.simulate(block, rv.elastic(1e6), press, boundary="free", edge="accept", progress=False)
    >>> ds.contact_fraction[-1].item()
    1.0
    """


class TooLargeError(InputError):
    """A case needs more memory than is available: the message states how much, and what would fit.

    See Also
    --------
    roughvisc.InputError, roughvisc.plan

    Examples
    --------
    >>> import roughvisc as rv
    >>> try:
    ...     wave = rv.wavy("1 um", "1 mm", "1 mm", 64)
    ... except rv.TooLargeError as error:
    ...     print(error)
    """

    transient = True  # it may fit elsewhere


class ConvergenceError(RoughviscError, RuntimeError):
    """A step did not reach its tolerance: the message names the time, the residual and what to try.

    See Also
    --------
    roughvisc.RoughviscError

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(1e-3, 2e-4, 15), rv.Program().load(1e-5, over=0)
    >>> try:
    ...     ds = rv.simulate(ball, rv.elastic(1e6), press, progress=False)
    ... except rv.ConvergenceError as error:
    ...     print(error)
    """


def short_repr(value: object) -> str:
    """Return a value as text for a message, of at most 60 characters."""
    if isinstance(value, Mapping):
        return f"a table with {', '.join(map(str, value)) or 'no keys'}"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def printable(text: str) -> str:
    """Return a text with escaped control characters, so that it cannot control a terminal.

    Examples
    --------
    >>> printable("red \\x1b[31m")
    'red \\\\x1b[31m'
    """
    hidden = {sign for sign in text if unicodedata.category(sign) in ("Cc", "Cf", "Cs")} - {"\n"}
    return text.translate({ord(sign): sign.encode("unicode_escape").decode() for sign in hidden})
