"""A budget on the command line, in its table and in its figure."""

import io

import numpy as np
import pytest
import xarray as xr
from rich.console import Console

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.views.console.accuracy_tables import budget_table

STUDY = """
title = "Ball"
[surface]
generate = "sphere"
radius = "1 mm"
size = "0.2 mm"
shape = [25, 25]
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
load = "0.2 mN"
over = 0
[[program]]
hold = "1 s"
[keep]
times = [0.01, 0.1, 1.0]
"""
SOURCES = ["grid", "sample", "next octave of waves", "modulus"]


def made_up(half_width, direction=(0, 0, -1, 0), value=(2e-9, 4e-9)):
    """A budget with these half-widths of its sources, the same at both times."""
    half = np.array(half_width, dtype=float)[:, None] * np.ones(2)
    value = np.array(value)
    known, towards = np.nan_to_num(half), np.array(direction)[:, None]
    down, up = (np.sqrt(np.sum(np.where((towards == 0) | (towards == s), known, 0) ** 2, axis=0)) for s in (-1, 1))
    return xr.Dataset(
        {
            "half_width": (("source", "time"), half),
            "direction": (("source", "time"), np.broadcast_to(towards, half.shape).astype("int8")),
            "state": ("source", ["open" if np.isnan(one) else "counted" for one in half_width]),
            "method": ("source", [f"by {name}" for name in SOURCES]),
            "cost": ("source", [0.5, 0.0, 0.0, 1.25]),
            "value": ("time", value, {"units": "m^2"}),
            "lower": ("time", value * np.exp(-down)),
            "upper": ("time", value * np.exp(up)),
            "case_cost": ((), 0.3),
        },
        coords={"source": SOURCES, "time": ("time", [0.1, 1.0], {"units": "s"})},
        attrs={"quantity": "contact_area", "population": "patch", "title": "Made up", "open": ""},
    )


def printed(dataset):
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(budget_table(dataset))
    return console.export_text()


def test_table__says_how_large_each_source_is():
    text = printed(made_up([0.05, 0.0, 0.2, np.nan]))
    lines = {line.split("  ")[0].strip(): line for line in text.splitlines()}
    assert "±5 by grid" in lines["grid"]
    assert "0.5 s" in lines["grid"]
    assert " 0 by sample" in lines["sample"]
    assert "-20 by next octave" in lines["next octave of waves"]
    assert "open" in lines["modulus"]
    assert "t = 1 s: 4000 µm², at 95 % from 3255 µm² to 4205 µm²" in text


def test_table__says_large_errors_as_factors():
    assert "factor 4.5 by sample" in printed(made_up([0.05, 1.5, 0.0, 0.1]))


def test_table__says_that_zero_has_no_interval():
    shown = made_up([0.1] * 4, value=(0.0, 4e-9))
    shown["upper"] = shown["upper"].where(shown["value"] > 0)
    text = " ".join(printed(shown).split())
    assert "t = 0.1 s: 0 µm², without an interval, as zero has no logarithm" in text or "t = 100 ms: 0 µm², w" in text
    assert "nan" not in text


@pytest.mark.parametrize("half_width", [[0.05, 0.0, 0.2, np.nan], [0.05, 1.5, 0.2, 0.1]], ids=["percent", "factors"])
def test_figure__draws_every_source_and_the_interval(half_width):
    dataset = made_up(half_width)
    figure = rv.plot.budget(dataset)
    bars, curve = figure.axes
    assert [label.get_text() for label in bars.get_yticklabels()] == [*SOURCES, "together"]
    drawn = [patch.get_bbox() for patch in bars.patches]
    assert len(drawn) == sum(one > 0 for one in half_width) + 1
    wide = half_width[1] > 1
    together = drawn[-1]
    for end, edge in (("lower", together.x0), ("upper", together.x1)):
        ratio = float(dataset[end][-1] / dataset["value"][-1])
        assert edge == pytest.approx(ratio if wide else 100 * (ratio - 1), rel=1e-9)
    assert bars.get_xscale() == ("log" if wide else "linear")
    low, high = bars.get_xlim()
    assert low < together.x0 < together.x1 < high
    assert [text.get_text() for text in bars.texts if text.get_text()] == _words(half_width)
    factor = {"Contact area [µm²]": 1e12, "Contact area [mm²]": 1e6}[curve.get_ylabel()]
    np.testing.assert_allclose(curve.lines[0].get_ydata(), factor * dataset["value"], rtol=1e-9)


def _words(half_width):
    return ["open" if np.isnan(one) else "below 1 %" for one in half_width if np.isnan(one) or one == 0]


def test_figure__of_one_place_is_one_panel():
    assert len(rv.plot.budget(made_up([0.05, 0.0, 0.2, 0.1]).isel(time=[1])).axes) == 1


def test_figure__refuses_what_is_no_budget_of_one_quantity():
    with pytest.raises(InputError, match=r"expected the Dataset of rv\.budget"):
        rv.plot.budget(xr.Dataset())
    with pytest.raises(InputError, match="found several quantities"):
        rv.plot.budget(made_up([0.05, 0.0, 0.2, 0.1]).expand_dims(quantity=["a", "b"]))


def test_command__prints_and_writes(invoke, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    arguments = ("--at", "100 ms", "--modulus-error", "10%", "--workers", 1)
    status, said, complained = invoke("budget", tmp_path / "study.toml", *arguments)
    assert status == 0, complained
    assert "t = 100 ms:" in said
    assert "time scale" in said
    folder = tmp_path / "results" / "study" / "budget"
    assert (folder / "budget-contact_area.png").stat().st_size > 10_000
    with xr.open_dataset(folder / "budget-contact_area.nc") as found:
        assert found["time"].values.tolist() == [0.1]
        assert found.attrs["open"] == "time scale"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--quantity", "area"], "expected one of contact_area"),
        (["--modulus-error", "ten"], "--modulus-error: found 'ten'"),
        (["--at", "3 kg"], "--at"),
        (["--cutoff", "-1 um"], "cutoff"),
    ],
)
def test_command__refuses(invoke, tmp_path, options, message):
    (tmp_path / "study.toml").write_text(STUDY)
    status, _, complained = invoke("budget", tmp_path / "study.toml", *options)
    assert status == 2
    assert message in complained
    assert not (tmp_path / "results").exists()
