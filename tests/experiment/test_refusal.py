"""Cases that cannot fit into memory: refused before anything is taken, with what would fit."""

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import psutil
import pytest
from dask.system import CPU_COUNT
from scipy import fft
from support import ROUGH, refused

import roughvisc as rv
from roughvisc.experiment import memory_limit as resources
from roughvisc.experiment.memory_limit import Available, memory_available
from roughvisc.experiment.profile import Profile
from roughvisc.study.case import read_cases

LARGE = ROUGH.replace("[30, 26]", "[600, 512]")


@pytest.fixture
def limited(monkeypatch):
    """Sets how much memory there is."""

    def limit(size, words="free in this machine"):
        monkeypatch.setattr(resources, "memory_available", lambda device="cpu": Available(size, words))

    return limit


@pytest.fixture
def study(tmp_path):
    def write(text):
        (tmp_path / "study.toml").write_text(text)
        return tmp_path / "study.toml"

    return write


def test_run__refuses_what_cannot_fit_and_says_what_would(study, limited, tmp_path, monkeypatch, invoke):
    path = study(LARGE)
    limited(40e6)
    monkeypatch.setattr(Profile, "__init__", lambda *_: pytest.fail("an array was made"))
    status, _, wrong = invoke("run", str(path), "--no-plots", "--out", tmp_path / "out")
    assert (status, "300 x 256 cells" in wrong) == (2, True)
    assert not list(tmp_path.glob("out/*")), "nothing is kept of it"


def test_sweep__refuses_only_what_does_not_fit(study, limited, tmp_path):
    path = study(LARGE + '[sweep]\n"surface.shape" = [[600, 512], [24, 20]]\n')
    limited(40e6)
    cases = read_cases(path)
    results = rv.sweep(cases, tmp_path / "out", workers=0, progress=False)
    assert results.sizes["case"] == 1
    assert not list((tmp_path / "out").glob("*.failed.json")), "it may fit elsewhere"


# ----------------------------------------------------------------------------------------------------------------
# what there is


def test_memory__is_limited_by_the_container_and_the_dask_worker(monkeypatch):
    memory_available()  # imports what it needs
    used = psutil.Process().memory_info().rss
    monkeypatch.setattr("distributed.system.MEMORY_LIMIT", used + 5e6)
    container = memory_available()
    assert container.size == pytest.approx(5e6, abs=4e6)
    assert "container" in container.words
    worker = SimpleNamespace(memory_manager=SimpleNamespace(memory_limit=used - 1e9))
    monkeypatch.setattr("distributed.get_worker", lambda: worker)
    assert memory_available().size == pytest.approx(-1e9, abs=4e6)
    assert "worker" in memory_available().words
    worker.memory_manager.memory_limit = None
    assert memory_available().words == container.words


def test_threads__are_those_asked_for_or_all_for_a_case_that_is_alone():
    ball, rubber, program = rv.sphere(1e-3, 2e-4, 9), rv.elastic(1e6), rv.Program().load(1e-4, over=0)

    def threads_of(requested):
        found = []
        rv.simulate(ball, rubber, program, threads=requested, progress=lambda *_: found.append(fft.get_workers()))
        return found[0]

    assert threads_of(3) == 3
    assert threads_of(None) == CPU_COUNT
    with fft.set_workers(5):
        assert threads_of(None) == 5
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(threads_of, None).result() == 1, "beside other threads"
    with refused("threads", 0):
        threads_of(0)
