"""Make the results of this folder anew, with roughvisc of commit 9bdb14a on the path: see README.md."""

from pathlib import Path

import roughvisc as rv
from roughvisc.study.storage.store import write_dataset

HERE = Path(__file__).parent

RUBBER = """
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
"""

BALL = """
[surface]
generate = "sphere"
radius = "2 mm"
size = ["340 um", "240 um"]
shape = [17, 12]
"""

ROUGH = """
[surface]
generate = "self_affine"
size = ["34 um", "24 um"]
shape = [17, 12]
hurst = 0.8
rms_slope = 0.1
seed = 3
"""

PERIODIC = """
[solve]
boundary = "periodic"
tolerance = 1e-2
"""

STUDIES = {
    "creep": f"""
title = "Ball on rubber"
{BALL}{RUBBER}
[[program]]
load = "5 mN"
over = "0.01 s"
[[program]]
hold = "0.5 s"
[solve]
tolerance = 1e-2
grid_error = true
[keep]
times = ["0.01 s", "0.1 s", "0.51 s"]
fields = ["pressure", "gap"]
""",
    "friction": f"""
title = "Steady sliding"
{ROUGH}{RUBBER}
[friction]
pressure = "100 kPa"
speeds = ["1 um/s", "100 um/s", "10 mm/s"]
{PERIODIC}
grid_error = true
[keep]
fields = []
""",
    "slide": f"""
title = "Slide"
{ROUGH}{RUBBER}
[[program]]
pressure = "100 kPa"
over = "0.1 s"
[[program]]
slide = "8 um"
over = "0.2 s"
{PERIODIC}
[keep]
fields = []
""",
    "sweep": f"""
title = "Two loads"
{ROUGH}{RUBBER}
[[program]]
pressure = "100 kPa"
over = "0.1 s"
{PERIODIC}
time_step = "0.02 s"
[keep]
fields = ["gap"]
[observe.leakage]
viscosity = "1 mPa s"
pressure_drop = "1 bar"
[sweep]
"program.0.pressure" = ["50 kPa", "200 kPa"]
""",
}

if __name__ == "__main__":
    for name, study in STUDIES.items():
        path = HERE / f"{name}.toml"
        path.write_text(study)
        run = rv.sweep if name == "sweep" else rv.run
        run(path, out=HERE / name, progress=False)
        rv.observe(path, out=HERE / name)
    write_dataset(rv.trade(HERE / "creep.toml", budget=20, progress=False), HERE / "trade.nc")
