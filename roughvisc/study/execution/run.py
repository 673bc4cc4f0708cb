"""Execution of one case, from the study to the result file."""

from __future__ import annotations

import errno
import json
import logging
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from contextlib import closing, suppress
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError, HinderedError, InputError, InUseError, RoughviscError
from roughvisc.mechanics.halfspace.transforms import transform_library
from roughvisc.study.simulation.malloc import keep_memory
from roughvisc.study.simulation.simulate import press
from roughvisc.study.statement.case import Case
from roughvisc.study.storage.checkpoint import Keeper
from roughvisc.study.storage.lock import held
from roughvisc.study.storage.parameters import labels_of_case
from roughvisc.study.storage.store import open_result, result_path, set_aside, torn_files, write_result
from roughvisc.variables import NOT_CONVERGED

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


def result_folder(case: Case, out: str | Path | None = None) -> Path:
    """Folder that the results of a study go to, refused here where nothing could be written there.

    Raises
    ------
    InputError
        If it is no folder, or may not be made or written to.
    """
    if out is not None:
        folder = Path(out).expanduser()
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


def compute(case: Case, *, progress: bool | Progress = True, keeper: Keeper | None = None) -> xr.Dataset:
    """Result of a case, with all that is needed to run it again in its attributes.

    With a keeper it goes on from what that has kept, and the fields of the result are read from there.

    Raises
    ------
    InputError, ConvergenceError
        As :func:`roughvisc.simulate`, with the study's name in front.
    """
    height = case.height()
    try:
        dataset = press(height, case.material(), case.program(), case.solving(), progress=progress, keeper=keeper)
    except HinderedError:
        raise
    except (InputError, ConvergenceError) as error:
        raise type(error)(f"{case.origin}: {error}" if case.origin else str(error)) from error
    scan = {name: height.attrs[name] for name in SCAN_ATTRIBUTES if name in height.attrs}
    transforms = transform_library() if keeper is None else keeper.saved.transforms
    dataset.attrs = _provenance(case, dataset.attrs.pop("history", ""), transforms) | dataset.attrs | scan
    return dataset.assign_coords(labels_of_case(json.loads(case.to_json()), case.key))


def _provenance(case: Case, before: str, transforms: str) -> dict[str, str]:
    """Attributes that say what this is, whence it came, and how to have it again."""
    version = metadata.version("roughvisc")
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    named = f"run of {case.origin.name}" if case.origin else "run of a case"
    varied = "".join(f", {key} = {json.dumps(value)}" for key, value in case.varied.items())
    return {
        "Conventions": "CF-1.11",
        "title": case.title + varied,
        "source": f"roughvisc {version}",
        "transforms": transforms,
        "history": "\n".join(filter(None, [before, f"{now} roughvisc {version}: {named}"])),
        "references": REFERENCES,
        "comment": "A rigid rough profile pressed without friction or adhesion on a linear viscoelastic half-space. "
        "Attribute 'case' states the whole computation (JSON, SI units); 'stated_error' how accurate it is; "
        "'surface_sha256' is the checksum of the scan's file, or of the recipe of a generated surface.",
        "case": case.to_json(),
        "case_key": case.key,
        "surface_sha256": case.surface_sha256,
    }


def run_case(
    case: Case,
    folder: str | Path,
    *,
    progress: bool | Progress = False,
    stop: Callable[[], bool] | None = None,
    checkpoint_seconds: float = 30.0,
    checkpoint_steps: int | None = None,
    same_bits: bool = False,
) -> Path:
    """Bring one case to its file in a folder, and give the file's path.

    Finished already: nothing is computed. Interrupted, by whatever means: it goes on from its last checkpoint, and
    ends with the same numbers, to the last bit, as if it had not been; ``wall_time`` leaves out what was lost. The
    seed paper's method begins again.

    Parameters
    ----------
    case : Case
        What to compute.
    folder : path
        Where the file goes; it is named by the case's key. What an unfinished run keeps is in hidden files beside it.
    progress : bool or callable
        A progress bar, or a function called with the time reached and the program's length. [s]
    stop : callable, optional
        Asked at every accepted step; if it says so, a checkpoint is written and :class:`KeyboardInterrupt` raised.
    checkpoint_seconds : float
        Time between checkpoints; longer where they would take a twentieth of the time. [s]
    checkpoint_steps : int, optional
        Accepted steps between checkpoints, whatever these take.
    same_bits : bool
        Compute anew what was computed, all or in part, with other versions of the transforms or of NumPy, whose last
        digits differ. Otherwise it counts, since it keeps the tolerance as well, and a warning says so.

    Raises
    ------
    InputError, ConvergenceError
        As :func:`roughvisc.run`. An unconverged result is kept and none of these.
    InUseError
        If another run is at work on this case in this folder.
    ChangedError
        If the surface's file was changed after the study was read.
    OSError
        If the disk is full; the last checkpoint stays.
    """
    folder = Path(folder)
    path = result_path(folder, case.key)
    if is_result_of(case, path, same_bits) and not _leftovers(path):
        return path
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    keep_memory()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with held(folder / f".{case.key}.lock") as lock:
            for torn in torn_files(path):
                torn.unlink()
            keeper = Keeper(
                folder / f".{case.key}.unfinished",
                case.key,
                lock.check,
                seconds=checkpoint_seconds,
                steps=checkpoint_steps,
                stop=stop,
                same_bits=same_bits,
            )
            with closing(keeper):
                if not is_result_of(case, path, same_bits):
                    if path.exists() and not is_result_of(case, path):  # damaged, and not of other transforms
                        set_aside(path)
                    keeper.resume()
                    _finish(case, folder, progress, keeper)
                keeper.remove()
    except InUseError:
        if is_result_of(case, path, same_bits):  # the other run has just finished
            return path
        raise
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        advice = "what was computed up to the last checkpoint is kept: make room and run it again"
        raise OSError(error.errno, f"{os.strerror(error.errno)}; {advice}", str(path)) from error
    finally:
        for place in made:  # empty only if nothing was kept
            with suppress(OSError):
                place.rmdir()
    return path


def _finish(case: Case, folder: Path, progress: bool | Progress, keeper: Keeper) -> None:
    """Compute what is missing of a case and write its file."""
    try:
        dataset = compute(case, progress=progress, keeper=keeper)
        keeper.check()
        keep(dataset, case, folder)
    except HinderedError:
        raise
    except RoughviscError:  # it would fail again in the same way
        keeper.remove()
        raise
    except KeyboardInterrupt:
        keeper.save()
        raise


def is_result_of(case: Case, path: Path, same_bits: bool = False) -> bool:
    """Whether a file is the whole result of a case, and on request of the transforms that are here."""
    if not path.exists():
        return False
    try:
        with open_result(path) as dataset:
            whole = bool(dataset.attrs.get("case_key") == case.key)
            made_with = str(dataset.attrs.get("transforms", ""))
    except InputError as error:
        log.warning("%s", error)
        return False
    if whole and made_with != transform_library():
        log.warning("%s: %s", path, other_transforms([made_with]))
        return not same_bits
    return whole


def other_transforms(made_with: Iterable[str]) -> str:
    """What to tell of finished results by what they were made with; empty if there is nothing to tell."""
    counts = Counter(made_with)
    if set(counts) <= {transform_library()}:
        return ""
    found = ", ".join(f"{count} with {transforms}" for transforms, count in counts.items())
    return (
        f"{found}, where this process has {transform_library()}: equal within the tolerance, not to the last bit; "
        "same_bits=True (--same-bits) computes the others anew"
    )


def _leftovers(path: Path) -> bool:
    """Whether a run has left behind what it needs no longer."""
    return any(path.parent.glob(f".{path.stem}.*"))


def keep(dataset: xr.Dataset, case: Case, folder: Path) -> Path:
    """Write a case's result to its file in a folder; the file is named by the case's key."""
    path = write_result(dataset, result_path(folder, case.key), precision=case.settings.keep.precision)
    dataset.encoding["source"] = str(path)
    complaint = unconverged(dataset)
    if complaint:
        log.warning("%s: %s", path, complaint)
    return path


def unconverged(histories: xr.Dataset | Mapping[str, NDArray[np.generic]]) -> str:
    """What to tell about steps that did not converge; empty if all did."""
    status = np.asarray(histories["status"])
    bad = np.flatnonzero(status == NOT_CONVERGED)
    if not bad.size:
        return ""
    left = np.asarray(histories["residual"], dtype=float)[bad]
    known = left[np.isfinite(left)]  # the seed paper's algorithm estimates nothing
    by = f" (estimated error of the pressure up to {known.max():.2g})" if known.size else ""
    return (
        f"{bad.size} of {status.size} kept times did not converge, first at "
        f"t = {float(histories['time'][bad[0]]):.6g} s{by}: try a looser tolerance or shorter steps"
    )
