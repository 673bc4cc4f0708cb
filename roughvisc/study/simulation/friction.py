"""``friction``: steady sliding of a surface at given speeds gives one Dataset over ``speed``."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.groups import root_of
from roughvisc.labels import annotate
from roughvisc.mechanics.halfspace.sheet import Base
from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.materials.protocol import complete
from roughvisc.mechanics.stepping.slide import Direction
from roughvisc.study.simulation.malloc import retain_arena
from roughvisc.study.simulation.notes import border_note, slope_note
from roughvisc.study.simulation.refusal import require_memory_of_curve
from roughvisc.study.simulation.scene import Ground
from roughvisc.study.simulation.speeds import Speeds
from roughvisc.study.statement.body import make_body
from roughvisc.study.statement.curve import SteadySliding
from roughvisc.study.statement.settings import Settings
from roughvisc.study.storage.checkpoint import Checkpoint, CheckpointWriter
from roughvisc.study.storage.records import RowsInMemory
from roughvisc.variables import RESULT_FORMAT

log = logging.getLogger("roughvisc")

Progress = Callable[[float, float], None]

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
    grid_error: bool = Settings.grid_error,
    progress: bool | Progress = True,
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
    grid_error : bool
        Whether to compute the curve again on cells twice and four times as long, and to bound by it the errors that the
        grid makes: ``grid_error_friction`` and ``grid_error_area``. It takes about a third of the time more.
    progress : bool or callable
        A progress bar, or a function called with the speeds done and their number.

    Returns
    -------
    xarray.Dataset
        Over ``speed``, in the order given: as :data:`roughvisc.variables.sliding.SLIDING` declares it.

    Raises
    ------
    InputError
        If the input is wrong, or the material creeps without end under waves across the motion.

    Notes
    -----
    In the steady state the friction force times the speed is the power that the material dissipates. The force is
    taken from that power: on the grid it converges much faster than the sum of pressure times slope. The force across
    the motion, ``friction_force_across``, is the same sum with the slope across the motion.

    References
    ----------
    .. [1] B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840.

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy(1e-6, 1e-3, (1e-3, 1e-4), (24, 3), waves=1)
    >>> rubber = rv.zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=1e3)
    >>> ds = rv.friction(wave, rubber, pressure=5e4, speeds=[1e-3, 0.1, 10.0], progress=False)
    >>> int(ds.friction_coefficient.argmax("speed"))
    1
    """
    curve = SteadySliding(speeds=speeds, load=load, pressure=pressure, direction=direction, last_octave=last_octave)
    settings = Settings(
        boundary="periodic",
        tolerance=tolerance,
        fields=_fields(fields),
        grid_error=grid_error,
        kernel=make_body(complete(material), thickness, base),
    )
    return root_of(rub(height, material, curve, settings, progress=progress).assign_attrs(title="Steady sliding"))


def rub(
    height: xr.DataArray,
    material: Material,
    curve: SteadySliding,
    settings: Settings,
    *,
    progress: bool | Progress,
    keeper: CheckpointWriter | None = None,
) -> xr.Dataset:
    """As :func:`friction`; a keeper takes each speed to the disk, and knows at which to go on."""
    began = time.perf_counter()
    material = complete(material)
    ground = Ground(height, "refuse", kernel=settings.kernel)
    require_memory_of_curve((ground.gap.shape[0], ground.gap.shape[1]), settings)
    if not ground.present.all():  # of a punch, which says so itself
        raise InputError("height is missing at some points: expected a whole surface, which repeats without end")
    reached = Checkpoint() if keeper is None else keeper.latest
    spent = reached.wall_time - began
    store = RowsInMemory() if keeper is None else keeper.rows
    rows = Speeds(ground, material, curve, settings, store)
    from roughvisc.study.progress import reporting  # slow to import

    with retain_arena(ground.gap.nbytes), reporting(progress, "sliding", at=curve.at) as report:
        for number in np.argsort(curve.asked)[reached.rows :]:
            rows.add(int(number), lambda: spent + time.perf_counter())
            reached = reached.at_speed(spent + time.perf_counter())
            report(float(reached.rows), float(len(curve.asked)))
            if keeper is not None:
                keeper.passed(reached)
    dataset = annotate(rows.dataset())
    notes = {
        "material_note": material.note,
        "slope_note": slope_note(ground.height, "periodic", np.inf),
        "border_note": border_note(ground.height, xr.Dataset()),
        "octave_note": octave_note(dataset),
        "wake_note": rows.wake_note(),
        **rows.told,
    }
    for name in ("slope_note", "border_note", "wake_note"):
        if notes[name]:
            log.warning("%s", notes[name])
    dataset.attrs = {
        "Conventions": "CF-1.11",
        "result_format": RESULT_FORMAT,
        "model_note": MODEL,
        "direction": curve.direction,
        "history": str(ground.height.attrs.get("history", "")),
        **settings.to_attributes(),
        **settings.kernel.described(),
        **{name: note for name, note in notes.items() if note},
    }
    return dataset


#: Part of the friction that the shortest octave of waves may add without a word.
_MUCH = 0.2


def octave_note(dataset: xr.Dataset) -> str:
    """What to say of a surface whose shortest waves add much of the friction; empty if they do not."""
    if "last_octave_friction" not in dataset:
        return ""
    most = float(dataset["last_octave_friction"].max())
    if not most > _MUCH:
        return ""
    return (
        f"The shortest octave of waves adds up to {100 * most:.0f} % of the friction: waves that the scan does not "
        "resolve may add as much again."
    )


def _fields(fields: Sequence[str]) -> tuple[str, ...]:
    for name in fields:
        if name not in _FIELDS:
            raise InputError(f"fields holds {name!r}: expected some of {', '.join(_FIELDS)}")
    return tuple(fields)
