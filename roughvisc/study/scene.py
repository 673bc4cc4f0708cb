"""From labels to arrays: a surface, a material and a program become the scene that the stepper marches through."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.engine import Engine, engine_for
from roughvisc.mechanics.halfspace import Boundary, HalfSpace
from roughvisc.mechanics.loading import Program
from roughvisc.mechanics.materials import Material
from roughvisc.mechanics.stepper import Scene
from roughvisc.study.representable import check_loads, check_times
from roughvisc.topography.grid import axis_step
from roughvisc.topography.indenters import grown

#: An analytic profile's grid grows by this factor a time, and no farther than so many cells.
GROWTH, MOST_CELLS = 1.5, 4096**2


class Ground:
    """The labelled surface under a scene, which may grow while that is marched through: ``growths`` times so far."""

    def __init__(self, height: xr.DataArray, missing: Literal["refuse", "absent"] = "refuse") -> None:
        self.height = _checked(height)
        values = self.height.values
        self.present: NDArray[np.bool_] = np.isfinite(values)
        _check_missing(self.height, self.present, missing)
        self._missing = missing
        self.growths = 0

    @property
    def gap(self) -> NDArray[np.float64]:
        """Undeformed gap at first touch, zero at absent cells. [m]"""
        values = self.height.values
        return np.where(self.present, np.max(values[self.present]) - values, 0.0)

    def halfspace(self, boundary: Boundary, workers: int | None = None) -> HalfSpace:
        """Half-space on the surface's grid."""
        sides = (_side(self.height, "x"), _side(self.height, "y"))
        return HalfSpace(self.height.shape, sides, boundary, workers)

    def can_grow(self) -> bool:
        """Whether the profile is known beyond its grid: its recipe still gives the heights."""
        return "recipe" in self.height.attrs and grown(self.height, 1.0) is not None

    def enlarge(self, scene: Scene) -> tuple[Scene, tuple[int, int]] | None:
        """The scene on a larger grid, and the cell of it where the present one begins; None if it cannot grow."""
        larger = grown(self.height, GROWTH)
        if larger is None or larger.size > MOST_CELLS:
            return None
        first = [int(np.searchsorted(larger[axis].values, self.height[axis].values[0])) for axis in ("x", "y")]
        growths = self.growths + 1
        self.__init__(larger, self._missing)  # type: ignore[misc]
        self.growths = growths
        halfspace = self.halfspace(scene.halfspace.boundary, scene.halfspace.workers)
        present = None if self.present.all() else self.present
        settings = {**vars(scene), "halfspace": halfspace, "gap": self.gap, "present": present}
        return Scene(**settings), (first[0], first[1])


def prepare(
    ground: Ground,
    material: Material,
    program: Program,
    *,
    boundary: Boundary,
    tolerance: float,
    time_step: float | Literal["auto"],
    times: int | Sequence[float] | None,
    edge: Literal["error", "accept"],
) -> tuple[Scene, Engine]:
    """Scene of a case and what models its material; see :func:`roughvisc.simulate` for the parameters.

    Raises
    ------
    InputError
        If any of it is wrong; nothing has been computed then.
    """
    if edge not in ("error", "accept"):
        raise InputError(f"edge is {edge!r}: expected 'error' or 'accept'")
    if not (isinstance(tolerance, int | float) and 0 < tolerance < 1):
        raise InputError(f"tolerance is {tolerance!r}: expected a number between 0 and 1")
    if time_step != "auto" and not (isinstance(time_step, int | float) and 0 < time_step < math.inf):
        raise InputError(f"time_step is {time_step!r}: expected 'auto' or a positive number [s]")
    if not program.segments:
        raise InputError("the program is empty: expected at least one segment")
    check_times(program, time_step)
    if not hasattr(material, "mean_contact_compliance"):
        raise InputError(f"material is a {type(material).__name__}: expected one of roughvisc's materials")
    grows = boundary == "free" and edge == "error" and ground.can_grow()
    gap = ground.gap
    _check_approach(program, boundary, gap[ground.present])
    halfspace = ground.halfspace(boundary)
    check_loads(program, material, halfspace, gap[ground.present])
    engine = engine_for(material, program.duration, tolerance, "pressure" if grows else "displacement")
    scene = Scene(
        halfspace=halfspace,
        gap=gap,
        material=material,
        memory=engine.memory,
        program=program,
        times=kept_times(program, times),
        tolerance=float(tolerance),
        time_step=None if time_step == "auto" else float(time_step),
        present=None if ground.present.all() else ground.present,
        accept_edge=edge == "accept",
        enlarge=ground.enlarge if grows else None,
    )
    return scene, engine


def _checked(height: xr.DataArray) -> xr.DataArray:
    if not isinstance(height, xr.DataArray) or height.dims != ("x", "y"):
        found = getattr(height, "dims", type(height).__name__)
        raise InputError(f"height is {found}: expected a DataArray with dimensions ('x', 'y')")
    if 0 in height.shape:
        raise InputError(f"height has {height.shape[0]} x {height.shape[1]} cells: expected at least one each way")
    height = height.astype(float, copy=False)
    for axis in ("x", "y"):
        _side(height, axis)
    if np.isinf(height.values).any():
        raise InputError("height holds infinite values: expected finite heights, or NaN where missing")
    return height


def _side(height: xr.DataArray, axis: str) -> float:
    """Side of the cells along one axis, [m]; a single cell begins at zero."""
    if height.sizes[axis] > 1:
        return axis_step(height, axis, "height")
    centre = float(height[axis].values[0]) if axis in height.coords else math.nan
    if not 0 < centre < math.inf:
        raise InputError(f"height: the only cell along {axis!r} is centred at {centre:g} m: expected half its side")
    return 2 * centre


def _check_missing(height: xr.DataArray, present: NDArray[np.bool_], missing: str) -> None:
    if missing not in ("refuse", "absent"):
        raise InputError(f"missing is {missing!r}: expected 'refuse' or 'absent'")
    if not present.any():
        raise InputError("height is missing everywhere: expected at least one finite height")
    absent = missing == "absent" or height.attrs.get("missing") == "absent"
    if not present.all() and not absent:
        row, column = np.argwhere(~present)[0]
        raise InputError(
            f"height is missing at {np.count_nonzero(~present)} of {present.size} points, the first at cell "
            f"({row}, {column}): fill it (fill = true in a study, rv.fill in Python), or say missing='absent' "
            "if there is no material"
        )


def _check_approach(program: Program, boundary: str, gap: NDArray[np.float64]) -> None:
    if boundary != "periodic":
        return
    full = float(np.mean(gap))
    for i, segment in enumerate(program.segments):
        largest = (segment.end or 0.0) + abs(segment.amplitude)
        if segment.control == "approach" and segment.end is not None and largest >= full:
            raise InputError(
                f"program.{i}: approach goes to {largest:.6g} m, and with periodic boundaries contact is full at "
                f"{full:.6g} m: expected less"
            )


def kept_times(program: Program, times: int | Sequence[float] | None) -> tuple[float, ...] | None:
    """Times to keep, ascending, snapped to the program's corners. [s]

    Parameters
    ----------
    program : Program
        The loading program.
    times : int, sequence of float or None
        A count, evenly from 0+ to the end; a list; None for every accepted step.

    Raises
    ------
    InputError
        If a time lies outside the program, or the count is not positive.
    """
    if times is None:
        return None
    duration = program.duration
    if isinstance(times, int | np.integer):
        if times < 1:
            raise InputError(f"times is {times}: expected a positive count, a list, or None")
        listed = np.linspace(0, duration, times) if times > 1 else np.array([duration])
    else:
        listed = np.unique(np.asarray(times, dtype=float))
    corners = np.array(program.corners)
    kept = []
    for value in listed:
        nearest = float(corners[np.argmin(np.abs(corners - value))])
        snapped = nearest if abs(nearest - value) <= 1e-12 * duration else float(value)
        if not 0 <= snapped <= duration:
            raise InputError(f"times holds {value:g} s: expected times from 0 to the program's end at {duration:g} s")
        kept.append(snapped)
    return tuple(kept)
