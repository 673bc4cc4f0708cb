"""Big results: how kept frames are best chunked, and the memory that figures, pages and observables take.

    python workflows/benchmarks/big_results.py 4096 [FOLDER] [chunks | memory]

The result is made up, of a rough contact that grows; it is written by the package itself. A field is 8 bytes a cell.
"""

import json
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
import xarray as xr
from big_scans import resident

import roughvisc as rv
from roughvisc.study.storage import store
from roughvisc.study.storage import store as encoding
from roughvisc.views.report.page import report

#: Chunks over (time, x, y) that are compared.
CHUNKS = ((8, 64, 64), (4, 128, 128), (2, 128, 128), (2, 256, 256), (1, 256, 256), (1, 512, 512), (1, 1024, 1024))


def made_up(cells, frames):
    """A result of so many cells a side: rough, periodic, 8 % in contact at the end; fields are made when asked for."""
    import dask.array as da

    x = (np.arange(cells) + 0.5) * 1e-6
    random = np.random.default_rng(1)
    numbers = random.integers(1, 60, (12, 2))
    phases = random.uniform(0, 2 * np.pi, (12, 2))

    def height():
        h = np.zeros((cells, cells))
        for (m, n), (a, b) in zip(numbers, phases, strict=True):
            along_x, along_y = (np.cos(2 * np.pi * k * x / x[-1] + p) for k, p in ((m, a), (n, b)))
            h += 1e-6 / np.hypot(m, n) * along_x[:, None] * along_y
        h += 1e-9 * np.random.default_rng(2).standard_normal(h.shape)
        return h

    h = height()
    level = np.quantile(h[:: max(1, cells // 256), :: max(1, cells // 256)], 1 - 0.08)

    def frame(number, name):
        depth = h - level - 1e-8 * (frames - 1 - number)
        if name == "pressure":
            return np.maximum(depth, 0, out=depth) * 1e13
        return np.maximum(-depth, 0, out=depth)

    def field(name):
        block = da.map_blocks(
            lambda block_id: frame(block_id[0], name)[np.newaxis],
            chunks=((1,) * frames, (cells,), (cells,)),
            dtype=float,
        )
        return ("time", "x", "y"), block

    time_ = np.linspace(0.1, 1.0, frames)
    areas = np.linspace(0.5, 1.0, frames) * 0.08 * (cells * 1e-6) ** 2
    return xr.Dataset(
        {
            "height": (("x", "y"), h),
            "pressure": field("pressure"),
            "gap": field("gap"),
            "force": ("time", time_),
            "approach": ("time", 1e-6 * time_),
            "contact_area": ("time", areas),
            "contact_area_counted": ("time", areas),
        },
        coords={"time": time_, "x": x, "y": x},
        attrs={"boundary": "periodic", "title": "made up", "tolerance": 1e-3, "result_format": 2},
    )


def in_chunks(chunk, shape):
    """Sides of the chunks of a variable, where those of a field are given."""
    return tuple(map(min, shape, chunk[-len(shape) :]))


def chunk_table(cells, folder, frames=20):
    """Time to write a field, and to read one of its frames and the history of one of its cells."""
    print(f"| chunk, {cells} x {cells} x {frames} | write a frame | read a frame | history of a cell | file |")
    print("|---|---|---|---|---|", flush=True)
    dataset = made_up(cells, frames)
    for name in ("pressure", "gap"):
        for chunk in CHUNKS:
            path = folder / "chunks.nc"
            cut = partial(in_chunks, chunk)
            with patch.object(store, "chunks", cut), patch.object(encoding, "chunks", cut):
                took = seconds(lambda n=name, p=path: store.write_result(dataset[[n, "force", "approach"]], p))
            opened = store.open_result(path)[name]
            one = min(
                seconds(lambda k=k, o=opened: o.isel(time=k).values) for k in (frames // 6, frames // 2, frames - 1)
            )
            cell = min(
                seconds(lambda i=i, o=opened: o.isel(x=i, y=cells // 3).values) for i in (5, cells // 2, cells - 9)
            )
            size = path.stat().st_size / 1e6
            row = f"{1e3 * took / frames:.0f} ms | {1e3 * one:.0f} ms | {1e3 * cell:.1f} ms | {size:.0f} MB |"
            print(f"| {name}, {' x '.join(map(str, chunk))} | {row}", flush=True)
            path.unlink()


def seconds(function):
    began = time.perf_counter()
    function()
    return time.perf_counter() - began


def steps(path, folder):
    """Name -> what is done to a stored result."""
    observed = rv.observables

    def opened(function):
        def step():
            with store.open_result(path) as dataset:
                outcome = function(dataset)
                return outcome.compute() if isinstance(outcome, xr.Dataset) else outcome

        return step

    found = {
        "figures, as plot makes them": opened(lambda ds: rv.plot.save_figures(ds, folder, "figure")),
        "report": lambda: report(path, folder / "page.html"),
        "film of all frames": opened(lambda ds: rv.plot.animate(ds, folder / "film.gif", dpi=60)),
        "maps": opened(lambda ds: rv.plot.maps(ds).savefig(folder / "maps.png")),
        "section": opened(lambda ds: rv.plot.section(ds).savefig(folder / "section.png")),
        "distributions": opened(lambda ds: rv.plot.distributions(ds).savefig(folder / "distributions.png")),
        "clusters figure": opened(lambda ds: rv.plot.contact_clusters(ds).savefig(folder / "clusters.png")),
        "surface": opened(lambda ds: rv.plot.surface(ds).savefig(folder / "surface.png")),
    }
    found |= {
        f"observables.{name}": opened(getattr(observed, name))
        for name in ("clusters", "percolation", "gap_statistics", "pressure_distribution", "gap_distribution")
    }
    return found


def measured(cells, folder, name):
    """Run one step here; its memory and time."""
    small = stored(64, folder)
    steps(small, folder)[name]()  # what the libraries take
    path = folder / f"result-{cells}.nc"
    before = resident("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # the highest from now on
    took = seconds(steps(path, folder)[name])
    return {"step": name, "fields": (resident("VmHWM") - before) / (8 * cells**2), "seconds": took}


def stored(cells, folder, frames=3):
    """File of a made-up result."""
    path = folder / f"result-{cells}.nc"
    if not path.exists():
        store.write_result(made_up(cells, frames), path)
    return path


def main():
    cells = int(sys.argv[1])
    folder = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    wanted = sys.argv[3] if len(sys.argv) > 3 else ""
    if wanted == "--only":
        print("RESULT", json.dumps(measured(cells, folder, sys.argv[4])))
        return
    if wanted in ("", "chunks"):
        chunk_table(cells, folder)
    if wanted in ("", "memory"):
        path = stored(cells, folder)
        print(f"| {cells} x {cells} x 3, pressure and gap | fields at most | seconds |\n|---|---|---|", flush=True)
        for name in steps(path, folder):
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
