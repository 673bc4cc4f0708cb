"""Rows of a result as figures take them: which ones are drawn, and the axis that they lie on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike

from roughvisc.errors import InputError
from roughvisc.labels import expect_declared_units, expect_history
from roughvisc.units import Unit, unit_for
from roughvisc.variables import AXES, OTHER_DIMS, ROW, VARIABLES, axis_of


def require(dataset: xr.Dataset, *names: str) -> None:
    """Refuse a Dataset that is not one case's result, or lacks variables; say how to get them."""
    if not isinstance(dataset, xr.Dataset):
        raise InputError(f"expected a result (xarray.Dataset), found {type(dataset).__name__}")
    if "time" in names and "case" not in dataset.dims:
        expect_history(dataset)
    axis = axis_of(names) if axis_of(names) in names else axis_of(dataset.variables)
    if axis not in dataset.variables:
        names = (axis, *names)
    extra = [dim for dim in dataset.dims if dim not in (axis, *OTHER_DIMS)]
    if extra:
        how = "rv.open_result(path)" if extra[0] == ROW else f"ds.isel({extra[0]}=0)"
        raise InputError(f"the result has dimension {extra[0]!r}: choose one case, as in {how}")
    for name in names:
        if name not in dataset.variables:
            stored = ", ".join(str(known) for known in dataset.data_vars)
            raise InputError(f"the result holds no {name!r} (it holds {stored}): run again with it among the fields")
    if dataset.sizes.get(axis, 1) == 0:
        raise InputError(f"the result holds no {axis} at all: nothing to draw")
    expect_declared_units(dataset)


def spans_decades(values) -> bool:
    """Whether increasing values lie more evenly on a logarithmic than on a linear axis, over two decades or more."""
    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values) & (values > 0)]
    if len(values) < 4 or values[-1] < 100 * values[0]:
        return False
    return unevenness(np.log(values)) < 0.7 * unevenness(values)


def unevenness(values: np.ndarray) -> float:
    """By how much of their range increasing values are off places at equal distances, at most."""
    return float(np.abs((values - values[0]) / (values[-1] - values[0]) - np.linspace(0, 1, len(values))).max())


def rows_of(dataset: xr.Dataset | xr.DataArray) -> xr.DataArray:
    """The coordinate that the rows of a result, or of a history, lie over."""
    return dataset[axis_of(dataset.variables if isinstance(dataset, xr.Dataset) else dataset.dims)]


def at_rows(dataset: xr.Dataset | xr.DataArray, numbers) -> Any:
    """Some rows of a result, or of a field, or one of them."""
    known = dataset.variables if isinstance(dataset, xr.Dataset) else dataset.dims
    return dataset.isel({axis_of(known): numbers})


@dataclass(frozen=True)
class RowAxis:
    """How the places of rows are shown: their unit, and a linear or a logarithmic scale chosen by the data."""

    unit: Unit
    logarithmic: bool
    first: float
    label: str = "Time"
    symbol: str = "t"

    @classmethod
    def of(cls, rows: xr.DataArray | ArrayLike, name: str = "") -> RowAxis:
        """Axis for increasing places on the axis of a name; by default that of the coordinate given, or times [s]."""
        name = name or getattr(rows, "name", "time")
        name = name if name in AXES else "time"
        known = VARIABLES[name]
        places = np.sort(np.asarray(rows, dtype=float).ravel())
        positive = places[places > 0]
        label = "Time" if name == "time" else known.label
        symbol = AXES[name].symbol
        if spans_decades(places):
            return cls(Unit(1.0, known.units), True, float(positive[0]), label, symbol)
        return cls(unit_for(places, known.units), False, float(positive[0]) if len(positive) else 1.0, label, symbol)

    def text(self, place: float) -> str:
        """A place as read in running text, in the unit of the axis, such as ``"t = 50 ms"``."""
        return f"{self.symbol} = {self.unit.text(float(place), 3)}"

    def apply(self, ax: Axes, times, most: int = 7) -> None:
        """Set scale, limits, label and at most so many decades of the axis; zero keeps its place on a log one."""
        times = self.unit(times)
        if self.logarithmic:
            zero = times[0] <= 0
            if zero:
                decades = math.log10(times[-1] / self.first)
                ax.set_xscale("symlog", linthresh=self.first, linscale=max(0.8, 0.09 * decades))
                ax.set_xlim(-0.15 * self.first, 1.2 * times[-1])
            else:
                ax.set_xscale("log")
                ax.set_xlim(times[0] / 1.2, 1.2 * times[-1])
            low, high = math.ceil(math.log10(self.first) - 1e-9), math.floor(math.log10(times[-1]) + 1e-9)
            labelled = 10.0 ** np.arange(low, high + 1, -(-(high - low + 1) // most))
            fine = np.outer(10.0 ** np.arange(low - 1, high + 1), np.arange(1, 10)).ravel()
            ax.xaxis.set_major_locator(FixedLocator([0.0, *labelled] if zero else labelled))
            ax.xaxis.set_minor_locator(FixedLocator(fine[(fine >= self.first) & (fine <= times[-1])]))
        elif len(times) > 1:
            margin = 0.02 * (times[-1] - times[0])
            ax.set_xlim(times[0] - margin, times[-1] + margin)
            ax.xaxis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
        else:
            ax.set_xticks(times, [f"{times[0]:.4g}"])
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set_xlabel(self.unit.label(self.label))


def spread_frames(times, count: int) -> np.ndarray:
    """Indices of at most ``count`` kept times [s], even on the axis that suits them, first and last included."""
    times = np.asarray(times, dtype=float)
    if len(times) <= count:
        return np.arange(len(times))
    if count == 1:
        return np.array([len(times) - 1])
    place = times
    if spans_decades(times):
        first = times[times > 0][0]
        place = np.log(np.maximum(times, first / 2))
    wanted = np.linspace(place[0], place[-1], count)
    nearest = np.abs(place[:, None] - wanted).argmin(axis=0)
    return np.unique(nearest)


def telling_frames(dataset: xr.Dataset, count: int) -> list[int]:
    """Indices of at most ``count`` frames: even in time while there is contact, that of the largest area among them.

    Frames whose contact is below a thousandth of the largest show nothing; they are drawn only if there are no others.
    """
    rows = rows_of(dataset)
    frames = np.arange(rows.size)
    if "contact_area" in dataset:
        area = np.nan_to_num(dataset["contact_area"].values)
        if area.max() > 0:
            frames = frames[area > 1e-3 * area.max()]
    chosen = frames[spread_frames(rows.values[frames], count)]
    if "contact_area" in dataset and len(chosen) > 2 and len(chosen) < len(frames):
        largest = frames[area[frames].argmax()]
        if area[chosen].max() < 0.999 * area[largest]:
            inner = np.abs(chosen[1:-1] - largest).argmin() + 1
            chosen = np.sort(np.append(np.delete(chosen, inner), largest))
    return [int(frame) for frame in np.unique(chosen)]


def fullest_frame(dataset: xr.Dataset) -> int:
    """Index of the last frame whose contact area is the largest, or of the last frame where areas are unknown."""
    if "contact_area" not in dataset:
        return rows_of(dataset).size - 1
    area = np.nan_to_num(dataset["contact_area"].values)
    return int(np.flatnonzero(area >= 0.999 * area.max())[-1])


def frames_at(rows: ArrayLike, asked: ArrayLike, most: int, doing: str = "draw", instead: str = "") -> list[int]:
    """Index of the row nearest to each of 1 to `most` places, as :func:`frame_at` finds it."""
    places = np.atleast_1d(np.asarray(asked, dtype=float)).ravel()
    if not 0 < places.size <= most:
        raise InputError(f"{places.size} times to {doing}: choose 1 to {most}{instead}")
    return [frame_at(rows, float(place)) for place in places]


def frame_at(times, time: float) -> int:
    """Index of the kept time nearest to ``time`` [s]; a negative whole number counts frames from the end."""
    times = np.asarray(times, dtype=float)
    if not np.isfinite(time):
        raise InputError(f"time is {time!r}: expected a number [s], or -1 for the last kept one")
    if time < 0:
        if time != int(time) or -int(time) > len(times):
            raise InputError(f"time is {time!r}: expected a time [s], or -1 to -{len(times)} to count from the end")
        return len(times) + int(time)
    return int(np.abs(times - time).argmin())
