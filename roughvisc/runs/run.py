"""Execution of one case, from the study to the result file, and the outcome, in which every error is a message."""

from __future__ import annotations

import errno
import json
import logging
import os
import re
import time
import traceback
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import filterfalse
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from roughvisc.arguments import count, split
from roughvisc.errors import InputError, RoughviscError
from roughvisc.experiment.problem import Problem
from roughvisc.labels import warnings_of
from roughvisc.paths import path_of
from roughvisc.runs.checkpoint import CheckpointWriter
from roughvisc.runs.folder import case_path, existing_part, lock_case, require_writable, unusable
from roughvisc.runs.netcdf import DamagedError, as_stored, open_result, write_result
from roughvisc.runs.sweep_data import Entry, entry_of, read_entry
from roughvisc.solve import Progress, solve
from roughvisc.study.case import Case, labels_of
from roughvisc.version import program_version

if TYPE_CHECKING:
    import xarray as xr

log = logging.getLogger("roughvisc")

#: Largest number of cells of heights that are kept for the next case, and the kept heights by their table.
_KEPT = 128**2
_LAST_HEIGHT: dict[str, xr.DataArray] = {}

#: Facts that a stored result omits, because its attribute ``case`` determines them.
_IN_THE_CASE = ("compliance_at_end", "poisson", "time_scale", "base")
#: How a case ended. ``hindered``: stopped by a cause outside the case, such as a full disk, too little memory, a killed
#: process, or another run of the case; the same command resumes it. ``failed``: it would fail again.
Kind = Literal["done", "failed", "hindered", "interrupted"]
#: Errors of a case that another run computes, and of a full disk.
IN_USE = errno.errorcode[errno.EWOULDBLOCK]
FULL = ("ENOSPC", "EDQUOT")
#: Errors that refuse the input of a case.
REFUSED = ("InputError", "EdgeContactError", "TooLargeError")


def result_folder(case: Case, out: str | Path | None = None) -> Path:
    """Return the folder of the results of a study.

    Parameters
    ----------
    case : Case
        A case of the study.
    out : path, optional
        The folder. Default: ``results/`` and the name of the study, next to the study.

    Raises
    ------
    InputError
        If the path is empty, is a file, or lies below a file.
    """
    if out is not None:
        folder = path_of(out, "out").expanduser()
    elif case.origin is not None:
        folder = case.origin.parent / "results" / case.origin.stem
    else:
        folder = Path("results") / (re.sub(r"[^a-z0-9]+", "-", case.title.lower()).strip("-") or "untitled")
    if not (there := existing_part(folder)).is_dir():
        key = "out" if out is not None else ""
        expected = "a folder for the results"
        text = f"{there}: is a file: expected {expected}"
        raise InputError(f"{key}: {text}" if key else text, key=key, found=out, expected=expected)
    return folder


def compute(
    case: Case, keeper: CheckpointWriter, folder: Path, *, progress: bool | Progress = True, threads: int | None = None
) -> xr.Dataset:
    """Compute a case and return the result; its attributes contain everything that a second run needs.

    Paths in the attributes are relative to the folder of the result. The run continues from the checkpoint of the
    keeper, which also provides the fields of the result.

    Raises
    ------
    InputError, ConvergenceError
        As :func:`roughvisc.simulate` and :func:`roughvisc.friction`, with the study's name in front.
    """
    height = _height_of(case)
    try:
        problem = Problem(height, case.body, case.settings)
        dataset = solve(problem, case.experiment, keeper, progress=progress, threads=threads)
    except InputError as error:
        raise error.prefixed(str(case.origin)) if case.origin else error  # noqa: B904
    if "speed" in dataset:
        dataset = dataset.assign(reduced_speed=("speed", case.shift_factor * dataset["speed"].values))
    title = case.title
    for key, value in case.varied.items():
        title += f", {key} = {json.dumps(value)}"
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    stated = case.to_json(folder)
    ran = f"{now} {program_version()}: run of {case.origin.name if case.origin else 'a case'}"
    provenance = {
        "Conventions": dataset.attrs.pop("Conventions"),
        "title": title,
        "source": dataset.attrs.pop("source"),
        "history": "\n".join(filter(None, [dataset.attrs.pop("history", ""), ran])),
        "case": stated,
        "case_key": case.key,
        "surface_sha256": case.surface_sha256,
    }
    dataset.attrs = provenance | split(dataset.attrs, *_IN_THE_CASE)[1]
    data = json.loads(stated)
    return dataset.assign_coords(labels_of(data.get("varied", {}), data))


def _height_of(case: Case) -> xr.DataArray:
    """Return the heights of a case; a small generated surface of the last case in this process is kept. [m]"""
    if "generate" not in case.surface or "second" in case.surface:  # a file may have changed
        return case.height()
    stated = json.dumps(dict(case.surface), default=str)
    if stated in _LAST_HEIGHT:
        return _LAST_HEIGHT[stated].copy()
    height = case.height()
    _LAST_HEIGHT.clear()
    if height.size <= _KEPT:
        _LAST_HEIGHT[stated] = height.copy()
    return height


def run_case(
    case: Case,
    folder: str | Path,
    *,
    progress: bool | Progress = False,
    stop: Callable[[], bool] | None = None,
    checkpoint_seconds: float = 30.0,
    threads: int | None = None,
) -> Path:
    """Run one case unless its file exists, and return the path of the file.

    An interrupted case continues from its last checkpoint, and its result has the same bits as the result of an
    uninterrupted run; ``wall_time`` does not include lost work. A friction curve continues with the speed at which it
    was interrupted.

    Parameters
    ----------
    case : Case
        The case.
    folder : path
        Folder of the file, which is named by the key of the case. Checkpoints are hidden folders in it.
    progress : bool or callable
        Whether to draw a progress bar; or a function of the current time and the length of the program [s], or of the
        number of finished speeds and their total number.
    stop : callable, optional
        Called at every accepted step, or speed; if it returns true, a checkpoint is written and
        :class:`KeyboardInterrupt` raised.
    checkpoint_seconds : float
        Least time between checkpoints, which take at most a twentieth of the run. [s]
    threads : int, optional
        As for :func:`roughvisc.simulate`.

    Raises
    ------
    InputError, ConvergenceError
        As for :func:`roughvisc.run`.
    BlockingIOError
        If another run computes this case in this folder.
    RoughviscError
        If the file of the surface has changed since the study was read.
    OSError
        If the disk is full; the last checkpoint is kept.
    """
    return _run(case, Path(folder), progress, stop, checkpoint_seconds, threads)[0]


def _run(
    case: Case,
    folder: Path,
    progress: bool | Progress = False,
    stop: Callable[[], bool] | None = None,
    checkpoint_seconds: float = 30.0,
    threads: int | None = None,
) -> tuple[Path, Entry | None]:
    """Run one case unless its file exists; return the path, and the entry of a file that was written now."""
    count("threads", threads, 1)
    path = case_path(folder, case.key, "result")
    entry = None
    if is_result_of(case, path) and not any(folder.glob(f".{case.key}.*")):
        return path, None  # finished, without leftovers to remove
    require_writable(folder, "since the case is not finished")
    made = list(filterfalse(Path.exists, (folder, *folder.parents)))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        unfinished = case_path(folder, case.key, "checkpoint")
        with (
            lock_case(case_path(folder, case.key, "lock")),
            closing(CheckpointWriter(unfinished, seconds=checkpoint_seconds, stop=stop)) as keeper,
        ):
            for torn in folder.glob(f".{case.key}.*.part.nc"):
                torn.unlink()
            if not is_result_of(case, path):
                if path.exists():
                    aside = path.replace(f"{path}.damaged")
                    log.warning("%s: is damaged: it is renamed to %s and computed again", path, aside.name)
                keeper.resume()
                try:
                    case = case.stored(folder)
                    dataset = compute(case, keeper, folder, progress=progress, threads=threads)
                    write_result(dataset, path)
                    entry = entry_of(path, as_stored(dataset))
                except RoughviscError as error:
                    if not error.transient:  # it would fail again in the same way
                        keeper.remove()
                    raise
                except KeyboardInterrupt:
                    keeper.save()
                    raise
                for text in warnings_of(dataset.attrs).values():
                    log.warning("%s: %s", path, text)
            keeper.remove()
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        advice = "what was computed up to the last checkpoint is kept: make room and run it again"
        raise OSError(error.errno, f"{os.strerror(error.errno)}; {advice}", str(path)) from error
    finally:
        for place in made:  # rmdir removes only empty folders
            with suppress(OSError):
                place.rmdir()
    return path, entry


def is_result_of(case: Case, path: Path) -> bool:
    """Return whether a file is the result of a case; an absent or damaged file is not.

    Parameters
    ----------
    case : Case
        The case.
    path : Path
        File named by the key of the case.

    Raises
    ------
    InputError
        If the file cannot be read, or is not a result of this case.
    """
    if not path.exists():
        return False
    try:
        with open_result(path) as dataset:
            stored_key = dataset.attrs.get("case_key")
    except DamagedError:
        return False
    if stored_key != case.key:
        raise unusable(path, f"holds the result of case {stored_key}", f"the result of case {case.key}, as in its name")
    return True


@dataclass(frozen=True)
class Outcome:
    """End of a case, small enough to be sent from a worker.

    Attributes
    ----------
    key : str
        Key of the case.
    kind : str
        How it ended.
    message : str
        Message to the user; empty if the case is done.
    error : str
        Class name of the exception, or name of a system error, such as ENOSPC.
    trace : str
        Traceback of an unexpected exception.
    seconds : float
        Wall time. [s]
    entry : Entry or None
        Contents of the result file without the fields.
    reused : bool
        Whether an earlier run computed it.
    """

    key: str
    kind: Kind
    message: str = ""
    error: str = ""
    trace: str = ""
    seconds: float = 0.0
    entry: Entry | None = None
    reused: bool = False


def outcome_of(entry: Entry, *, seconds: float = 0.0, reused: bool = False) -> Outcome:
    """Return the outcome of a case whose result exists."""
    return Outcome(entry.key, "done", seconds=seconds, entry=entry, reused=reused)


def attempt(case: Case, folder: Path, *, progress: Callable[[float, float], None], **settings: Any) -> Outcome:
    """Run a case with some settings of :func:`run_case` and return its outcome; raise only ``KeyboardInterrupt``."""
    began = time.perf_counter()
    kind = "hindered"
    trace = ""
    try:
        path, entry = _run(case, folder, progress, **settings)
        return outcome_of(entry or read_entry(path), seconds=time.perf_counter() - began)
    except MemoryError as error:
        name = type(error).__name__
        advice = "roughvisc plan says how much a case needs, and fewer --workers leave more"
        message = f"not enough memory; the last checkpoint is kept: {advice}"
    except OSError as error:  # for example a full disk, or another run of the case
        name = errno.errorcode.get(error.errno or 0, "OSError")
        place = f"{error.filename}: " if error.filename else ""
        message = f"{place}{error.strerror or error}"
    except RoughviscError as error:
        name = type(error).__name__
        message = str(error)
        kind = "hindered" if error.transient else "failed"
    except Exception as error:  # noqa: BLE001  (an unexpected error of one case must not stop the others)
        name = type(error).__name__
        message = str(error)
        kind = "failed"
        trace = traceback.format_exc()
        message = f"{name}: {message}"
    return Outcome(case.key, kind, message, name, trace, time.perf_counter() - began)
