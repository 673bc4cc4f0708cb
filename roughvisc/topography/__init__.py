"""Surfaces: instrument files and recipes become labelled height grids ``height(x, y)``."""

from pathlib import Path

#: Name of the example scan that ships with roughvisc, in the folder ``example`` of an installation and in ``surfaces``
#: of a checkout.
EXAMPLE = "focus_variation.x3p"


def example_scan() -> Path:
    """Return the path of the measured scan that ships with roughvisc.

    Returns
    -------
    Path
        An X3P file, 160 x 256 points over 70 um x 112 um, measured by focus variation and not levelled. Do not change
        it; ``roughvisc new`` writes a copy into the current folder.

    See Also
    --------
    roughvisc.open_scan, roughvisc.inspect

    Examples
    --------
    >>> import roughvisc as rv
    >>> rv.open_scan(rv.example_scan()).shape
    (160, 256)
    """
    package = Path(__file__).parents[1]
    installed = package / "example" / EXAMPLE
    return installed if installed.exists() else package.parent / "surfaces" / EXAMPLE
