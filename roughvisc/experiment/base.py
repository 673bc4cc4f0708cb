"""Base classes of the experiments. An experiment on a surface yields rows along one axis.

The driver (:mod:`roughvisc.solve`), files, sweeps, tables and figures treat the rows of all experiments equally.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.experiment.profile import Profile
from roughvisc.mechanics.body import Body
from roughvisc.settings import Problem, Settings

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Row:
    """Result of an experiment at one position of its axis.

    Attributes
    ----------
    at : float
        Position on the axis, in its units.
    values : dict
        Variables of the row. If empty, the row only reports progress and state.
    fields : dict
        Kept fields.
    kept : bool
        Whether the row belongs to the result; otherwise only to the history of all steps.
    state : Any
        Plain value from which the rows continue after this one; None if they cannot.
    done : float
        Progress, on the scale of :attr:`Rows.end`.
    """

    at: float
    values: dict[str, Any] = field(default_factory=dict)
    fields: Mapping[str, Array] = field(default_factory=dict)
    kept: bool = True
    state: Any = None
    done: float = 0.0


class Outgrown(Exception):
    """Contact has outgrown the domain of a solve; the argument is the state from which the rows restart."""


class Rows(ABC):
    """Rows of an experiment on a problem.

    Attributes
    ----------
    problem : Problem
        The problem solved; its surface may be larger than the surface of the given problem.
    profile : Profile
        Arrays of this surface.
    end : float
        End of the experiment, in the unit of :attr:`Row.done`.
    """

    problem: Problem
    profile: Profile
    end: float

    @abstractmethod
    def __iter__(self) -> Iterator[Row]:
        """Compute the rows.

        Raises
        ------
        Outgrown
            If contact has outgrown the domain.
        """

    @abstractmethod
    def finish(self, dataset: xr.Dataset) -> tuple[xr.Dataset, dict[str, str]]:
        """Return the result of the values and fields of its rows with further attributes, and warnings by subject."""


class Experiment(ABC):
    """Experiment on a surface; a frozen value.

    Attributes
    ----------
    axis : str
        Name of the axis of its rows, one of :data:`roughvisc.variables.AXES`.
    boundary : {"free", "periodic"} or None
        Boundary used for ``auto``. None: the boundary that the surface was made for.
    """

    axis: ClassVar[str]
    boundary: ClassVar[Literal["free", "periodic"] | None] = None

    @abstractmethod
    def rows(self, problem: Problem, state: Any = None, *, in_memory: bool = True) -> Rows:
        """Return the rows that follow the state of an earlier row.

        Parameters
        ----------
        problem : Problem
            Surface, body and settings.
        state : Any
            State of the last recorded row. None: from the beginning.
        in_memory : bool
            Whether the kept fields stay in memory.

        Raises
        ------
        InputError
            If the problem does not fit the experiment; raised before any computation.
        """

    @abstractmethod
    def facts(self, body: Body, height: xr.DataArray) -> dict[str, Any]:
        """Return the attributes of a result that an audit needs: facts about the body, and the time scale [s]."""

    def described(self) -> str:
        """Return the experiment in words, for the attribute ``program`` of a result."""
        return repr(self)

    @abstractmethod
    def progress(self, done: float, end: float) -> str:
        """Return the progress in words."""

    @abstractmethod
    def unsupported(self, settings: Settings, body: Body) -> Iterator[tuple[str, Any, str]]:
        """Yield the settings that this experiment does not support on a body: name, value and expected value."""

    def check_cells(self, problem: Problem) -> None:
        """Refuse a surface whose cells are too long for the problem."""
        return
