"""Example scan that ships with roughvisc."""

from __future__ import annotations

from pathlib import Path

#: Name of the file, and its folder in an installation and in a checkout.
EXAMPLE = "focus_variation.x3p"
_PACKAGE = Path(__file__).parents[1]
_HELD_IN = (_PACKAGE / "example", _PACKAGE.parent / "surfaces")


def example_scan() -> Path:
    """Return the path of the measured scan that ships with roughvisc.

    Returns
    -------
    Path
        An X3P file, 160 x 256 points over 70 um x 112 um, measured by focus variation and not levelled. Do not change
        it; ``roughvisc new`` writes a copy into the current folder.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rv.open_scan(rv.example_scan()).shape
    (160, 256)
    """
    return next(folder / EXAMPLE for folder in _HELD_IN if (folder / EXAMPLE).exists())
