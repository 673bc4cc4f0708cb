"""The page to explore results, in a browser: what it shows is what the result contains."""

import html
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import sample_results as made
import xarray as xr
from click.testing import CliRunner
from matplotlib import colormaps
from matplotlib.colors import to_hex
from support import refused

import roughvisc as rv
from roughvisc.cli import main
from roughvisc.plot import result_page
from roughvisc.plot.style import CONTACT, NO_CONTACT
from roughvisc.runs.netcdf import write_result

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
HOSTILE = "Dents </script><script>throw Error('alert')</script> & <b>bumps</b>"

#: Collects what the browser complains about, before any other script.
LISTEN = """<script>
const complaints = [];
for (const kind of ["error", "warn"]) console[kind] = (...what) => complaints.push(what.join(" "));
addEventListener("error", (event) => complaints.push(event.message));
addEventListener("unhandledrejection", (event) => complaints.push(String(event.reason)));
addEventListener("securitypolicyviolation", (event) => complaints.push(event.blockedURI));
</script>"""

#: Uses the page as a reader does, and writes what it shows into the document.
READER = Path(__file__).with_name("page_reader.js").read_text()


def read(path, steps, places, tmp_path):
    """Return what a browser shows after each step of a reader, and everything that it complains about."""
    text = path.read_text(encoding="utf-8")
    reader = READER.replace("STEPS", json.dumps(steps)).replace("PLACES", json.dumps(places))
    reader = f'<script type="module">{reader}</script>'
    read_by = tmp_path / "read.html"
    read_by.write_text(text.replace("<head>", "<head>" + LISTEN, 1).replace("</body>", reader + "</body>"))
    options = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'browser'}"]
    command = [BROWSER, *options, "--virtual-time-budget=30000", "--dump-dom", read_by.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    shown = json.loads(html.unescape(re.search(r'<pre id="result">(.*?)</pre>', done.stdout, re.S)[1]))
    assert shown["complaints"] == []
    return shown


@pytest.mark.thorough
@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
def test_page__shows_in_a_browser_what_the_results_contain(tmp_path):
    one = made.rough_creep((24, 20), 5).assign_attrs(title=HOSTILE)
    one["pressure"][0] = np.nan  # a row without values
    other = one.copy(deep=True)
    other["pressure"] *= 2
    tension = 0.2 * float(other["pressure"][3].max())
    edge = np.argwhere((other["pressure"][3] > 0).values)[0]
    other["pressure"] = other["pressure"].where(other["pressure"] != 0, -tension)
    other["pressure"][3, edge[0], edge[1]] = -tension / 2  # contact carries tension too
    texts = [{"title": HOSTILE, "varied": {"material.shear_modulus": value}} for value in (1e6, 2e6)]
    for number, (case, text) in enumerate(zip((one, other), texts, strict=True)):
        write_result(case.assign_attrs(case=json.dumps(text), case_key=f"{number:016x}"), tmp_path / f"{number}.nc")
    path = rv.plot.page(tmp_path)
    i, j = np.unravel_index(int(one.pressure[4].fillna(0).values.argmax()), one.pressure[4].shape)
    crest = float(one.x[i] * 1e3), float(one.y[j] * 1e3)
    absent = np.argwhere(one.height.isnull().values)[3]
    apart = np.argwhere((one.pressure[4] == 0).values & one.height.notnull().values)[7]
    places = [[(a + 0.4) / 24, (b + 0.4) / 20] for a, b in ([i, j], absent, apart)]
    steps = [("row", 4), ("point", crest), ("field", "gap"), ("field", "pressure"), ("key", "ArrowLeft")]
    stuck = float(one.x[edge[0]] * 1e3), float(one.y[edge[1]] * 1e3)
    steps += [("varied Shear modulus", "2 MPa"), ("point", stuck), ("scale", "row"), ("row", 0)]
    shown = read(path, steps, places, tmp_path)
    assert shown["title"] == HOSTILE
    last, point, gap, _, before, second, pulled, scaled, empty = shown["found"]
    largest, high = float(one.pressure[4].max()), float(one.pressure[1:].max())
    expected = to_hex(colormaps["viridis_r"](min(int(largest / high * 256), 255)))
    distance = [abs(int(last["colours"][0][k : k + 2], 16) - int(expected[k : k + 2], 16)) for k in (1, 3, 5)]
    assert max(distance) <= 8
    assert last["colours"][1:] == ["#b8b8b8", NO_CONTACT]
    assert float(re.search(r"pressure ([\d.]+) MPa, in contact", point["reading"])[1]) == pytest.approx(
        1e-6 * largest, rel=1e-3
    )
    assert gap["colours"][0] == CONTACT
    assert "Gap [µm]" in gap["key"]
    times = one.time.values
    assert last["now"] == pytest.approx(times[4], rel=1e-6)
    assert before["now"] == pytest.approx(times[3], rel=1e-6)
    assert before["place"] != last["place"]
    assert f"Contact fraction {100 * float(one.contact_fraction[3]):.3g} %" in before["facts"]
    value = float(re.search(r"pressure ([\d.]+) MPa", second["reading"])[1])
    assert value == pytest.approx(2e-6 * float(one.pressure[3, i, j]), rel=1e-3)
    assert second["colours"][1:] == ["#b8b8b8", to_hex(colormaps["RdBu_r"](0.0))]
    value = float(re.search(r"pressure (-[\d.]+) MPa, in contact", pulled["reading"])[1])
    assert value == pytest.approx(-5e-7 * tension, rel=2e-3)
    assert scaled["key"] != second["key"]
    assert empty["colours"] == ["#b8b8b8"] * 3
    assert "missing" in empty["reading"]


@pytest.mark.parametrize("make", [made.one_frame, made.open_contact, lambda: made.hertz_creep()[["force", "approach"]]])
def test_page__of_few_data_needs_no_other_file_and_no_user_text_is_a_script(make, tmp_path):
    path = rv.plot.page(make().assign_attrs(title=HOSTILE), tmp_path / "page.html")
    text = path.read_text(encoding="utf-8")
    assert "default-src 'none'" in text
    assert text.count("</script>") == 3
    assert html.unescape(re.search("<title>(.*?)</title>", text)[1]) == HOSTILE
    data = json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.S)[1])
    assert [case["title"] for case in data["cases"]] == [HOSTILE]


def test_page__of_a_sweep_keeps_less_above_its_largest_size_and_says_so(tmp_path, monkeypatch, caplog):
    case = made.rough_creep((96, 75), 12)
    sweep = xr.concat([case, 2 * case], dim="case")
    whole = rv.plot.page(sweep, tmp_path / "whole.html").stat().st_size
    bokeh = len(result_page._library())
    monkeypatch.setattr(result_page, "LARGEST", (whole - bokeh) // 10)
    small = rv.plot.page(sweep, tmp_path / "small.html")
    assert small.stat().st_size - bokeh < (whole - bokeh) / 4
    assert "the page keeps" in small.read_text()
    assert "the page keeps" in caplog.text


def test_view__writes_the_page_and_refuses_what_is_no_result(tmp_path):
    write_result(made.one_frame(), tmp_path / "one.nc")
    done = CliRunner().invoke(main, ["view", str(tmp_path / "one.nc"), "--no-open"])
    assert (done.exit_code, (tmp_path / "one-page.html").exists()) == (0, True)
    (tmp_path / "empty").mkdir()
    for wrong in ("empty", "one-page.html", "absent.nc"):
        assert CliRunner().invoke(main, ["view", str(tmp_path / wrong), "--no-open"]).exit_code == 2
    with refused("results", "int"):
        rv.plot.page(3)
