"""A rough seal that creeps until it closes: leak rate over five decades of time, and maps of the flow.

Runs ``creeping_seal.toml``, which requests the leak rate, and draws the flow of the water.

    python workflows/creeping_seal.py [FIGURE]
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import roughvisc as rv

STUDY = Path(__file__).with_suffix(".toml")


def main(figure="creeping_seal.png"):
    with tempfile.TemporaryDirectory() as folder:
        ds = rv.run(STUDY, folder, progress=False).load()
    flowing = ds.leak_rate > 0
    for time, rate, area in zip(ds.time[flowing], ds.leak_rate[flowing], ds.contact_fraction[flowing], strict=True):
        print(f"{float(time):8.3g} s   {1e9 * float(rate):9.3g} mm3/s   {100 * float(area):5.1f} % in contact")
    first = ds.isel(time=int(np.flatnonzero(~flowing)[0]))
    print(f"closed from {float(first.time):g} s on, {100 * float(first.contact_fraction):.1f} % in contact")
    rv.plot.maps(ds, fields="flux").savefig(figure, dpi=200)
    return ds


if __name__ == "__main__":
    main(*sys.argv[1:])
