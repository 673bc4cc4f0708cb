"""Where is it right? Time over retardation time and early over late modulus, against the closed form, as a map.

    python workflows/stability_map.py [FIGURE.png]

Each point is a case of stability_map.toml: a ball pressed in at once and held. Its force relaxes as the modulus does;
the error is that of the force over the force at once, so that it is of time alone. What is refused is hatched.
"""

import sys
from pathlib import Path

import numpy as np
import xarray as xr

import roughvisc as rv
from roughvisc.mechanics.closed_forms.growing_contact import ContactRelaxation

STUDY = Path(__file__).with_suffix(".toml")
FIGURE = Path(__file__).parents[1] / "docs" / "figures" / "stability_map.png"


def error_of(case):
    """Largest error of the force over its first value; NaN where the case is refused."""
    try:
        ds = rv.simulate(case.height(), case.material(), case.program(), times=3, fields=(), progress=False)
    except rv.InputError:
        return np.nan
    exact = ContactRelaxation.of(case.material())(ds.time.values)
    error = float(np.max(np.abs(ds.force.values / float(ds.force[0]) - exact / exact[0])))
    return error if np.isfinite(error) else np.inf


def main(figure=FIGURE, every=1):
    cases = rv.read_cases(STUDY)
    points = [(case.program().duration, case.material().compliances[0] / case.material().glassy) for case in cases]
    durations, ratios = (sorted(set(values))[::every] for values in zip(*points, strict=True))
    held = ("duration", durations, {"long_name": r"time held over retardation time, $T / \tau$"})
    ratio = ("ratio", ratios, {"long_name": r"early over late modulus, $G / G_K$"})
    error = np.full((len(durations), len(ratios)), np.nan)
    about = {"long_name": "error of the force, over the force at once"}
    found = xr.Dataset({"error": (("duration", "ratio"), error, about)}, {"duration": held, "ratio": ratio})
    for case, (time, step) in zip(cases, points, strict=True):
        if time in durations and step in ratios:
            found.error.loc[time, step] = error_of(case)
    drawn = rv.plot.stability_map(found, expected=1e-3)
    drawn.savefig(figure, dpi=200)
    refused, largest = int(found.error.isnull().sum()), float(found.error.max())
    print(f"{found.error.size} points, {refused} refused, largest error {largest:.1e}")
    return found


if __name__ == "__main__":
    main(*sys.argv[1:])
