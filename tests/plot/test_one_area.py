"""One number, one meaning: table, console, report and figures state the same contact area and share."""

import csv
import math
import re
from io import StringIO

import numpy as np
import pytest
from rich.console import Console
from support import BALL

import roughvisc as rv
from roughvisc.cli.tables import result_table
from roughvisc.study.storage.netcdf import open_result
from roughvisc.study.storage.results_table import CASES
from roughvisc.topography.grid import nominal_area

STUDY = BALL.replace("[24, 21]", "[17, 12]").replace("[keep]", "tolerance = 1e-2\n[keep]")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("areas")
    (folder / "ball.toml").write_text(STUDY + '[sweep]\n"program.0.load" = ["1 mN", "2 mN"]\n')
    rv.sweep(folder / "ball.toml", out=folder / "out", workers=0, progress=False)
    return folder / "out"


def printed(text):
    """First number with a unit of area or a percent sign in a text. [m2], [1]"""
    number, unit = re.search(r"([\d.e-]+) (mm²|µm²|m²|nm²|%)", text).groups()
    return float(number) * {"mm²": 1e-6, "µm²": 1e-12, "nm²": 1e-18, "m²": 1.0, "%": 0.01}[unit]


def test_one_row__has_one_area_and_one_share_everywhere(folder):
    table = list(csv.DictReader((folder / CASES).read_text("utf-8-sig").splitlines()))
    swept = rv.open_results(folder)
    for number, told in enumerate(table):
        ds = open_result(folder / told["file"]).load()
        # the reference: cells of the kept pressure, less 0.088 of a cell for each face, in free space
        contact = np.pad(ds.pressure.values[-1] > 0, 1)
        faces = sum(np.count_nonzero(contact & ~np.roll(contact, turn, axis)) for axis in (0, 1) for turn in (1, -1))
        cell = float(ds.x[1] - ds.x[0]) * float(ds.y[1] - ds.y[0])
        area = (np.count_nonzero(contact) - 0.088 * faces) * cell
        share = area / nominal_area(ds)
        assert area < np.count_nonzero(contact) * cell
        assert float(told["contact_area [m^2]"]) == pytest.approx(area, rel=1e-6, abs=0)
        assert float(told["contact_fraction"]) == pytest.approx(share, rel=1e-6)
        console = Console(width=200, record=True, file=StringIO())
        console.print(result_table(ds))
        line = next(line for line in console.export_text().splitlines() if "Contact area at the end" in line)
        assert printed(line) == pytest.approx(area, rel=5e-3, abs=0)
        assert printed(line.partition(",")[2]) == pytest.approx(share, rel=5e-3)
        panel = next(ax for ax in rv.plot.history(ds).axes if ax.get_ylabel().startswith("Contact area"))
        drawn = panel.lines[0]
        unit = printed(f"1 {panel.get_ylabel().partition('[')[2]}")
        assert drawn.get_ydata()[-1] * unit == pytest.approx(area, rel=1e-9, abs=0)
        across = rv.plot.sweep(swept, times=[-1]).axes[0]
        unit = printed(f"1 {across.get_ylabel().partition('[')[2]}")
        assert np.asarray(across.lines[0].get_ydata())[number] * unit == pytest.approx(area, rel=1e-9, abs=0)
        assert math.isclose(float(swept.contact_area[number, -1]), area, rel_tol=1e-12)
