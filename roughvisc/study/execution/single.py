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
    """Compute one case and keep it in one file.

    It is computed in this process, or by a worker of the ``dask.distributed.Client`` that you have made the default.

    Parameters
    ----------
    case : Case or path
        A case, or the study file that states one.
    out : path, optional
        Folder of the result, which workers see under the same path. Default: ``results/`` and the study's name,
        beside the study.
    progress : bool or callable
        A progress bar, or a function called with the time reached and the program's length. [s]
    same_bits : bool
        Compute anew what was computed, all or in part, with other versions of the transforms or of NumPy, whose last
        digits differ. Otherwise it counts, since it keeps the tolerance as well, and a warning says so.
    threads : int, optional
        Of a large grid; see :func:`roughvisc.simulate`. On a worker, by default as many as that has.

    Returns
    -------
    xarray.Dataset
        The result, ``(time, x, y)``, whose fields are read from its file when they are asked for; the file is
        ``ds.encoding["source"]``, named by the case's key. A case that was finished before is not computed again, one
        that was interrupted goes on; see :func:`run_case`.

    Raises
    ------
    InputError
        If the input is wrong; nothing is written.
    TooLargeError
        If the case needs more memory than there is, before any is taken; nothing is recorded against it.
    ConvergenceError
        If a step did not converge. The result is written all the same, and the message says where.
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
