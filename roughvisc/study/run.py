"""One case, from its statement to its file."""

from __future__ import annotations

import json
import logging
import os
import re
from collections.abc import Callable
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.study.case import Case, read_study
from roughvisc.study.simulate import simulate
from roughvisc.study.store import write_result
from roughvisc.variables import STATUS_MEANINGS

if TYPE_CHECKING:
    import xarray as xr

log = logging.getLogger("roughvisc")

REFERENCES = (
    "A robust algorithm for the contact of viscoelastic materials (the method started from); "
    "K. L. Johnson, Contact Mechanics, Cambridge University Press, 1985"
)

Progress = Callable[[float, float], None]

#: Attributes of a surface that stay with the result: whence it came, and what was made up where it was missing.
SCAN_ATTRIBUTES = ("source_file", "format", "instrument", "channel", "recipe", "filled_points", "fill_method")


def run(case: Case | str | Path, out: str | Path | None = None, *, progress: bool | Progress = True) -> xr.Dataset:
    """Compute one case and keep it in one file.

    Parameters
    ----------
    case : Case or path
        A case, or the study file that states one.
    out : path, optional
        Folder of the result. Default: ``results/`` and the study's name, beside the study.
    progress : bool or callable
        A progress bar, or a function called with the time reached and the program's length. [s]

    Returns
    -------
    xarray.Dataset
        The result, ``(time, x, y)``; the file is ``ds.encoding["source"]``, named by the case's key.

    Raises
    ------
    InputError
        If the input is wrong; nothing is written.
    ConvergenceError
        If a step did not converge. The result is written all the same, and the message says where.
    """
    if not isinstance(case, Case):
        case = read_study(case)
    folder = result_folder(case, out)
    dataset = compute(case, progress=progress)
    path = keep(dataset, case, folder)
    complaint = unconverged(dataset)
    if complaint:
        raise ConvergenceError(f"{complaint}; the result is kept in {path}, its variable 'status' says which")
    return dataset


def result_folder(case: Case, out: str | Path | None = None) -> Path:
    """Folder that the results of a study go to, refused here where nothing could be written there.

    Raises
    ------
    InputError
        If it is no folder, or may not be made or written to.
    """
    if out is not None:
        folder = Path(out)
    elif case.origin is not None:
        folder = case.origin.parent / "results" / case.origin.stem
    else:
        folder = Path("results") / (re.sub(r"[^a-z0-9]+", "-", case.title.lower()).strip("-") or "untitled")
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir():
        raise InputError(f"{there}: is a file: expected a folder for the results")
    if not os.access(there, os.W_OK):
        raise InputError(f"{there}: may not be written to: expected a folder with write permission")
    return folder


def compute(case: Case, *, progress: bool | Progress = True) -> xr.Dataset:
    """Result of a case, with all that is needed to run it again in its attributes.

    Raises
    ------
    InputError, ConvergenceError
        As :func:`roughvisc.simulate`, with the study's name in front.
    """
    settings = case.settings
    height = case.height()
    try:
        dataset = simulate(
            height,
            case.material(),
            case.program(),
            boundary=settings.solve.boundary,
            tolerance=settings.solve.tolerance,
            time_step=settings.solve.time_step,
            times=None if settings.keep.times == "all" else settings.keep.times,
            fields=settings.keep.fields,
            method=settings.solve.method,
            missing=settings.surface.missing,
            edge=settings.solve.edge,
            progress=progress,
        )
    except (InputError, ConvergenceError) as error:
        raise type(error)(f"{case.origin}: {error}" if case.origin else str(error)) from error
    scan = {name: height.attrs[name] for name in SCAN_ATTRIBUTES if name in height.attrs}
    dataset.attrs = _provenance(case, dataset.attrs.pop("history", "")) | dataset.attrs | scan
    return dataset


def _provenance(case: Case, before: str) -> dict[str, str]:
    """Attributes that say what this is, whence it came, and how to have it again."""
    version = metadata.version("roughvisc")
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    named = f"run of {case.origin.name}" if case.origin else "run of a case"
    varied = "".join(f", {key} = {json.dumps(value)}" for key, value in case.varied.items())
    return {
        "Conventions": "CF-1.11",
        "title": case.title + varied,
        "source": f"roughvisc {version}",
        "history": "\n".join(filter(None, [before, f"{now} roughvisc {version}: {named}"])),
        "references": REFERENCES,
        "comment": "A rigid rough profile pressed without friction or adhesion on a linear viscoelastic half-space. "
        "Attribute 'case' states the whole computation (JSON, SI units); 'residual' and 'time_error' how accurate it "
        "is; 'surface_sha256' is the checksum of the scan's file, or of the recipe of a generated surface.",
        "case": case.to_json(),
        "case_key": case.key,
        "surface_sha256": case.surface_sha256,
    }


def run_case(
    case: Case, folder: Path, *, progress: bool | Progress = False, stop: Callable[[], bool] | None = None
) -> Path:
    """Bring one case to its file in a folder, and give the file's path.

    Parameters
    ----------
    case : Case
        What to compute.
    folder : path
        Where the file goes; it is named by the case's key.
    progress : bool or callable
        As in :func:`run`.
    stop : callable, optional
        Asked at every accepted step; if it says so, :class:`KeyboardInterrupt` is raised.

    Raises
    ------
    InputError, ConvergenceError
        As :func:`run`; an unconverged result is kept all the same.
    """

    def report(now: float, end: float) -> None:
        if stop is not None and stop():
            raise KeyboardInterrupt
        if callable(progress):
            progress(now, end)

    return keep(compute(case, progress=report), case, folder)


def keep(dataset: xr.Dataset, case: Case, folder: Path) -> Path:
    """Write a case's result to its file in a folder; the file is named by the case's key."""
    path = write_result(dataset, folder / f"{case.key}.nc")
    dataset.encoding["source"] = str(path)
    complaint = unconverged(dataset)
    if complaint:
        log.warning("%s: %s", path, complaint)
    return path


def unconverged(dataset: xr.Dataset) -> str:
    """What to tell about steps that did not converge; empty if all did."""
    bad = np.flatnonzero(dataset["status"].values == STATUS_MEANINGS.index("not_converged"))
    if not bad.size:
        return ""
    times, residual = dataset["time"].values[bad], float(np.max(dataset["residual"].values[bad]))
    return (
        f"{bad.size} of {dataset.sizes['time']} kept times did not converge, first at t = {times[0]:.6g} s "
        f"(residual up to {residual:.2g}): try a looser tolerance or shorter steps"
    )
