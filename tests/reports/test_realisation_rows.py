"""Statistics over realisations as text: on the command line, in the report, and what they say of a scan."""

import pandas as pd

from roughvisc.reports.realisations import realisation_rows

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
    "itself": 1.7e-9,
    "ratio": 0.85,
}


def test_realisation_rows__say_what_a_reader_needs():
    leak = {"quantity": "leak_rate", "unit": "m^3/s", "mean": 1e-12}
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
    assert notes == ["Over 24 Gaussian surrogates of the scan, values at the end."]


def test_realisation_rows__of_no_scan():
    table = pd.DataFrame([ROW]).drop(columns=["itself", "ratio"])
    headings, rows, notes = realisation_rows(table)
    assert len(headings) == len(rows[0]) == 5
    assert "24 realisations" in notes[0]
    assert realisation_rows(pd.DataFrame()) == ([], [], [])
    follows = pd.DataFrame([ROW | {"quantity": "contact_fraction"}])
    assert realisation_rows(follows) == ([], [], [])
