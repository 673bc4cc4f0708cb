"""One entry of the vocabulary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Variable:
    """One entry of the vocabulary: what a variable is, how it is written, and which others state its error.

    ``short`` is what it is called where there is no room for ``long_name``. ``axis`` is the axis that a coordinate
    lies on.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    comment: str = ""
    dtype: str = "float64"
    ancillary: tuple[str, ...] = ()
    short: str = ""
    axis: str = ""

    @property
    def label(self) -> str:
        """Short name as it stands on an axis or in a table, capitalised."""
        text = self.short or self.long_name
        return text[:1].upper() + text[1:]

    def attributes(self) -> dict[str, Any]:
        """CF attributes of this variable."""
        attrs: dict[str, Any] = {"long_name": self.long_name}
        if self.units:
            attrs["units"] = self.units
        if self.comment:
            attrs["comment"] = self.comment
        return attrs
