"""``friction``: steady sliding of a surface at given speeds gives one Dataset over ``speed``."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from typing import Any, Literal, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.labels import annotate
from roughvisc.mechanics.halfspace.sheet import Base
from roughvisc.mechanics.materials.frequency import complex_compliance, over_frequencies
from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.materials.protocol import complete
from roughvisc.mechanics.sliding.persson import persson
from roughvisc.mechanics.sliding.steady import Sliding, SteadyState, steady_state
from roughvisc.study.simulation.neighbours import staircase
from roughvisc.study.simulation.notes import border_note, slope_note
from roughvisc.study.simulation.scene import Ground, nominal_area
from roughvisc.study.statement.body import body
from roughvisc.study.statement.settings import Settings
from roughvisc.topography.spectrum import without_last_octave
from roughvisc.variables import STATUS_MEANINGS

Direction = Literal["x", "-x", "y", "-y"]
Array = NDArray[np.float64]

#: What every result on sliding says of its model.
MODEL = (
    "Normal contact alone: friction is that of pressure on inclined faces, which the material's losses make uneven. "
    "No shear at the interface, no adhesion, no heating."
)
_FIELDS = ("pressure", "gap")


def friction(
    height: xr.DataArray,
    material: Material,
    *,
    speeds: Sequence[float] | float,
    load: float | None = None,
    pressure: float | None = None,
    direction: Direction = "x",
    thickness: float | None = None,
    base: Base | None = None,
    tolerance: float = Settings.tolerance,
    fields: Sequence[str] = (),
    last_octave: bool = False,
) -> xr.Dataset:
    """Friction of a rigid profile that slides steadily on a viscoelastic body, with periodic boundaries.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        Profile, peaks up, with cell-centre coordinates and no missing points. [m]
    material : Material
        Of the body: one with a finite compliance after endless creep, unless the profile is the same all across the
        motion. Shift factors of a temperature act as factors of the speed.
    speeds : float or sequence of float
        [m/s]
    load, pressure : float
        Load [N] or nominal pressure [Pa]: one of them.
    direction : {"x", "-x", "y", "-y"}
        In which the profile moves.
    thickness, base : float, str
        Of a sheet on a rigid base, in place of a half-space: as :func:`roughvisc.simulate` has them.
    tolerance : float
        On what the iteration leaves of pressure (L1, over the load) and friction (relative).
    fields : sequence of str
        Fields to keep, of ``pressure`` and ``gap``, in the frame of the profile.
    last_octave : bool
        Whether to tell what the shortest octave of the surface's waves adds to friction and area, at twice the cost. If
        that is much, the waves that the scan does not resolve would add as much again.

    Returns
    -------
    xarray.Dataset
        Over ``speed``, in the order given: as :data:`roughvisc.variables.SLIDING` declares it.

    Raises
    ------
    InputError
        If the input is wrong, or the material creeps without end under waves across the motion.

    Notes
    -----
    In the steady state the friction force times the speed is the power that the material dissipates. The force is
    taken from that power: on the grid it converges much faster than the sum of pressure times slope, which stands
    beside it as ``slope_friction_force``.

    References
    ----------
    .. [1] B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840.

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy(1e-6, 1e-3, (1e-3, 1e-4), (24, 3), waves=1)
    >>> rubber = rv.zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=1e3)
    >>> ds = rv.friction(wave, rubber, pressure=5e4, speeds=[1e-3, 0.1, 10.0])
    >>> int(ds.friction_coefficient.argmax("speed"))
    1
    """
    settings = Settings(boundary="periodic", tolerance=tolerance)
    wanted = _fields(fields)
    asked = _speeds(speeds)
    if direction not in get_args(Direction):
        raise InputError(f"direction is {direction!r}: expected {' or '.join(map(repr, get_args(Direction)))}")
    material = complete(material)
    kernel = body(material, thickness, base)
    ground = Ground(height, "refuse", kernel=kernel)
    force = _load(load, pressure, nominal_area(ground.height))
    if not ground.present.all():  # of a punch, which says so itself
        raise InputError("height is missing at some points: expected a whole surface, which repeats without end")

    there, back = _turned(direction)
    gap = np.ascontiguousarray(there(ground.gap))
    sides = ground.spacing if direction.endswith("x") else ground.spacing[::-1]
    waves = 2 * np.pi * np.fft.fftfreq(gap.shape[0], sides[0])
    smooth, shortest = without_last_octave(gap, sides) if last_octave else (gap, 0.0)
    if last_octave and not np.ptp(smooth) > 1e-9 * np.ptp(gap):
        raise InputError("height has no waves beyond its shortest octave: expected last_octave = False")
    rows: list[dict[str, Any]] = [{} for _ in asked]
    began, found, without = time.perf_counter(), None, None
    for number in np.argsort(asked):
        speed = float(asked[number])
        closed = over_frequencies(material, speed * waves, 0.1 * tolerance)  # once: a table takes a fit
        sliding = Sliding(kernel, partial(complex_compliance, closed), gap.shape, sides, speed)
        found = _state(sliding, gap, force, tolerance, found)
        row = _row(found, ground, there, back, speed, force, wanted)
        estimate = persson(sliding, gap, row["nominal_pressure"])
        row["persson_friction_coefficient"] = estimate.friction_coefficient
        row["persson_contact_fraction"] = estimate.contact_fraction
        if last_octave:
            without = _state(sliding, smooth, force, tolerance, without)
            row |= _added(row, found, without, ground)
        rows[number] = row | {"wall_time": time.perf_counter() - began}
    dataset = _dataset(rows, asked, ground, settings, direction, kernel.described(), material)
    return dataset.assign_attrs(last_octave=f"waves shorter than {shortest:.4g} m") if last_octave else dataset


def _state(sliding: Sliding, gap: Array, force: float, tolerance: float, last: SteadyState | None) -> SteadyState:
    """Steady state, begun with that of the last speed."""
    start = None if last is None else last.pressure
    return steady_state(sliding, gap, force, tolerance=tolerance, start=start)


def _added(row: dict[str, Any], found: SteadyState, without: SteadyState, ground: Ground) -> dict[str, float]:
    """What the shortest octave of waves adds, relative to what there is with it."""
    if not (found.converged and without.converged and found.power_force > 0):
        return {"last_octave_friction": np.nan, "last_octave_area": np.nan}
    area = _areas(without.pressure > 0, float(np.prod(ground.spacing)))[1]
    return {
        "last_octave_friction": 1 - without.power_force / found.power_force,
        "last_octave_area": 1 - area / row["contact_area_corrected"],
    }


def _areas(contact: NDArray[np.bool_], cell: float) -> tuple[float, float]:
    """Contact area, counted and corrected. [m2]"""
    counted = np.count_nonzero(contact) * cell
    return counted, max(counted - staircase(contact, ~contact, cell, True), 0.0)


def _row(
    found: SteadyState, ground: Ground, there: Any, back: Any, speed: float, force: float, wanted: tuple[str, ...]
) -> dict[str, Any]:
    pressure, displacement = back(found.pressure), back(found.displacement)
    contact = pressure > 0
    area, corrected = _areas(contact, float(np.prod(ground.spacing)))
    gap = np.maximum(ground.gap + displacement - found.approach, 0.0)
    gap[contact] = 0.0
    if not found.converged:
        status = "not_converged"
    else:
        status = "full_contact" if contact.all() else "converged"
    fields = {"pressure": pressure, "gap": gap}
    return {
        "force": force,
        "nominal_pressure": force / ground.nominal_area,
        "approach": found.approach,
        "contact_area": area,
        "contact_area_corrected": corrected,
        "contact_fraction": area / ground.nominal_area,
        "mean_gap": float(gap.mean()),
        "friction_coefficient": found.power_force / force,
        "friction_force": found.power_force,
        "slope_friction_force": found.slope_force,
        "dissipated_power": found.power_force * speed,
        "loss_tangent": found.loss_tangent,
        "pressure_residual": found.residual,
        "friction_residual": found.friction_residual,
        "iterations": found.inner,
        "outer_iterations": found.outer,
        "status": STATUS_MEANINGS.index(status),
        **{name: fields[name] for name in wanted},
    }


def _dataset(
    rows: Sequence[dict[str, Any]],
    speeds: Array,
    ground: Ground,
    settings: Settings,
    direction: str,
    described: dict[str, Any],
    material: Material,
) -> xr.Dataset:
    height = ground.height
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    dataset = xr.Dataset(
        {name: (("speed", "x", "y")[: values.ndim], values) for name, values in columns.items()} | {"height": height},
        coords={"speed": speeds, "x": height["x"], "y": height["y"]},
    )
    dataset = annotate(dataset)
    notes = {
        "material_note": material.note,
        "slope_note": slope_note(height, "periodic", np.inf),
        "border_note": border_note(height, xr.Dataset()),
    }
    dataset.attrs = {
        "title": "Steady sliding",
        "model_note": MODEL,
        "direction": direction,
        **settings.told(),
        **described,
        **{name: note for name, note in notes.items() if note},
    }
    return dataset


def _turned(direction: str) -> tuple[Any, Any]:
    """How fields turn so that the profile moves along +x, and how they turn back."""
    flip = slice(None, None, -1 if direction.startswith("-") else 1)
    if direction.endswith("x"):
        return (lambda field: field[flip]), (lambda field: field[flip])
    return (lambda field: field.T[flip]), (lambda field: np.ascontiguousarray(field[flip].T))


def _fields(fields: Sequence[str]) -> tuple[str, ...]:
    for name in fields:
        if name not in _FIELDS:
            raise InputError(f"fields holds {name!r}: expected some of {', '.join(_FIELDS)}")
    return tuple(fields)


def _speeds(speeds: Sequence[float] | float) -> Array:
    try:
        found = np.atleast_1d(np.asarray(speeds, dtype=float))
    except (TypeError, ValueError):
        found = np.array([])
    if found.ndim != 1 or not found.size or not (np.isfinite(found) & (found > 0)).all():
        raise InputError(f"speeds is {speeds!r}: expected positive numbers [m/s]")
    return found


def _load(load: float | None, pressure: float | None, area: float) -> float:
    if (load is None) == (pressure is None):
        raise InputError(f"load is {load!r} and pressure is {pressure!r}: expected one of them")
    name, value, unit = ("load", load, "N") if pressure is None else ("pressure", pressure, "Pa")
    if not (isinstance(value, int | float) and 0 < value < np.inf):
        raise InputError(f"{name} is {value!r}: expected a positive number [{unit}]")
    return float(value) if pressure is None else float(value) * area
