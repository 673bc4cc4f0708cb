"""Files of figures: of one result, of a sweep, and of a whole folder in parallel."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib
import xarray as xr
from matplotlib.figure import Figure

from roughvisc.errors import InputError, RoughviscError
from roughvisc.observables.history import expect_result
from roughvisc.paths import path_of
from roughvisc.plot import style
from roughvisc.plot.curves import friction, history
from roughvisc.plot.fields import maps, section, surface
from roughvisc.plot.sweep import sweep_figures
from roughvisc.progress import reporting
from roughvisc.runs.folder import atomic_write
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.sweep_data import open_results, read_sweep
from roughvisc.study.case_text import file_stems

#: Name -> function of a result, variables that it needs, and a caption.
FIGURES: dict[str, tuple[Callable[[xr.Dataset], Figure], tuple[str, ...], str]] = {
    "friction": (friction, ("speed", "friction_coefficient"), "Friction coefficient and contact fraction."),
    "history": (history, ("time", "force", "approach"), "Histories. Dots: kept times; bands: stated error."),
    "maps": (maps, ("x", "y", "pressure"), "Pressure and gap between the bodies."),
    "leakage": (partial(maps, fields="flux"), ("leak_rate", "gap", "x"), "Flux of the fluid, integrated over the gap."),
    "section": (section, ("height", "pressure", "gap"), "Section through the contact at its largest area."),
    "slide": (partial(history, over="sliding_distance"), ("time", "sliding_distance"), "Friction over the distance."),
    "surface": (surface, ("height",), "Surface after conditioning."),
}
#: Resolution of pictures. [1/inch]
DPI = 200
#: Key of the metadata that names the program which made a picture, by format.
_MAKER = {"png": "Software", "pdf": "Creator", "svg": "Creator"}
#: Figures that are drawn unless all are requested.
DEFAULT = ("friction", "history", "maps", "leakage")


def figures_of(dataset: xr.Dataset, names: Collection[str] | None = None) -> Iterator[tuple[str, str, Figure]]:
    """Yield name, caption and figure of everything that a result allows, or of the requested names only."""
    for name, (draw, needed, caption) in FIGURES.items():
        if (names is None or name in names) and all(one in dataset for one in needed):
            yield name, caption, draw(dataset)


@matplotlib.rc_context(style.STYLE)
def write_figure(figure: Figure, path: Path, maker: str = "") -> Path:
    """Write a figure to a file in the format of its suffix, complete or not at all.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure to write.
    path : Path
        File to write.
    maker : str
        Program to name in the metadata of a .png, .pdf or .svg, see :func:`is_made_by`.

    Raises
    ------
    InputError
        If the suffix is not a picture format, or the folder cannot be written to.
    """
    kind = path.suffix.lstrip(".") or "png"
    if kind not in figure.canvas.get_supported_filetypes():
        raise InputError(f"{path}: is not a picture format: expected one of .png, .pdf, .svg")
    about = {_MAKER[kind]: maker} if maker and kind in _MAKER else None
    with atomic_write(path) as temporary:
        figure.savefig(temporary, format=kind, dpi=DPI, metadata=about)
    return path


def is_made_by(path: Path, maker: str) -> bool:
    """Return whether a file names its maker, as :func:`write_figure` writes it."""
    return path.is_file() and maker.encode() in path.read_bytes()


def save_figures(
    dataset: xr.Dataset, folder: Any, stem: str, names: Collection[str] | None = None, *, kind: str = "png"
) -> list[Path]:
    """Write the figures that the variables of a result allow, as ``STEM-history.png`` and so on.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.
    folder : path-like
        Folder for the files; created if absent.
    stem : str
        First part of every file name.
    names : collection of str, optional
        Only these figures, such as ``["history", "maps"]``.
    kind : {"png", "svg", "pdf"}
        Format of the files.

    Returns
    -------
    list of pathlib.Path
        The files written.

    Raises
    ------
    InputError
        If the Dataset is not one case's result or allows no figure.
    """
    dataset = expect_result(dataset)
    folder = path_of(folder, "folder")
    figures = figures_of(dataset, names)
    written = [write_figure(figure, folder / f"{stem}-{name}.{kind}") for name, _, figure in figures]
    if not written:
        raise InputError(f"the result allows no figure: it holds {', '.join(map(str, dataset.variables))}")
    return written


def save_figures_of_files(
    paths: Sequence[Path], folder: Path | None, *, every: bool = True, processes: int = 1, kind: str = "png"
) -> list[Path]:
    """Write the figures of result files, in parallel and with a progress bar.

    Parameters
    ----------
    paths : sequence of Path
        Results. For several results, the file names state the varied settings.
    folder : Path, optional
        Folder for the figures. Default: the folder of each result.
    every : bool
        True: all figures, and the surface of the first case, or of all cases if it is varied. False: the default
        figures.
    processes : int
        Number of processes. Several processes need a main module that may be imported again.
    kind : {"png", "svg", "pdf"}
        Format of the files.
    """
    cases: dict[str, Any] = {}
    named: dict[str, Any] = {}
    for path in paths:
        with open_result(path) as dataset:
            cases[path.stem] = json.loads(dataset.attrs.get("case", "{}"))
            if dataset.attrs.get("case_key") == path.stem:  # a renamed file keeps its own name
                named[path.stem] = cases[path.stem]
    stems = file_stems(named)
    jobs: list[Any] = []
    for path in paths:
        known = FIGURES if every else DEFAULT
        with_surface = not jobs or varies_surface(cases[path.stem])
        names = [name for name in known if name != "surface" or with_surface]
        jobs.append((path, folder or path.parent, stems.get(path.stem, path.stem), names, kind))
    return [one for written in in_parallel(_save_file, jobs, processes, "drawing") for one in written]


def varies_surface(case: Mapping[str, Any]) -> bool:
    """Return whether the sweep of a case varies its surface."""
    return any(key.startswith("surface.") for key in case.get("varied", {}))


def _save_file(job: tuple[Path, Path, str, Collection[str], str]) -> list[Path]:
    path, folder, stem, names, kind = job
    with open_result(path) as dataset:
        return save_figures(dataset, folder, stem, names, kind=kind)


def in_parallel(work: Callable[[Any], Any], jobs: Sequence[Any], processes: int, label: str) -> list[Any]:
    """Return the results of a function of some jobs, in order; several processes compute, with a progress bar."""
    # a process that is forked while threads run may hang
    pool = ProcessPoolExecutor(max(min(processes, len(jobs)), 1), multiprocessing.get_context("spawn"))
    with pool, reporting(label, lambda done, count: f"{done:.0f} of {count:.0f} cases") as report:
        results = []
        try:
            for result in pool.map(work, jobs) if min(processes, len(jobs)) > 1 else map(work, jobs):
                results.append(result)
                report(len(results), len(jobs))
        except BrokenProcessPool as error:
            lost = f"{label}: a process was killed, perhaps because the memory was full: expected more free memory"
            raise RoughviscError(lost, transient=True) from error
        return results


def results_of_sweep(folder: Path) -> xr.Dataset | None:
    """Return the results of the last sweep in a folder; None if there are fewer than two."""
    read_sweep(folder)  # refuses a list of cases that cannot be read
    with suppress(InputError):
        results = open_results(folder)
        return results if results["case_key"].size > 1 else None
    return None


def save_sweep_figures(results: xr.Dataset, folder: Any, *, kind: str = "png") -> list[Path]:
    """Write the figures of a sweep, as ``sweep-contact_area.png``, ``sweep-approach.png`` and so on.

    Parameters
    ----------
    results : xarray.Dataset
        Result of :func:`roughvisc.open_results`.
    folder : path-like
        Folder for the files; created if absent.
    kind : {"png", "svg", "pdf"}
        Format of the files.

    Returns
    -------
    list of pathlib.Path
        The files written.

    Raises
    ------
    InputError
        If the Dataset does not hold several cases.
    """
    folder = path_of(folder, "folder")
    return [write_figure(figure, folder / f"sweep-{name}.{kind}") for name, _, figure in sweep_figures(results)]
