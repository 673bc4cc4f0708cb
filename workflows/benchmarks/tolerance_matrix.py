"""Is the tolerance kept? Materials x loading programs x tolerances, measured against runs at a tenth of the tolerance.

    python workflows/benchmarks/tolerance_matrix.py [OUT.nc] [FIGURE.png]

The error is the largest over eight kept times: of the pressure (L1, over the largest force so far) and of the approach
(over its largest value so far), on the same grid. Power laws without a glassy part are judged on the approach.
"""

import sys
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import roughvisc as rv

TOLERANCES = (1e-2, 1e-3, 1e-4)
GRID, SIZE, RADIUS, SPAN = (33, 35), 1.0, 1.0, 4.0
ROWS = np.geomspace(1e-4, 4 * SPAN, 40)
NOISE = 1 + 0.01 * np.random.default_rng(7).standard_normal(40)
MATERIALS = {
    "Maxwell": rv.maxwell(1.0, 1.0),
    "Zener 1:1": rv.zener(1.0, 1.0, 1.0),
    "Zener 1:100": rv.zener(1.0, 0.01, 0.01),
    "Kelvin-Voigt": rv.kelvin_voigt(1.0, 1.0),
    **{f"0.3 + t^{a}": rv.PowerLaw(0.3, 1.0, a) for a in (0.2, 0.5, 0.8)},
    "table, 1 % noise": rv.Tabulated(tuple(ROWS), tuple((0.3 + ROWS**0.4) * NOISE), noise=0.1),
    **{f"t^{a}": rv.PowerLaw(0.0, 1.0, a) for a in (0.2, 0.5, 0.8)},
}


def programs(load, approach):
    new = rv.Program
    return {
        "step, hold": new().load(load, over=0).hold(4),
        "ramp, hold": new().load(load, over=1).hold(3),
        "triangle": new().load(load, over=2).load(0.1 * load, over=2),
        "triangle, hold, reload": new().load(load, over=1).load(0, over=1).hold(1).load(load, over=1),
        "five cycles": new().load(0.5 * load, over=0.5) + new.cycle(0.5 * load, 0.4 * load, 0.7, 5),
        "approach, hold": new().approach(approach, over=1).hold(3),
        "load, hold approach": new().load(load, over=1).hold(3, control="approach"),
    }


def column(task):
    """Errors over tolerance and steps for all tolerances of one material and program."""
    material, name, tolerances = MATERIALS[task[0]], task[1], task[2]
    radius = 0.36 * SIZE
    load = 4 * radius**3 / (3 * RADIUS) / float(material.contact_compliance(SPAN))
    program = programs(load, radius**2 / RADIUS)[name]
    ball = rv.sphere(RADIUS, SIZE, GRID)
    kept = program.duration * np.arange(1, 9) / 8
    runs = {}
    for tolerance in (*tolerances, tolerances[-1] / 10):
        steps = []
        runs[tolerance] = rv.simulate(
            ball,
            material,
            program,
            times=kept,
            tolerance=tolerance,
            edge="accept",
            fields=("pressure",),
            progress=lambda now, end, s=steps: s.append(now),
        )
        runs[tolerance].attrs["steps"] = len(steps)
    found = []
    for tolerance in tolerances:
        run, exact = runs[tolerance], runs[tolerance / 10]
        force = np.maximum.accumulate(exact.pressure.sum(("x", "y")).values)
        largest = np.maximum.accumulate(np.abs(exact.approach.values))
        pressure = float((abs(run.pressure - exact.pressure).sum(("x", "y")).values / force).max())
        approach = float((abs(run.approach - exact.approach).values / largest).max())
        judged = approach if task[0].startswith("t^") else max(pressure, approach)
        found.append((judged / tolerance, pressure / tolerance, approach / tolerance, run.attrs["steps"]))
    return found


def main(
    out="tolerance_matrix.nc",
    figure="tolerance_matrix.png",
    materials=tuple(MATERIALS),
    tolerances=TOLERANCES,
    workers=2,
):
    """The whole matrix; each tolerance is a tenth of the one before. ``workers`` 0: in this process."""
    names = tuple(programs(1, 1))
    tasks = [(m, p, tolerances) for m in materials for p in names]
    if workers:
        with ProcessPoolExecutor(workers) as pool:
            cells = list(pool.map(column, tasks))
    else:
        cells = [column(task) for task in tasks]
    values = np.array(cells).reshape(len(materials), len(names), len(tolerances), 4)
    dims = ("material", "program", "tolerance")
    quantities = ("error_over_tolerance", "pressure_error_over_tolerance", "approach_error_over_tolerance", "steps")
    ds = xr.Dataset(
        {q: (dims, values[..., i]) for i, q in enumerate(quantities)},
        coords={"material": list(materials), "program": list(names), "tolerance": list(tolerances)},
    )
    ds.to_netcdf(out, engine="netcdf4")
    draw(ds).savefig(figure, dpi=200)
    judged = ds.error_over_tolerance
    print(f"{float((judged <= 1).mean()):.1%} of {judged.size} within the tolerance, largest {float(judged.max()):.2f}")
    for cell in (
        judged.stack(cell=dims).where(lambda e: e > 1, drop=True).cell.values if bool((judged > 1).any()) else ()
    ):
        at = dict(zip(dims, cell, strict=True))
        print("missed:", *cell, f"{float(judged.sel(at)):.2f}, {int(ds.steps.sel(at))} steps")
    return ds


def draw(ds):
    fig = Figure(figsize=(10, 4.6), layout="constrained")
    for axes, part in zip(
        fig.subplots(1, len(ds.tolerance), sharey=True, squeeze=False)[0], range(len(ds.tolerance)), strict=True
    ):
        error, steps = ds.error_over_tolerance.isel(tolerance=part), ds.steps.isel(tolerance=part)
        image = axes.pcolormesh(np.log10(np.maximum(error, 1e-2)), cmap="cividis", vmin=-2, vmax=0.3)
        for i, j in np.ndindex(*error.shape):
            dark = error[i, j] < 0.2
            axes.text(j + 0.5, i + 0.5, f"{float(error[i, j]):.2f}\n{int(steps[i, j])}", ha="center", va="center",
                      fontsize=5.5, color="white" if dark else "black")  # fmt: skip
        axes.set_xticks(np.arange(len(ds.program)) + 0.5, ds.program.values, rotation=60, ha="right", fontsize=7)
        axes.set_yticks(np.arange(len(ds.material)) + 0.5, ds.material.values, fontsize=7)
        axes.set_title(f"tolerance {float(ds.tolerance[part]):g}", fontsize=9)
    bar = fig.colorbar(image, ax=fig.axes, ticks=[-2, -1, 0], shrink=0.8)
    bar.ax.set_yticklabels(["0.01", "0.1", "1"])
    bar.set_label("measured error over tolerance (below it: steps)")
    return fig


if __name__ == "__main__":
    main(*sys.argv[1:])
