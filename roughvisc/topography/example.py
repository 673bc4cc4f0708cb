"""The scan that ships with roughvisc, to try things with."""

from __future__ import annotations

from pathlib import Path

#: Its name, and the folders that hold it: of an installation, and of a checkout.
EXAMPLE = "ground_steel.x3p"
_PACKAGE = Path(__file__).parents[1]
_HELD_IN = (_PACKAGE / "example", _PACKAGE.parent / "surfaces")


def example_scan() -> Path:
    """Path of a scan that ships with roughvisc: ground steel, tilted, with spikes and missing points.

    Returns
    -------
    Path
        An X3P file, 256 x 224 points. It is to be read; ``roughvisc new`` writes a copy of one's own.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rv.open_scan(rv.example_scan()).shape
    (256, 224)
    """
    return next(folder / EXAMPLE for folder in _HELD_IN if (folder / EXAMPLE).exists())
