"""Instrument files through the libraries that parse them: x3pio, sdfio and SurfaceTopography.

Orientation: y points up, as on the map of a microscope. x3pio and sdfio give rows along y, ascending, so that
``height(x, y)`` is the transpose. SurfaceTopography gives (x, y), for many formats with the top line first: those are
turned over here, and :mod:`roughvisc.topography.orientation` says of each format how that was told. Row j of a matrix
in plain text or in a NumPy file is ``y[j]``, and runs along x.
"""

from __future__ import annotations

import traceback
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from roughvisc.errors import InputError
from roughvisc.topography.orientation import top_line_first
from roughvisc.topography.separated_values import separated_by_blanks

#: Formats that are opened elsewhere, and their suffixes: grid files and surface cards.
ELSEWHERE: dict[str, tuple[str, ...]] = {"nc": ("nc", "nc4", "cdf", "hdf5", "zarr"), "card": ("toml",)}
_TEXT = ("xyz", "asc")
#: Where suffixes are shared by formats: those to try, in this order.
_SHARED = {"txt": _TEXT, "asc": _TEXT, "dat": ("metropro", *_TEXT), "di": ("di",), "tif": ("ps",)}
#: Formats without compression: a point takes a byte at least.
_PLAIN = {"al3d", "asc", "bcr", "di", "ezd", "frt", "hgt", "ibw", "mdt", "metropro", "mi", "nms", "npy", "opd", "os3d"}
_PLAIN |= {"plu", "tmd", "wsxm", "xyz"}
#: No deflated stream expands further than this.
EXPANSION = 1040
#: Measured heights are not compressed so far: a file that expands so, and beyond this size, is none. [1, byte]
_PLAUSIBLE, _SMALL = 100, 256 << 20


@dataclass(frozen=True)
class Channel:
    """What one channel of a file holds.

    Parameters
    ----------
    index : int
        Its number in the file, from 0.
    name : str
        Its name, as ``channel=`` of :func:`~roughvisc.topography.readers.open_scan` takes it.
    is_height : bool
        Whether it is an areal grid of heights; False for phases, voltages, profiles and the like.
    shape : tuple of int
        Points along x and y; one number for a profile.
    unit : str or None
        Unit of length in the file; None if the file states none.
    """

    index: int
    name: str
    is_height: bool
    shape: tuple[int, ...]
    unit: str | None


class Raw(NamedTuple):
    """What a file holds of one channel, in its own units.

    Parameters
    ----------
    heights : ndarray, shape (nx, ny)
        NaN where missing; in the unit of the channel.
    sides : tuple of float or None
        Cell sides, None if the file states no size.
    units : tuple of str or None
        Units of x and y, None if the file states none.
    """

    heights: np.ndarray
    sides: tuple[float, float] | None
    units: tuple[str, str] | None


@dataclass(frozen=True)
class Opened:
    """A file whose header is read: its channels, and how to load one.

    Parameters
    ----------
    format : str
        Name of the format.
    channels : tuple of Channel
        All channels of the file.
    load : callable
        ``load(channel)`` gives a :class:`Raw`; of a grid file, which is read elsewhere, none.
    default : int or None
        Index of the channel that the library takes.
    instrument : str
        Maker and model where known.
    complaints : list of str
        What is wrong with the file and was read past, filled in by ``load``.
    close : callable
        Lets go of the file.
    """

    format: str
    channels: tuple[Channel, ...]
    load: Callable[[Channel], Raw] | None = None
    default: int | None = None
    instrument: str = ""
    complaints: list[str] = field(default_factory=list)
    close: Callable[[], None] = lambda: None


def open_instrument(path: Path, format: str | None) -> Opened:
    """Header of an instrument file, by the format's name, ``"auto"``, or the suffix (None)."""
    if format == "auto":
        from SurfaceTopography.IO import detect_format

        format = detect_format(str(path))
    suffix = path.suffix.lower().removeprefix(".")
    for name, (theirs, read) in READERS.items():
        if format == name or (format is None and suffix in theirs):
            return read(path)
    candidates = (format,) if format else formats_of(path)
    if candidates == ("npy",):  # SurfaceTopography does not close these
        return _npy(path)
    failures: dict[str, Exception] = {}
    for candidate in candidates:
        opened = _tried(path, candidate)
        if isinstance(opened, Opened):
            return opened
        failures[candidate] = opened
    raise InputError("; ".join(f"not {name}: {brief(error)}" for name, error in failures.items()))


def add_format(format: str, suffixes: Sequence[str], read: Callable[[Path], Opened]) -> None:
    """Make a format known to :func:`roughvisc.open_scan` in this process; one of the same name is replaced.

    Parameters
    ----------
    format : str
        Its name, as ``format=`` takes it.
    suffixes : sequence of str
        Of its files, without the dot: they are taken for this format from now on. May be none.
    read : callable
        ``read(path)`` reads the header and gives an :class:`Opened`. Whatever it raises is reported as one
        :class:`~roughvisc.errors.InputError` that names the file.

    Raises
    ------
    InputError
        If the name or a suffix belongs to a format that roughvisc reads itself.
    """
    theirs = {suffix for name in _BUILT_IN for suffix in own_suffixes()[name]}
    given = tuple(suffix.lower().removeprefix(".") for suffix in suffixes)
    if format in _BUILT_IN or theirs & set(given):
        raise InputError(
            f"format {format!r} with suffixes {', '.join(given) or 'none'}: expected others than the formats "
            f"{', '.join(sorted(_BUILT_IN))} and their suffixes {', '.join(sorted(theirs))}"
        )
    READERS[format] = given, read


def own_suffixes() -> dict[str, tuple[str, ...]]:
    """Format -> suffixes without the dot, of what SurfaceTopography does not read here."""
    return {name: theirs for name, (theirs, _) in READERS.items()} | ELSEWHERE


def suffixes() -> dict[str, tuple[str, ...]]:
    """Format -> suffixes without the dot, of everything that can be opened."""
    from SurfaceTopography.IO import readers

    theirs = {reader.format(): tuple(reader.file_extensions() or ()) for reader in readers}
    theirs["di"] = (*theirs["di"], "di", "000 to 999")
    return {**theirs, **own_suffixes()}


def formats_of(path: Path) -> tuple[str, ...]:
    """Formats of SurfaceTopography to try for a file name, in order."""
    suffix = path.suffix.lower().removeprefix(".")
    if suffix in _SHARED:
        return _SHARED[suffix]
    if len(suffix) == 3 and suffix.isdigit():
        return ("di",)
    found = tuple(name for name, theirs in suffixes().items() if suffix and suffix in theirs)
    if not found:
        known = sorted({s for theirs in suffixes().values() for s in theirs})
        raise InputError(
            f'the suffix {path.suffix!r} is not known: expected format, or "auto" to detect it; known suffixes are '
            f"{', '.join(known)}",
            key="format",
        )
    return found


def brief(error: BaseException) -> str:
    """First line of an error, not too long; its kind where it says nothing."""
    text = str(error).strip().split("\n")[0].strip()
    return (text if len(text) < 200 else text[:197] + "...") or type(error).__name__


def forget(error: BaseException | None) -> None:
    """Let go of what the frames of an error hold: readers that fail leave their files open."""
    while error is not None:
        traceback.clear_frames(error.__traceback__)
        error = error.__context__


def affordable(path: Path, points: int, expansion: float) -> None:
    """Refuse a header that claims more points than the file can hold, before they are allocated."""
    held = sum(p.stat().st_size for p in path.rglob("*")) if path.is_dir() else path.stat().st_size
    if points > max(held * expansion, 1024):
        raise InputError(f"the header claims {points} points, which {held} bytes cannot hold: the file is damaged")
    _modest(8 * points, held)


def _modest(size: int, held: int) -> None:
    if size > max(_PLAUSIBLE * held, _SMALL):
        raise InputError(
            f"it would take {size:.3g} bytes in memory, {size / held:.0f} times as many as the file has: expected "
            f"measured heights, at most {_PLAUSIBLE} times"
        )


def _x3p(path: Path) -> Opened:
    import x3pio

    with suppress(zipfile.BadZipFile), zipfile.ZipFile(path) as parts:  # the reader says what is wrong with it
        _modest(sum(part.file_size for part in parts.infolist()), path.stat().st_size)
    info = x3pio.info(path, verify=False)
    surface = info.feature_type == x3pio.FeatureType.SURFACE and len(info.shape) == 2
    affordable(path, info.layer_count * int(np.prod([int(n) for n in info.shape], dtype=object)), EXPANSION)
    channels = tuple(
        Channel(i, f"layer {i}", surface, tuple(reversed(info.shape)), "m") for i in range(info.layer_count)
    )
    complaints: list[str] = []

    def load(channel: Channel) -> Raw:
        try:
            content = x3pio.read(path)
        except x3pio.X3pChecksumError as error:
            complaints.append(f"its checksum is wrong ({brief(error)}): it was changed or damaged after it was written")
            content = x3pio.read(path, verify=False)
        layer = content.layers[channel.index]
        if not layer.is_regular_grid:
            raise InputError("its points lie on no regular grid (absolute axes): expected equal steps in x and y")
        return Raw(layer.z.T, (layer.header.x.increment, layer.header.y.increment), ("m", "m"))

    maker = info.metadata.instrument if info.metadata else None
    instrument = " ".join(filter(None, (maker.manufacturer, maker.model))) if maker else ""
    return Opened("x3p", channels, load, 0, instrument, complaints)


def _sdf(path: Path) -> Opened:
    import sdfio

    content = sdfio.read(path)
    rows, columns = content.data.shape
    channel = Channel(0, "height", rows > 1, (columns, rows), "m")
    raw = Raw(content.data.T, (content.header.x_scale, content.header.y_scale), ("m", "m"))
    maker = content.header.manufacturer_id.strip()
    return Opened("sdf", (channel,), lambda _: raw, 0, maker)


def _csv(path: Path) -> Opened:
    """Points x, y, z one a line, as SurfaceTopography takes them, or else a matrix."""
    opened = _tried(path, "xyz")
    if isinstance(opened, Opened):
        return opened
    return replace(_surface_topography(path, "asc"), format="csv")


#: Format -> suffixes without the dot, and what reads the header; of files that SurfaceTopography does not read here.
READERS: dict[str, tuple[tuple[str, ...], Callable[[Path], Opened]]] = {
    "x3p": (("x3p",), _x3p),
    "sdf": (("sdf",), _sdf),
    "csv": (("csv",), _csv),
}
_BUILT_IN = frozenset(own_suffixes())


def _npy(path: Path) -> Opened:
    heights = np.load(path, mmap_mode="r", allow_pickle=False)  # mapped: a forged shape fails before it is allocated
    areal = heights.ndim == 2 and heights.dtype.kind in "fiu"

    def load(channel: Channel) -> Raw:
        return Raw(np.array(heights.T, dtype=float, order="C"), None, None)

    return Opened("npy", (Channel(0, "array", areal, heights.shape[::-1], None),), load)


def _tried(path: Path, format: str) -> Opened | Exception:
    """The header by one reader of SurfaceTopography, or why that cannot read it."""
    try:
        return _surface_topography(path, format)
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001  (each reader has its own kinds, struct.error and KeyError among them)
        forget(error)
        return error


def _surface_topography(path: Path, format: str) -> Opened:
    from SurfaceTopography.IO import lookup_reader_by_format

    if format not in lookup_reader_by_format:
        known = sorted({*lookup_reader_by_format, *own_suffixes()})
        raise InputError(f"format is {format!r}: expected one of {', '.join(known)}, or 'auto'")
    reader = lookup_reader_by_format[format](separated_by_blanks(path) if format in _TEXT else str(path))
    theirs = list(reader.channels)

    def load(channel: Channel) -> Raw:
        found = theirs[channel.index]
        affordable(path, int(np.prod(channel.shape, dtype=object)), 1 if format in _PLAIN else EXPANSION)
        if found.is_uniform is False:
            raise InputError("its points lie on no uniform grid: expected equal steps in x and y")
        sized = found.physical_sizes is not None
        topography = found.topography() if sized else found.topography(physical_sizes=channel.shape)
        heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=float), np.nan)
        if top_line_first(format):
            heights = heights[:, ::-1]
        x, y = channel.unit, channel.unit
        if channel.unit is None:  # a header may state the units of x and y alone, which the library then leaves as read
            header = found.info.get("raw_metadata", {})
            x, y = header.get("xunit") or header.get("yunit"), header.get("yunit") or header.get("xunit")
        sides = tuple(float(size) / n for size, n in zip(topography.physical_sizes, heights.shape, strict=True))
        return Raw(heights, sides if sized else None, None if x is None else (x, y))

    default = getattr(reader, "_default_channel_index", None)
    described = theirs[0].info.get("instrument", {}) if theirs else {}
    instrument = described.get("name", "") if isinstance(described, dict) else ""
    channels = tuple(_channel(found) for found in theirs)
    return Opened(format, channels, load, default, str(instrument or ""), close=reader.close)


def _channel(found: Any) -> Channel:
    from SurfaceTopography.Support.UnitConversion import is_length_unit

    shape = tuple(int(n) for n in found.nb_grid_pts or ())
    # a reader may take an odd unit for a length: phases of Bruker files come as heights in ('µm', None)
    units = [u for u in (found.unit, found.data_unit) if u is not None]
    is_height = (
        found.is_height_channel and found.dim == 2 and all(isinstance(u, str) and is_length_unit(u) for u in units)
    )
    return Channel(found.index, str(found.channel_id), bool(is_height), shape, found.unit if is_height else None)
