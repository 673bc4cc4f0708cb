"""One surface, one material, one program -> one Dataset ``(time, x, y)``."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.mechanics.halfspace import Boundary, HalfSpace
from roughvisc.mechanics.loading import Program
from roughvisc.mechanics.materials import Material, Prony
from roughvisc.mechanics.memory import Modes
from roughvisc.mechanics.seed import march_seed
from roughvisc.mechanics.stepper import Scene, Step, march
from roughvisc.variables import FIELDS, STATUS_MEANINGS, annotate

#: Counted contact cells overestimate the area by this part of the staircase perimeter times the cell side; measured
#: on Hertz contacts of 6 to 200 cells' radius (0.080 to 0.092).
PERIMETER_CORRECTION = 0.088

Progress = Callable[[float, float], None]
Method = Literal["fast", "seed"]


def simulate(
    height: xr.DataArray,
    material: Material,
    program: Program,
    *,
    boundary: Boundary = "free",
    tolerance: float = 1e-3,
    time_step: float | Literal["auto"] = "auto",
    times: int | Sequence[float] | None = None,
    fields: Sequence[str] = ("pressure", "gap"),
    method: Method = "fast",
    missing: Literal["refuse", "absent"] = "refuse",
    edge: Literal["error", "accept"] = "error",
    progress: bool | Progress = True,
) -> xr.Dataset:
    """Press a rigid profile on a linear viscoelastic half-space.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        Profile, peaks up, with cell-centre coordinates. The undeformed gap is ``max(height) - height``. [m]
    material : Material
        Of the half-space.
    program : Program
        Load or approach against time.
    boundary : {"free", "periodic"}
        ``free`` for an indenter, ``periodic`` for a nominally flat scan.
    tolerance : float
        Bounds, at every kept time, the error in time of the pressure (L1, over the largest force so far) and of
        the approach (over its largest value); the error of the grid comes on top.
    time_step : "auto" or float
        Steps chosen by the tolerance, or of a given length. [s]
    times : int or sequence of float, optional
        Times to keep, stepped onto exactly: a count, evenly from 0+ to the end; a list; or None, every accepted
        step. [s]
    fields : sequence of str
        Fields to keep, of ``pressure``, ``gap``, ``displacement``.
    method : {"fast", "seed"}
        ``seed`` is the seed paper's algorithm, slips corrected and not accelerated.
    missing : {"refuse", "absent"}
        Missing heights are an error, or cells without material that never touch.
    edge : {"error", "accept"}
        In free space, whether contact may reach the border of the grid.
    progress : bool or callable
        A progress bar, or a function called with the time reached and the program's length. [s]

    Returns
    -------
    xarray.Dataset
        As described in :mod:`roughvisc.variables`.

    Raises
    ------
    InputError
        If the input is wrong; the message says what was found and what was expected.
    EdgeContactError
        If contact reached the border of a free-space domain.
    ConvergenceError
        If any step did not converge and nothing was kept; otherwise ``status`` says which did not.

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=45)
    >>> rubber = rv.zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=1e5)
    >>> press = rv.Program().load(1e-4, over=0).hold(0.5)
    >>> ds = rv.simulate(ball, rubber, press, times=[0, 0.5], progress=False)
    >>> dict(ds.sizes)
    {'time': 2, 'x': 45, 'y': 45}
    >>> bool(ds.contact_area[1] > ds.contact_area[0])
    True
    """
    began = time.perf_counter()
    scene, present = _scene(height, material, program, boundary, tolerance, time_step, times, missing, edge)
    unknown = [name for name in fields if name not in FIELDS]
    if unknown:
        raise InputError(f"fields holds {unknown[0]!r}: expected some of {', '.join(FIELDS)}")
    if method not in ("fast", "seed"):
        raise InputError(f"method is {method!r}: expected 'fast' or 'seed'")
    steps = march(scene) if method == "fast" else march_seed(scene)
    rows = []
    for step in _shown(steps, scene, progress):
        rows.append(_row(scene, present, step, fields, time.perf_counter() - began))
    if not rows:
        raise ConvergenceError("no step was accepted at a kept time: expected a program with at least one segment")
    return _dataset(height, rows, fields, boundary, tolerance, method)


def grid_of(height: xr.DataArray) -> tuple[tuple[int, int], tuple[float, float]]:
    """Shape and spacing [m] of a labelled grid.

    Raises
    ------
    InputError
        If the dimensions are not ``(x, y)`` or the coordinates are not evenly spaced, ascending cell centres.
    """
    if not isinstance(height, xr.DataArray) or height.dims != ("x", "y"):
        found = getattr(height, "dims", type(height).__name__)
        raise InputError(f"height is {found}: expected a DataArray with dimensions ('x', 'y')")
    sides = []
    for name in ("x", "y"):
        if name not in height.coords:
            raise InputError(f"height has no coordinate {name!r}: expected cell centres [m]")
        centres = height[name].values
        if centres.size == 0:
            raise InputError(f"height has no cell along {name}: expected at least one")
        steps = np.diff(centres)
        if centres.size == 1:
            side = float(height.attrs.get(f"spacing_{name}", 2 * centres[0])) or 1.0
        else:
            side = float((centres[-1] - centres[0]) / (centres.size - 1))
        if not side > 0 or (steps.size and not np.allclose(steps, side, rtol=1e-6, atol=0)):
            raise InputError(f"coordinate {name!r} of height is not evenly spaced and ascending")
        sides.append(side)
    return (height.sizes["x"], height.sizes["y"]), (sides[0], sides[1])


def _scene(
    height: xr.DataArray,
    material: Material,
    program: Program,
    boundary: Boundary,
    tolerance: float,
    time_step: float | Literal["auto"],
    times: int | Sequence[float] | None,
    missing: str,
    edge: str,
) -> tuple[Scene, NDArray[np.bool_]]:
    shape, spacing = grid_of(height)
    for name, value, expected in (("missing", missing, ("refuse", "absent")), ("edge", edge, ("error", "accept"))):
        if value not in expected:
            raise InputError(f"{name} is {value!r}: expected {expected[0]!r} or {expected[1]!r}")
    if not (isinstance(tolerance, int | float) and 0 < tolerance < 1):
        raise InputError(f"tolerance is {tolerance!r}: expected a number between 0 and 1")
    if time_step != "auto" and not (isinstance(time_step, int | float) and 0 < time_step < np.inf):
        raise InputError(f"time_step is {time_step!r}: expected 'auto' or a positive number [s]")
    if not program.segments:
        raise InputError("the program is empty: expected at least one segment")
    values = np.asarray(height.values, dtype=float)
    present = np.isfinite(values)
    _check_missing(height, values, present, missing)
    gap = np.where(present, np.max(values[present]) - values, 0.0)
    _check_approach(program, boundary, gap, present)
    if not isinstance(material, Prony):
        raise InputError(f"material is a {type(material).__name__}: expected one of roughvisc's materials")
    scene = Scene(
        halfspace=HalfSpace(shape, spacing, boundary),
        gap=gap,
        material=material,
        memory=Modes(material),
        program=program,
        times=kept_times(program, times),
        tolerance=float(tolerance),
        time_step=None if time_step == "auto" else float(time_step),
        present=None if present.all() else present,
        accept_edge=edge == "accept",
    )
    return scene, present


def _check_missing(height: xr.DataArray, values: NDArray[np.float64], present: NDArray[np.bool_], missing: str) -> None:
    if np.isinf(values).any():
        raise InputError("height holds infinite values: expected finite heights, or NaN where missing")
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


def _check_approach(program: Program, boundary: str, gap: NDArray[np.float64], present: NDArray[np.bool_]) -> None:
    if boundary != "periodic":
        return
    full = float(np.mean(gap[present]))
    for i, segment in enumerate(program.segments):
        if segment.control == "approach" and (segment.end or 0.0) + abs(segment.amplitude) >= full:
            raise InputError(
                f"program.{i}: approach goes to {(segment.end or 0.0) + abs(segment.amplitude):.6g} m, and with "
                f"periodic boundaries contact is full at {full:.6g} m: expected less"
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


def _shown(steps: Iterator[Step], scene: Scene, progress: bool | Progress) -> Iterator[Step]:
    """Steps at kept times, with the worst of what lies between folded in, reporting progress."""
    report, close = _reporter(progress)
    kept = None if scene.times is None else set(scene.times)
    worst_error, converged = np.nan, True
    try:
        for step in steps:
            report(step.shown.time, scene.program.duration)
            worst_error = np.fmax(worst_error, step.time_error)
            converged = converged and step.converged
            if kept is None or step.shown.time in kept:
                yield Step(step.shown, step.level, step.bound, float(worst_error), converged, step.state)
                worst_error, converged = np.nan, True
    finally:
        close()


def _reporter(progress: bool | Progress) -> tuple[Progress, Callable[[], None]]:
    if callable(progress):
        return progress, lambda: None
    if not progress:
        return (lambda _time, _duration: None), (lambda: None)
    from rich.progress import Progress as Bar

    bar = Bar(transient=True)
    task = bar.add_task("pressing", total=1.0)
    bar.start()
    return (lambda now, duration: bar.update(task, completed=now / duration if duration else 1.0)), bar.stop


def _row(
    scene: Scene, present: NDArray[np.bool_], step: Step, fields: Sequence[str], wall_time: float
) -> dict[str, Any]:
    """One kept instant, by variable."""
    shown = step.shown
    area = scene.halfspace.cell_area
    contact = shown.pressure > 0
    gap = scene.gap + shown.displacement
    gap -= step.level
    np.maximum(gap, 0.0, out=gap)  # below the solver's tolerance inside the contact
    gap[contact] = 0.0
    gap[~present] = np.nan
    counted = float(np.count_nonzero(contact)) * area
    available = {"pressure": shown.pressure, "gap": gap, "displacement": shown.displacement}
    return {
        "time": shown.time,
        "force": shown.force,
        "approach": shown.approach,
        "contact_area": counted,
        "contact_area_corrected": max(counted - _staircase(contact, scene), 0.0),
        "contact_fraction": counted / (area * contact.size),
        "mean_gap": float(np.nanmean(gap)),
        "iterations": step.state.iterations,
        "convolutions": step.state.convolutions,
        "residual": step.bound,
        "time_error": step.time_error,
        "status": _status(step, contact, present, shown.force),
        "wall_time": wall_time,
        **{name: available[name].copy() for name in fields},
    }


def _status(step: Step, contact: NDArray[np.bool_], present: NDArray[np.bool_], force: float) -> int:
    if not step.converged:
        meaning = "not_converged"
    elif force == 0:
        meaning = "open"
    elif contact[present].all():
        meaning = "full_contact"
    else:
        meaning = "converged"
    return STATUS_MEANINGS.index(meaning)


def _staircase(contact: NDArray[np.bool_], scene: Scene) -> float:
    """Area by which counting cells is too large: a part of the perimeter's strip. [m2]"""
    dx, dy = scene.halfspace.spacing
    faces_x = np.count_nonzero(contact[1:] != contact[:-1])
    faces_y = np.count_nonzero(contact[:, 1:] != contact[:, :-1])
    if scene.halfspace.boundary == "periodic":
        faces_x += np.count_nonzero(contact[0] != contact[-1])
        faces_y += np.count_nonzero(contact[:, 0] != contact[:, -1])
    # a face across x is dy long and lies in a strip dx wide, and the other way round
    return PERIMETER_CORRECTION * dx * dy * (faces_x + faces_y)


def _dataset(
    height: xr.DataArray,
    rows: list[dict[str, Any]],
    fields: Sequence[str],
    boundary: str,
    tolerance: float,
    method: str,
) -> xr.Dataset:
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    for counter in ("iterations", "convolutions"):
        columns[counter] = np.diff(columns[counter], prepend=0)
    stamp = columns.pop("time")
    variables: dict[str, Any] = {"height": (("x", "y"), np.asarray(height.values, dtype=float))}
    for name, values in columns.items():
        variables[name] = (("time", "x", "y") if name in fields else ("time",), values)
    dataset = xr.Dataset(
        variables,
        coords={"time": ("time", stamp), "x": height["x"].values, "y": height["y"].values},
        attrs={
            "Conventions": "CF-1.11",
            "boundary": boundary,
            "tolerance": tolerance,
            "method": method,
            "history": str(height.attrs.get("history", "")),
        },
    )
    return annotate(dataset)
