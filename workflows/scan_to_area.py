"""Contact area against load of ``scan_to_area.toml`` at several times, with the elastic limits.

    python workflows/scan_to_area.py [FOLDER]

Under a constant load the contact grows from the elastic contact with the glassy modulus to the elastic contact with the
rubbery modulus. Both are computed on the same surface. The lines at low loads are for a Gaussian surface of the same
slope. Ground steel has fewer peaks than valleys, and two to three times this area.
"""

import sys
from pathlib import Path

import xarray as xr

import roughvisc as rv

STUDY = Path(__file__).with_suffix(".toml")


def main(folder=STUDY.parent / "results" / STUDY.stem, changes=None):
    """Compute the cases and return the figure."""
    cases = [rv.vary(case, changes or {}) for case in rv.read_cases(STUDY)]
    poisson, compliance = cases[0].material.poisson, cases[0].material.contact_compliance
    limits = {"glassy": 1 / float(compliance(0.0)), "rubbery": 1 / float(compliance(float("inf")))}
    elastic = {}
    for name, contact_modulus in limits.items():
        solid = {"model": "elastic", "shear_modulus": contact_modulus * (1 - poisson) / 2, "poisson": poisson}
        runs = [rv.run(rv.vary(case, {"material": solid}), folder, progress=False) for case in cases]
        elastic[name] = at_age(runs, runs[0].time[-1])
    results = [rv.run(case, folder, progress=False) for case in cases]
    between = results[0].time.values[1:-1]  # the first is the glassy contact, the last as good as the rubbery one
    lines = {"elastic, glassy": elastic["glassy"]}
    lines |= {f"after {1e3 * t:g} ms": at_age(results, t) for t in between}
    lines |= {"elastic, rubbery": elastic["rubbery"]}
    figure = rv.plot.area_against_load(lines, contact_modulus=limits)
    figure.savefig(Path(folder) / "area_against_load.png", dpi=200)
    return figure


def at_age(results, time):
    """Return the states of all cases at one time as one Dataset along the loads."""
    return xr.concat(
        [ds.sel(time=[time]) for ds in results],
        "time",
        data_vars="minimal",
        coords="minimal",
        compat="override",
        join="exact",
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
