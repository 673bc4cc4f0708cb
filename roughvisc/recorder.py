"""What keeps the rows of a solve, in memory or in a file, and how far it has come."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.bodies.transforms import transform_library

Array = NDArray[Any]
#: Writes the field of a row to an array of zeros, and gives that.
Frame = Callable[[int, Array], Array]

#: Between two libraries in the account of what a solve was computed with.
_THEN = "; then "


class RowStore(Protocol):
    """Where the rows of a solve are kept."""

    plain: list[dict[str, Any]]

    def append(self, plain: dict[str, Any], arrays: Mapping[str, Array]) -> None:
        """Take up a row: plain values and arrays."""
        ...

    def arrays(self, row: int, *names: str) -> Mapping[str, Array]:
        """Arrays of a row, those of these names at least."""
        ...

    def stacked(self, frame: Frame, rows: Sequence[int], shape: tuple[int, int]) -> Any:
        """Array (rows, x, y) of what ``frame`` gives for each of some rows."""
        ...


class RowsInMemory:
    """Rows of a solve that leaves no file."""

    def __init__(self) -> None:
        self.plain: list[dict[str, Any]] = []
        self._arrays: list[Mapping[str, Array]] = []

    def append(self, plain: dict[str, Any], arrays: Mapping[str, Array]) -> None:
        """Take up a row."""
        self.plain.append(plain)
        self._arrays.append(arrays)

    def arrays(self, row: int, *names: str) -> Mapping[str, Array]:
        """Arrays of a row, those of these names at least."""
        return self._arrays[row]

    def stacked(self, frame: Frame, rows: Sequence[int], shape: tuple[int, int]) -> Array:
        """The frames of some rows."""
        frames = np.zeros((len(rows), *shape))  # memory that is never written to is never touched
        for row, out in zip(rows, frames, strict=True):
            frame(row, out)
        return frames


@dataclass(frozen=True)
class Checkpoint:
    """How far a solve has come.

    Attributes
    ----------
    state : Any
        From which the rows of the experiment go on; None at the start.
    done : float
        How far it has come, of the end of its rows.
    rows : int
        Rows that are recorded, those of steps that are not kept too.
    wall_time : float
        Spent so far. [s]
    transforms : str
        Libraries that it was computed with, one after the other.
    """

    state: Any = None
    done: float = 0.0
    rows: int = 0
    wall_time: float = 0.0
    transforms: str = field(default_factory=transform_library)

    def with_current_transforms(self) -> Checkpoint:
        """The same, to be gone on from with the transforms that are here."""
        before = self.transforms.split(_THEN)
        return replace(self, transforms=_THEN.join(dict.fromkeys([*before, transform_library()])))


class Recorder(Protocol):
    """Takes the rows of a solve, and knows from where it goes on."""

    rows: RowStore
    latest: Checkpoint
    in_memory: bool

    def update(self, reached: Checkpoint) -> None:
        """Take note of how far the solve has come; it may be stopped here."""
        ...


class MemoryRecorder:
    """Keeps the rows in memory; what is not finished is lost."""

    in_memory = True

    def __init__(self) -> None:
        self.rows: RowStore = RowsInMemory()
        self.latest = Checkpoint()

    def update(self, reached: Checkpoint) -> None:
        """Nothing: the state of a step is not needed while the next one is computed."""
