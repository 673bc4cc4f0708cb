"""Scans whose bytes are damaged. Formats with a checksum must notice; numbers in text are read a second time here."""

import hashlib
import io
import shutil
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from damage import damaged_bytes, within
from outcome import PATIENCE, Outcome, byte_change, compared, opened
from scan_files import CELL, SCANS, tilted, write_sdf, write_text, write_x3p

import roughvisc as rv
from roughvisc.errors import RoughviscError
from roughvisc.topography.inspection import inspect_scan
from roughvisc.topography.scans import outline

ROOT = Path(__file__).parents[2]
#: Of the real scans, those that open.
REAL = ("al3d-1.al3d", "di-3.di", "frt-2.frt", "gwyddion-export-english.txt", "opd-1.opd", "sdf-1.sdf", "stp-1.stp",
         "sur-2.sur", "x3p-2.x3p")  # fmt: skip
#: Bytes at the beginning of which half of the damage is done: there headers are.
_HEADER = 3000


@dataclass(frozen=True)
class Scan:
    """A scan as it was made.

    Attributes
    ----------
    raw : bytes
        Its content.
    suffix : str
        By which its format is known.
    options : dict
        Of ``open_scan``.
    checked : bool
        Whether the file, or what names it, has a checksum of its heights.
    numbers : callable, optional
        Heights over (x, y) by a parse of the content that is none of the package's. [m]
    card : str
        Text of a surface card through which it is opened.
    """

    raw: bytes
    suffix: str
    options: dict = field(default_factory=dict)
    checked: bool = False
    numbers: Callable | None = None
    card: str = ""


def prepare(folder, real=SCANS):
    """The originals, and what they are read as; with those in a folder of real scans."""
    heights, plain = tilted(missing=False), {"unit": "um", "spacing": CELL}
    x, y = ((np.arange(n) + 0.5) * d for n, d in zip(heights.shape, CELL, strict=True))
    points = np.column_stack([np.repeat(x, len(y)), np.tile(y, len(x)), heights.ravel()]) * 1e6
    np.save(folder / "a.npy", heights.T * 1e6)
    np.savetxt(folder / "a.csv", heights.T * 1e6, delimiter=";", fmt="%.6f")
    np.savetxt(folder / "points.xyz", points, fmt="%.6f")
    (folder / "comma.csv").write_text((folder / "a.csv").read_text().replace(".", ","))
    rv.save_scan(rv.from_array(heights, CELL), folder / "a.nc")
    for version in ("NETCDF3_CLASSIC", "NETCDF3_64BIT"):
        rv.from_array(heights, CELL).to_netcdf(folder / f"{version}.nc", engine="netcdf4", format=version)
    scans = {
        "NumPy": Scan((folder / "a.npy").read_bytes(), ".npy", plain, numbers=_of_npy),
        "CSV": Scan((folder / "a.csv").read_bytes(), ".csv", plain, numbers=partial(_of_text, separator=";", mark=".")),
        "CSV, decimal commas": Scan(
            (folder / "comma.csv").read_bytes(), ".csv", plain, numbers=partial(_of_text, separator=";", mark=",")
        ),
        "points": Scan((folder / "points.xyz").read_bytes(), ".xyz", {"unit": "um"}),
        "text with header": Scan(write_text(folder / "a.txt").read_bytes(), ".txt"),
        "X3P": Scan(write_x3p(folder / "a.x3p").read_bytes(), ".x3p", checked=True),
        "SDF": Scan(write_sdf(folder / "a.sdf").read_bytes(), ".sdf"),
        "NetCDF-4": Scan((folder / "a.nc").read_bytes(), ".nc"),
        "NetCDF-3": Scan((folder / "NETCDF3_CLASSIC.nc").read_bytes(), ".nc"),
        "NetCDF-3, 64 bit": Scan((folder / "NETCDF3_64BIT.nc").read_bytes(), ".nc"),
        "ground_steel.x3p": Scan((ROOT / "surfaces" / "ground_steel.x3p").read_bytes(), ".x3p", checked=True),
    }
    for name in REAL if real else ():
        content = (Path(real) / name).read_bytes()
        scans[name] = Scan(content, Path(name).suffix, checked=name.endswith(".x3p"))
    for name in ("SDF", "NetCDF-4", "al3d-1.al3d"):
        if name in scans:
            sum_ = hashlib.sha256(scans[name].raw).hexdigest()
            card = f'title = "T"\nfile = "{{}}"\nsha256 = "{sum_}"\n'
            scans[f"card of {name}"] = Scan(scans[name].raw, scans[name].suffix, checked=True, card=card)
    originals = {}
    for name, scan in scans.items():
        before = reader(scan, *_written(scan, scan.raw, folder, "original"))()
        if scan.numbers:
            np.testing.assert_allclose(scan.numbers(scan.raw), before.values, rtol=1e-12)
        originals[name] = scan, before.load()
    shutil.rmtree(folder / "cards", ignore_errors=True)
    return originals


def reader(scan, path, card):
    return partial(rv.open_scan, card or path, **scan.options)


def _written(scan, raw, folder, name):
    """The scan, and its card if it has one."""
    path = folder / f"{name}{scan.suffix}"
    path.write_bytes(raw)
    card = folder / f"{name}.toml" if scan.card else None
    if card:
        card.write_text(scan.card.format(path.name))
    return path, card


def examine(originals, folder, number, rng):
    name = list(originals)[rng.integers(len(originals))]
    scan, before = originals[name]
    if rng.random() < 0.5:
        head = scan.raw[:_HEADER]
        raw = damaged_bytes(rng, head) + scan.raw[_HEADER:]
    else:
        raw = damaged_bytes(rng, scan.raw)
    outcome = Outcome(number, name, byte_change(scan.raw, raw))
    path, card = _written(scan, raw, folder, f"scan{number}")
    height = opened(outcome, reader(scan, path, card), path, lambda message: True)
    if height is not None:
        unsaid = [*_unlike(scan, raw, height), *_other_header(scan, path, card, height)]
        differs = differences(before, height)
        if scan.checked and differs and not outcome.warned:
            unsaid.append("a checksum, and no word of it")
        compared(outcome, differs, unsaid)
    for one in (path, card):
        if one:
            one.unlink()
    return outcome


def _unlike(scan, raw, height):
    """What no scan may be, and heights that are not those of the parse here."""
    if height.dims != ("x", "y") or not np.isfinite(height.values).any():
        yield f"dimensions {height.dims}, {int(np.isfinite(height.values).sum())} heights"
    for axis in ("x", "y"):
        steps = np.diff(height[axis].values)
        if not (np.isfinite(steps).all() and (steps > 0).all()):
            yield f"{axis} does not ascend"
    if scan.numbers:
        try:
            said = scan.numbers(raw)
        except (ValueError, OSError, EOFError) as error:
            yield f"served although it cannot be read as it was made: {error!r}"
            return
        if said.shape != height.shape or not np.allclose(said, height.values, rtol=1e-12, atol=0, equal_nan=True):
            yield f"heights {height.shape} are not the numbers in the file {said.shape}"


def _other_header(scan, path, card, height):
    """What the header alone says, as the lazy engine serves it; and the look that a command takes at a scan."""
    try:
        with within(PATIENCE), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            warnings.simplefilter("error", RuntimeWarning)
            header = outline(card or path, **scan.options)
            inspect_scan(height)
    except RoughviscError as error:
        if path.name not in str(error):
            yield f"a refusal that does not name the file: {error}"
        return
    except BaseException as error:  # noqa: BLE001  (whatever it is, it is a traceback)
        yield f"a traceback: {type(error).__name__}: {error}"
        return
    for axis in ("x", "y"):
        if not np.array_equal(header[axis].values, height[axis].values):
            yield f"{axis} is another by the header alone"


def _of_npy(raw):
    return np.load(io.BytesIO(raw), allow_pickle=False).T * 1e-6


def _of_text(raw, separator, mark):
    """Rows of a matrix; what is empty, or stands for a missing point, is missing."""
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("cp1252")
    rows = [line.split(separator) for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if all(not row[-1].strip() for row in rows):  # a separator ends every row
        rows = [row[:-1] for row in rows]
    missing = ("", "nan", "bad", "-", "#n/a", "n/a")
    numbers = [
        [float("nan") if c.strip().lower() in missing else float(c.replace(mark, ".")) for c in row] for row in rows
    ]
    return np.array(numbers).T * 1e-6


def differences(before, after):
    """What differs of two scans, in short."""
    found = []
    if before.shape != after.shape:
        return [f"points: {before.shape} -> {after.shape}"]
    for axis in ("x", "y"):
        one, other = before[axis].values, after[axis].values
        if not np.array_equal(one, other):
            found.append(f"{axis}: {one[0]:.6g} to {one[-1]:.6g} -> {other[0]:.6g} to {other[-1]:.6g} m")
    changed = ~((before.values == after.values) | (np.isnan(before.values) & np.isnan(after.values)))
    if changed.any():
        at = tuple(int(i) for i in np.argwhere(changed)[0])
        one, other = before.values[at], after.values[at]
        found.append(f"{int(changed.sum())} heights, at {at}: {one:.6g} -> {other:.6g} m")
    for name in ("format", "channel", "instrument", "orientation"):
        if before.attrs.get(name) != after.attrs.get(name):
            found.append(f"{name}: {before.attrs.get(name)!r} -> {after.attrs.get(name)!r}")
    return found
