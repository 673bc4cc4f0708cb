"""One case in this process."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from roughvisc.errors import ConvergenceError
from roughvisc.study.case import Case
from roughvisc.study.execution.run import Progress, is_result_of, result_folder, run_case, unconverged
from roughvisc.study.storage.files import require_writable
from roughvisc.study.storage.store import open_result, result_path

if TYPE_CHECKING:
    import xarray as xr


def run_stated(
    case: Case,
    out: str | Path | None = None,
    *,
    progress: bool | Progress = True,
    threads: int | None = None,
) -> xr.Dataset:
    """Bring a case as it is stated to its file; see :func:`roughvisc.run`."""
    folder = result_folder(case, out, to_write=False)
    if not is_result_of(case, result_path(folder, case.key)):
        require_writable(folder, "since the case is not finished")
    path = run_case(case, folder, progress=progress, threads=threads)
    dataset = open_result(path)
    complaint = unconverged(dataset)
    if complaint:
        raise ConvergenceError(f"{complaint}; the result is kept in {path}, its variable 'status' says which")
    return dataset
