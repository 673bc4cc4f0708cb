"""One case, in this process or on the client that the user has made the default."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

from roughvisc.errors import ConvergenceError
from roughvisc.groups import whole_of
from roughvisc.study.execution.cluster import default_client
from roughvisc.study.execution.run import Progress, is_result_of, result_folder, run_case, unconverged
from roughvisc.study.statement.case import Case, read_study
from roughvisc.study.storage.store import open_result, require_writable, result_path
from roughvisc.study.storage.upkeep import upgrade_note

if TYPE_CHECKING:
    import xarray as xr

log = logging.getLogger("roughvisc")


def run(
    case: Case | str | Path,
    out: str | Path | None = None,
    *,
    progress: bool | Progress = True,
    same_bits: bool = False,
    threads: int | None = None,
) -> xr.Dataset:
    """Compute one case and store it in a file.

    It runs in this process, or on a worker of the default ``dask.distributed.Client`` if there is one.

    Parameters
    ----------
    case : Case or path
        A case, or its study file.
    out : path, optional
        Results folder, under the same path for all workers. Default: ``results/`` and the name of the study, next to
        the study.
    progress : bool or callable
        A progress bar, or a function called with the current time and the length of the program. [s]
    same_bits : bool
        Compute again what was computed, completely or in part, with other versions of the FFTs or of NumPy, whose last
        digits differ. Otherwise such results are used, because they also meet the tolerance, and a warning says so.
    threads : int, optional
        Number of threads for a large grid; see :func:`roughvisc.simulate`. Default on a worker: all its threads.

    Returns
    -------
    xarray.Dataset
        The result over ``(time, x, y)``; fields are read from its file when they are needed. The file is
        ``ds.encoding["source"]``, named by the key of the case. A finished case is not computed again, and an
        interrupted one is resumed; see :func:`run_case`.

    Raises
    ------
    InputError
        If the input is invalid; nothing is written.
    TooLargeError
        If the case needs more memory than is available. It is refused before any memory is allocated, and no failure is
        recorded.
    ConvergenceError
        If a step did not converge. The result is written nevertheless, and the message names the file.
    """
    if not isinstance(case, Case):
        case = read_study(case)
    folder, client = result_folder(case, out, to_write=False), default_client()
    if not is_result_of(case, result_path(folder, case.key), same_bits):
        require_writable(folder, "since the case is not finished")
        if told := upgrade_note(folder, [case]):
            log.warning("%s", told)
    if client is None:
        path = run_case(case, folder, progress=progress, same_bits=same_bits, threads=threads)
    else:
        from roughvisc.study.execution.dispatch import run_on

        path = run_on(client, case, folder.absolute(), progress, same_bits, threads)
    dataset = open_result(path)
    complaint = unconverged(whole_of(dataset))
    if complaint:
        raise ConvergenceError(f"{complaint}; the result is kept in {path}, its variable 'status' says which")
    return dataset
