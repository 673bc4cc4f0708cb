"""How a command reads a scan: the options that say what its file does not, and messages that name them."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import click

from roughvisc.errors import InputError

_OPTIONS = (
    click.option("--unit", help="Unit of length if the file states none: um; or of x, y and of heights: mm,um."),
    click.option("--channel", help="Name or number of the channel. [default: the height]"),
    click.option("--spacing", help="Distance between points if the file states none: 1um, or 1um,2um."),
    click.option("--format", help="Format if the suffix does not tell it; auto: detect it."),
)
_NAMES = "unit|height_unit|spacing|format|channel"
#: Settings of which messages speak as Python does -> table of a study that has them.
_TABLES = {"boundary": "solve", "edge": "solve", "missing": "surface"}


def reading_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator: a command takes ``--unit``, ``--channel``, ``--spacing`` and ``--format``."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def read_options(unit: str | None, channel: str | None, spacing: str | None, format: str | None) -> dict[str, Any]:
    """The options as :func:`roughvisc.open_scan` takes them."""
    lateral, _, vertical = (unit or "").partition(",")
    return {
        "format": format,
        "unit": lateral.strip() or None,
        "height_unit": vertical.strip() or None,
        "channel": int(channel) if channel is not None and channel.isdecimal() else channel,
        "spacing": _sides(spacing),
    }


def _sides(text: str | None) -> Any:
    """Distance of the points along x and y, or one for both. [m]"""
    from roughvisc.units import quantity

    if text is None:
        return None
    sides = [float(part) if part.strip().replace(".", "").isdecimal() else part for part in text.split(",")]
    if len(sides) > 2:
        raise InputError(f"--spacing: found {text!r}: expected one length, or two separated by a comma")
    metres = [quantity(side, "m", "--spacing") for side in sides]
    return metres[0] if len(metres) == 1 else tuple(metres)


def naming_options(message: str) -> str:
    """A message of the readers with the options of the command line in place of Python's keywords.

    Examples
    --------
    >>> naming_options("it states no unit of its heights: pass unit= (such as unit='um')")
    'it states no unit of its heights: pass --unit (such as --unit=um)'
    >>> naming_options("pass unit= (such as unit='um'; or unit='mm', height_unit='um' where they differ)")
    'pass --unit (such as --unit=um; or --unit=mm,um where they differ)'
    >>> naming_options("it states no size: pass spacing=(dx, dy) [m]")
    'it states no size: pass --spacing (such as --spacing=1um,1um)'
    """
    message = re.sub(r"\bspacing=(\(dx, dy\))? \[m\]", "--spacing (such as --spacing=1um,1um)", message)
    message = message.replace(" (see supported_formats())", "")
    message = re.sub(r"\bunit='(\w+)', height_unit='(\w+)'", r"--unit=\1,\2", message)
    message = re.sub(rf"\b({_NAMES})='(\w+)'", r"--\1=\2", message)
    message = re.sub(rf"\b({_NAMES})=(?=\W|$)", r"--\1", message)
    message = re.sub(rf"(^|: )({_NAMES}) is ", r"\1--\2 is ", message)
    return message.replace("--height_unit", "--unit")  # which takes both units


def naming_keys(message: str) -> str:
    """The same with the keys of a study, and with the options of a command.

    Examples
    --------
    >>> naming_keys("it states no unit of its heights: pass unit= (such as unit='um')")
    'it states no unit of its heights: pass the key unit (such as unit = "um")'
    >>> naming_keys("contact at the border: use boundary='periodic'")
    'contact at the border: use [solve] boundary = "periodic"'
    """
    message = re.sub(r"\bspacing=(\(dx, dy\))? \[m\]", 'the key spacing (such as spacing = "1 um")', message)
    message = message.replace(" (see supported_formats())", "")
    message = re.sub(rf"\b({_NAMES})='(\w+)'", r'\1 = "\2"', message)
    message = re.sub(
        rf"\b({'|'.join(_TABLES)})=(['\"])(\w+)\2", lambda m: f'[{_TABLES[m[1]]}] {m[1]} = "{m[3]}"', message
    )
    return re.sub(rf"\b({_NAMES})=(?=\W|$)", r"the key \1", message)
