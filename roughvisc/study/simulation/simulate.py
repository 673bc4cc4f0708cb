"""One surface, one material, one program -> one Dataset ``(time, x, y)``."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from typing import Any, Literal

import xarray as xr

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.mechanics.halfspace.kernel import Kernel
from roughvisc.mechanics.halfspace.love import HALF_SPACE
from roughvisc.mechanics.halfspace.operator import Boundary
from roughvisc.mechanics.hereditary.choice import Kind
from roughvisc.mechanics.materials.completed import complete
from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.stepping.march import march
from roughvisc.mechanics.stepping.program import Program
from roughvisc.mechanics.stepping.seed import march_seed
from roughvisc.study.simulation.grid_error import with_grid_error
from roughvisc.study.simulation.malloc import expect_arrays
from roughvisc.study.simulation.notes import accuracy_note, left_out, slope_note
from roughvisc.study.simulation.rows import Rows, keeps_its_word
from roughvisc.study.simulation.scene import Ground, follows, prepare
from roughvisc.study.storage.checkpoint import Keeper, Reached
from roughvisc.study.storage.records import RowsInMemory
from roughvisc.variables import FIELDS, annotate

log = logging.getLogger("roughvisc")

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
    memory: Kind = "auto",
    grid_error: bool = False,
    kernel: Kernel = HALF_SPACE,
    progress: bool | Progress = True,
) -> xr.Dataset:
    """Press a rigid profile on a linear viscoelastic half-space.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        Profile, peaks up, with cell-centre coordinates. The undeformed gap is ``max(height) - height``; an indenter's
        counts from its apex, wherever that lies between the cells. [m]
    material : Material
        Of the half-space: one of roughvisc's, or any object with the two functions that
        :class:`roughvisc.mechanics.materials.models.Material` asks for.
    program : Program
        Load or approach against time.
    boundary : {"free", "periodic"}
        ``free`` for an indenter, ``periodic`` for a nominally flat scan.
    tolerance : float
        Asked of ``stated_error`` at every kept time: the error that time steps, contact solver and series leave of
        pressure (L1), force and approach, over the largest force and approach so far. Rows that miss it state by how
        much, and ``accuracy_note`` counts them; the error of the grid comes on top.
    time_step : "auto" or float
        Steps chosen by the tolerance, or of a given length. [s]
    times : int or sequence of float, optional
        Times to keep, stepped onto exactly: a count, evenly from 0+ to the end; a list; or None, all corners of the
        program and every accepted step that keeps the tolerance. [s]
    fields : sequence of str
        Fields to keep, of ``pressure``, ``gap``, ``displacement``.
    method : {"fast", "seed"}
        ``seed`` is the seed paper's algorithm, slips corrected and not accelerated.
    missing : {"refuse", "absent"}
        Missing heights are an error, or cells without material that never touch.
    edge : {"error", "accept"}
        In free space, whether contact may reach the border of the grid.
    memory : {"auto", "direct"}
        ``direct`` keeps every past pressure, whatever the material: dearer, and independent of any series.
    grid_error : bool
        Whether to compute the history again on cells twice and four times as long, and to bound by it the error that
        the grid makes: ``grid_error`` and ``grid_error_area`` at the kept times.
    kernel : Kernel
        Of the body that is pressed, if it is no half-space: see :class:`roughvisc.mechanics.halfspace.kernel.Kernel`.
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
    return press(
        height,
        material,
        program,
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
        kernel=kernel,
        progress=progress,
    )


def press(
    height: xr.DataArray,
    material: Material,
    program: Program,
    *,
    fields: Sequence[str],
    grid_error: bool,
    progress: bool | Progress,
    keeper: Keeper | None = None,
    **settings: Any,
) -> xr.Dataset:
    """As :func:`simulate`; a keeper takes to the disk what is computed, and knows where to go on from.

    The seed paper's algorithm keeps all past pressures and is not checkpointed: an interrupted run begins again.
    """
    needed = ("pressure",) if grid_error and "pressure" not in fields else ()
    given = {"fields": (*fields, *needed), "keeper": keeper, "progress": progress}
    dataset = _press(height, material, program, **given, **settings)
    if not grid_error:
        return dataset

    def again(few: xr.DataArray, times: list[float]) -> xr.Dataset:
        given = {"fields": ("pressure",), "keeper": None, "progress": False}
        return _press(few, material, program, **given, **{**settings, "times": times})

    return annotate(with_grid_error(dataset, height, again)).drop_vars(needed)


def _press(
    height: xr.DataArray,
    material: Material,
    program: Program,
    *,
    boundary: Boundary,
    tolerance: float,
    time_step: float | Literal["auto"],
    times: int | Sequence[float] | None,
    fields: Sequence[str],
    method: Method,
    missing: Literal["refuse", "absent"],
    edge: Literal["error", "accept"],
    memory: Kind,
    kernel: Kernel,
    progress: bool | Progress,
    keeper: Keeper | None,
) -> xr.Dataset:
    began = time.perf_counter()
    ground = Ground(height, missing, follow=follows(boundary, edge, method), mirror=method == "fast", kernel=kernel)
    expect_arrays(ground.gap.nbytes)
    scene, engine = prepare(
        ground,
        material,
        program,
        boundary=boundary,
        tolerance=tolerance,
        time_step=time_step,
        times=times,
        edge=edge,
        memory=memory,
    )
    followed = not ground.window.whole
    unknown = [name for name in fields if name not in FIELDS]
    if unknown:
        raise InputError(f"fields holds {unknown[0]!r}: expected some of {', '.join(FIELDS)}")
    if method not in ("fast", "seed"):
        raise InputError(f"method is {method!r}: expected 'fast' or 'seed'")
    log.info("memory: %s", engine.note)
    reached = Reached() if keeper is None else keeper.saved
    for _ in range(reached.growths):
        larger = ground.enlarge(scene)
        assert larger is not None, "it grew before"
        scene = larger[0]
    rows = Rows(ground, fields, RowsInMemory() if keeper is None else keeper.rows, tolerance, engine.series_error)
    spent = reached.wall_time - began
    kept = set(program.corners if scene.times is None else scene.times)
    every = scene.times is None
    report, close = _reporter(progress)
    try:
        for step in march(scene, reached.state) if method == "fast" else march_seed(scene):
            scene = step.scene
            reached = reached.after(step, ground.growths, spent + time.perf_counter())
            # of every step those that keep the tolerance: the first ones from rest cannot, relative to themselves
            if step.shown.time in kept or (every and keeps_its_word(step, engine.series_error)):
                rows.add(step, reached.converged, reached.wall_time)
                reached = reached.kept()
            report(step.shown.time, scene.program.duration)
            if keeper is not None and method == "fast":
                keeper.passed(reached)
            del step  # its fields are not needed while the next one is computed
    finally:
        close()
    if not len(rows):
        raise ConvergenceError("no step was accepted at a kept time: expected a program with at least one segment")
    dataset = rows.dataset(scene, method)
    deepest = float(dataset["approach"].max()) - ground.least_gap  # below the highest cell
    described = {
        "memory": engine.note,
        "series_error": engine.series_error,
        "kernel": "" if kernel == HALF_SPACE else repr(kernel),
        "material_note": complete(material).note,
        "accuracy_note": accuracy_note(scene, dataset),
        "slope_note": slope_note(ground.domain[ground.window.cells], boundary, deepest),
        "left_out": left_out(engine, boundary, method, fields, times is None, followed, ground.mirrored),
    }
    if described["slope_note"]:
        log.warning("%s", described["slope_note"])
    dataset.attrs |= {name: value for name, value in described.items() if value != ""}
    return dataset


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
