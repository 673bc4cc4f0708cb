"""Multilevel Monte Carlo over the surfaces of a recipe, and the number that it gives."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy import optimize, stats

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.study.budget import population
from roughvisc.study.budget.grids import Grids, first_grids
from roughvisc.study.budget.population import Level, counts_for, mean_of, mean_of_population, scatter_of
from roughvisc.study.budget.solves import Bench
from roughvisc.study.budget.target import wanting
from roughvisc.study.budget.variants import Variants
from roughvisc.study.execution.monitor import Monitor
from roughvisc.study.quantities import QUANTITIES

STUDY = """
title = "Draws"
[surface]
generate = "self_affine"
size = ["1 mm", "0.9 mm"]
shape = [27, 25]
hurst = 0.8
rms_slope = 0.2
rolloff = "0.3 mm"
shortcut = "150 um"
amplitudes = "gaussian"
seed = 1
[material]
model = "elastic"
shear_modulus = "3 MPa"
[[program]]
pressure = "50 kPa"
over = 0
[keep]
fields = []
times = [0.0]
[want]
population = "ensemble"
"""


def level(values, cost):
    values = np.asarray(values, dtype=float)[:, None]
    return Level({"mean_gap": values}, cost * len(values))


def test_scatter__of_one_level_is_that_of_student():
    values = np.random.default_rng(1).normal(2.0, 0.3, 17)
    levels = {0: level(values, 1.0)}
    half, _ = scatter_of(levels, "mean_gap")
    expected = stats.t.interval(0.95, 16, values.mean(), stats.sem(values))
    assert float(half[0]) == pytest.approx((expected[1] - expected[0]) / 2, rel=1e-12)
    assert float(mean_of(levels, "mean_gap")[0]) == pytest.approx(values.mean(), rel=1e-12)


def test_scatter__of_two_levels_is_that_of_welch():
    """The mean of the sum is that of a difference of two samples, one with its sign changed."""
    draws = np.random.default_rng(2)
    one, other = draws.normal(1.0, 0.5, 12), draws.normal(0.2, 0.1, 21)
    half, _ = scatter_of({1: level(one, 1.0), 0: level(other, 4.0)}, "mean_gap")
    interval = stats.ttest_ind(one, -other, equal_var=False).confidence_interval(0.95)
    assert float(half[0]) == pytest.approx((interval.high - interval.low) / 2, rel=1e-9)


def test_counts__are_the_cheapest_that_fit():
    draws = np.random.default_rng(3)
    levels = {
        n: level(draws.normal(0, sd, 20), cost) for n, sd, cost in ((2, 0.3, 1.0), (1, 0.1, 5.0), (0, 0.05, 21.0))
    }
    room = {"mean_gap": np.array([0.01])}
    counts = counts_for(levels, room)
    _, quantile = scatter_of(levels, "mean_gap")
    variance = np.array([float(one.variance("mean_gap")[0]) for one in levels.values()])
    cost = np.array([one.cost for one in levels.values()])
    fits = {"type": "eq", "fun": lambda n: 1 - (variance / np.exp(n)).sum() * (float(quantile[0]) / 0.01) ** 2}
    best = optimize.minimize(lambda n: np.log(cost @ np.exp(n)), np.full(3, 8.0), constraints=fits, method="SLSQP")
    assert best.success
    np.testing.assert_allclose(list(counts.values()), 1.05 * np.exp(best.x), rtol=0.01)
    assert counts_for(levels, {"mean_gap": np.array([10.0])}) == dict.fromkeys(levels, 20)


@pytest.fixture
def made_up(monkeypatch):
    """Draws of which the logarithm is known: normal, with an error of the grid that shrinks by four."""
    seen = []

    def values(texts, names, places, threads=None):
        found = {name: [] for name in names}
        for text in texts:
            surface = json.loads(text)["surface"]
            cells = (surface.get("band_limit") or surface["shape"])[0]
            seen.append((surface["seed"], cells))
            wave = np.random.default_rng(surface["seed"]).normal(0, [0.2, 0.02])
            for name in names:
                found[name].append(np.exp([-11.0 + wave[0] + (0.3 + wave[1]) * (7 / cells) ** 2] * len(places)))
        return found, 1e-4 * sum(cells**2 for _, cells in seen[-len(texts) :])

    monkeypatch.setattr(population, "_values", values)
    return seen


def prepared(tmp_path, target, **changes):
    (tmp_path / "study.toml").write_text(STUDY)
    case = wanting(rv.vary(rv.read_study(tmp_path / "study.toml"), changes), {"mean_gap": target})
    bench = Bench([QUANTITIES["mean_gap"]], tmp_path / "budget", Monitor, [].append)
    return first_grids(case, bench, {"mean_gap": target}, np.inf)


@pytest.mark.thorough
def test_mean__is_within_the_target_of_the_truth(tmp_path, made_up):
    around = prepared(tmp_path, 0.03)
    own, off = around.grids, []
    for seed in range(20):
        (tmp_path / str(seed)).mkdir()
        moved = Variants(rv.vary(own.variants.case, {"surface.seed": seed}), own.variants.height)
        bench = replace(around.bench, folder=tmp_path / str(seed))
        other = replace(around, bench=bench, grids=Grids(own.own, moved))
        found = mean_of_population(other, {"mean_gap": 0.03}, np.inf)
        assert found.error(QUANTITIES["mean_gap"]) <= np.log(1.03)
        off.append(float(mean_of(found.levels, "mean_gap")[0]) + 11.0)
    assert np.mean(np.abs(off) <= np.log(1.03)) >= 0.85
    assert np.mean(np.abs(off) > 0.3 * np.log(1.03)) > 0.2  # no more draws than it takes


def test_draws__of_a_pair_have_the_same_waves_and_no_level_those_of_another(tmp_path, made_up):
    around = prepared(tmp_path, 0.05)
    found = mean_of_population(around, {"mean_gap": 0.05}, np.inf)
    grids_of = {}
    for seed, cells in made_up:
        grids_of.setdefault(seed, []).append(cells)
    assert len(grids_of) == sum(one.count for one in found.levels.values())
    assert {tuple(one) for one in grids_of.values()} == {(7,), (14, 7), (27, 14), (54, 27)}
    count = len(made_up)
    mean_of_population(around, {"mean_gap": 0.05}, np.inf)
    assert len(made_up) == count  # all were kept
    assert min(one.count for one in found.levels.values()) >= 20


def test_target__that_takes_too_many_draws_or_too_long_is_refused(tmp_path, made_up, monkeypatch):
    monkeypatch.setattr("roughvisc.study.budget.population.MOST", 300)
    for part, limit, told in ((0.004, np.inf, "limit of 300 draws"), (0.01, 1.0, "limit of 1 s|expected some")):
        around = prepared(tmp_path, part)
        with pytest.raises(InputError, match=told):
            mean_of_population(around, {"mean_gap": part}, limit)


def test_zero__in_a_draw_has_no_logarithm(tmp_path, monkeypatch):
    monkeypatch.setattr(
        population, "_values", lambda texts, names, places, threads: ({"mean_gap": [[0.0]] * len(texts)}, 1.0)
    )
    around = prepared(tmp_path, 0.05)
    with pytest.raises(InputError, match="mean_gap: found zero, or less, in 20 of 20 draws"):
        mean_of_population(around, {"mean_gap": 0.05}, np.inf)


def test_run__of_a_population_ends_with_its_mean(tmp_path, made_up):
    (tmp_path / "study.toml").write_text(STUDY)
    found = rv.run(tmp_path / "study.toml", tmp_path / "results", want={"mean_gap": "5 %"}, progress=False)
    assert found.sizes["x"] == 54
    assert "draws: " in found.attrs["choice"]
    with xr.open_dataset(tmp_path / "results" / "budget" / "budget-mean_gap.nc") as one:
        assert abs(np.log(float(one["value"][0])) + 11.0) < 0.1
        assert str(one["method"].sel(source="sample").values).startswith("draws: ")
        assert one.attrs["population"] == "ensemble"
        assert float(one["upper"][0] / one["value"][0]) <= 1.05 * (1 + 1e-9)


@pytest.mark.long
def test_mean__of_solves_is_that_of_many_draws(tmp_path):
    """Against the plain mean over draws of the finest grid, with other seeds."""
    (tmp_path / "study.toml").write_text(STUDY)
    rv.run(tmp_path / "study.toml", tmp_path / "results", want={"mean_gap": "8 %"}, progress=False)
    with xr.open_dataset(tmp_path / "results" / "budget" / "budget-mean_gap.nc") as one:
        value = float(one["value"][0])
    surfaces = [
        rv.self_affine(
            ("1 mm", "0.9 mm"),
            (54, 50),
            hurst=0.8,
            rms_slope=0.2,
            rolloff="0.3 mm",
            shortcut="150 um",
            amplitudes="gaussian",
            seed=seed,
        )
        for seed in range(100)
    ]
    rubber, press = rv.elastic("3 MPa"), rv.Program().pressure("50 kPa", over=0)
    gaps = [float(rv.simulate(h, rubber, press, times=[0.0], fields=(), progress=False).mean_gap[0]) for h in surfaces]
    error = 1.96 * np.std(np.log(gaps), ddof=1) / 10
    assert abs(np.log(value) - np.mean(np.log(gaps))) < np.hypot(np.log(1.08), error)
