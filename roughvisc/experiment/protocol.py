"""What an experiment is: a value that yields rows along one axis from a problem.

Everything else takes rows and knows no kind of experiment: the driver (:mod:`roughvisc.solve`), what keeps the rows
(:mod:`roughvisc.recorder`), files, checkpoints, sweeps, tables and figures.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.mechanics.grid import Boundary
from roughvisc.problem import Problem
from roughvisc.recorder import RowStore
from roughvisc.settings import ENTRIES, Settings

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Row:
    """What is found at one place of the axis.

    Attributes
    ----------
    at : float
        Place on the axis, in its units.
    values : dict
        Variables of the row; none: the experiment has come so far, and leaves no row there.
    fields : dict
        Arrays that the fields of the row are, or are made from in the end.
    kept : bool
        Whether it is a row of the result, or of the histories of its steps alone.
    state : Any
        A plain value from which the rows go on after this one; None: they cannot.
    facts : dict
        Plain values that must be known of the row in the end, beside its variables.
    done : float
        How far the experiment has come, of :attr:`Rows.end`.
    """

    at: float
    values: dict[str, Any] = field(default_factory=dict)
    fields: Mapping[str, Array] = field(default_factory=dict)
    kept: bool = True
    state: Any = None
    facts: dict[str, Any] = field(default_factory=dict)
    done: float = 0.0


class Outgrown(Exception):
    """Contact has outgrown the domain of a solve, which begins anew on a larger one.

    Parameters
    ----------
    state : Any
        From which the rows begin anew.
    """

    def __init__(self, state: Any) -> None:
        super().__init__("contact has outgrown the domain")
        self.state = state


class Rows:
    """The rows of an experiment on a problem, and what becomes of them in the end.

    What is recorded of them comes back as a :class:`~roughvisc.recorder.RowStore`, from memory or from a file. An
    experiment whose surface is the same in the end as in the beginning needs nothing but the rows.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        Of the surface, or a larger one that it has become part of. [m]
    found : iterable of Row
        In the order in which they are found.
    end : float
        How far the experiment goes, in the unit of :attr:`Row.done`.
    highest : float, optional
        Height of the highest point, which on an indenter may lie between the cells. [m]
    """

    def __init__(
        self, height: xr.DataArray, found: Iterable[Row] = (), end: float = 1.0, highest: float | None = None
    ) -> None:
        self.height, self.end, self.highest = height, end, highest
        self._found = found

    def __iter__(self) -> Iterator[Row]:
        return iter(self._found)

    def order(self, records: RowStore) -> list[int]:
        """Numbers of the recorded rows that the result has, in its order."""
        return [number for number, plain in enumerate(records.plain) if plain["kept"]]

    def settled(self, records: RowStore, number: int) -> dict[str, Any]:
        """Values of a recorded row that are others over the surface as it is in the end."""
        return {}

    def columns(self, columns: dict[str, Array]) -> dict[str, Array]:
        """Variables over the axis, from those of the rows of the result."""
        return columns

    def field(self, records: RowStore, name: str, number: int, out: Array) -> Array:
        """A field of a recorded row over the surface as it is in the end, written to ``out``, which holds zeros."""
        out[...] = records.arrays(number, name)[name]
        return out

    def attributes(self, dataset: xr.Dataset) -> dict[str, Any]:
        """What the result says beside its variables; an empty text says nothing."""
        return {}


class Experiment(Protocol):
    """What is done with a surface. An experiment is a frozen value; one that inherits from this class has the rest.

    Attributes
    ----------
    axis : str
        Name of the axis of its rows, one of :data:`roughvisc.variables.axes.AXES`.
    table : str
        Table of a study file that states it.
    called : str
        What it is called in a sentence, as ``steady sliding``.
    doing : str
        What is going on meanwhile, as a progress bar says it.
    states : tuple of type
        Dataclasses that the state of its rows is made of, beside plain values, tuples and arrays: for checkpoints.
    boundary : {"free", "periodic"} or None
        The only one that it can be done with: then ``auto`` is that. None: it has both.
    states_grid_error : bool
        Whether its rows state the error of the grid themselves; that of any other is found by doing all of it again
        on coarser grids.
    convolution_cost : float
        Time of one of its convolutions, with all that goes with it, over that of one in a contact problem.
    """

    axis: ClassVar[str]
    table: ClassVar[str]
    called: ClassVar[str]
    doing: ClassVar[str] = "solving"
    boundary: ClassVar[Boundary | None] = None
    states: ClassVar[tuple[type, ...]] = ()
    states_grid_error: ClassVar[bool] = False
    convolution_cost: ClassVar[float] = 1.0

    @abstractmethod
    def rows(self, problem: Problem, state: Any = None, *, in_memory: bool = True) -> Rows:
        """Its rows, from the state of an earlier row on.

        Parameters
        ----------
        problem : Problem
            Surface, body and settings.
        state : Any
            Of the last row that was recorded; None: from the beginning.
        in_memory : bool
            Whether the kept fields stay in memory.

        Raises
        ------
        InputError
            If problem and experiment do not go together; nothing has been computed then.
        """

    def prepared(self, problem: Problem) -> Problem:
        """Return the problem as it is computed. Default: unchanged."""
        return problem

    @abstractmethod
    def content(self) -> Any:
        """All that determines what is done, as JSON has it: for the key of a case."""

    def unsupported(self, settings: Settings) -> Iterator[tuple[str, Any, str]]:
        """Settings that have no meaning here: their names, what was found, and why not. Nothing else refuses them."""
        for name, entry in ENTRIES.items():
            found = getattr(settings, name)
            if entry.only_over not in ("", self.axis) and found != getattr(Settings, name):
                yield name, found, f"{self.called} has none: expected the usual"

    def on_area(self, area: float) -> Experiment:
        """The same with loads in place of nominal pressures, which refer to an area. [m2]"""
        return self

    def with_common_rows(self, settings: Settings, spacings: Sequence[tuple[float, float]]) -> Settings:
        """Settings with which its rows lie at the same places on grids of all these cell sides [m], with any steps."""
        return settings

    def with_rows_at(self, settings: Settings, places: Sequence[float]) -> Settings:
        """Settings with which it has the rows of an earlier solve again, at these places of its axis."""
        return settings

    def progress(self, done: float, end: float) -> str:
        """How far it has come, as one reads it."""
        return f"{done:.0f} of {end:.0f}"

    def creep_time(self, size: float) -> float:
        """How long a place of a surface so long [m] is pressed, at most: the material creeps till then. [s]"""
        return 0.0

    @property
    def time_scale(self) -> float:
        """Shortest time in which what is prescribed changes; infinite where all is steady. [s]"""
        return math.inf

    @property
    def largest_speed(self) -> float:
        """At which the surface slides; zero where it does not. [m/s]"""
        return 0.0

    def cheaper(self) -> tuple[Experiment, int, float]:
        """The same with fewer rows, spread evenly over all; the number of all; and how much one costs over one of it.

        For a plan, which does it on coarse grids. Default: all rows, whose number is then known.
        """
        return self, 0, 1.0
