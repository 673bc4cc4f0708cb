"""Settings of a solve, each declared and checked once.

The signature of :func:`roughvisc.simulate` repeats the names that users need. :class:`Numerics` holds the others, which
are one argument there. The tables ``[solve]`` and ``[keep]`` of a study, the key of a case and the refusals of an
experiment follow from the fields.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from roughvisc.errors import InputError
from roughvisc.units import in_si, number
from roughvisc.variables import FIELDS

#: :func:`known_boundary` resolves ``auto`` to one of the other values.
Boundary = Literal["auto", "free", "periodic", "mirror"]
Missing = Literal["refuse", "absent"]
Edge = Literal["error", "accept"]
Device = Literal["cpu", "gpu"]

#: Valid words of each setting.
WORDS: dict[str, tuple[str, ...]] = {
    "boundary": get_args(Boundary),
    "missing": get_args(Missing),
    "edge": get_args(Edge),
}
#: Settings without a meaning in steady sliding.
OVER_TIME = ("times", "missing", "edge", "time_step")
#: Smallest tolerance. Rounding errors are of this order, and a run with a smaller tolerance would not end.
FINEST_TOLERANCE = 1e-12
#: Smallest and largest number of cells for which the grid error is estimated by default. The coarser run takes 0.8 to
#: 0.9 of the time of the first run at 32 x 32 cells, 0.4 to 0.5 at 128 x 128, 0.25 to 0.3 at 256 x 256, and 0.2 at
#: 512 x 512: more than a third on fewer cells than the smallest number.
GRID_ERROR_CELLS = 256 * 256, 512 * 512
#: Largest number of kept times.
MOST_TIMES = 1_000_000


@dataclass(frozen=True, kw_only=True)
class Numerics:
    """Settings of a solve that are rarely changed.

    Parameters
    ----------
    time_step : "auto" or float or str
        Steps chosen by the tolerance, or a fixed step length. [s]
    device : {"cpu", "gpu"}
        Device that computes the fields. A GPU needs CuPy; its results agree with CPU results within the tolerance.

    Raises
    ------
    InputError
        If a value is invalid.

    Examples
    --------
    >>> Numerics(time_step="10 ms")
    Numerics(time_step=0.01, device='cpu')
    """

    time_step: float | str = "auto"
    device: Device = "cpu"

    def __post_init__(self) -> None:
        if self.device not in get_args(Device):
            raise InputError(key="device", found=self.device, expected="'cpu' or 'gpu'")
        if self.time_step != "auto":
            try:
                step = number(self.time_step, "s", "time_step", above=0)
            except InputError as error:
                expected = f"'auto', or {error.expected}"
                raise InputError(key="time_step", found=self.time_step, expected=expected) from error
            object.__setattr__(self, "time_step", step)


@dataclass(frozen=True, kw_only=True)
class Settings(Numerics):
    """Settings of a solve: numerical method and kept quantities; see :func:`roughvisc.simulate`.

    Parameters
    ----------
    boundary, tolerance, times, fields, edge, missing, grid_error
        As in :func:`roughvisc.simulate`; any sequence of times or fields becomes a tuple.
    time_step, device
        As in :class:`Numerics`.

    Raises
    ------
    InputError
        If a value is invalid. :func:`roughvisc.experiment.loading.check_program` checks the settings that depend on the
        program or the surface.

    Examples
    --------
    >>> Settings(tolerance=1e-2, times=[1.0, 0.5]).times
    (0.5, 1.0)
    """

    boundary: Boundary = "auto"
    tolerance: float = 1e-3
    times: int | Sequence[float | str] | None = None
    fields: Sequence[str] = ("pressure", "gap")
    edge: Edge = "error"
    missing: Missing = "refuse"
    grid_error: bool | Literal["auto"] = "auto"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, words in WORDS.items():
            if (found := getattr(self, name)) not in words:
                raise InputError(key=name, found=found, expected=" or ".join(map(repr, words)))
        tolerance = number(self.tolerance, "1", "tolerance", least=FINEST_TOLERANCE, below=1)
        times: Any = self.times
        expected = f"a positive number of times up to {MOST_TIMES}, a list of times [s], or None"
        if isinstance(times, int | np.integer):
            if not 1 <= times <= MOST_TIMES:
                raise InputError(key="times", found=int(times), expected=expected)
            times = int(times)
        elif times is not None:
            try:
                times = tuple(np.unique(np.asarray(in_si(times, "s", "times"), dtype=float)).tolist())
            except (TypeError, ValueError) as error:  # an InputError is a ValueError
                raise InputError(key="times", found=self.times, expected=expected) from error
        names = tuple(self.fields) if isinstance(self.fields, Iterable) else (self.fields,)
        if not set(names) <= set(FIELDS):
            raise InputError(key="fields", found=self.fields, expected=f"some of {', '.join(FIELDS)}")
        grid_error = self.grid_error if self.grid_error == "auto" else bool(self.grid_error)
        found = {"tolerance": tolerance, "times": times, "fields": names, "grid_error": grid_error}
        for name, value in found.items():
            object.__setattr__(self, name, value)


#: Message if ``auto`` cannot be resolved, for a study file; in Python ``=`` has no spaces.
OPEN_BOUNDARY = """\
is 'auto', the default, and the surface does not tell what lies beyond its border: expected one of
  a nominally flat scan that stands for a larger surface: boundary = "mirror"; boundary = "periodic" if it \
repeats as it is
  an indenter or a single bump whose contact stays inside: boundary = "free"
  a scan that is itself the whole body: boundary = "free" with edge = "accept\""""


def known_boundary(
    stated: Any, only: Literal["free", "periodic"] | None, made_for: Callable[[], Literal["free", "periodic"] | None]
) -> Literal["free", "periodic", "mirror"] | None:
    """Return the stated boundary, with ``auto`` resolved; None if the user has to state one.

    Parameters
    ----------
    stated : Settings, or an object with ``boundary`` and ``edge``
        An accepted edge means free space.
    only : {"free", "periodic"} or None
        The only boundary of the experiment, if there is one.
    made_for : callable
        Returns the boundary that the surface was made for, or None; called last.
    """
    if stated.boundary != "auto":
        return stated.boundary
    return only or ("free" if stated.edge == "accept" else made_for())
