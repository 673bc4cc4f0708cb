"""Cases in threads of one process, as ``dask.delayed(rv.run)`` computes them."""

import subprocess
import sys

import pytest
from support import SMALL

SCRIPT = """
import sys, dask, roughvisc as rv
cases = rv.read_cases("balls.toml")
found = dask.compute(
    *(dask.delayed(rv.run)(case, "results", progress=False) for case in cases), scheduler="threads", num_workers=4
)
print(len({float(ds.pressure.max()) for ds in found}))
"""


@pytest.mark.thorough
@pytest.mark.parametrize("count", [8, pytest.param(400, marks=pytest.mark.long)])
def test_run__in_four_threads(tmp_path, count):
    loads = ", ".join(f'"{4 + 0.01 * number} mN"' for number in range(count))
    (tmp_path / "balls.toml").write_text(f'{SMALL}[sweep]\n"program.0.load" = [{loads}]\n')
    done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, f"{count}\n"), done.stderr
