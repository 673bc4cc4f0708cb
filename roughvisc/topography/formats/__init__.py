"""Formats of scan files: their readers by name and suffix, and the orientation of the map in each.

A reader takes a path and returns a :class:`ScanFile`: the channels of the file, in the units of the file.
:mod:`roughvisc.topography.readers` decides units and missing values, and refuses implausible files.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from functools import partial
from pathlib import Path

from roughvisc.arguments import listed_names
from roughvisc.errors import InputError
from roughvisc.paths import cause_of_system
from roughvisc.topography.formats import binary, mesh, text
from roughvisc.topography.formats.scan_file import Channel, ScanFile

__all__ = ["READERS", "Channel", "ScanFile", "add_format", "open_file", "orientation", "supported_formats"]

#: Format -> suffixes without the dot, and its reader, for formats with a reader in this package. A text format without
#: a suffix is recognised by its content.
READERS: dict[str, tuple[Sequence[str], Callable[[Path], ScanFile]]] = {
    "x3p": (("x3p",), binary.read_x3p),
    "sdf": (("sdf",), binary.read_sdf),
    "npy": (("npy",), binary.read_npy),
    "nc": (("nc", "nc4", "cdf", "hdf5"), binary.read_netcdf),
    "tmd": (("tmd",), binary.read_truemap),
    "sur": (("sur",), binary.read_digital_surf),
    "stl": (("stl",), mesh.read_stl),
    "ply": (("ply",), mesh.read_ply),
    "txt": (("txt", "csv", "asc", "xyz"), text.read_text_file),
    **dict.fromkeys(("csv", "xyz", "asc", "zygo", "wyko", "esri", "keyence"), ((), text.read_text_file)),
}
#: Formats to try, in this order, for suffixes that are also used for other content.
_SHARED = {"dat": ("metropro", "txt"), "h5": ("nc", "h5")}
#: Formats that this package reads and that their content identifies.
_BY_CONTENT = ("x3p", "sdf", "npy", "sur")
#: Suffix -> kind of a file that no reader reads or that holds no heights, and what to export instead.
_PICTURE = "a picture without heights: expected the heights, such as .x3p, .sur or a text matrix, from the instrument"
_SHEET = "a spreadsheet: expected its sheet of heights as .csv, with unit and spacing"
_EXPORTS = {
    "obj": "a mesh of another format: expected .stl or .ply, with unit and grid",
    **dict.fromkeys(("png", "jpg", "jpeg", "bmp", "gif"), _PICTURE),
    **dict.fromkeys(("xls", "xlsx", "ods"), _SHEET),
    "h5-jpk": "a video of a JPK instrument: expected one height image, saved as .jpk or as text",
    "topostats": "a result of TopoStats: expected its array 'image' as .npy, with unit = \"nm\" and the spacing",
}
#: Formats whose reader returns the top line of the map first, and the evidence. For the first two, it is a feature in a
#: real file; for the others, mostly the agreement of two programs.
_GWYDDION = "not verified: the reader matches the map of Gwyddion, whose first line is the top one"
TOP_FIRST = {
    "tmd": "verified: the letters of a coin (DIME), and the maker's own script draws the first line at the top",
    "al3d": "verified: heights and camera image of a real file agree line by line, and images begin at the top",
    "esri": "verified: the definition of the format, whose first row is the top one",
    "gwy": "not verified: Gwyddion's own format, whose first line is the top one",
    "opd": "not verified: two programs draw the same line at the top",
    **dict.fromkeys(("di", "ezd", "frt", "ibw", "jpk", "mdt", "mi", "ps", "wsxm"), _GWYDDION),
}
#: Evidence for formats that define the direction of y, and for all others.
STATED = {
    "wyko": "not verified: each line is a column of the map from the bottom up, as Gwyddion reads it",
    "nc": "verified: the coordinates in the file",
    **dict.fromkeys(("xyz", "stl", "ply"), "verified: the coordinates in the file"),
}
TAKEN = "not verified: rows are taken to run along x and the first to be y = 0; it may be a mirror image"


def open_file(path: Path, format: str | None) -> ScanFile:
    """Read the header of a scan file; find its format by name, or else by suffix."""
    names = _formats_of(path) if format is None else (format,)
    failures = list[str]()
    for name in names:
        default = partial(binary.read_with_surface_topography, format=name)
        try:
            file = READERS.get(name, ((), default))[1](path)
            if name == names[-1] or any(channel.is_height for channel in file.channels):
                return file
        except Exception as error:  # readers raise many types, such as struct.error and KeyError
            if isinstance(error, InputError) or cause_of_system(error):
                raise
            if unit := re.match(r"Unknown unit '(.*)'", str(error)):
                expected = "a map of heights, and no image of intensity or of another quantity"
                raise InputError(
                    f"it holds values in {unit[1]!r}, which is not a length: expected {expected}"
                ) from error
            failures.append(f"as {name}: {str(error) or type(error).__name__}")
    if format is None and (export := _EXPORTS.get(_suffix(path))):
        raise InputError(f"it is {export}", key="format", found=path.suffix)
    if content := _format_of_content(path, names):
        expected = f"{content!r}, the format of the content"
        raise InputError(key="format", found=format or path.suffix, expected=expected)
    raise ValueError("; ".join(failures))


def _format_of_content(path: Path, tried: Sequence[str]) -> str | None:
    """Return the format whose reader opens a file, other than the tried ones; None if there is none."""
    from SurfaceTopography.IO import detect_format

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in (name for name in _BY_CONTENT if name not in tried):
            with suppress(Exception), closing(READERS[name][1](path)):  # readers raise many types
                return name
        with suppress(Exception):
            detected = str(detect_format(str(path)))
            return None if detected in tried or detected in READERS else detected
    return None


def add_format(format: str, suffixes: Sequence[str] | str, read: Callable[[Path], ScanFile]) -> None:
    """Add a format to :func:`roughvisc.open_scan` in this process, or replace a format of the same name.

    Parameters
    ----------
    format : str
        Name, as ``format=`` takes it.
    suffixes : sequence of str, or str
        Suffixes of its files, without the dot. May be empty.
    read : callable
        ``read(path)`` returns a :class:`ScanFile`. Any exception is reported as an
        :class:`~roughvisc.errors.InputError` that names the file.
    """
    READERS[format] = tuple(suffix.lower().removeprefix(".") for suffix in listed_names(suffixes)), read


def supported_formats() -> dict[str, Sequence[str]]:
    """Return the names of all formats, for ``format=``, with their usual suffixes.

    Returns
    -------
    dict
        Name -> suffixes without the dot, in alphabetical order.

    See Also
    --------
    roughvisc.open_scan

    Examples
    --------
    >>> import roughvisc as rv
    >>> rv.supported_formats()["x3p"]
    ('x3p',)
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from SurfaceTopography.IO import readers  # slow to import
    known: dict[str, Sequence[str]] = {reader.format(): tuple(reader.file_extensions() or ()) for reader in readers}
    known["di"] = (*known["di"], "di", "000 to 999")
    known["jpk"] = (*known["jpk"], "jpk-qi-image")
    known |= {name: theirs for name, (theirs, _) in READERS.items()}
    return dict(sorted(known.items()))


def _formats_of(path: Path) -> Sequence[str]:
    """Return the formats to try for the suffix of a file, in order."""
    suffix = _suffix(path)
    if quick := [name for name, (theirs, _) in READERS.items() if suffix in theirs][-1:] or _SHARED.get(suffix):
        return quick
    known = supported_formats()
    wanted = "000 to 999" if len(suffix) == 3 and suffix.isdigit() else suffix
    if names := [name for name, theirs in known.items() if wanted in theirs]:
        return names
    if suffix in _EXPORTS:
        raise InputError(f"it is {_EXPORTS[suffix]}", key="format", found=path.suffix)
    listed = ", ".join(sorted({one for theirs in known.values() for one in theirs}))
    raise InputError(f"the suffix {path.suffix!r} is not known: expected format, or a suffix of {listed}", key="format")


def _suffix(path: Path) -> str:
    """Return the suffix of a file in lower case, without the dot."""
    return path.suffix.lower().removeprefix(".")


def orientation(format: str) -> str:
    """Return the evidence for the orientation of a format: a scan with a wrong orientation is a mirror image.

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
    return TOP_FIRST.get(format) or STATED.get(format, TAKEN)
