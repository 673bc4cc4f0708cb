"""Statistics over realisations as text: on the command line, in the report, and what they say of a scan."""

from io import StringIO

import pandas as pd
import pytest
from rich.console import Console

from roughvisc.study.execution.sweep import sweep
from roughvisc.study.storage.index import index_of
from roughvisc.study.storage.store import write_dataset
from roughvisc.study.storage.table import realisations_table
from roughvisc.topography.synthesis import self_affine
from roughvisc.views.console.tables import realisations_tables
from roughvisc.views.realisation_rows import realisation_rows
from roughvisc.views.report.page import report

ROW = {
    "case": 1,
    "program.0.load [mN]": 20.0,
    "quantity": "contact_area",
    "unit": "m^2",
    "where": "end",
    "mean": 2e-9,
    "standard_deviation": 1e-10,
    "lower": 1.9e-9,
    "upper": 2.1e-9,
    "patch_lower": 1.5e-9,
    "patch_upper": 2.5e-9,
    "count": 24,
    "zeros": 0,
    "itself": 1.7e-9,
    "ratio": 0.85,
    "standing": "inside",
}


def test_realisation_rows__say_what_a_reader_needs():
    leak = {"quantity": "leak_rate", "unit": "m^3/s", "mean": 1e-12, "zeros": 3, "standing": "not known"}
    leak |= dict.fromkeys(("lower", "upper", "patch_lower", "patch_upper"), float("nan"))
    headings, rows, notes = realisation_rows(pd.DataFrame([ROW, ROW | leak]))
    assert headings == [
        "load [mN]",
        "quantity",
        "mean",
        "95 % of the mean",
        "95 % prediction interval",
        "scan",
        "ratio",
    ]
    assert rows[0] == ["20", "contact area", "2000 µm²", "1900 to 2100", "1500 to 2500", "1700 µm²", "0.85"]
    assert rows[1][3:5] == ["none", "none"]
    assert notes == [
        "Over 24 Gaussian surrogates of the scan, values at the end.",
        "A quantity that is zero in some of them has no interval.",
    ]


def test_realisation_rows__mark_a_scan_that_stands_outside():
    _, rows, notes = realisation_rows(pd.DataFrame([ROW | {"standing": "below"}]))
    assert rows[0][-1] == "0.85 !"
    assert notes[1].startswith("! Not a random-phase surface")
    assert "outside the 99 % of its surrogates in contact area." in notes[1]
    table = pd.DataFrame([ROW]).drop(columns=["itself", "ratio", "standing"])
    assert realisation_rows(table)[2] == ["Over 24 realisations, values at the end."]
    assert realisation_rows(pd.DataFrame()) == ([], [], [])


@pytest.mark.thorough
def test_a_sweep_of_realisations__is_told_on_the_screen_and_in_the_report(tmp_path):
    rough = self_affine(1e-3, (9, 7), hurst=0.8, rms_slope=0.1, seed=1)
    write_dataset(rough.to_dataset(name="height"), tmp_path / "scan.nc")
    (tmp_path / "study.toml").write_text(
        '[surface]\nfile = "scan.nc"\n[material]\nmodel = "elastic"\nshear_modulus = "1 MPa"\n'
        '[[program]]\npressure = "10 kPa"\nover = 0\n[solve]\nboundary = "periodic"\n[sweep]\nrealisations = 3\n'
    )
    out = tmp_path / "out"
    sweep(tmp_path / "study.toml", out, workers=0, progress=False)
    console = Console(file=StringIO(), width=200)
    console.print(realisations_tables(realisations_table(index_of(out))))
    assert "Over 3 Gaussian surrogates of the scan, values at the end." in console.file.getvalue()
    page = report(out).read_text()
    assert "<th>95 % prediction interval</th><th>Scan</th><th>Ratio</th>" in page
    assert "Contact area over time, mean and band of the realisations" in page
    assert "Contact area against force, one line per case" not in page
