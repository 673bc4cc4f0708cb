"""One entry of the vocabulary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True)
class Variable:
    """One entry of the vocabulary: all that is said of a variable anywhere.

    Attributes
    ----------
    dims, units, long_name, comment, dtype
        As they stand in a result's file.
    ancillary : tuple of str
        Variables that state its error.
    short : str
        What it is called where there is no room for `long_name`.
    axis : str
        The axis that a coordinate lies on.
    may_be_missing : bool
        Whether NaN says that a value is missing: a fill value is declared of no other variable.
    every_step : bool
        Whether it is known of every accepted step, also between the kept times.
    in_table : {"", "last", "largest"}
        What the table of a sweep has of each case: its value in the last row, or its largest one.
    meanings : tuple of str
        Of the values 0, 1, ... of a flag.
    cell_methods : str
        What its values are of the cells that they stand for, in CF's words.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    comment: str = ""
    dtype: str = "float64"
    ancillary: tuple[str, ...] = ()
    short: str = ""
    axis: str = ""
    may_be_missing: bool = False
    every_step: bool = False
    in_table: Literal["", "last", "largest"] = ""
    meanings: tuple[str, ...] = ()
    cell_methods: str = ""

    @property
    def label(self) -> str:
        """Short name as it stands on an axis or in a table, capitalised."""
        text = self.short or self.long_name
        return text[:1].upper() + text[1:]

    def attributes(self) -> dict[str, Any]:
        """CF attributes of this variable."""
        names = ("long_name", "units", "cell_methods", "comment")
        return {name: value for name in names if (value := getattr(self, name))}
