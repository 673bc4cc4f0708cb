"""Checkpoints: the state of an unfinished run, from which it continues to the same last bit.

A checkpoint is one record of everything in the state of a march, all floats exact. Two files take turns, each written
whole under another name first, so that one whole checkpoint outlives whatever happens to the other.
"""

from __future__ import annotations

import logging
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from roughvisc.mechanics.bodies.transforms import transform_library
from roughvisc.recorder import Checkpoint
from roughvisc.study.statement.identity import NUMERICS_REVISION
from roughvisc.study.storage.links import refuse_link
from roughvisc.study.storage.records import Damaged, RowFile, read_record, write_record
from roughvisc.study.storage.store import atomic_write
from roughvisc.variables import RESULT_FORMAT

log = logging.getLogger("roughvisc")

#: Raised by whoever changes what a checkpoint holds of a state.
_LAYOUT = 2
#: Writing checkpoints may take this part of the time.
_SHARE = 0.05


def save_checkpoint(path: Path, reached: Checkpoint, key: str) -> None:
    """Write how far the case of that key has come, whole or not at all."""
    arrays: dict[str, Any] = {}
    seen: dict[int, str] = {}
    stated = {field.name: _flatten(getattr(reached, field.name), arrays, seen) for field in fields(reached)}
    plain = {"key": key, "revision": NUMERICS_REVISION, "result_format": RESULT_FORMAT, "layout": _LAYOUT}
    plain["reached"] = stated
    with atomic_write(path) as temporary, open(temporary, "wb", buffering=0) as stream:
        write_record(stream, plain, arrays)


def load_checkpoint(path: Path, key: str, states: Sequence[type] = ()) -> Checkpoint | None:
    """How far the case of that key has come; None if the file is absent, damaged, or of something else.

    Parameters
    ----------
    path : path
        Of the file.
    key : str
        Of the case.
    states : sequence of type
        Dataclasses that the state of its experiment is made of: no others are made.
    """
    try:
        with open(path, "rb", buffering=0) as stream:
            plain, arrays = read_record(stream)
        found = plain["key"], plain["revision"], plain.get("result_format", 1), plain.get("layout", 1)
        if found == (key, NUMERICS_REVISION, RESULT_FORMAT, _LAYOUT):
            kinds = {kind.__name__: kind for kind in states}
            parts = plain["reached"].items()
            reached = Checkpoint(**{name: _unflatten(value, arrays, kinds) for name, value in parts})
    except FileNotFoundError:
        return None
    except (Damaged, OSError, KeyError, TypeError, ValueError) as error:
        log.warning("%s: is damaged and not used: %s", path, error)
        return None
    if found != (key, NUMERICS_REVISION, RESULT_FORMAT, _LAYOUT):
        log.warning("%s: belongs to another case or revision and is not used", path)
        return None
    return reached


def checkpoint_version(folder: Path) -> tuple[int, int] | None:
    """Revision of the numerics and format of an unfinished run's latest checkpoint; None if there is none to read."""
    found = []
    for path in folder.glob("checkpoint.*"):
        try:
            with open(path, "rb", buffering=0) as stream:
                plain, _ = read_record(stream, only=())
            found.append((int(plain["revision"]), int(plain.get("result_format", 1))))
        except (Damaged, OSError, KeyError, TypeError, ValueError):
            continue
    return max(found, default=None)


def _flatten(value: Any, arrays: dict[str, Any], seen: dict[int, str]) -> Any:
    """A value as JSON knows it, its arrays put aside under names, the same array once."""
    if isinstance(value, np.ndarray):
        name = seen.setdefault(id(value), f"a{len(seen)}")
        arrays[name] = value
        return {"array": name}
    if is_dataclass(value):
        parts = {field.name: _flatten(getattr(value, field.name), arrays, seen) for field in fields(value)}
        return {"type": type(value).__name__, "parts": parts}
    if isinstance(value, tuple):
        return {"tuple": [_flatten(part, arrays, seen) for part in value]}
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"a checkpoint cannot hold a {type(value).__name__}")


def _unflatten(value: Any, arrays: dict[str, Any], kinds: Mapping[str, type]) -> Any:
    if not isinstance(value, dict):
        return value
    if "array" in value:
        return arrays[value["array"]]
    if "tuple" in value:
        return tuple(_unflatten(part, arrays, kinds) for part in value["tuple"])
    parts = value["parts"].items()
    return kinds[value["type"]](**{name: _unflatten(part, arrays, kinds) for name, part in parts})


class CheckpointWriter:
    """Keeps what a run has computed: rows in one file, how far it has come in two others, all in one folder.

    Parameters
    ----------
    folder : path
        Of this run alone; made if need be.
    key : str
        Of the case.
    check : callable
        Called before anything is written: may raise that this run has lost its right to.
    states : sequence of type
        Dataclasses that the state of the experiment is made of.
    seconds, steps : float, int or None
        A checkpoint is written after so long, but not so often that it would take a twentieth of the time; and after
        so many accepted steps.
    stop : callable or None
        Asked after every accepted step.
    same_bits : bool
        Do not go on from what other transforms have computed.

    Raises
    ------
    FolderError
        If the folder or a file in it is a link.
    """

    def __init__(
        self,
        folder: Path,
        key: str,
        check: Callable[[], None],
        states: Sequence[type] = (),
        *,
        seconds: float = 30.0,
        steps: int | None = None,
        stop: Callable[[], bool] | None = None,
        same_bits: bool = False,
    ) -> None:
        refuse_link(folder, "the folder of an unfinished run")
        self._paths = [folder / "checkpoint.0", folder / "checkpoint.1"]
        for path in self._paths:
            refuse_link(path, "a checkpoint of a run")
        folder.mkdir(exist_ok=True)
        self.rows = RowFile(folder / "rows", check)
        self.in_memory = False
        #: How far the run has come: no state of an earlier step is held.
        self.latest = Checkpoint()
        self._folder = folder
        self._key = key
        self.check, self._interval, self._steps, self._stop = check, seconds, steps, stop
        self._states, self._same_bits = states, same_bits
        self._pending, self._last_save = 0, time.monotonic()

    def resume(self) -> None:
        """Find out where to go on from: the last whole checkpoint whose rows are there; the start if there is none."""
        for leftover in self._folder.glob(".*"):
            leftover.unlink()
        read = [(load_checkpoint(path, self._key, self._states), path) for path in self._paths]
        found = [(reached, path) for reached, path in read if reached is not None]
        for reached, path in sorted(found, key=lambda pair: -pair[0].wall_time):
            here = reached.with_current_transforms()
            if here != reached and self._same_bits:
                log.warning(
                    "%s: was computed with %s: not used, this is %s", path, reached.transforms, transform_library()
                )
                continue
            if self.rows.keep_first(reached.rows):
                log.info("%s: goes on from here", path)
                self.latest = here
                if path == self._paths[0]:
                    self._paths.reverse()
                return
            log.warning("%s: its rows are damaged; not used", path)
        for path in self._paths:
            path.unlink(missing_ok=True)
        self.rows.keep_first(0)

    def update(self, reached: Checkpoint) -> None:
        """Take note of an accepted step; write a checkpoint if it is time to.

        Raises
        ------
        KeyboardInterrupt
            If the run is to stop; a checkpoint has then been written.
        """
        self.latest = reached
        self._pending += 1
        if self._stop is not None and self._stop():
            self.save()
            raise KeyboardInterrupt
        due = time.monotonic() - self._last_save >= self._interval
        if due or (self._steps is not None and self._pending >= self._steps):
            self.save()

    def save(self) -> None:
        """Write a checkpoint, if anything has been computed since the last one."""
        if not self._pending:
            return
        began = time.monotonic()
        self.check()
        self.rows.sync()  # first: a checkpoint counts on its rows
        save_checkpoint(self._paths[0], self.latest, self._key)
        self._paths.reverse()
        self._pending, self._last_save = 0, time.monotonic()
        self._interval = max(self._interval, (self._last_save - began) / _SHARE)

    def remove(self) -> None:
        """Remove all that was kept: the result is written, or cannot be had."""
        self.check()
        self.rows.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def close(self) -> None:
        """Close the files; without a checkpoint nothing in them is of use."""
        self.rows.close()
        if not any(path.exists() for path in self._paths):
            self.remove()
