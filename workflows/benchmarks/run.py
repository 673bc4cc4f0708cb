"""All benchmarks: prints the tables and writes them as NetCDF.

    python workflows/benchmarks/run.py [--small] [--only paper,tamaas,contact_mechanics] [--out benchmarks.nc]

Every figure is a ratio or a count measured in one run, at equal or smaller measured error. Times are processor times,
of one thread. Tamaas and ContactMechanics are used if installed.
"""

import argparse
import pathlib
import sys

import numpy as np
import xarray as xr

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import against_contact_mechanics
import against_paper
import against_tamaas

SMALL = {
    "paper": {"sizes": ((32, 10),), "repeats": 1},
    "tamaas": {"sizes": (32,), "areas": (0.3,), "creep_steps": (10,), "creep_cells": 32, "repeats": 1},
    "contact_mechanics": {"sizes": (32,), "areas": (0.3,), "repeats": 1},
}
PARTS = {
    "paper": against_paper.measure,
    "tamaas": against_tamaas.measure,
    "contact_mechanics": against_contact_mechanics.measure,
}


def main(parts=tuple(PARTS), small=False, out=None):
    tables = {}
    for part in parts:
        rows = []
        for row in PARTS[part](**(SMALL[part] if small else {})):
            rows.append(row)
            print("  ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()), flush=True)
        tables[part] = rows
    if out:
        rows = [row | {"table": part} for part, table in tables.items() for row in table]
        names = sorted({name for row in rows for name in row})
        columns = {n: ("row", [row.get(n, "" if n in ("case", "peer") else np.nan) for row in rows]) for n in names}
        xr.Dataset(columns).to_netcdf(out, engine="netcdf4")
    return tables


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--only", default=",".join(PARTS))
    parser.add_argument("--out")
    given = parser.parse_args()
    main(given.only.split(","), given.small, given.out)
