"""Base classes of the experiments. An experiment on a surface yields rows along one axis.

The driver (:mod:`roughvisc.solve`), files, sweeps, tables and figures treat the rows of all experiments equally.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, ClassVar, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.body import Body
from roughvisc.settings import GRID_ERROR_CELLS, OPEN_BOUNDARY, Settings, known_boundary
from roughvisc.topography.borders import is_mirrored, is_periodic, recipe_name
from roughvisc.topography.grid import checked
from roughvisc.topography.indenters import is_indenter
from roughvisc.topography.synthesis import BOUNDARIES

Array = NDArray[np.float64]


def boundary_of(h: xr.DataArray) -> Literal["free", "periodic"] | None:
    """Return the boundary that a surface was made for; None for scans, plain arrays and all other surfaces.

    The user must state the boundary if this function returns None. The recipe of an indenter counts only if it
    reproduces the heights, because the grid may have to grow. The recipe of waves or roughness, and the record of
    mirroring, count only if the attribute ``period`` gives the sides of the grid and the borders meet
    (:func:`is_periodic`).

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights. [m]

    Returns
    -------
    {"free", "periodic"} or None
        ``free`` for an indenter; ``periodic`` for waves, self-affine roughness and mirrored surfaces.

    Examples
    --------
    >>> from roughvisc.topography.indenters import sphere
    >>> from roughvisc.topography.synthesis import wavy
    >>> ball, waves = sphere(1e-2, 1e-3, 8), wavy(1e-6, 1e-3, 1e-3, 8)
    >>> boundary_of(ball), boundary_of(waves), boundary_of(ball + waves)
    ('free', 'periodic', None)
    """
    if is_indenter(h):
        return "free"
    made = BOUNDARIES.get(recipe_name(h)) == "periodic" and is_periodic(h)
    return "periodic" if made or is_mirrored(h) else None


@dataclass(frozen=True)
class Problem:
    """Surface, body and settings of an experiment.

    Attributes
    ----------
    height : xarray.DataArray, dims (x, y)
        Profile, peaks up. [m]
    body : Body
        The body under it.
    settings : Settings
        Numerical settings and the fields to keep.
    """

    height: xr.DataArray
    body: Body
    settings: Settings

    def resolved(self, experiment: Experiment) -> Problem:
        """Return the problem that an experiment computes: ``auto`` is replaced in boundary and grid error.

        Raises
        ------
        InputError
            If the heights are invalid, the boundary must be stated, or a setting has no meaning in the experiment.
        """
        height, settings = checked(self.height, "height", least=1), self.settings
        boundary = known_boundary(settings, experiment.boundary, partial(boundary_of, height))
        if boundary is None:
            name = height.attrs.get("source_file", "height")
            raise InputError(f"{name}: boundary {OPEN_BOUNDARY.replace(' = ', '=')}")
        grid_error, (fewest, most) = settings.grid_error, GRID_ERROR_CELLS
        if grid_error == "auto":  # only if no further field has to be kept
            needs_pressure = experiment.axis == "time" and "pressure" not in settings.fields
            grid_error = fewest <= height.size <= most and not needs_pressure
        settings = replace(settings, boundary=boundary, grid_error=grid_error)
        for name, found, why in experiment.unsupported(settings):
            raise InputError(f"{name} is {found!r}: {why}")
        return replace(self, height=height, settings=settings)


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
    place : int
        Sort key of the rows of the result; rows with equal keys stay in the order of computation.
    state : Any
        Plain value from which the rows continue after this one; None if they cannot.
    done : float
        Progress, on the scale of :attr:`Rows.end`.
    """

    at: float
    values: dict[str, Any] = field(default_factory=dict)
    fields: Mapping[str, Array] = field(default_factory=dict)
    kept: bool = True
    place: int = 0
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
    end : float
        End of the experiment, in the unit of :attr:`Row.done`.
    """

    problem: Problem
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
    def finish(self, dataset: xr.Dataset) -> xr.Dataset:
        """Return the result, with its attributes, from a Dataset of the values and fields of its rows."""


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

    @abstractmethod
    def progress(self, done: float, end: float) -> str:
        """Return the progress in words."""

    def unsupported(self, settings: Settings) -> Iterator[tuple[str, Any, str]]:
        """Yield the settings that this experiment does not support: name, value and expected value."""
        yield from ()
