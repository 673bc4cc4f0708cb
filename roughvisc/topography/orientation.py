"""Orientation of the map in each format, and its evidence: a scan with a wrong orientation is a mirror image."""

from __future__ import annotations

#: Formats whose reader returns the top line of the map first, and the evidence. For the first two, it is a feature in a
#: real file; for the others, mostly the agreement of two programs.
_GWYDDION = "the reader matches the map of Gwyddion, whose first line is the top one; by no feature in a real file"
_TOP_FIRST = {
    "tmd": "verified: the letters of a coin (DIME), and the maker's own script draws the first line at the top",
    "al3d": "verified: heights and camera image of a real file lie line by line alike, and images begin at the top",
    "esri": "verified: the definition of the format, whose first row is the top one",
    "gwy": "Gwyddion's own format, whose first line is the top one; by no feature in a real file",
    "opd": "two programs draw the same line at the top; by no feature in a real file",
    **dict.fromkeys(("di", "ezd", "frt", "ibw", "jpk", "mdt", "mi", "ps", "wsxm"), _GWYDDION),
}
#: Formats that define the direction of y.
_STATED = {
    "wyko": "each line is a column of the map from the bottom up, as Gwyddion reads it; by no feature in a real file",
    "nc": "verified: the coordinates in the file",
    "xyz": "verified: the coordinates in the file",
}
#: Formats of bare matrices, and how messages call the file.
_MATRICES = {"asc": "text matrix", "csv": "CSV matrix", "npy": "NumPy array"}


def top_line_first(format: str) -> bool:
    """Return whether the reader of a format returns the line of the largest y first."""
    return format in _TOP_FIRST


def orientation(format: str) -> str:
    """Return the evidence for the orientation of a format.

    Parameters
    ----------
    format : str
        Its name, as ``format=`` of :func:`roughvisc.open_scan` takes it.

    Returns
    -------
    str
        Begins with ``verified`` if the evidence is a feature in a real file, or the file itself states the orientation;
        otherwise with ``not verified``.

    Examples
    --------
    >>> orientation("tmd").partition(":")[0], orientation("plu").partition(":")[0]
    ('verified', 'not verified')
    """
    told = _TOP_FIRST.get(format) or _STATED.get(format)
    if told is None:
        kind = _MATRICES.get(format, f"{format} file")
        rows = "its rows are taken to run along x and the first to be y = 0"
        return f"not verified: {kind}, {rows}; it may be a mirror image"
    return told if told.startswith("verified") else f"not verified: {told}"
