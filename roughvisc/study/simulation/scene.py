"""From labelled to plain arrays: surface, material, program and settings become the scene of a march."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.halfspace.kernel import Kernel, has_finite_mean
from roughvisc.mechanics.halfspace.love import HALF_SPACE
from roughvisc.mechanics.halfspace.operator import Boundary, HalfSpace
from roughvisc.mechanics.halfspace.window import Window, whole_domain, window_around
from roughvisc.mechanics.hereditary.choice import SERIES_SHARE, Choice, choose_memory
from roughvisc.mechanics.hereditary.exponentials import ActsOn
from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.materials.protocol import complete
from roughvisc.mechanics.stepping.control import SMALLEST_STEP
from roughvisc.mechanics.stepping.program import Program
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.study.simulation.kept_times import kept_times
from roughvisc.study.simulation.mirror import is_mirrored, quarter
from roughvisc.study.simulation.representable import check_loads, check_times
from roughvisc.study.simulation.slides import check_slides, snap_to_cells
from roughvisc.study.statement.settings import Missing, Settings
from roughvisc.topography.grid import checked, nominal_area, spacing, taper_weights
from roughvisc.topography.indenters import grown, highest

#: A window, and the grid of an analytic profile, grow by this factor a time; the latter no farther than so many cells.
GROWTH, MOST_CELLS = 1.5, 4096**2
#: The window begins so many cells wide, on surfaces whose shorter side has so many.
_FIRST_EXTENT, _WORTH_FOLLOWING = 32, 96
#: Cells of the longer side on which the window after a jump at the start is foreseen.
_FORESEEN_ON = 40


class Ground:
    """The labelled surface under a scene, and the window of it that is solved on.

    Both may grow while the scene is marched through: ``growths`` times so far. The window follows the contact in free
    space, where only what is pressed matters; elsewhere it is the whole surface.

    Parameters
    ----------
    height : xarray.DataArray
        Profile, peaks up. [m]
    missing : {"refuse", "absent"}
        What missing heights mean.
    follow : bool
        Whether to begin with a small window, where all of the surface is present.
    mirror : bool
        Whether to solve on a quarter of a surface that is its own mirror image in x and in y.
    kernel : Kernel
        Of the body that it is pressed on; under one that bulges there is no window.
    """

    def __init__(
        self,
        height: xr.DataArray,
        missing: Missing = Settings.missing,
        *,
        follow: bool = False,
        mirror: bool = False,
        kernel: Kernel = HALF_SPACE,
    ) -> None:
        self._missing = missing
        self.kernel = kernel
        self.growths = 0
        height = _checked(height)
        self.mirrored = mirror and is_mirrored(height.values)
        self._lay(height)
        #: Area that nominal pressures refer to: that of the surface as it was given. [m2]
        self.nominal_area = nominal_area(height)
        self._extent = float(_FIRST_EXTENT)
        if follow and not kernel.raises_surface and self.present.all() and min(height.shape) >= _WORTH_FOLLOWING:
            self.window = window_around(self.gap, _FIRST_EXTENT, self.mirrored)

    def _lay(self, height: xr.DataArray) -> None:
        self.height = height
        present = np.isfinite(height.values)
        _check_missing(height, present, self._missing)
        cells = quarter(height.shape) if self.mirrored else ...
        #: What is solved for: the surface, or the quarter of it at the end of both axes.
        self.domain = height[cells]
        values = self.domain.values
        self._centres = self.domain["x"].values, self.domain["y"].values
        self.present: NDArray[np.bool_] = present[cells]
        #: Height of the highest point, which on an indenter may lie between the cells. [m]
        self.highest = highest(height)
        #: Undeformed gap of the domain at first touch, zero at absent cells. [m]
        self.gap = self.highest - values
        #: The least of it, which is not zero where the highest point lies between the cells. [m]
        self.least_gap = float(np.nanmin(self.gap))
        self.gap[~self.present] = 0.0
        #: Its mean over the present cells. [m]
        self.mean_gap = float(np.sum(self.gap)) / np.count_nonzero(self.present)
        self.spacing = spacing(self.height, "height")
        self._taper = taper_weights(self.domain)
        self.window = whole_domain((values.shape[0], values.shape[1]), self.mirrored)

    @property
    def corner(self) -> tuple[float, float]:
        """Centre of the window's first cell. [m]"""
        (i, j), (x, y) = self.window.first, self._centres
        return float(x[i]), float(y[j])

    def halfspace(self, boundary: Boundary, workers: int | None = None) -> HalfSpace:
        """The body under the window's grid."""
        return HalfSpace(self.window.shape, self.spacing, boundary, workers, mirrored=self.mirrored, kernel=self.kernel)

    def contact_fraction(self, contact: NDArray[np.bool_], area: float) -> float:
        """Contact area over that of the surface; on a tapered one both are weighted by the taper.

        Parameters
        ----------
        contact : ndarray of bool, of the window's shape
            Cells in contact.
        area : float
            Contact area: those cells, over all of the surface, counted or corrected for the grid. [m2]
        """
        dx, dy = self.spacing
        fraction = area / (dx * dy * self.height.size)
        if self._taper is None or area == 0:
            return fraction
        along_x, along_y = self._taper
        rows, columns = self.window.cells
        weighted = along_x[rows] @ contact @ along_y[columns] / (along_x.sum() * along_y.sum())
        return fraction * float(weighted) * self.domain.size / np.count_nonzero(contact)

    def can_grow(self) -> bool:
        """Whether the profile is known beyond its grid: its recipe still gives the heights."""
        return "recipe" in self.height.attrs and grown(self.height, 1.0) is not None

    def enlarge(self, scene: Scene) -> tuple[Scene, tuple[int, int]] | None:
        """The scene on a larger grid, and the cell of it where the present one begins; None if it cannot grow."""
        x, y = self.corner
        if self.window.whole:
            larger = grown(self.height, GROWTH)
            if larger is None or larger.size > MOST_CELLS:
                return None
            self._lay(_checked(larger))
        else:
            self.widen()
        self.growths += 1
        first = (self._cell(0, x) - self.window.first[0], self._cell(1, y) - self.window.first[1])
        halfspace = self.halfspace(scene.halfspace.boundary, scene.halfspace.workers)
        return replace(scene, halfspace=halfspace, **self.shown()), first

    def widen(self) -> None:
        """Take the next larger window, which contains the present one and is the whole surface in the end."""
        before = self.window
        while self.window == before:
            self._extent *= GROWTH
            self.window = window_around(self.gap, int(self._extent), self.mirrored, former=before)

    def shown(self) -> dict[str, Any]:
        """What a scene takes from the surface."""
        return {
            "gap": np.ascontiguousarray(self.gap[self.window.cells]),
            "present": None if self.present.all() else self.present,
            "outside": self.window.outside,
        }

    def _cell(self, axis: int, position: float) -> int:
        """Index in the domain of the cell at a position. [m]"""
        return int(np.searchsorted(self._centres[axis], position))

    def window_at(self, corner: Sequence[float], shape: Sequence[int]) -> Window:
        """A window of the present domain that was solved on before: its first cell's centre and its shape."""
        first = (self._cell(0, corner[0]), self._cell(1, corner[1]))
        return Window(self.window.domain, first, (shape[0], shape[1]), mirrored=self.mirrored)


def uses_window(settings: Settings) -> bool:
    """Whether a march follows the contact with a window: where it may reach neither the border nor the other side."""
    return settings.boundary == "free" and settings.edge == "error" and settings.method == "fast"


def check_cells(height: xr.DataArray, settings: Settings) -> None:
    """Refuse a surface on whose cells the kernel is not accurate in free space.

    With periodic boundaries the transfer function is exact on any cells. Coarser copies of the surface are not refused.
    """
    if settings.boundary == "free":
        dx, dy = spacing(height, "height")
        settings.kernel.check_cells((dx, dy))


def build_scene(ground: Ground, material: Material, program: Program, settings: Settings) -> tuple[Scene, Choice]:
    """Scene of a case and what models its material.

    Raises
    ------
    InputError
        If surface, material, program and settings do not go together; nothing has been computed then.
    """
    program = program.on_area(ground.nominal_area)
    if not program.segments:
        raise InputError("the program is empty: expected at least one segment")
    check_times(program, settings.time_step)
    check_slides(program, settings, ground.spacing)
    material = complete(material)
    (nx, ny), (dx, dy) = ground.height.shape, ground.spacing
    check_loads(program, material, settings.boundary, (nx * dx, ny * dy), ground.gap[ground.present])
    if settings.boundary == "periodic" and ground.present.all() and not has_finite_mean(ground.kernel):
        _check_approach(program, ground.mean_gap)
    foreseen = 0.0 if ground.window.whole else _foreseen(ground, program, material)
    while ground.window.outside <= foreseen:
        ground.widen()
    grows = not ground.window.whole or (settings.boundary == "free" and settings.edge == "error" and ground.can_grow())
    choice = choose_memory(material, **memory_options(program, settings, "pressure" if grows else "displacement"))
    scene = Scene(
        halfspace=ground.halfspace(settings.boundary),
        material=choice.material,
        memory=choice.memory,
        program=program,
        times=snap_to_cells(program, kept_times(program, settings.times), ground.spacing),
        tolerance=settings.tolerance,
        time_step=None if settings.time_step == "auto" else settings.time_step,
        accept_edge=settings.edge == "accept",
        enlarge=ground.enlarge if grows else None,
        **ground.shown(),
    )
    return scene, choice


def _foreseen(ground: Ground, program: Program, material: Material) -> float:
    """About the approach right after a jump at the start, from every so-many-eth cell; zero if there is none. [m]"""
    segment, glassy = program.segments[0], float(material.contact_compliance(0.0))
    value = segment.end or 0.0
    if segment.duration > 0 or value <= 0 or glassy <= 0:
        return 0.0
    if segment.control == "approach":
        return value
    stride = math.ceil(max(ground.height.shape) / _FORESEEN_ON)
    gap = ground.gap[::stride, ::stride]
    dx, dy = (stride * side for side in ground.spacing)
    halfspace = HalfSpace((gap.shape[0], gap.shape[1]), (dx, dy), mirrored=ground.mirrored, kernel=ground.kernel)
    load = value * glassy / halfspace.cell_area
    return solve_contact(halfspace, gap, load=load, tolerance=1e-2, max_iterations=50).approach


def _checked(height: xr.DataArray) -> xr.DataArray:
    height = checked(height, "height", least=1)
    if np.isinf(height.values).any():
        raise InputError("height holds infinite values: expected finite heights, or NaN where missing")
    return height


def is_absent(height: xr.DataArray, missing: str) -> bool:
    """Whether there is no material where heights are missing: the settings or the surface say so."""
    return missing == "absent" or height.attrs.get("missing") == "absent"


def _check_missing(height: xr.DataArray, present: NDArray[np.bool_], missing: str) -> None:
    if not present.any():
        raise InputError("height is missing everywhere: expected at least one finite height")
    absent = is_absent(height, missing)
    if not present.all() and not absent:
        row, column = np.argwhere(~present)[0]
        raise InputError(
            f"height is missing at {np.count_nonzero(~present)} of {present.size} points, the first at cell "
            f"({row}, {column}): fill it (fill = true in a study, rv.fill in Python), or say missing='absent' "
            "if there is no material"
        )


def _check_approach(program: Program, full: float) -> None:
    """Refuse an approach beyond the one of full contact, which has none: pressure may rise without limit there.

    Where cells are absent the half-space bulges into them, and every approach has its force.
    """
    for i, segment in enumerate(program.segments):
        largest = (segment.end or 0.0) + abs(segment.amplitude)
        if segment.control == "approach" and segment.end is not None and largest >= full:
            raise InputError(
                f"program.{i}: approach goes to {largest:.6g} m, and with periodic boundaries contact is full at "
                f"{full:.6g} m: expected less"
            )


def memory_options(program: Program, settings: Settings, acts_on: ActsOn = "displacement") -> dict[str, Any]:
    """What :func:`~roughvisc.mechanics.hereditary.choice.choose_memory` is to be asked for, whatever the material."""
    return {
        "duration": program.duration,
        "tolerance": settings.tolerance,
        "acts_on": acts_on,
        "kind": settings.memory,
        "shortest": shortest_age(program, kept_times(program, settings.times), settings.tolerance),
    }


def shortest_age(program: Program, kept: Sequence[float] | None, tolerance: float) -> float:
    """Shortest age, beside zero, at which the compliance matters to what is kept. [s]

    Parameters
    ----------
    program : Program
        The loading program.
    kept : sequence of float or None
        Kept times, None for every accepted step. [s]
    tolerance : float
        Relative error that is allowed.

    Returns
    -------
    float
        Zero for a program of jumps alone.

    Notes
    -----
    What is kept soonest after a corner of the program resolves the shortest interval. Pressure that came in the last
    part ``f`` of an interval ``h`` is all that meets ages below ``f h``. What a compliance that ascends from the right
    value at age zero can be wrong by there is the creep till then: for the whole interval less than ``f`` of
    ``C(h)``. With a tenth of the tolerance for ``f`` that is as much as the error beyond may be. Steps below a
    millionth of a segment are not taken, so that ``f`` need not be less.
    """
    spans = [min(segment.duration, segment.period) for segment in program.segments if segment.duration > 0]
    if not spans:
        return 0.0
    if kept is None:
        return SMALLEST_STEP * min(spans)
    times = np.array(sorted(kept))
    after = [times[times > corner][:1] - corner for corner in program.corners]
    return float(min([*spans, *np.concatenate(after)])) * max(SERIES_SHARE * tolerance, SMALLEST_STEP)
