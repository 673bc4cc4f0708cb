"""Formats by name and suffix."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from roughvisc.errors import InputError
from roughvisc.topography.formats import libraries, makers
from roughvisc.topography.formats.scan_file import ScanFile

#: Format -> suffixes without the dot, and its reader, for formats with a reader in this package. A text format without
#: a suffix is recognised by its content.
_FORMATS: dict[str, tuple[Sequence[str], Callable[[Path], ScanFile]]] = {
    "x3p": (("x3p",), libraries.read_x3p),
    "sdf": (("sdf",), libraries.read_sdf),
    "npy": (("npy",), libraries.read_npy),
    "nc": (("nc", "nc4", "cdf", "hdf5"), libraries.read_netcdf),
    "tmd": (("tmd",), makers.read_truemap),
    "sur": (("sur",), makers.read_digital_surf),
}
for _name, _suffixes in {"csv": ("csv",), "txt": ("txt", "asc"), "xyz": ("xyz",)}.items():
    _FORMATS[_name] = _suffixes, partial(makers.read_text_file, format=_name)
for _name in ("asc", "zygo", "keyence", "wyko", "esri"):
    _FORMATS[_name] = (), partial(makers.read_text_file, format=_name)
#: Formats to try, in this order, for suffixes and formats that are also used for other content.
_SHARED = {"dat": ("metropro", "txt"), "h5": ("nc", "h5"), "tif": ("ps",)}


def open_file(path: Path, format: str | None) -> ScanFile:
    """Read the header of a scan file; find its format by name, or else by suffix."""
    names, failures = _formats_of(path) if format is None else _SHARED.get(format, (format,)), []
    for name in names:
        try:
            file = _read(path, name)
            if name == names[-1] or any(channel.is_height for channel in file.channels):
                return file
        except InputError:
            raise
        except Exception as error:  # noqa: BLE001 - readers raise many types, such as struct.error and KeyError
            failures.append(f"as {name}: {str(error) or type(error).__name__}")
    raise ValueError("; ".join(failures))


def _read(path: Path, name: str) -> ScanFile:
    if name in _FORMATS:
        return _FORMATS[name][1](path)
    return libraries.read_with_surface_topography(path, name)


def add_format(format: str, suffixes: Sequence[str], read: Callable[[Path], ScanFile]) -> None:
    """Add a format to :func:`roughvisc.open_scan` in this process, or replace a format of the same name.

    Parameters
    ----------
    format : str
        Name, as ``format=`` takes it.
    suffixes : sequence of str
        Suffixes of its files, without the dot. May be empty.
    read : callable
        ``read(path)`` returns a :class:`ScanFile`. Any exception is reported as an
        :class:`~roughvisc.errors.InputError` that names the file.
    """
    _FORMATS[format] = tuple(suffix.lower().removeprefix(".") for suffix in suffixes), read


def supported_formats() -> dict[str, Sequence[str]]:
    """Return the names of all formats, for ``format=``, with their usual suffixes.

    Returns
    -------
    dict
        Name -> suffixes without the dot, in alphabetical order.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from SurfaceTopography.IO import readers  # slow to import
    known = {reader.format(): tuple(reader.file_extensions() or ()) for reader in readers}
    known["di"] += ("di", "000 to 999")
    known |= {name: theirs for name, (theirs, _) in _FORMATS.items()} | {"card": ("toml",)}
    return dict(sorted(known.items()))


def _formats_of(path: Path) -> Sequence[str]:
    """Return the formats to try for the suffix of a file, in order."""
    suffix = path.suffix.lower().removeprefix(".")
    if quick := [name for name, (theirs, _) in _FORMATS.items() if suffix in theirs][-1:] or _SHARED.get(suffix):
        return quick
    known = supported_formats()
    wanted = "000 to 999" if len(suffix) == 3 and suffix.isdigit() else suffix
    if found := [name for name, theirs in known.items() if wanted in theirs]:
        return found
    listed = ", ".join(sorted({one for theirs in known.values() for one in theirs}))
    raise InputError(f"the suffix {path.suffix!r} is not known: expected format, or a suffix of {listed}", key="format")
