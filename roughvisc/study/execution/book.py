"""Account of a sweep: who is told how it goes on, what is recorded, what the index holds."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from roughvisc.errors import DiskFullError
from roughvisc.study.execution.task import IN_WORDS, Outcome
from roughvisc.study.statement.case import Case
from roughvisc.study.storage.failures import forget_failure, record_failure
from roughvisc.study.storage.index import Entry, Index, index_of, save_index
from roughvisc.study.storage.store import is_writable
from roughvisc.study.storage.table import write_table

log = logging.getLogger("roughvisc")

#: Seconds between two savings of the index while a sweep runs.
_SAVE_EVERY = 60.0


class Monitor(Protocol):
    """Who is told how a sweep goes on; times in seconds."""

    def begin(self, cases: Sequence[Case], link: str) -> None:
        """The distinct cases, in order, and the address of Dask's dashboard if there is one."""

    def reached(self, key: str, now: float, end: float) -> None:
        """A running case is at this time of so much; from any thread."""

    def ended(self, outcome: Outcome) -> None:
        """A case ended."""

    def tick(self) -> None:
        """Called several times a second."""

    def told(self, message: str) -> None:
        """Something the user should know at once."""

    def stopping(self) -> None:
        """The sweep is interrupted and waits for the running cases to stop."""

    def close(self) -> None:
        """Nothing more follows."""


@dataclass
class SweepLog:
    """Keeps account of a sweep.

    Attributes
    ----------
    folder : Path
        Of the results.
    cases : dict
        All distinct cases by key.
    outcomes : dict
        How those ended that have ended.
    watch : Monitor
        Who is told.
    entries : list of Entry
        Of the results that are known.
    saved : float
        When the index was saved last, by the monotonic clock. [s]
    """

    folder: Path
    cases: Mapping[str, Case]
    outcomes: dict[str, Outcome]
    watch: Monitor
    entries: list[Entry]
    saved: float = 0.0

    def begin(self, link: str = "") -> None:
        self.saved = time.monotonic()
        self.watch.begin(list(self.cases.values()), link)
        for outcome in self.outcomes.values():
            self.watch.ended(outcome)
        if link:
            log.info("dashboard: %s", link)

    def ended(self, outcome: Outcome) -> None:
        self.outcomes[outcome.key] = outcome
        case = self.cases[outcome.key]
        varied = json.dumps(dict(case.varied))
        level = logging.INFO if outcome.kind == "done" else logging.WARNING
        log.log(
            level, "%s %s %.3g s %s %s", outcome.key, IN_WORDS[outcome.kind], outcome.seconds, varied, outcome.message
        )
        if outcome.trace:
            log.error("%s", outcome.trace)
        if outcome.kind == "failed" and len(self.cases) > 1:
            record_failure(self.folder, case, outcome.message, outcome.error, outcome.trace)
        elif outcome.entry is not None:
            self.entries.append(outcome.entry)
            forget_failure(self.folder, outcome.key)
        self.watch.ended(outcome)
        if len(self.cases) > 1 and time.monotonic() - self.saved > _SAVE_EVERY:
            self.save()
        if outcome.error == DiskFullError.__name__:  # the others would fill the log with the same
            finished = sum(one.entry is not None for one in self.outcomes.values())
            raise DiskFullError(f"{outcome.message} ({finished} of {len(self.cases)} cases are finished)")

    def tell(self, message: str) -> None:
        """Say what the user should know at once, and log it."""
        log.warning("%s", message)
        self.watch.told(message)

    def save(self) -> None:
        """Write the index and the table of the folder, unless it may not be written to."""
        self.saved = time.monotonic()
        if not is_writable(self.folder):
            return
        index = Index(index_of(self.folder, self.entries).entries, tuple(self.cases))
        save_index(self.folder, index)
        held = {key: outcome.message for key, outcome in self.outcomes.items() if outcome.kind == "held"}
        write_table(self.folder, index, {key: json.loads(case.to_json()) for key, case in self.cases.items()}, held)
