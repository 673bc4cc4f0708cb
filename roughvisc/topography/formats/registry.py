"""Formats by name and suffix, and the result of a reader."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from roughvisc.errors import InputError

#: Format -> suffixes without the dot, and its reader, for formats with a reader in this package. Formats without a
#: suffix are recognised by their first line.
_OWN: dict[str, tuple[tuple[str, ...], str]] = {
    "x3p": (("x3p",), "libraries.read_x3p"),
    "sdf": (("sdf",), "libraries.read_sdf"),
    "npy": (("npy",), "libraries.read_npy"),
    "nc": (("nc", "nc4", "cdf", "hdf5"), "grid_file.read_grid"),
    "h5": (("h5",), "grid_file.read_hdf5"),
    "tmd": (("tmd",), "makers.read_truemap"),
    "sur": (("sur",), "makers.read_digital_surf"),
    "csv": (("csv",), "text.read_text_file"),
    "txt": (("txt", "asc"), "text.read_text_file"),
    "xyz": (("xyz",), "text.read_text_file"),
    **dict.fromkeys(("asc", "zygo", "keyence", "wyko", "esri"), ((), "text.read_text_file")),
}
#: Formats to try, in this order, for suffixes that several formats share.
_SHARED = {"dat": ("metropro", "txt"), "di": ("di",), "tif": ("ps",)}
#: Formats that users added in this process.
_ADDED: dict[str, tuple[tuple[str, ...], Callable[[Path], ScanFile]]] = {}


@dataclass(frozen=True)
class Channel:
    """One channel of a file.

    Parameters
    ----------
    name : str
        Name, as ``channel=`` of :func:`roughvisc.open_scan` takes it.
    shape : tuple of int
        Points along x and y; one number for a profile or for points.
    load : callable
        Returns the heights over (x, y), peaks up, NaN where missing, in `unit`: an array, or a DataArray whose
        attributes and coordinates are kept; for points an array of shape (n, 3).
    unit : str, optional
        Unit of the heights; None if the file states none.
    lateral_unit : str, optional
        Unit of x and y; None if the file states none.
    spacing : tuple of float, optional
        Cell sides in `lateral_unit`; None if the file states none.
    positions : tuple of ndarray, optional
        Cell centres along x and y in `lateral_unit`; None if the file states none.
    kind : {"height", "points", "profile", ...}
        ``"height"`` for an areal grid, ``"points"`` for points x, y, z, otherwise a description of the content.
    """

    name: str
    shape: tuple[int, ...]
    load: Callable[[], Any]
    unit: str | None = None
    lateral_unit: str | None = None
    spacing: tuple[float, float] | None = None
    positions: tuple[np.ndarray, np.ndarray] | None = None
    kind: str = "height"

    @property
    def is_height(self) -> bool:
        """Whether the channel holds heights over x and y."""
        return self.kind in ("height", "points")


@dataclass(frozen=True)
class ScanFile:
    """Scan file with its header read.

    Parameters
    ----------
    format : str
        Name of the format.
    channels : sequence of Channel
        All channels of the file.
    default : int or None
        Index of the channel to read if the user names none. None: the first height.
    instrument : str
        Maker and model if known.
    complaints : list of str
        Faults of the file that do not prevent reading; ``load`` of a channel may add some.
    close : callable
        Closes the file.
    """

    format: str
    channels: Sequence[Channel]
    default: int | None = None
    instrument: str = ""
    complaints: list[str] = field(default_factory=list)
    close: Callable[[], None] = lambda: None


def open_file(path: Path, format: str | None) -> ScanFile:
    """Read the header of a scan file; find its format by name, by content (``"auto"``) or by suffix (None)."""
    names = (_detected(path),) if format == "auto" else (format,) if format else _formats_of(path)
    failures = []
    for name in names:
        try:
            return _reader(name)(path)
        except InputError:
            raise
        except Exception as error:  # readers raise many types, such as struct.error and KeyError
            if len(names) == 1:
                raise
            forget(error)
            failures.append(f"not {name}: {brief(error)}")
    raise InputError("; ".join(failures))


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
    _ADDED[format] = tuple(suffix.lower().removeprefix(".") for suffix in suffixes), read


def suffixes() -> dict[str, tuple[str, ...]]:
    """Return the suffixes of each format, without the dot."""
    from SurfaceTopography.IO import readers

    theirs = {reader.format(): tuple(reader.file_extensions() or ()) for reader in readers}
    theirs["di"] = (*theirs["di"], "di", "000 to 999")
    own = {name: suffixes for name, (suffixes, _) in _OWN.items() if suffixes or name not in theirs}
    return theirs | own | {name: suffixes for name, (suffixes, _) in _ADDED.items()} | {"card": ("toml",)}


def _formats_of(path: Path) -> tuple[str, ...]:
    """Return the formats to try for the suffix of a file, in order."""
    suffix = path.suffix.lower().removeprefix(".")
    quick = _SHARED | {one: (name,) for name, (theirs, _) in (_OWN | _ADDED).items() for one in theirs}
    if suffix in quick:
        return quick[suffix]
    if len(suffix) == 3 and suffix.isdigit():
        return ("di",)
    found = tuple(name for name, theirs in suffixes().items() if suffix in theirs)
    if not found:
        known = ", ".join(sorted({one for theirs in suffixes().values() for one in theirs}))
        expected = f'expected format, or "auto" to detect it; known suffixes are {known}'
        raise InputError(f"the suffix {path.suffix!r} is not known: {expected}", key="format")
    return found


def _reader(name: str) -> Callable[[Path], ScanFile]:
    """Return the reader of a format."""
    if name in _ADDED:
        return _ADDED[name][1]
    module, _, function = (_OWN[name][1] if name in _OWN else "libraries.read_with_surface_topography").partition(".")
    read = getattr(import_module(f"roughvisc.topography.formats.{module}"), function)
    return partial(read, format=name) if function in ("read_text_file", "read_with_surface_topography") else read


def _detected(path: Path) -> str:
    """Return the format of a file by its content."""
    from SurfaceTopography.Exceptions import CannotDetectFileFormat
    from SurfaceTopography.IO import detect_format

    try:
        return detect_format(str(path))
    except CannotDetectFileFormat as error:
        raise InputError("no reader recognises its content: expected the name of its format", key="format") from error


def brief(error: BaseException) -> str:
    """Return the first line of an error, shortened, or its type if it has no text."""
    text = str(error).strip().split("\n")[0].strip()
    return (text if len(text) < 200 else text[:197] + "...") or type(error).__name__


def forget(error: BaseException | None) -> None:
    """Clear the traceback of an error, so that files opened by a failed reader are closed."""
    while error is not None:
        traceback.clear_frames(error.__traceback__)
        error = error.__context__
