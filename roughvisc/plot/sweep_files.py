"""Figures of a whole sweep: which of them its results allow, and their files."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.experiment.resources import cores
from roughvisc.plot.case_text import case_words, file_stems
from roughvisc.plot.files import write_figure
from roughvisc.plot.sweeps import area_of, curves_of, histories, sweep
from roughvisc.progress import reporting
from roughvisc.study.storage.results import open_results
from roughvisc.study.storage.store import open_result
from roughvisc.variables import AXES, CONDUCTANCES, axis_of


def results_of(folder: str | Path) -> xr.Dataset | None:
    """Results of the sweep that ran last in a folder; None if there are fewer than two."""
    try:
        results = open_results(folder)
    except InputError:
        return None
    return results if results["case_key"].size > 1 else None


def cases_in(paths: Sequence[Path]) -> dict[Path, tuple[str, str]]:
    """Name for the files and words for the title of each result that states its case; other files are left out."""
    cases = {}
    for path in paths:
        with suppress(InputError, ValueError), open_result(path) as dataset:
            cases[str(path)] = json.loads(dataset.attrs["case"]) if "case" in dataset.attrs else {}
    stems = file_stems({Path(path).stem: case for path, case in cases.items()})
    return {Path(path): (stems[Path(path).stem], case_words(case)) for path, case in cases.items()}


def sweep_figures(results: xr.Dataset) -> Iterator[tuple[str, str, Figure]]:
    """Name, title and figure of all that results of several cases allow, one at a time.

    What the program prescribes alike in all cases, or a parameter states already, is left out.
    """
    axis = axis_of(results.variables)
    if AXES[axis].telling == "friction_coefficient":
        yield "friction", "Friction against the speed", histories(results, "friction_coefficient")
        yield "area", "Contact area against the speed", histories(results, "contact_fraction")
        if "reduced_speed" in results and not np.allclose(*_pairs(results, "reduced_speed", "speed")):
            title = "The friction against the speed times the shift factor: a master curve"
            yield "master", title, histories(results, "friction_coefficient", over="reduced_speed")
        return
    area = area_of(results)
    observed = ("leak_rate", *CONDUCTANCES)
    loading = "nominal_pressure" if area == "contact_fraction" else "force"
    held = [name for name in (area, "approach", loading, *observed) if name in results]
    for name in held:
        if _tells_more(results, name):
            file = "area" if name == area else name
            yield file, f"{_word(name)} against what was varied", sweep(results, name)
    for name in (area, *(one for one in held if one in observed)):
        file = "histories" if name == area else f"{name}-histories"
        yield file, f"{_word(name)} over {axis}", histories(results, name)


def _word(name: str) -> str:
    return name.replace("_", " ").capitalize()


def _pairs(results: xr.Dataset, *names: str) -> list[np.ndarray]:
    """Values of two variables at the rows that both have."""
    first, second = (one.values for one in xr.broadcast(*(results[name] for name in names)))
    known = np.isfinite(first) & np.isfinite(second)
    return [first[known], second[known]]


def _tells_more(results: xr.Dataset, name: str) -> bool:
    """Whether the last values of the cases differ, and are not those of a parameter."""
    curves = curves_of(results, name)
    last = np.array([float(one["value"].iloc[-1]) for one in curves.frames])
    scale = 1e-6 * np.nanmax(np.abs(last), initial=0.0)
    stated = [one.values for one in curves.parameters if one.numeric]
    return bool(stated or curves.parameters) and not any(
        np.allclose(last, values, rtol=0, atol=scale) for values in (last[0], *stated)
    )


def save_sweep_figures(results: xr.Dataset, folder: Any, *, suffix: str = ".png", dpi: float = 200.0) -> list[Path]:
    """Write the figures of a sweep, as ``sweep-area.png``, ``sweep-approach.png``, ``sweep-histories.png``.

    What was observed has figures alike. Of curves of friction these are ``sweep-friction.png``, ``sweep-area.png`` and,
    where temperatures shift them, ``sweep-master.png``. Where the surfaces differ in size, areas are fractions of
    theirs, and forces nominal pressures.

    Parameters
    ----------
    results : xarray.Dataset
        What :func:`roughvisc.open_results` gives.
    folder : path-like
        Where to write; made if absent.
    suffix : str
        Kind of file, as matplotlib knows it: ``".png"``, ``".pdf"``, ``".svg"``.
    dpi : float
        Resolution of pictures made of pixels.

    Returns
    -------
    list of pathlib.Path
        The files written.

    Raises
    ------
    InputError
        If there are no several cases.
    """
    drawn = sweep_figures(results)
    return [write_figure(figure, Path(folder, f"sweep-{name}{suffix}"), dpi) for name, _, figure in drawn]


def save_case_figures(
    paths: Sequence[Path], folder: Path | None = None, *, every: bool, named: bool, progress: bool = False
) -> list[Path]:
    """Write the figures of single cases, several at a time.

    Parameters
    ----------
    paths : sequence of Path
        Files of results.
    folder : Path, optional
        Where to write. Default: beside each file.
    every : bool
        Whether to draw section and surface too.
    named : bool
        Whether files and titles state what was varied; else they have the name of the result.
    progress : bool
        Whether to draw a progress bar.

    Returns
    -------
    list of pathlib.Path
        The files written, in the order of the cases.
    """
    names = cases_in(paths) if named else {}
    jobs = [(path, folder or path.parent, *names.get(path, (path.stem, "")), every) for path in paths]
    workers = min(cores(), len(jobs) // 2)  # a process takes as long to start as two cases to draw
    if workers < 2:
        return [file for job in jobs for file in _save_case(*job)]
    written: dict[int, list[Path]] = {}
    with (
        ProcessPoolExecutor(workers, get_context("spawn")) as pool,
        reporting(progress, "drawing", at=_cases) as report,
    ):
        running = {pool.submit(_save_case, *job): number for number, job in enumerate(jobs)}
        for done in as_completed(running):
            written[running[done]] = done.result()
            report(len(written), len(jobs))
    return [file for number in range(len(jobs)) for file in written[number]]


def _cases(done: float, count: float) -> str:
    return f"{done:.0f} of {count:.0f} cases"


def _save_case(path: Path, folder: Path, stem: str, title: str, every: bool) -> list[Path]:
    """Write the figures of a case; a function of a module, for other processes."""
    from roughvisc.plot import save_figures

    with open_result(path) as dataset:
        return save_figures(dataset, folder, stem, title=title, every=every)
