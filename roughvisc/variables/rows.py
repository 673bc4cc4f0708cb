"""What the rows of a result lie over: times of a history, or speeds of steady sliding."""

from __future__ import annotations

from collections.abc import Container
from typing import Literal

from roughvisc.variables import VARIABLES, Variable
from roughvisc.variables.sliding import SLIDING

Rows = Literal["time", "speed"]

#: What the rows lie over -> the vocabulary of such a result.
VOCABULARIES: dict[Rows, dict[str, Variable]] = {"time": VARIABLES, "speed": SLIDING}
#: What the rows lie over -> variables without which a file is no result, and what the solver leaves of the pressure.
NEEDED: dict[Rows, tuple[str, ...]] = {
    "time": ("time", "force", "approach"),
    "speed": ("speed", "force", "friction_coefficient"),
}
RESIDUALS: dict[Rows, str] = {"time": "residual", "speed": "pressure_residual"}


def rows_of(names: Container[str]) -> Rows:
    """What the rows of a result lie over, by the names that it holds.

    Examples
    --------
    >>> rows_of({"time", "force"}), rows_of({"speed", "force"})
    ('time', 'speed')
    """
    return "speed" if "speed" in names else "time"
