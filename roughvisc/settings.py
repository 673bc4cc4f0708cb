"""Settings of a solve, each declared and checked once.

The signature of :func:`roughvisc.simulate` repeats the names that users need. :class:`Numerics` holds the others, which
are one argument there. The tables ``[solve]`` and ``[keep]`` of a study, the key of a case and the refusals of an
experiment follow from the fields.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from roughvisc.arguments import listed_names
from roughvisc.errors import InputError
from roughvisc.mechanics.adhesion import Adhesion
from roughvisc.units import listed, number
from roughvisc.variables import FIELDS

#: :meth:`roughvisc.experiment.base.Experiment.resolved` replaces ``auto`` by one of the other values.
Boundary = Literal["auto", "free", "periodic", "mirror"]
Missing = Literal["refuse", "absent"]
Edge = Literal["error", "accept"]
Device = Literal["cpu", "gpu"]

#: Valid words of each setting.
WORDS: dict[str, tuple[str, ...]] = {
    "boundary": get_args(Boundary),
    "missing": get_args(Missing),
    "edge": get_args(Edge),
    "device": get_args(Device),
}
#: Settings without a meaning in steady sliding.
OVER_TIME = ("times", "missing", "edge", "time_step", "adhesion")
#: Smallest tolerance. Rounding errors are of this order, and a run with a smaller tolerance would not end.
FINEST_TOLERANCE = 1e-12
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

    See Also
    --------
    roughvisc.simulate, roughvisc.friction

    Examples
    --------
    >>> Numerics(time_step="10 ms")
    Numerics(time_step=0.01, device='cpu')
    """

    time_step: float | str = "auto"
    device: Device = "cpu"

    def __post_init__(self) -> None:
        for name, words in WORDS.items():
            if (chosen := getattr(self, name, words[0])) not in words:
                raise InputError(key=name, found=chosen, expected=" or ".join(map(repr, words)))
        if self.time_step != "auto":
            try:
                step = number(self.time_step, "s", "time_step", above=0)
            except InputError as error:
                raise InputError(key=error.key, found=error.found, expected=f"'auto', or {error.expected}") from None
            object.__setattr__(self, "time_step", step)


@dataclass(frozen=True, kw_only=True)
class Settings(Numerics):
    """Settings of a solve: numerical method and kept quantities; see :func:`roughvisc.simulate`.

    Parameters
    ----------
    boundary, tolerance, times, fields, edge, missing, grid_error, adhesion
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
    times: int | Sequence[float | str] | str | None = None
    fields: Sequence[str] | str = ("pressure", "gap")
    edge: Edge = "error"
    missing: Missing = "refuse"
    grid_error: bool | Literal["auto"] = "auto"
    adhesion: Adhesion | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        tolerance = number(self.tolerance, "1", "tolerance", least=FINEST_TOLERANCE, below=1)
        times: Any = self.times
        if isinstance(times, int | np.integer) and not isinstance(times, bool):
            times = int(number(int(times), "1", "times", least=1, most=MOST_TIMES))
        elif times is not None:
            times = tuple(np.unique(listed(times, "s", "times", "a whole number counts rows")).tolist())
            if not times:
                raise InputError(key="times", found=self.times, expected="at least one time [s], or None")
        names: Any = listed_names(self.fields)
        if not all(name in FIELDS for name in names):
            raise InputError(key="fields", found=self.fields, expected=f"some of {', '.join(FIELDS)}")
        grid_error = self.grid_error if self.grid_error == "auto" else bool(self.grid_error)
        if not isinstance(self.adhesion, Adhesion | None):
            expected = "rv.adhesion(work=..., range=...), or None"
            raise InputError(key="adhesion", found=self.adhesion, expected=expected)
        chosen = {"tolerance": tolerance, "times": times, "fields": names, "grid_error": grid_error}
        for name, value in chosen.items():
            object.__setattr__(self, name, value)


def attraction(settings: Settings) -> Adhesion | None:
    """Return the attraction of the surfaces; None without adhesion, or if its work is zero."""
    return settings.adhesion if settings.adhesion is not None and settings.adhesion.work > 0 else None
