"""Solves of one case with something changed, the numbers read off them, and what a result of the case states itself."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError, RoughviscError
from roughvisc.study.case import Case
from roughvisc.study.execution.monitor import Monitor
from roughvisc.study.execution.run import unconverged
from roughvisc.study.execution.sweep import run_cases
from roughvisc.study.quantities import Observable
from roughvisc.study.storage.store import open_result, result_path

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger("roughvisc")
Array = NDArray[np.float64]
#: Folder of the further solves, in that of the results.
FOLDER = "budget"
#: Places of a result that differ by less are the same.
_ALIKE = 1e-9
#: Time of some solves from which on further processes are worth it, where they are not asked for. [s]
_WORTH_PROCESSES = 20.0
#: Time of some solves from which on a display shows how they go on. [s]
_WORTH_WATCHING = 2.0


def nearest_rows(rows: Any, places: Any) -> NDArray[np.intp]:
    """Numbers of the rows that lie nearest to some places of their axis."""
    apart = np.abs(np.asarray(rows, dtype=float)[:, None] - np.asarray(places, dtype=float))
    return np.asarray(apart.argmin(axis=0))


@dataclass(frozen=True)
class Reading:
    """What one result gives of some quantities.

    Attributes
    ----------
    places : ndarray
        Of its rows on the axis.
    values, stated : dict
        Name of each quantity -> its values, and what steps and solver leave of their logarithms.
    touches : ndarray of bool
        Whether there is a force at each place.
    seconds : float
        Wall time of the solve. [s]
    """

    places: Array
    values: Mapping[str, Array]
    stated: Mapping[str, Array]
    touches: NDArray[np.bool_]
    seconds: float

    def at(self, places: Array) -> Reading:
        """Its rows nearest to some places."""
        rows = nearest_rows(self.places, places)
        values, stated = ({name: one[rows] for name, one in of.items()} for of in (self.values, self.stated))
        return Reading(self.places[rows], values, stated, self.touches[rows], self.seconds)


def read(result: xr.Dataset, case: Case, quantities: Sequence[Observable]) -> Reading:
    """Quantities of a whole result, or of some of its rows."""
    values = {one.name: one.of(result, case) for one in quantities}
    return Reading(
        places=np.asarray(result[case.experiment().axis].values, dtype=float),
        values=values,
        stated={one.name: one.stated_error(result, values[one.name]) for one in quantities},
        touches=result["force"].values > 0,
        seconds=float(result["wall_time"].values[-1]),
    )


@dataclass(frozen=True)
class Bench:
    """Where solves are made, and which quantities are read off them.

    Attributes
    ----------
    quantities : sequence of Observable
    folder : Path
        Of the results of the solves, which are used again.
    watch : callable
        Makes what shows how solves that take long go on.
    tell : callable
        Told in a sentence what solves have given.
    client, workers, threads, retry_failed
        As :func:`roughvisc.sweep` has them; ``workers=None``: further processes where they are worth it.
    what : str
        What the solves are for, in messages.
    """

    quantities: Sequence[Observable]
    folder: Path
    watch: Callable[[], Monitor]
    tell: Callable[[str], None] = log.info
    client: Client | None = None
    workers: int | None = 0
    threads: int | None = None
    retry_failed: bool = True
    what: str = "run --for"

    def solve(self, solves: Mapping[Any, Case], each: float = 0.0) -> dict[Any, Reading]:
        """Name -> what is read off each of some cases; ``each`` is how long one is expected to take. [s]"""
        workers, expected = self.workers, len(solves) * each
        if self.client is None and workers is None and expected < _WORTH_PROCESSES:
            workers = 0
        watch = self.watch() if expected > _WORTH_WATCHING else Monitor()
        with replace(self, workers=workers, watch=lambda: watch).results(solves) as results:
            return {name: self._read(one, solves[name]) for name, one in results.items()}

    def _read(self, result: xr.Dataset, case: Case) -> Reading:
        found = read(result, case, self.quantities)
        return replace(found, stated={name: np.nan_to_num(one) for name, one in found.stated.items()})

    @contextmanager
    def results(self, solves: Mapping[Any, Case]) -> Iterator[dict[Any, xr.Dataset]]:
        """Name -> whole result of each of some cases, from their files.

        Raises
        ------
        RoughviscError
            If one fails.
        """
        outcomes = run_cases(
            list(solves.values()),
            self.folder,
            watch=self.watch(),
            client=self.client,
            workers=self.workers,
            threads=self.threads,
            retry_failed=self.retry_failed,
        )
        with ExitStack() as files:
            found = {}
            for name, one in solves.items():
                outcome = outcomes[one.key]
                if outcome.entry is None:
                    raise RoughviscError(f"{self.what}: the solve {name!r} failed: {outcome.message}")
                if outcome.kind != "done":
                    log.warning("%s: the solve %r: %s: %s", self.what, name, outcome.kind, outcome.message)
                found[name] = files.enter_context(open_result(result_path(self.folder, one.key)))
            yield found


def finished_result(path: Path, quantities: Sequence[Observable], axis: str, places: Any) -> xr.Dataset | None:
    """Return the result in a file with these places of its axis, all rows if None; None if it is not there."""
    if not path.is_file():
        return None
    try:
        with open_result(path) as opened:  # without the fields that no quantity is derived from
            needed = {one for quantity in quantities for one in quantity.fields}
            whole = opened.drop_vars([name for name in opened if opened[name].ndim > 2 and name not in needed]).load()
    except (InputError, OSError) as error:
        log.info("budget: %s: %s: the case is solved again", path, error)
        return None
    if any(one not in whole for quantity in quantities for one in quantity.fields) or unconverged(whole):
        return None
    if places is None:
        return whole
    rows = nearest_rows(whole[axis], places)
    same = np.isclose(whole[axis].values[rows], places, rtol=_ALIKE, atol=0).all()
    return whole.isel({axis: rows}) if same else None
