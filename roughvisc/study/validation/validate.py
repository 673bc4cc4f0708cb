"""``validate``: runs of the solver against closed forms, with the errors to expect."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import nan

from roughvisc.errors import InputError, RoughviscError
from roughvisc.study.validation.closed_cases import CASES

__all__ = ["Comparison", "validate"]

#: Cells below which a contact has too few of them for the orders that the expected errors rest on.
_FEWEST = 33


@dataclass(frozen=True)
class Comparison:
    """One quantity of one case, compared with its closed form.

    Attributes
    ----------
    case : str
        What is pressed on what.
    compared : str
        Which quantity, and how its error is taken.
    error : float
        The error found, relative.
    expected : float
        The largest error that the grid, the tolerance and the closed form's own validity explain.
    """

    case: str
    compared: str
    error: float
    expected: float

    @property
    def passed(self) -> bool:
        """Whether the error is no larger than expected; one that is not a number is not."""
        return self.error <= self.expected


def validate(
    cells: int = 129,
    *,
    cases: Sequence[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Comparison]:
    """Compare the solver on this machine with closed-form solutions.

    The cases are elastic, viscoelastic, free, periodic, growing, shrinking and fixed contacts, computed with
    :func:`roughvisc.simulate`. The expected errors follow from the convergence orders of the method (cell size over
    contact radius), the tolerance, and, if a closed form is a limit, its next term.

    Parameters
    ----------
    cells : int
        Number of cells along the sides of the grids. Spheres and cones under an elastic load are also computed with one
        more cell, so that the apex lies in a cell and between cells. [-]
    cases : sequence of str, optional
        Names of :data:`roughvisc.study.validation.closed_cases.CASES`; None: all.
    progress : callable, optional
        Called with the number of finished cases and the total number.

    Returns
    -------
    list of Comparison
        ``case``, ``compared``, ``error``, ``expected``, ``passed``.

    Raises
    ------
    InputError
        If a case is unknown or the grid is too coarse for a meaningful comparison.

    Examples
    --------
    >>> import roughvisc as rv
    >>> all(found.passed for found in rv.validate(33, cases=["Hertz"]))
    True
    """
    if not (isinstance(cells, int) and cells >= _FEWEST):
        raise InputError(f"cells is {cells!r}: expected a whole number from {_FEWEST}")
    names = list(CASES) if cases is None else list(cases)
    unknown = [name for name in names if name not in CASES]
    if unknown:
        raise InputError(f"cases holds {unknown[0]!r}: expected some of {', '.join(CASES)}")
    found = []
    for number, name in enumerate(names, 1):
        title, compare = CASES[name]
        try:
            found += [Comparison(title, compared, error, expected) for compared, error, expected in compare(cells)]
        except RoughviscError as error:  # what a closed form has and the solver refuses is wrong too
            found.append(Comparison(title, f"refused: {error}", nan, 0.0))
        if progress is not None:
            progress(number, len(names))
    return found
