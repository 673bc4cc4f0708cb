"""Contact area of random elastic surfaces on finer and finer cells, against Persson's theory.

    python workflows/benchmarks/elastic_area.py [--surfaces 4]

Prints, for each pressure over modulus and rms slope, the contact fraction on cells of the shortest wave over 4, 8, 16
and 32, its limit for small cells, and its ratio to the theory. The contact fraction is ``kappa`` times this pressure
for small pressures: 1.60 by Persson's theory, 2.51 by that of Bush, Gibson and Thomas.
"""

import argparse
import logging
import math
import warnings

import numpy as np

import roughvisc as rv

PRESSURES = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8)  # over contact modulus and rms slope
CELLS = (4, 8, 16, 32)  # of the shortest wave
#: Shortest waves along a side; the longest wave is a quarter of the side.
WAVES = 16


def compare(surfaces):
    """Yield a row of numbers for each pressure."""
    rubber, slope = rv.elastic(shear_modulus=0.25), 0.1
    fractions = np.zeros((surfaces, len(CELLS), len(PRESSURES)))
    for seed in range(surfaces):
        fine = rv.self_affine(
            1.0, WAVES * CELLS[-1], hurst=0.8, rms_slope=slope, rolloff=0.25, shortcut=1 / WAVES, seed=seed
        )
        for place, cells in enumerate(CELLS):
            stride = CELLS[-1] // cells
            coarse = rv.from_array(fine.values[::stride, ::stride], spacing=1 / (WAVES * cells))
            loads = [pressure * slope for pressure in PRESSURES]
            program = rv.Program.table(range(len(loads)), loads, "pressure")
            options = {"boundary": "periodic", "progress": False, "tolerance": 1e-3, "fields": ()}
            ds = rv.simulate(coarse, rubber, program, times=range(len(loads)), **options)
            fractions[seed, place] = ds.contact_fraction.values
    for row, pressure in enumerate(PRESSURES):
        mean = fractions[:, :, row].mean(axis=0)
        limit = 2 * mean[-1] - mean[-2]  # the error is proportional to the cell
        error = fractions[:, -1, row].std(ddof=1) / math.sqrt(surfaces)
        theory = math.erf(math.sqrt(2) * pressure)
        yield pressure, *mean, limit, error, theory, limit / theory, limit / pressure


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--surfaces", type=int, default=4)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    logging.getLogger("roughvisc").setLevel(logging.ERROR)
    heads = ["pressure", *(f"{cells} cells" for cells in CELLS), "limit", "error", "theory", "limit / theory", "kappa"]
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for row in compare(given.surfaces):
        print(f"| {' | '.join(f'{value:.3g}' for value in row)} |", flush=True)


if __name__ == "__main__":
    main()
