"""What the rows of a result lie over: times of a history, or speeds of steady sliding."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from roughvisc.units import unit_for
from roughvisc.variables import VARIABLES, Variable
from roughvisc.variables.sliding import SLIDING


@dataclass(frozen=True)
class Axis:
    """What the rows of a result lie over, and all that is said of it anywhere.

    Attributes
    ----------
    name : str
        Of the coordinate, which is one of the variables.
    variables : dict
        What a Dataset over it may hold: the vocabulary.
    needed : tuple of str
        Variables without which a file is no result.
    residual : str
        What the solver leaves of the pressure.
    rows : str
        What its rows are called, as ``speeds``.
    symbol : str
        Of a place on it, as ``t`` in ``t = 50 ms``.
    advice : str
        What to try if a row did not converge.
    model : str
        What was computed, as a sentence.
    telling : str
        Variable whose largest value marks the row that stands for the result in a table; empty: the last row does.
    """

    name: str
    variables: dict[str, Variable]
    needed: tuple[str, ...]
    residual: str
    rows: str
    symbol: str
    advice: str
    model: str
    telling: str = ""

    def place(self, value: float, digits: int = 6) -> str:
        """A place on it, as one reads it.

        Examples
        --------
        >>> AXES["time"].place(0.05), AXES["speed"].place(2e-3)
        ('t = 50 ms', 'V = 2 mm/s')
        """
        return f"{self.symbol} = {unit_for([value], self.variables[self.name].units).text(value, digits)}"

    def telling_row(self, histories: Mapping[str, Any]) -> int:
        """Number of the row that stands for a result in a table."""
        found = np.asarray(histories[self.telling]) if self.telling else np.zeros(0)
        return int(np.nanargmax(found)) if np.isfinite(found).any() else -1

    def in_table(self, which: str) -> list[str]:
        """Variables of which the table of a sweep has the value in the ``last`` row, or the ``largest``."""
        return [name for name, one in self.variables.items() if one.in_table == which]


#: Dimension of the kept times or speeds of cases that do not share them, and number of these in each case.
ROW, ROWS = "row", "rows"
TIME = Axis(
    "time",
    VARIABLES,
    needed=("time", "force", "approach"),
    residual="residual",
    rows="kept times",
    symbol="t",
    advice="a looser tolerance or shorter steps",
    model="A rigid rough profile pressed without friction or adhesion on a linear viscoelastic half-space.",
)
SPEED = Axis(
    "speed",
    SLIDING,
    needed=("speed", "force", "friction_coefficient"),
    residual="pressure_residual",
    rows="speeds",
    symbol="V",
    advice="a looser tolerance",
    model="A rigid rough profile that slides steadily on a linear viscoelastic body, without shear or adhesion.",
    telling="friction_coefficient",
)
#: Name of an axis -> the axis.
AXES: dict[str, Axis] = {axis.name: axis for axis in (TIME, SPEED)}


def axis_of(names: Container[str]) -> str:
    """Name of the axis that the rows of a result lie over, by the names that it holds.

    Examples
    --------
    >>> axis_of({"time", "force"}), axis_of({"speed", "force"})
    ('time', 'speed')
    """
    return next((name for name in AXES if name != "time" and name in names), "time")
