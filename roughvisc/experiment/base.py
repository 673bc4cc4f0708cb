"""Base classes of the experiments. An experiment on a surface yields rows along one axis.

The driver (:mod:`roughvisc.solve`), files, sweeps, tables and figures treat the rows of all experiments equally.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.experiment.problem import OPEN_BOUNDARY, Problem, boundary_of
from roughvisc.experiment.profile import Profile
from roughvisc.mechanics.body import Body
from roughvisc.settings import Settings
from roughvisc.topography.grid import checked

Array = NDArray[np.float64]
#: Smallest and largest number of cells for which the grid error is estimated by default. The coarser run takes 0.8 to
#: 0.9 of the time of the first run at 32 x 32 cells, 0.4 to 0.5 at 128 x 128, 0.25 to 0.3 at 256 x 256, and 0.2 at
#: 512 x 512: more than a third on fewer cells than the smallest number.
GRID_ERROR_CELLS = 256 * 256, 512 * 512


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

    def resolved(self, problem: Problem) -> Problem:
        """Return the problem that is computed: ``auto`` is replaced in boundary and grid error.

        Raises
        ------
        InputError
            If the heights are invalid, the boundary must be stated, or a setting has no meaning in the experiment.
        """
        height = checked(problem.height, "height", least=1)
        settings = problem.settings
        boundary: Any = settings.boundary
        if boundary == "auto":
            boundary = self.boundary or ("free" if settings.edge == "accept" else boundary_of(height))
        if boundary is None:
            raise InputError(key="boundary", found="auto", expected=OPEN_BOUNDARY)
        grid_error = settings.grid_error
        if grid_error == "auto":  # only if no further field has to be kept
            fewest, most = GRID_ERROR_CELLS
            needs_pressure = self.axis == "time" and "pressure" not in settings.fields
            grid_error = fewest <= height.size <= most and not needs_pressure
        settings = replace(settings, boundary=boundary, grid_error=grid_error)
        for name, value, expected in self.unsupported(settings, problem.body):
            raise InputError(key=name, found=value, expected=expected)
        problem = replace(problem, height=height, settings=settings)
        self.check_cells(problem)
        return problem

    def check_cells(self, problem: Problem) -> None:
        """Refuse a surface whose cells are too long for the problem."""
        return
