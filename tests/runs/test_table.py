"""The table of a sweep says of every case what was asked, how it ended and where it is."""

import csv

import pandas as pd
import pytest
from support import BALL

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.runs.csv_files import CASES
from roughvisc.runs.display import Display
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.sweep import run_cases
from roughvisc.study.case import read_cases

SMALL = BALL.replace("[24, 21]", "[12, 9]").replace("[keep]", "tolerance = 1e-2\n[keep]")
#: The last two touch the border of the grid, which counts as measured and does not grow.
SWEEP = """
[[sweep]]
"program.0.load" = ["500 uN", "1 mN", 2, "3 N"]
"solve.edge" = "error"
"material.kelvin_viscosity" = [1e5, "0.2 MPa s", 1e5, 1e5]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of a sweep of four cases, two of which fail."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "balls.toml").write_text(SMALL.replace('"A ball"', '"Bälle, größer"') + SWEEP, encoding="utf-8")
    run_cases(read_cases(folder / "balls.toml"), folder / "out", workers=0, display=Display(False))
    return folder / "out"


def test_table__says_what_the_results_say(folder):
    table = rv.to_table(folder)
    assert table.index.tolist() == [0, 1, 2, 3]
    assert table.index.name == "case"
    assert table["program.0.load [N]"].tolist() == [5e-4, 1e-3, 2, 3]
    assert table["material.kelvin_viscosity [Pa s]"].tolist() == [1e5, 2e5, 1e5, 1e5]
    assert set(table["solve.edge"]) == {"error"}
    assert table["status"].tolist() == ["converged", "converged", "failed", "failed"]
    assert (table["message"].str.contains("border") == [False, False, True, True]).all()
    for row in range(2):
        with open_result(folder / table["file"].iloc[row]) as ds:
            last = {column: ds[name] for column in table if (name := column.split(" [")[0]) in ds and name != "status"}
            assert len(last) > 6
            for column, values in last.items():
                assert table[column].iloc[row] == float(values[-1]), column
            assert table["largest stated_error"].iloc[row] == float(ds.stated_error.max())
    headings = list(table)
    assert headings.index("contact_area_error [m^2]") == headings.index("contact_area [m^2]") + 1
    assert "time_error" not in headings, "it is no error of the time"
    assert not any("residual" in heading for heading in headings), "only the steps have it"
    assert table["force [N]"].iloc[2:].isna().all()
    assert set(table["file"].iloc[2:]) == {""}


def test_table__is_written_with_the_results(folder):
    text = (folder / CASES).read_bytes()
    assert text.startswith(b"\xef\xbb\xbf"), "the mark by which a spreadsheet knows UTF-8"
    rows = list(csv.DictReader(text.decode("utf-8-sig").splitlines()))
    assert [row["title"] for row in rows] == ["Bälle, größer"] * 4
    assert [float(row["program.0.load [N]"]) for row in rows] == [5e-4, 1e-3, 2, 3]
    pd.testing.assert_frame_equal(
        pd.read_csv(folder / CASES, index_col="case", nrows=2, keep_default_na=False),
        rv.to_table(folder).iloc[:2],
        rtol=1e-6,
        check_dtype=False,
    )


def test_table__leaves_out_what_is_not_known(folder, tmp_path):
    with pytest.raises(InputError, match="holds no results"):
        rv.to_table(tmp_path)
    (tmp_path / "one.toml").write_text(SMALL)
    rv.run(rv.read_study(tmp_path / "one.toml"), out=tmp_path / "one", progress=False)
    table = rv.to_table(tmp_path / "one")
    assert table["title"].tolist() == ["A ball"]
    assert not [name for name in table if name.startswith(("program", "material"))], "nothing was varied"


def test_table__names_cases_that_were_not_reached(tmp_path):
    class Stop(Display):
        def ended(self, outcome):
            raise KeyboardInterrupt

    (tmp_path / "balls.toml").write_text(SMALL + '[sweep]\n"program.0.load" = ["1 mN", "2 mN"]\n')
    with pytest.raises(KeyboardInterrupt):
        run_cases(read_cases(tmp_path / "balls.toml"), tmp_path / "out", workers=0, display=Stop(False))
    written = pd.read_csv(tmp_path / "out" / CASES)
    assert written["status"].tolist() == ["converged", "not computed"]
    assert written["program.0.load [N]"].tolist() == [1e-3, 2e-3]
    assert rv.to_table(tmp_path / "out")["status"].tolist() == ["converged", "not computed"]
