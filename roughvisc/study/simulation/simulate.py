"""``simulate``: one surface, one material, one program give one Dataset ``(time, x, y)``."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import xarray as xr
from scipy import fft

from roughvisc.errors import ConvergenceError
from roughvisc.groups import root_of
from roughvisc.labels import annotate
from roughvisc.mechanics.fields.reuse import reused
from roughvisc.mechanics.halfspace.kernel import Kernel
from roughvisc.mechanics.halfspace.operator import Boundary
from roughvisc.mechanics.halfspace.sheet import Base
from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.materials.protocol import complete
from roughvisc.mechanics.stepping.march import march
from roughvisc.mechanics.stepping.program import Program
from roughvisc.mechanics.stepping.scene import Scene, State
from roughvisc.mechanics.stepping.seed import march_seed
from roughvisc.study.simulation.available import threads_for
from roughvisc.study.simulation.grid_error import with_grid_error
from roughvisc.study.simulation.malloc import retain_arena
from roughvisc.study.simulation.notes import accuracy_note, body_note, border_note, edge_note, left_out, slope_note
from roughvisc.study.simulation.refusal import require_memory
from roughvisc.study.simulation.rows import Rows, is_end_value, meets_tolerance
from roughvisc.study.simulation.scene import Ground, build_scene, check_cells, uses_window
from roughvisc.study.simulation.slides import slide_note
from roughvisc.study.simulation.wake import contact_stands_alone, creep_left, surface_stands_alone, wake_note
from roughvisc.study.statement.body import make_body, separability_error
from roughvisc.study.statement.settings import Edge, Memory, Method, Missing, Settings, TimeStep
from roughvisc.study.storage.checkpoint import Checkpoint, CheckpointWriter
from roughvisc.study.storage.records import RowsInMemory
from roughvisc.topography.grid import checked, nominal_area

log = logging.getLogger("roughvisc")

Progress = Callable[[float, float], None]


def simulate(
    height: xr.DataArray,
    material: Material,
    program: Program,
    *,
    boundary: Boundary = Settings.boundary,
    tolerance: float = Settings.tolerance,
    time_step: TimeStep = Settings.time_step,
    times: int | Sequence[float] | None = Settings.times,
    fields: Sequence[str] = Settings.fields,
    method: Method = Settings.method,
    missing: Missing = Settings.missing,
    edge: Edge = Settings.edge,
    memory: Memory = Settings.memory,
    grid_error: bool = Settings.grid_error,
    thickness: float | None = None,
    base: Base | None = None,
    kernel: Kernel = Settings.kernel,
    threads: int | None = None,
    progress: bool | Progress = True,
) -> xr.Dataset:
    """Press a rigid profile on a linear viscoelastic half-space, or on a sheet on a rigid base.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        Profile, peaks up, with cell-centre coordinates; or a Dataset that holds it as ``height``. A unit of length
        that heights or coordinates state is converted; without one they are metres. The undeformed gap is
        ``max(height) - height``; an indenter's counts from its apex, wherever that lies between the cells. [m]
    material : Material
        Of the body: one of roughvisc's, or any object with the two functions that
        :class:`roughvisc.mechanics.materials.models.Material` asks for.
    program : Program
        Load, nominal pressure or approach against time. A nominal pressure is the load over the whole area of the
        grid of heights as it is given, absent cells included; of a tapered surface, over the integral of the taper's
        weight.
    boundary : {"free", "periodic"}
        ``free`` for an indenter, ``periodic`` for a nominally flat scan.
    tolerance : float
        Asked of ``stated_error`` at every kept time: the error that time steps, contact solver and series leave of
        pressure (L1), force and approach, over the largest force and approach so far. Rows that miss it state by how
        much, and ``accuracy_note`` counts them; the error of the grid comes on top.
    time_step : "auto" or float
        Steps chosen by the tolerance, or of a given length. [s]
    times : int or sequence of float, optional
        Times whose fields are kept, stepped onto exactly: a count, the corners of the program and the rest where the
        result changes; a list; or None, all corners and every accepted step that keeps the tolerance. [s]
    fields : sequence of str
        Fields to keep, of ``pressure``, ``gap``, ``displacement``.
    method : {"fast", "seed"}
        ``seed`` is the seed paper's algorithm, slips corrected and not accelerated.
    missing : {"refuse", "absent"}
        Missing heights are an error, or cells without material that never touch.
    edge : {"error", "accept"}
        In free space, whether contact may reach the border of the grid. Where it is accepted, the attribute ``edge``
        of the result says so, and ``edge_note`` when contact came to the border, where the surface acts as a punch.
    memory : {"auto", "direct"}
        ``direct`` keeps every past pressure, whatever the material: dearer, and independent of any series.
    grid_error : bool
        Whether to compute the history again on cells twice and four times as long, and to bound by it the error that
        the grid makes: ``grid_error``, ``grid_error_area`` and the bounds ``contact_area_lower`` and
        ``contact_area_upper`` at the kept times.
    thickness : float, optional
        Of a sheet of the material on a rigid base, in place of a half-space. With periodic boundaries and a Poisson
        ratio below a half, the approach holds the compression of the sheet itself. [m]
    base : {"bonded", "slipping"}, optional
        Whether the sheet sticks to its base, as it does unless said otherwise, or slides on it without friction.
    kernel : Kernel
        Of any other body: see :class:`roughvisc.mechanics.halfspace.kernel.Kernel`.
    threads : int, optional
        Of a large grid; the bits are the same with any number. Default: as ``scipy.fft.set_workers`` has it; where
        nobody has set that, all cores the process may use, but one beside other threads or in a process that was
        started by another one.
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
    TooLargeError
        If it needs more memory than there is, before any is taken.
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
    >>> ds.pressure.shape
    (2, 45, 45)
    >>> bool(ds.contact_area[1] > ds.contact_area[0])
    True
    """
    settings = Settings(
        boundary=boundary,
        tolerance=tolerance,
        time_step=time_step,
        times=times,
        fields=fields,
        method=method,
        missing=missing,
        edge=edge,
        memory=memory,
        grid_error=grid_error,
        kernel=make_body(material, thickness, base, kernel),
    )
    return root_of(press(height, material, program, settings, progress=progress, threads=threads))


def press(
    height: xr.DataArray,
    material: Material,
    program: Program,
    settings: Settings,
    *,
    progress: bool | Progress,
    keeper: CheckpointWriter | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """As :func:`simulate`; a keeper takes to the disk what is computed, and knows where to go on from.

    The seed paper's algorithm keeps all past pressures and is not checkpointed: an interrupted run begins again.
    """
    height = checked(height, "simulate", least=1)
    check_cells(height, settings)
    needed = ("pressure",) if settings.grid_error and "pressure" not in settings.fields else ()
    with_needed = replace(settings, fields=(*settings.fields, *needed))
    count = threads_for(threads)

    def pressed(of: xr.DataArray, program: Program, settings: Settings, **kept: Any) -> xr.Dataset:
        with fft.set_workers(count), retain_arena(8 * of.size):
            return _press(of, material, program, settings, **kept)

    dataset = pressed(height, program, with_needed, progress=progress, keeper=keeper)
    if not settings.grid_error:
        return dataset

    loads = program.on_area(nominal_area(height))  # coarser grids may be of other sizes

    def again(few: xr.DataArray, times: list[float]) -> xr.Dataset:
        return pressed(few, loads, replace(settings, times=times, fields=("pressure",)))

    return annotate(with_grid_error(dataset, height, again)).drop_vars(needed)


def _press(
    height: xr.DataArray,
    material: Material,
    program: Program,
    settings: Settings,
    progress: bool | Progress = False,
    keeper: CheckpointWriter | None = None,
) -> xr.Dataset:
    began = time.perf_counter()
    shape, area, held = (height.sizes["x"], height.sizes["y"]), nominal_area(height), keeper is None
    require_memory(shape, settings, material, program, in_memory=held, heights=height.values, area=area)
    mirror = settings.method == "fast" and not program.slides
    ground = Ground(height, settings.missing, follow=uses_window(settings), mirror=mirror, kernel=settings.kernel)
    scene, choice = build_scene(ground, material, program, settings)
    followed = not ground.window.whole
    log.info("memory: %s", choice.note)
    if keeper is not None:
        scene = _grown(scene, ground, keeper.latest.growths)
    rows = Rows(ground, settings, RowsInMemory() if keeper is None else keeper.rows, choice.series_error)
    from roughvisc.study.progress import reporting  # slow to import

    with reused(), reporting(progress, "pressing") as report:
        _march(scene, ground, rows, settings, began, report, keeper)
    if not len(rows):
        raise ConvergenceError("no step was accepted at a kept time: expected a program with at least one segment")
    dataset = rows.dataset()
    described = {
        "memory": choice.note,
        "series_error": choice.series_error,
        **settings.kernel.described(),
        "body_note": _body_note(ground, scene, settings, dataset),
        "material_note": complete(material).note,
        "program_note": program.note,
        "slide_note": slide_note(program, ground.spacing),
        "accuracy_note": accuracy_note(scene, dataset),
        "slope_note": _slope_note(ground, settings, dataset),
        "border_note": _border_note(ground, settings, dataset),
        "edge": "accept" if settings.edge == "accept" else "",
        "edge_note": _edge_note(rows.border),
        "wake_note": _wake_note(ground, scene, dataset),
        "left_out": left_out(choice, settings, followed, ground.mirrored),
        **_for_the_audit(scene, height, material),
    }
    dataset.attrs |= {name: value for name, value in described.items() if value != ""}
    return dataset


def _for_the_audit(scene: Scene, height: xr.DataArray, material: Material) -> dict[str, Any]:
    """What an audit asks that the variables do not say, so that a result without a study can be audited too."""
    return {
        "compliance_at_once": scene.compliance(0.0),
        "compliance_at_end": scene.final,
        "poisson": "" if separability_error(material) else complete(material).poisson,
        "time_scale": scene.program.time_scale,
        "recipe": str(height.attrs.get("recipe", "")),
    }


def _grown(scene: Scene, ground: Ground, growths: int) -> Scene:
    """The scene on the grid that an interrupted run had come to."""
    for _ in range(growths):
        larger = ground.enlarge(scene)
        assert larger is not None, "it grew before"
        scene = larger[0]
    return scene


def _march(
    scene: Scene,
    ground: Ground,
    rows: Rows,
    settings: Settings,
    began: float,
    report: Progress,
    keeper: CheckpointWriter | None,
) -> None:
    """March to the end of the program; the rows take up what is kept, the keeper how far it has come."""
    reached = Checkpoint() if keeper is None else keeper.latest
    assert reached.state is None or isinstance(reached.state, State), "the key tells a program from a curve"
    spent = reached.wall_time - began
    every = scene.times is None
    kept = set(scene.program.corners if scene.times is None else scene.times)
    for step in march(scene, reached.state) if settings.method == "fast" else march_seed(scene):
        rows.watch_border(step)
        reached = reached.after(step, ground.growths, spent + time.perf_counter())
        # of every step those that keep the tolerance: the first ones from rest cannot, relative to themselves
        if step.shown.time in kept or (every and meets_tolerance(step, rows.series_error)):
            rows.add(step, reached.converged, reached.wall_time)
            reached = reached.kept()
        elif not every and is_end_value(step):
            rows.add(step, step.converged, reached.wall_time, kept=False)
            reached = reached.noted()
        report(step.shown.time, scene.program.duration)
        if keeper is not None and settings.method == "fast":
            keeper.passed(reached)
        else:
            reached = replace(reached, state=None)
        del step  # its fields are not needed while the next one is computed


def _slope_note(ground: Ground, settings: Settings, dataset: xr.Dataset) -> str:
    """What to say of a surface that is too steep where it was loaded, in the log too."""
    deepest = float(dataset["approach"].max()) - ground.least_gap  # below the highest cell
    note = slope_note(ground.height[ground.window.surface_cells], settings.boundary, deepest)
    if note:
        log.warning("%s", note)
    return note


def _body_note(ground: Ground, scene: Scene, settings: Settings, dataset: xr.Dataset) -> str:
    (nx, ny), (dx, dy) = ground.height.shape, ground.spacing
    largest = (float(dataset[name].max()) for name in ("force", "approach"))
    return body_note(settings.kernel, settings, (nx * dx, ny * dy), scene.final, *largest)


def _wake_note(ground: Ground, scene: Scene, dataset: xr.Dataset) -> str:
    """What to say of a contact that stands alone and slides into the wake of the one before, in the log too."""
    segments = [(one, one.slide) for one in scene.program.segments if one.slide is not None]
    if not segments:
        return ""
    notes, alone = [], surface_stands_alone(ground.height)
    for axis, side in enumerate(ground.spacing):
        period = ground.height.shape[axis] * side
        strokes = [(slide.distance, slide.distance / one.duration) for one, slide in segments if slide.axis == axis]
        if sum(distance for distance, _ in strokes) < period / 2:  # it does not come as far as the next wake
            continue
        single = alone
        if single is None and "pressure" in dataset:
            single = contact_stands_alone(dataset["pressure"][-1].values, axis)
        if single:
            left = {speed: creep_left(scene.compliance(period / speed), scene.final) for _, speed in strokes}
            notes.append(wake_note(left, period))
    note = " ".join(filter(None, notes))
    if note:
        log.warning("%s", note)
    return note


def _border_note(ground: Ground, settings: Settings, dataset: xr.Dataset) -> str:
    """What to say of a periodic surface whose opposite borders do not meet, in the log too."""
    if settings.boundary != "periodic" or ground.mirrored:
        return ""
    note = border_note(ground.height, dataset)
    if note:
        log.warning("%s", note)
    return note


def _edge_note(time: float | None) -> str:
    """What to say of contact at the border of a free-space domain, in the log too."""
    if time is None:
        return ""
    note = edge_note(time)
    log.warning("%s", note)
    return note
