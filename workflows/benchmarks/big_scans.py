"""Memory of a big scan: what reading, conditioning, storing and looking at it takes, in fields of the scan.

    python workflows/benchmarks/big_scans.py 4096 [FOLDER] [STEP ...]

A field is 8 bytes a point. Every step runs in a process of its own; stated is the highest resident memory above that
of the process before it held any heights, the scan itself and the outcome included. Files are made in FOLDER.
"""

import hashlib
import json
import resource
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import roughvisc as rv
from roughvisc.cli.scans import scan as scan_command
from roughvisc.topography.inspection import inspect_scan

SPACING = 1e-6
FORMATS = ("npy", "nc", "sdf", "x3p", "sur")
CARD = '[conditioning]\nlevel = 1\noutliers = true\nfill = "harmonic"\nfilter = "20 um"\n'


def waves(cells, rows=256):
    """Blocks of rows of a tilted rough scan: waves over a wide range of lengths, noise, holes and spikes. [m]"""
    random = np.random.default_rng(1)
    y = np.arange(cells) / cells
    phases = random.uniform(0, 2 * np.pi, (40, 2))
    numbers = random.integers(1, 200, (40, 2))
    for first in range(0, cells, rows):
        x = np.arange(first, min(first + rows, cells))[:, None] / cells
        block = 5e-6 * x + 2e-6 * y + 2e-8 * random.standard_normal((len(x), cells))
        for (m, n), (a, b) in zip(numbers, phases, strict=True):
            block += 1e-6 / np.hypot(m, n) * np.cos(2 * np.pi * m * x + a) * np.cos(2 * np.pi * n * y + b)
        at = random.integers(0, block.size, block.size // 2000)
        block.reshape(-1)[at] += 1e-5
        for _ in range(block.size // 36_000):  # a hundredth of the points, in holes of some hundreds
            i, j = random.integers(0, len(x)), random.integers(0, cells)
            block[i : i + 12, j : j + 30] = np.nan
        yield slice(first, first + len(x)), block


def make(folder, cells, format):
    """A scan of that many points a side, unless it is there."""
    path = folder / f"scan-{cells}.{format}"
    if path.exists():
        return path
    if format == "npy":
        heights = np.lib.format.open_memmap(path, "w+", float, (cells, cells))
        for rows, block in waves(cells):
            heights[rows] = block
    elif format == "sur":
        with path.open("wb") as file:
            file.write(sur_header(cells))
            for _, block in waves(cells):
                file.write(np.where(np.isnan(block), -(1 << 30), np.rint(block / 1e-11)).astype("<i4").tobytes())
    else:
        rv.save_scan(rv.from_array(np.load(make(folder, cells, "npy")), SPACING), path)
    return path


def sur_header(cells):
    """512 bytes before the heights in a file of Digital Surf; one unit is 10 pm."""
    texts = [b"x", b"y", b"height", b"um", b"um", b"um", b"um", b"um", b"um"]
    return struct.pack(
        "<12s4H30s30s5H2IH4iI3f16s16s16s16s16s16s16s16s16s3f3H3I7Hf2I3H128s3f34b",
        *(b"DIGITAL SURF", 0, 1, 1, 2, b"", b"", 0, 0, 0, 1, 1, 0, 0, 32, 2 - (1 << 30), 1 << 30),
        *(cells, cells, cells * cells, 1.0, 1.0, 1e-5, *texts, 1.0, 1.0, 1.0),
        *(0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 2026, 0, 0.0, 0, 0, 0, 0, 0, b"", 0.0, 0.0, 0.0, *(0,) * 34),
    )


def height(folder, cells):
    """The scan in memory: one field."""
    return rv.from_array(np.load(folder / f"scan-{cells}.npy"), SPACING)


def whole(h):
    """The scan without its missing points, in the same field."""
    h.values[np.isnan(h.values)] = 0.0
    return h


def steps(folder, cells):
    """Name -> what prepares a step, and the step."""

    def scan():
        return height(folder, cells)

    def opening(format):
        path = folder / f"scan-{cells}.{format}"
        needed = {"unit": "m", "spacing": SPACING} if format == "npy" else {}
        return lambda: None, lambda _: rv.open_scan(path, **needed)

    found = {f"open {format}": opening(format) for format in FORMATS}
    found |= {
        "level": (scan, rv.level),
        "mask_outliers": (scan, rv.mask_outliers),
        "fill": (scan, rv.fill),
        "gaussian_filter": (scan, lambda h: rv.gaussian_filter(h, 20e-6)),
        "gaussian_filter, periodic": (scan, lambda h: rv.gaussian_filter(whole(h), 20e-6, periodic=True)),
        "resample to 3/4": (scan, lambda h: rv.resample(h, 3 * cells // 4)),
        "parameters": (scan, rv.parameters),
        "psd": (scan, lambda h: rv.psd(whole(h), window="hann")),
        "mirror (four fields come out)": (scan, rv.mirror),
        "save nc": (scan, lambda h: rv.save_scan(h, folder / "out.nc")),
        "save sdf": (scan, lambda h: rv.save_scan(h, folder / "out.sdf")),
        "save x3p": (scan, lambda h: rv.save_scan(h, folder / "out.x3p")),
        "inspect_scan": (scan, inspect_scan),
        "surface figure": (scan, lambda h: rv.plot.surface(h).savefig(folder / "out.png")),
        "surface card: level, outliers, fill, filter": (lambda: None, lambda _: rv.open_scan(card(folder, cells))),
        "roughvisc scan": (lambda: None, lambda _: say_what_is_in_it(folder, cells)),
    }
    return found


def card(folder, cells):
    path = folder / f"scan-{cells}.toml"
    scan = folder / f"scan-{cells}.sdf"
    with scan.open("rb") as file:
        sha = hashlib.file_digest(file, "sha256").hexdigest()
    path.write_text(f'file = "{scan.name}"\nsha256 = "{sha}"\n{CARD}')
    return path


def say_what_is_in_it(folder, cells):
    arguments = [str(folder / f"scan-{cells}.sdf"), "--plot", str(folder / "out.png"), "--force"]
    scan_command.main(arguments, standalone_mode=False)


def resident(which):
    """Resident memory of this process, now (VmRSS) or at most so far (VmHWM). [byte]"""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(which):
            return 1024 * int(line.split()[1])
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def measured(folder, cells, name):
    """Run one step here; its memory and time."""
    prepare, step = steps(folder, 64)[name]
    for format in FORMATS:
        make(folder, 64, format)
    step(prepare())  # what the libraries take
    before = resident("VmRSS")
    prepare, step = steps(folder, cells)[name]
    h = prepare()
    Path("/proc/self/clear_refs").write_text("5")  # the highest from now on
    began = time.perf_counter()
    outcome = step(h)
    took = time.perf_counter() - began
    del outcome
    return {"step": name, "fields": (resident("VmHWM") - before) / (8 * cells**2), "seconds": took}


def main():
    cells = int(sys.argv[1])
    folder = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    if len(sys.argv) > 4 and sys.argv[3] == "--only":
        print("RESULT", json.dumps(measured(folder, cells, sys.argv[4])))
        return
    for format in FORMATS:
        make(folder, cells, format)
    print(f"| {cells} x {cells} points | fields at most | seconds |\n|---|---|---|", flush=True)
    for name in sys.argv[3:] or steps(folder, cells):
        command = [sys.executable, __file__, str(cells), str(folder), "--only", name]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        line = next((one for one in done.stdout.splitlines() if one.startswith("RESULT")), None)
        if line is None:
            print(f"| {name} | failed: {done.stderr.strip().splitlines()[-1:]} | |", flush=True)
            continue
        found = json.loads(line.removeprefix("RESULT"))
        print(f"| {name} | {found['fields']:.2f} | {found['seconds']:.1f} |", flush=True)


if __name__ == "__main__":
    main()
