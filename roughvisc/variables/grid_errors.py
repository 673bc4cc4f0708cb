"""The vocabulary of the grid's errors: one for each quantity, the same over time and over speed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from roughvisc.variables.entry import Variable

#: Quantity -> variable that states its error.
GRID_ERROR = {
    "pressure": "grid_error_pressure",
    "force": "grid_error_force",
    "approach": "grid_error_approach",
    "mean_gap": "grid_error_gap",
    "contact_area": "grid_error_area",
    "friction_force": "grid_error_friction",
}
#: Name -> what it is the error of, and what bounds it beside the coarser grids.
_ERRORS = {
    "grid_error_pressure": (
        "pressure",
        "its absolute values summed (L1) over the force, and from the force on cells at the contact's edge",
    ),
    "grid_error_force": ("force", "zero where the force is prescribed"),
    "grid_error_approach": ("approach", "zero where the approach is prescribed; it counts from the highest point"),
    "grid_error_gap": ("mean gap", "and of an opening that full contact may hide"),
    "grid_error_area": (
        "contact area",
        "and from the number of faces at the contact's edge, or an opening that full contact may hide",
    ),
    "grid_error_friction": (
        "friction",
        "in steady sliding at least the difference from pressure times slope, if at most 10 %",
    ),
}


def grid_errors(
    axis: str, relative_to: str, names: Iterable[str] = tuple(_ERRORS), *, in_table: Literal["last", "largest"]
) -> dict[str, Variable]:
    """Variables that state the grid's errors.

    Parameters
    ----------
    axis : str
        That the rows lie over.
    relative_to : str
        What the errors are divided by, in words.
    names : iterable of str
        Of the variables. Default: all.
    in_table : {"last", "largest"}
        What the table of a sweep has of each case.
    """
    found = {}
    for name in names:
        quantity, more = _ERRORS[name]
        comment = f"bound in practice, relative to {relative_to}: from the same on cells twice and four times as long"
        comment += " (grid convergence index); of a scan it holds what roughness its coarser copies have lost"
        found[name] = Variable(
            (axis,),
            "1",
            f"error of the {quantity} due to the grid",
            f"{comment}; {more}" if more else comment,
            short=f"grid error of {quantity.removeprefix('contact ').removeprefix('mean ')}",
            may_be_missing=True,
            in_table=in_table,
        )
    return found
