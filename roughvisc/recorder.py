"""What keeps the rows of a solve, in memory or in a file, how far it has come, and the chunks of that file."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.grid import transform_library

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

    def restart(self) -> None:
        """Forget all rows: the solve begins anew."""
        ...


class MemoryRecorder:
    """Keeps the rows in memory; what is not finished is lost."""

    in_memory = True

    def __init__(self) -> None:
        self.rows: RowStore = RowsInMemory()
        self.latest = Checkpoint()

    def restart(self) -> None:
        """Forget all rows."""
        self.rows = RowsInMemory()

    def update(self, reached: Checkpoint) -> None:
        """Nothing: the state of a step is not needed while the next one is computed."""


#: Chunk of a field over (time, x, y). At 512 x 512 x 50, compressed, one frame and one cell's history take, in ms:
#: (1, 512, 512) 9 and 370; (4, 128, 128) 18 and 22; (8, 64, 64) 35 to 65 and 4 to 7; (16, 64, 64) 60 to 145 and 4 to 7;
#: (50, 32, 32) 170 and 1.5. A fifth of that or less where it is not compressed.
_CHUNK = (8, 64, 64)
#: The same of a grid of more cells than this: a frame is read without its neighbours in time, which no memory has room
#: for. At 4096 x 4096 x 20, in ms, compressed: (8, 64, 64) 2809 and 12; (2, 256, 256) 1277 and 51; (1, 256, 256) 331
#: and 41; (1, 1024, 1024) 309 and 302.
_MANY_CELLS, _CHUNK_OF_MANY = 1 << 20, (1, 256, 256)
#: The longest side of a chunk of anything else: a map of 1024 x 1024 doubles is 8 MB.
_LONGEST_CHUNK = 1024


def chunks(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Sides of the chunks: as equal as they can be, since a chunk that sticks out takes its whole space."""
    many = len(shape) > 1 and shape[-2] * shape[-1] > _MANY_CELLS
    fields = _CHUNK_OF_MANY if many else _CHUNK
    longest = fields[-len(shape) :] if len(shape) == 3 or many else (_LONGEST_CHUNK,) * len(shape)
    return tuple(math.ceil(n / math.ceil(n / most)) for n, most in zip(shape, longest, strict=True))
