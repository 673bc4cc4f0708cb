"""Error against the closed form, as a map over time and ratio of moduli.

    python workflows/stability_map.py [FIGURE.png]

Each point is a case of stability_map.toml: a ball pressed in by a step and held. Its force relaxes like the modulus.
The error of the force is relative to the initial force. Refused cases are hatched.
"""

import sys
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from maxwell_step import relaxation

import roughvisc as rv

STUDY = Path(__file__).with_suffix(".toml")
FIGURE = Path(__file__).parents[1] / "docs" / "figures" / "stability_map.png"


def error_of(case):
    """Return the largest error of the force over its first value; NaN if the case is refused."""
    try:
        ds = rv.simulate(case.height(), case.material, case.program, times=3, fields=(), progress=False)
    except rv.InputError:
        return np.nan
    equilibrium, moduli, times = relaxation(case.material)
    exact = equilibrium + np.exp(-ds.time.values[:, None] / times) @ moduli
    error = float(np.max(np.abs(ds.force.values / float(ds.force[0]) - exact / exact[0])))
    return error if np.isfinite(error) else np.inf


def draw(error, largest):
    """Draw the errors as a map; refused cases are hatched, errors beyond the largest are framed."""
    across, up = error.dims
    values = np.maximum(error.transpose(up, across).values, 1e-6 * largest)
    figure = Figure(figsize=(5.6, 3.9), layout="constrained")
    axes = figure.add_subplot()
    shown = np.ma.masked_invalid(values)
    image = axes.pcolormesh(shown, cmap="cividis", norm=LogNorm(1e-6 * largest, largest), edgecolors="w", lw=0.6)
    figure.colorbar(image, extend="min", label=error.attrs["long_name"])
    marks = {"refused": (np.isnan(values), "0.5", "////"), f"beyond {largest:g}": (values > largest, "#d55e00", None)}
    for label, (where, colour, hatch) in marks.items():
        for row, column in np.argwhere(where):
            axes.add_patch(Rectangle((column, row), 1, 1, fill=False, ec=colour, hatch=hatch, label=label))
    for axis, dim in ((axes.xaxis, across), (axes.yaxis, up)):
        powers = np.log10(error[dim].values)
        axis.set_ticks(np.arange(len(powers)) + 0.5, [f"$10^{{{power:.3g}}}$" for power in powers])
        axis.set_label_text(error[dim].attrs["long_name"])
    handles, labels = axes.get_legend_handles_labels()
    if labels:
        named = dict(zip(labels, handles, strict=True))
        figure.legend(named.values(), named, loc="outside upper center", ncols=2)
    return figure


def main(figure=FIGURE, every=1):
    cases = rv.read_cases(STUDY)
    points = [(case.program.duration, case.material.compliances[0] / case.material.glassy) for case in cases]
    durations, ratios = (sorted(set(values))[::every] for values in zip(*points, strict=True))
    held = ("duration", durations, {"long_name": r"time held over retardation time, $T / \tau$"})
    ratio = ("ratio", ratios, {"long_name": r"early over late modulus, $G / G_K$"})
    error = np.full((len(durations), len(ratios)), np.nan)
    about = {"long_name": "error of the force, over the force at once"}
    found = xr.Dataset({"error": (("duration", "ratio"), error, about)}, {"duration": held, "ratio": ratio})
    for case, (time, step) in zip(cases, points, strict=True):
        if time in durations and step in ratios:
            found.error.loc[time, step] = error_of(case)
    draw(found.error, largest=1e-3).savefig(figure, dpi=200)
    refused, largest = int(found.error.isnull().sum()), float(found.error.max())
    print(f"{found.error.size} points, {refused} refused, largest error {largest:.1e}")
    return found


if __name__ == "__main__":
    main(*sys.argv[1:])
