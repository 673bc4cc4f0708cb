"""The figures of a whole sweep: which of them its results allow, and their files."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.study.storage.results import open_results
from roughvisc.study.storage.store import open_result
from roughvisc.variables import AXES, CONDUCTANCES
from roughvisc.views.figures.files import write_figure
from roughvisc.views.sweep_figures.case_text import case_words, file_stems
from roughvisc.views.sweep_figures.cases import Cases, cases_of
from roughvisc.views.sweep_figures.curves import friction_of_cases, histories_of_cases
from roughvisc.views.sweep_figures.sweeps import sweep, telling_frames_of


def results_of(folder: str | Path) -> xr.Dataset | None:
    """Results of the sweep that ran last in a folder; None if there are fewer than two."""
    try:
        results = open_results(folder)
    except InputError:
        return None
    return results if results["case_key"].size > 1 else None


#: What files are called after other than the quantity.
_FILES = {"contact_area": "area", "contact_fraction": "area"}


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

    What the program prescribes alike in all cases, or a parameter says already, is left out.
    """
    cases = cases_of(results)
    each = "one line per case" if not any(cases.bands) else "mean and band of the realisations"
    if AXES[cases.axis].telling == "friction_coefficient":
        yield "friction", f"Friction and contact area against the speed, {each}", friction_of_cases(results)
        if _is_shifted(cases):
            title = "The same against the speed times the shift factor: a master curve"
            yield "master", title, friction_of_cases(results, reduced=True)
        return
    loading = "force" if cases.alike_in_size else "nominal_pressure"
    observed = ("leak_rate", *CONDUCTANCES)
    held = [name for name in (cases.area, "approach", loading, *observed) if cases.lies_over_axis(name)]
    for name in held:
        if cases.parameters and not _known_before(cases, name):
            yield _FILES.get(name, name), f"{_word(name)} against what was varied", sweep(results, name)
    for name in (*held[:1], *(one for one in held if one in observed)):
        kind = "histories" if name == held[0] else f"{name}-histories"
        yield kind, f"{_word(name)} over {cases.axis}, {each}", histories_of_cases(results, name)


def _word(name: str) -> str:
    return name.replace("_", " ").capitalize()


def _is_shifted(cases: Cases) -> bool:
    """Whether the materials of curves of friction are shifted in time, by a temperature."""
    told = [member for member in cases.members if "reduced_speed" in member]
    shifted = any(not np.allclose(member["reduced_speed"], member["speed"]) for member in told)
    return shifted and len(told) == len(cases.members)


def _known_before(cases: Cases, name: str) -> bool:
    """Whether the values that would be drawn are alike, or those of a parameter."""
    frames = telling_frames_of(cases, name)
    last = np.array([float(m[name][frame]) for m, frame in zip(cases.members, frames, strict=True)])
    scale = 1e-6 * np.nanmax(np.abs(last), initial=0.0)
    stated = [one.values for one in cases.parameters if one.numeric]
    return any(np.allclose(last, values, rtol=0, atol=scale) for values in (last[0], *stated))


def save_sweep_figures(results: xr.Dataset, folder: Any, *, suffix: str = ".png", dpi: float = 200.0) -> list[Path]:
    """Write the figures of a sweep, as ``sweep-area.png``, ``sweep-approach.png``, ``sweep-histories.png``,
    and what was observed alike.

    Of curves of friction ``sweep-friction.png`` and, where temperatures shift them, ``sweep-master.png``.

    Where the surfaces differ in size, areas are fractions of theirs, and forces nominal pressures.

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
        The files written; none where the results hold neither area, approach nor force.

    Raises
    ------
    InputError
        If there are no several cases.
    """
    drawn = sweep_figures(results)
    return [write_figure(figure, Path(folder, f"sweep-{name}{suffix}"), dpi) for name, _, figure in drawn]
