"""Quantities that a study asks for in ``[observe]``, added to the files of its results."""

from __future__ import annotations

import json
import logging
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.observables import OBSERVABLES
from roughvisc.progress import reporting
from roughvisc.runs.cluster import default_client, require_synchronous
from roughvisc.runs.csv_files import update_table
from roughvisc.runs.folder import case_path, lock_case
from roughvisc.runs.netcdf import open_result, write_result
from roughvisc.runs.run import result_folder
from roughvisc.solve import Progress
from roughvisc.study.case import Case, cases_given

log = logging.getLogger("roughvisc")

#: Attribute of a result: the arguments of each observable that it contains, as JSON.
OBSERVED = "observed"


def observe(
    cases: Sequence[Case] | str | Path,
    out: str | Path | None = None,
    *,
    progress: bool | Progress = True,
) -> list[Path]:
    """Compute the quantities in ``[observe]`` of a study from its finished results, and add them to the files.

    :func:`roughvisc.run`, :func:`roughvisc.sweep` and ``roughvisc run`` do so at the end. Call this function with the
    same arguments after a change of ``[observe]``: no case is computed again. Quantities that a file already contains,
    for equal arguments, are not computed again.
    Frames are Dask tasks, on the default client if there is one, otherwise in threads.

    Parameters
    ----------
    cases : sequence of Case, or path
        Cases, or their study file. Unfinished cases are skipped.
    out : path, optional
        Results folder. Default: ``results/`` and the name of the study, next to the study.
    progress : bool or callable
        A progress bar, or a function called with the number of finished cases and the total number.

    Returns
    -------
    list of pathlib.Path
        The files that were changed.

    Raises
    ------
    InputError
        If a quantity cannot be computed from a result; its file is not changed. If the default client is asynchronous.

    See Also
    --------
    roughvisc.run, roughvisc.sweep, roughvisc.observables

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ds = rv.run(case, folder, progress=False).load()
    ...     with_conductance = rv.vary(case, {"observe": {"conductance": {"resistivity": ["0.2 K m/W", 0]}}})
    ...     changed = rv.observe([with_conductance], folder, progress=False)
    >>> len(changed)
    1
    """
    cases = cases_given(cases)
    distinct = {case.key: case for case in cases if case.observed}
    folder = result_folder(cases[0], out).absolute()
    require_synchronous(default_client())
    added = []
    bar: AbstractContextManager[Progress | None] = nullcontext(progress if callable(progress) else None)
    if progress is True and distinct:
        bar = reporting("observing", lambda done, count: f"{done:.0f} of {count:.0f} cases")
    with bar as report:
        for number, case in enumerate(distinct.values()):
            if report is not None:
                report(number, len(distinct))
            path = case_path(folder, case.key, "result")
            if path.exists() and _add(case, path):
                added.append(path)
    if added and len(cases) > 1:
        update_table(folder)
    return added


def _add(case: Case, path: Path) -> bool:
    """Add the missing quantities of one case to its file; return whether any was missing."""
    if not _lacking(case, open_result(path)):
        return False
    with lock_case(case_path(path.parent, case.key, "lock")), open_result(path) as result:
        lacking = _lacking(case, result)  # again, because the file may have changed
        frames = result.chunk({dim: 1 if dim == "time" else -1 for dim in result.dims})  # a block is a frame
        try:
            parts = [OBSERVABLES[name](frames, **arguments) for name, arguments in lacking.items()]
            observables = xr.merge(parts, compat="equals", join="exact").compute()
        except InputError as error:
            raise error.prefixed(str(path)) from error
        known = json.loads(result.attrs.get(OBSERVED, "{}")) | lacking
        whole = result.drop_vars(set(observables.data_vars) & set(result.data_vars)).merge(
            observables, compat="equals", join="exact"
        )
        whole.attrs = result.attrs | {"case": case.to_json(path.parent), OBSERVED: json.dumps(known)}
        write_result(whole, path)
    log.info("%s: added %s", path, ", ".join(lacking))
    return True


def _lacking(case: Case, result: xr.Dataset) -> dict[str, Any]:
    """Return the observables that a result lacks, or contains for other arguments."""
    before = json.loads(result.attrs.get(OBSERVED, "{}"))
    return {name: values for name, values in case.observed.items() if before.get(name) != values}
