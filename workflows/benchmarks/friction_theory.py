"""Compare Persson's theory of rubber friction with steady sliding on random surfaces of the same spectrum.

    python workflows/benchmarks/friction_theory.py [--cells 512] [--surfaces 12]

Prints for each pressure and speed the mean contact fraction and friction coefficient of the surfaces, their ratios to
the theory without reduced dissipation (g = 1), the standard errors of the ratios, and the number g with which the
theory has the friction of the surfaces. Some ten minutes on one core with 512 x 512 cells.
"""

import argparse
import logging

import numpy as np

import roughvisc as rv

SIDE, HURST, SLOPE = 1e-3, 0.8, 0.2  # m
#: Longest wave over the side, and cells of the shortest wave.
LONGEST, SHORTEST = 1 / 4, 12
RUBBER = rv.from_relaxation(1e6, [3e6, 3e6, 3e6], [1e-5, 1e-4, 1e-3])  # Pa, s
PRESSURES, SPEEDS = (5e4, 2e5, 8e5, 1.6e6), (1e-2, 0.3)  # Pa, m/s


def road(cells):
    """Spectrum of the surfaces: self-affine between two wavelengths."""
    ends = 2 * np.pi / (SIDE * LONGEST), 2 * np.pi / (SIDE * SHORTEST / cells)
    q = np.geomspace(*ends, 200)
    density = q ** (-2 - 2 * HURST)
    square = np.trapezoid(q**4 * density, np.log(q)) / (2 * np.pi)
    return rv.psd_table(q, density * SLOPE**2 / square, convention="psd")


def compare(cells, surfaces, pressures=PRESSURES, speeds=SPEEDS):
    """Yield for each pressure and speed a row of numbers, see :func:`main`."""
    spectrum = road(cells)
    table = {"wavevectors": spectrum["wavevector"].values, "densities": spectrum["psd"].values, "convention": "psd"}
    heights = [rv.from_spectrum(SIDE, cells, **table, seed=seed) for seed in range(surfaces)]
    settings = {"speeds": speeds, "tolerance": 5e-3, "grid_error": False, "progress": False}
    for pressure in pressures:
        theory = {
            g: rv.friction_theory(spectrum, RUBBER, speeds=speeds, pressure=pressure, dissipation_factor=g)
            for g in (0, 1)
        }
        curves = [rv.friction(height, RUBBER, pressure=pressure, **settings) for height in heights]
        for place, speed in enumerate(speeds):
            least, most = (float(theory[g].friction_coefficient[place]) for g in (0, 1))
            fraction = float(theory[1].contact_fraction[place])
            areas = np.array([float(one.contact_fraction[place]) for one in curves]) / fraction
            frictions = np.array([float(one.friction_coefficient[place]) for one in curves]) / most
            scatter = [float(one.std(ddof=1) / np.sqrt(one.size)) for one in (areas, frictions)]
            yield {
                "pressure": pressure,
                "speed": speed,
                "fraction": areas.mean() * fraction,
                "area": areas.mean(),
                "area_error": scatter[0],
                "coefficient": frictions.mean() * most,
                "friction": frictions.mean(),
                "friction_error": scatter[1],
                "g": (frictions.mean() * most - least) / (most - least),
            }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cells", type=int, default=512)
    parser.add_argument("--surfaces", type=int, default=12)
    given = parser.parse_args()
    logging.getLogger("roughvisc").setLevel(logging.ERROR)
    heads = ("pressure [MPa]", "speed [m/s]", "contact fraction", "over theory", "friction", "over theory, g = 1", "g")
    print(f"| {' | '.join(heads)} |")
    print("|---|---|---|---|---|---|---|")
    line = "| {:g} | {speed:g} | {fraction:.3f} | {area:.3f} ± {area_error:.3f} | {coefficient:.4f} | "
    line += "{friction:.3f} ± {friction_error:.3f} | {g:.2f} |"
    for row in compare(given.cells, given.surfaces):
        print(line.format(row["pressure"] / 1e6, **row), flush=True)


if __name__ == "__main__":
    main()
