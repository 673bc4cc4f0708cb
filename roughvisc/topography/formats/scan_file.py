"""Content of a scan file, as a reader returns it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Channel:
    """One channel of a file.

    Parameters
    ----------
    name : str
        Name, as ``channel=`` of :func:`roughvisc.open_scan` takes it.
    load : callable
        Returns the heights over (x, y), peaks up, NaN where missing, in `unit`: an array, or a DataArray whose
        attributes and coordinates are kept; for points an array of shape (n, 3), for
        triangles one of shape (n, 3, 3): triangle, corner, coordinate.
    unit : str, optional
        Unit of the heights; None if the file states none.
    lateral_unit : str, optional
        Unit of x and y; None if the file states none.
    spacing : tuple of float, optional
        Cell sides in `lateral_unit`; None if the file states none.
    positions : tuple of ndarray, optional
        Cell centres along x and y in `lateral_unit`; None if the file states none.
    kind : {"height", "points", "triangles", "profile", ...}
        ``"height"`` for an areal grid, ``"points"`` for points x, y, z, ``"triangles"`` for a mesh, otherwise a
        description of the content.
    """

    name: str
    load: Callable[[], Any]
    unit: str | None = None
    lateral_unit: str | None = None
    spacing: tuple[float, float] | None = None
    positions: tuple[np.ndarray, np.ndarray] | None = None
    kind: str = "height"

    @property
    def is_height(self) -> bool:
        """Whether the channel holds heights over x and y."""
        return self.kind in ("height", "points", "triangles")


@dataclass(frozen=True)
class ScanFile:
    """Scan file with its header read.

    Parameters
    ----------
    format : str
        Name of the format.
    channels : sequence of Channel
        All channels of the file.
    default : int or None
        Index of the channel to read if the user names none. None: the first height.
    complaints : list of str
        Faults of the file that do not prevent reading.
    close : callable
        Closes the file.
    """

    format: str
    channels: Sequence[Channel]
    default: int | None = None
    complaints: list[str] = field(default_factory=list)
    close: Callable[[], None] = lambda: None


def single_map(format: str, heights: np.ndarray, *about: Any) -> ScanFile:
    """Return the content of a file with one map, with unit, lateral unit and spacing as in :class:`Channel`."""
    return ScanFile(format, [Channel("height", lambda: heights, *about)])
