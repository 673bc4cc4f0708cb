"""One case, in this process or on the client that the user has made the default."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from roughvisc.errors import ConvergenceError
from roughvisc.study.execution.run import Progress, is_result_of, result_folder, run_case, unconverged
from roughvisc.study.statement.case import Case
from roughvisc.study.storage.files import require_writable
from roughvisc.study.storage.store import open_result, result_path

if TYPE_CHECKING:
    import xarray as xr
    from distributed import Client


def run_stated(
    case: Case,
    out: str | Path | None = None,
    *,
    progress: bool | Progress = True,
    threads: int | None = None,
) -> xr.Dataset:
    """Bring a case as it is stated to its file; see :func:`roughvisc.run`."""
    folder, client = result_folder(case, out, to_write=False), default_client()
    if not is_result_of(case, result_path(folder, case.key)):
        require_writable(folder, "since the case is not finished")
    if client is None:
        path = run_case(case, folder, progress=progress, threads=threads)
    else:
        from roughvisc.study.execution.dispatch import run_on

        path = run_on(client, case, folder.absolute(), progress, threads)
    dataset = open_result(path)
    complaint = unconverged(dataset)
    if complaint:
        raise ConvergenceError(f"{complaint}; the result is kept in {path}, its variable 'status' says which")
    return dataset


def default_client() -> Client | None:
    """The client that the user has made the default; none within a Dask task, which is there to compute itself."""
    distributed = sys.modules.get("distributed")
    if distributed is None:  # nobody has made one
        return None
    with suppress(ValueError):
        distributed.get_worker()
        return None
    with suppress(ValueError):
        return distributed.default_client()
    return None
