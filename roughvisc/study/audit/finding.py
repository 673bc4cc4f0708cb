"""A finding: one assumption, its number, the verdict by the table of limits, and one sentence."""

from __future__ import annotations

import math
from dataclasses import dataclass

from roughvisc.study.audit.limits import LIMITS, NOT_KNOWN, Limit
from roughvisc.units import said

#: Shown as nothing.
_LEAST = 1e-9


@dataclass(frozen=True)
class Finding:
    """What was found of one assumption.

    Attributes
    ----------
    name : str
        Of the assumption, as :data:`roughvisc.study.audit.limits.LIMITS` has it.
    number : float
        What it is judged by; NaN where it is not known.
    sentence : str
        What the number says here, or what to give so that it is known.
    judged_by : str
        Entry of that table which the number belongs to; that of the name unless given.
    """

    name: str
    number: float
    sentence: str
    judged_by: str = ""

    @property
    def limit(self) -> Limit:
        """What it is judged by."""
        return LIMITS[self.judged_by or self.name]

    @property
    def verdict(self) -> str:
        """``holds``, ``doubtful``, ``broken`` or ``not known``."""
        return self.limit.verdict(self.number)

    @property
    def shown(self) -> str:
        """The number to two digits, next to nothing as 0; empty where it is not known."""
        return "" if self.verdict == NOT_KNOWN else f"{float(f'{max(self.number, _LEAST) - _LEAST:.2g}'):g}"


def unknown(name: str, sentence: str) -> Finding:
    """A finding without a number."""
    return Finding(name, math.nan, sentence)


def as_text(value: float, unit: str, digits: int = 2) -> str:
    """A quantity in SI to so many digits, as 490 kPa and not 4.9e+02 kPa."""
    return said(float(f"{value:.{digits}g}"), unit)


def percent(share: float) -> str:
    """A share to two digits, as 100 % and not 1e+02 %; of next to nothing a bound."""
    if 0 < share < 1e-3:
        return "less than 0.1 %"
    return f"{float(f'{100 * share:.2g}'):g} %"
