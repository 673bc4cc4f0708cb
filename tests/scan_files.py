"""Scan files of every format, written for the tests: whole, tilted, damaged."""

import hashlib
import random
import resource
import sys
from pathlib import Path

import numpy as np
import pytest

from roughvisc.errors import InputError, RoughviscError
from roughvisc.topography.scans import open_scan

ROOT = Path(__file__).parents[1]
SCANS = next((p for p in (ROOT.parent / "shared" / "scans", ROOT / "shared" / "scans") if p.exists()), None)
real = pytest.mark.skipif(SCANS is None, reason="the real scans are not here")
SHAPE, CELL = (13, 9), (2e-6, 3e-6)


def tilted(missing=True):
    """Heights [m] that are told apart under any transposition or reversal."""
    x, y = np.meshgrid(np.arange(13), np.arange(9), indexing="ij")
    heights = 1e-6 * (x + 0.1 * y + 0.01 * x * y)
    if missing:
        heights[2, 5] = heights[7, 1] = np.nan
    return heights


def write_x3p(path, heights=None, **options):
    x3pio = pytest.importorskip("x3pio")
    x3pio.write(path, (tilted() if heights is None else heights).T, x_scale=CELL[0], y_scale=CELL[1], **options)
    return path


def write_sdf(path, heights=None, **options):
    sdfio = pytest.importorskip("sdfio")
    sdfio.write(path, (tilted() if heights is None else heights).T, x_scale=CELL[0], y_scale=CELL[1], **options)
    return path


def write_text(path, header="# Width: 26 µm\n# Height: 27 µm\n# Value units: m\n", missing=False):
    path.write_text(header + "\n".join(" ".join(f"{z:.9e}" for z in row) for row in tilted(missing).T) + "\n")
    return path


def refusal(*arguments, **options):
    """The message with which open_scan refuses; it names the file."""
    with pytest.raises(InputError) as refused:
        open_scan(*arguments, **options)
    assert Path(arguments[0]).name in str(refused.value)
    return str(refused.value)


TABLE = {
    "al3d-1.al3d": ((200, 296), (87.61e-6, 129.7e-6), 0.0),
    "sur-2.sur": ((563, 484), (1.961e-3, 1.686e-3), 0.0004),
    "frt-2.frt": ((150, 300), (30e-3, 60e-3), 0.274),
    "opd-1.opd": ((640, 480), (125.9e-6, 94.43e-6), 0.0004),
    "x3p-2.x3p": ((650, 650), (82.98e-6, 204.5e-6), 0.0),
    "di-3.di": ((256, 256), (10e-6, 10e-6), 0.0),
    "stp-1.stp": ((256, 256), (600e-9, 600e-9), 0.0),
    "sdf-1.sdf": ((7, 4), (7e-6, 4e-6), 0.0),
    "gwyddion-export-english.txt": ((3, 4), (12.34e-6, 5.679e-6), 0.0),
}


def damaged(content, rng):
    """Truncations at the likely places, and flips anywhere and in the header."""
    cuts = {1, 10, 80, 512, 4096, len(content) // 2, len(content) - 1, rng.randrange(len(content))}
    yield from (content[:cut] for cut in sorted(cuts) if cut < len(content))
    for flips, top in [(1, len(content)), (1, 600), (3, 600), (20, 4000), (20, len(content))] * 3:
        changed = bytearray(content)
        for _ in range(flips):
            changed[rng.randrange(min(top, len(content)))] = rng.randrange(256)
        yield bytes(changed)


def survive(path, content, **options):
    """Open every damaged version: a grid or one of our errors, within memory."""
    rng, outcomes = random.Random(1), set()
    resident = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for version in damaged(content, rng):
        path.write_bytes(version)
        try:
            h = open_scan(path, **options)
            assert h.ndim == 2
            assert np.isfinite(h).any()
            outcomes.add("read")
        except RoughviscError as error:
            outcomes.add("refused" if path.name in str(error) else str(error))
        except UserWarning as warning:  # as an error here
            outcomes.add("read" if "checksum" in str(warning) else str(warning))
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - resident
    assert grown * (1 if sys.platform == "darwin" else 1024) < 1e9
    assert {"refused"} <= outcomes <= {"refused", "read"}


def card(folder, text):
    (folder / "card.toml").write_text(text)
    return folder / "card.toml"


def file_card(folder, extra="", sha=None):
    path = write_x3p(folder / "scan.x3p")
    sha = sha or hashlib.sha256(path.read_bytes()).hexdigest()
    return card(folder, f'title = "T"\nlicence = "CC0"\nsource = "S"\nfile = "scan.x3p"\nsha256 = "{sha}"\n{extra}')
