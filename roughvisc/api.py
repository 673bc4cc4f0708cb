"""Entry points of the package: loading, steady sliding and a case of a study, each with one Dataset as its result."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.experiment.base import Experiment
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.problem import Problem
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.labels import warnings_of
from roughvisc.mechanics.adhesion import Adhesion
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.heating import Heating
from roughvisc.mechanics.materials.material import Material
from roughvisc.mechanics.program import Direction, Program
from roughvisc.settings import Boundary, Edge, Missing, Numerics, Settings
from roughvisc.solve import Progress, solve
from roughvisc.units import Quantity, quantities

if TYPE_CHECKING:
    from roughvisc.study.case import Case

log = logging.getLogger("roughvisc")


def simulate(
    height: xr.DataArray,
    material: Material | Body,
    program: Program,
    *,
    boundary: Boundary = Settings.boundary,
    tolerance: float = Settings.tolerance,
    times: int | Sequence[float | str] | str | None = Settings.times,
    fields: Sequence[str] | str = Settings.fields,
    missing: Missing = Settings.missing,
    edge: Edge = Settings.edge,
    grid_error: bool | Literal["auto"] = Settings.grid_error,
    adhesion: Adhesion | None = None,
    numerics: Numerics = Numerics(),
    threads: int | None = None,
    progress: bool | Progress = True,
) -> xr.Dataset:
    """Press a rigid profile on a linear viscoelastic body: a half-space, a sheet, layers, or a body of your own.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        Profile, peaks up, with cell-centre coordinates; or a Dataset with the profile as ``height``. A stated unit of
        length of heights or coordinates is converted; without a unit they are metres. The undeformed gap is
        ``max(height) - height``; for an indenter it is measured from the apex, which may lie between cells. [m]
    material : Material
        Material of a half-space, such as from :func:`roughvisc.zener` or :func:`roughvisc.creep`; or a body, such as
        from :func:`roughvisc.sheet`. With periodic boundaries and a Poisson ratio below 0.5, the approach on a sheet
        includes its compression.
    program : Program
        Load, nominal pressure or approach against time. A nominal pressure is the load over the whole area of the given
        grid, absent cells included.
    boundary : {"auto", "free", "periodic", "mirror"}
        ``free`` for an indenter; ``mirror`` for a nominally flat scan, which then repeats with its mirror images;
        ``periodic`` for a surface that repeats without mirror images. ``auto`` is ``free`` for the indenters of
        this package, and ``periodic`` for its waves, its self-affine roughness and any surface with its mirror images
        (:func:`roughvisc.mirror`), as long as their heights are unchanged; any other surface needs an explicit choice.
    tolerance : float
        Relative tolerance on ``stated_error`` at each output time: the error of pressure (L1), force and approach from
        time steps, contact solver and exponential series, over the largest force and approach of the kept rows so far.
        If rows exceed it, a ``UserWarning`` and the attribute ``warnings`` count them. The grid error is not included.
    times : int, sequence of float or str, or str, optional
        Output times, reached exactly. A whole number: how many rows, counting time zero and the corners of the program,
        the others where the result changes most. A list, or one text with a unit: the times. None, in a study
        ``"all"``: all corners, every accepted step whose stated error is at most half the tolerance, and all steps of a
        fixed length or of a slide. [s]
    fields : sequence of str, or str
        Fields to keep: any of ``pressure``, ``gap``, ``displacement``.
    missing : {"refuse", "absent"}
        Whether missing heights are an error, or cells without material that never touch.
    edge : {"error", "accept"}
        Whether contact may reach the border of the grid in free space. With "accept" the scan outline is treated as a
        punch, and the attribute ``warnings`` of the result reports contact at the border.
    grid_error : "auto" or bool
        Whether to estimate the grid error from one more run, on cells twice as long: ``grid_error``,
        ``grid_error_area`` and others at the output times. ``auto``: from 256 x 256 to 512 x 512
        cells, if the pressure is kept; then this run takes at most a third of the time of the first.
    adhesion : Adhesion, optional
        Attraction of the surfaces, from :func:`roughvisc.adhesion`: on a half-space, without slides, on the CPU. Loads
        may then be negative, but an approach follows the contact until it separates. An elastic body follows its
        branch. Default: no attraction.
    numerics : Numerics
        Settings that are rarely changed: length of the time steps, device.
    threads : int, optional
        Number of threads for a large grid; the result does not depend on it. Default: the value of
        ``scipy.fft.set_workers``, or else all cores that the process may use, but one thread if other threads run or in
        a child process.
    progress : bool or callable
        A progress bar, or a function called with the current time and the length of the program. [s]

    Returns
    -------
    xarray.Dataset
        As described in :mod:`roughvisc.variables`.

    Raises
    ------
    InputError
        If the input is invalid; the message states the invalid value and the valid ones.
    TooLargeError
        If the computation needs more memory than is available; raised before any memory is allocated.
    EdgeContactError
        If contact reached the border of a free-space domain.
    ConvergenceError
        If the contact of a step is not solved; the message states the time, the error and what to try.

    See Also
    --------
    roughvisc.friction, roughvisc.Case, roughvisc.Program, roughvisc.observables.history

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
    settings = {
        "boundary": boundary,
        "tolerance": tolerance,
        "times": times,
        "fields": fields,
        "missing": missing,
        "edge": edge,
        "grid_error": grid_error,
        "adhesion": adhesion,
    }
    return _solved(height, material, Loading(program), settings, numerics, 3, progress=progress, threads=threads)


@quantities(speeds="m/s", load="N", pressure="Pa")
def friction(
    height: xr.DataArray,
    material: Material | Body,
    *,
    speeds: Sequence[Quantity] | Quantity,
    load: Quantity | None = None,
    pressure: Quantity | None = None,
    direction: Direction = "x",
    boundary: Boundary = Settings.boundary,
    tolerance: float = Settings.tolerance,
    fields: Sequence[str] | str = (),
    grid_error: bool | Literal["auto"] = Settings.grid_error,
    heating: Heating | None = None,
    numerics: Numerics = Numerics(),
    threads: int | None = None,
    progress: bool | Progress = True,
) -> xr.Dataset:
    """Compute the friction of a rigid profile that slides steadily on a viscoelastic body, with periodic boundaries.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        Profile, peaks up, with cell-centre coordinates and no missing points. [m]
    material : Material
        Material of a half-space, or a body, as in :func:`roughvisc.simulate`. Its compliance must be finite at long
        times, unless the profile is uniform across the motion. Shift factors of a temperature act as factors of the
        speed.
    speeds : float or str, or sequence of float or str
        Sliding speeds. [m/s]
    load, pressure : float or str
        Load [N] or nominal pressure [Pa]; give one.
    direction : {"x", "-x", "y", "-y"}
        Direction of motion of the profile.
    boundary : {"auto", "periodic", "mirror"}
        ``mirror``: the surface is unfolded first, by :func:`roughvisc.mirror`, and the result has four times the cells;
        expects a nominal pressure. ``auto`` is ``periodic``.
    tolerance : float
        Tolerance on the iteration errors of pressure (L1, over the load) and friction (relative).
    fields : sequence of str, or str
        Fields to keep: any of ``pressure`` and ``gap``, in the frame of the profile.
    grid_error : "auto" or bool
        Whether to estimate the grid errors ``grid_error_friction`` and ``grid_error_area`` from the same curve on cells
        twice and four times as long. It takes about a third more time. ``auto``: from
        256 x 256 to 512 x 512 cells.
    heating : Heating, optional
        Heat of sliding: the body has the temperature in the mean spot that the heat of friction makes, found by
        iteration; see Notes. Default: friction does not change the temperature.
    numerics : Numerics
        Settings that are rarely changed; here the device.
    threads : int, optional
        As in :func:`roughvisc.simulate`.
    progress : bool or callable
        A progress bar, or a function called with the number of finished speeds and the total number.

    Returns
    -------
    xarray.Dataset
        Variables over ``speed``, in the given order, as declared in :data:`roughvisc.variables.VARIABLES`.

    Raises
    ------
    InputError
        If the input is invalid, or the material creeps without limit and the profile varies across the motion.
    ConvergenceError
        If the contact at a speed is not solved; the message states the speed, the error and what to try.

    See Also
    --------
    roughvisc.simulate, roughvisc.SteadySliding, roughvisc.plot.friction, roughvisc.friction_theory

    Notes
    -----
    In the steady state the friction force times the speed equals the power dissipated in the material. The force is
    computed from this power. At low speed the sum of pressure times slope is the difference of two large forces. The
    force across the motion, ``friction_force_across``, is computed in the same way.

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
    curve = SteadySliding(speeds=speeds, load=load, pressure=pressure, direction=direction, heating=heating)
    settings = {"boundary": boundary, "tolerance": tolerance, "fields": fields, "grid_error": grid_error}
    result = _solved(height, material, curve, settings, numerics, 4, progress=progress, threads=threads)
    return result.assign_attrs(title="Steady sliding")


def _solved(
    height: xr.DataArray,
    material: Material | Body,
    experiment: Experiment,
    settings: dict[str, Any],
    numerics: Numerics,
    level: int,
    **options: Any,
) -> xr.Dataset:
    """Return the result of an experiment, with options of :func:`roughvisc.solve.solve`.

    Missed tolerances and sparse tables become Python warnings at a level of the stack; other warnings are logged.
    """
    if not isinstance(numerics, Numerics):
        raise InputError(key="numerics", found=numerics, expected="rv.Numerics(...)")
    body = material if isinstance(material, Body) else Body(material)
    problem = Problem(height, body, Settings(**vars(numerics), **settings))
    dataset = solve(problem, experiment, **options)
    for subject, text in warnings_of(dataset.attrs).items():
        if subject in ("tolerance", "material"):
            warnings.warn(text, UserWarning, level)
        else:
            log.warning("%s", text)
    return dataset


def run(
    case: Case | str | Path,
    out: str | Path | None = None,
    *,
    want: Mapping[str, Quantity] | None = None,
    progress: bool | Progress = True,
    threads: int | None = None,
) -> xr.Dataset:
    """Compute one case and store it in a file, with the quantities that ``[observe]`` of the study requests.

    It runs in this process. To run it on a worker of a cluster, use :func:`roughvisc.sweep` with a client.

    Parameters
    ----------
    case : Case or path
        A case, or its study file.
    out : path, optional
        Results folder. Default: ``results/`` and the name of the study, next to the study.
    want : dict, optional
        Wanted relative errors of numbers at 95 %, such as ``{"friction_coefficient": "1 %"}``, and known errors as
        :func:`roughvisc.budget` takes them, such as ``{"modulus_error": "5 %"}``. The grid and the tolerance are then
        chosen, and the grid and tolerance of the case are not used. Default: the case is not changed.
    progress : bool or callable
        A progress bar, or a function called with the current time and the length of the program. [s]
    threads : int, optional
        Number of threads for a large grid; see :func:`roughvisc.simulate`.

    Returns
    -------
    xarray.Dataset
        The result over ``(time, x, y)``; fields are read from its file when they are needed. The file is
        ``ds.encoding["source"]``, named by the key of the case. A finished case is not computed again, and an
        interrupted one is resumed. With `want` it is the result of the chosen case: the attribute ``choice`` states
        the choice and its reasons, and the budgets are in the folder ``budget`` next to the file.

    Raises
    ------
    InputError
        If the input is invalid, or the folder holds the sweep of another study; nothing is written. If a wanted error
        cannot be reached: the message states the smallest error that can be reached, and its sources. If a quantity in
        ``[observe]`` cannot be computed from the result; the result is kept.
    TooLargeError
        If the case needs more memory than is available. It is refused before any memory is allocated, and no failure is
        recorded.
    ConvergenceError
        If the contact of a step or at a speed is not solved; no result is written.

    See Also
    --------
    roughvisc.simulate, roughvisc.sweep, roughvisc.Case, roughvisc.open_result

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ds = rv.run(case, folder, progress=False).load()
    >>> ds.attrs["case_key"] == case.key
    True
    """
    from roughvisc.runs.netcdf import open_result
    from roughvisc.runs.run import result_folder
    from roughvisc.runs.sweep import run_one
    from roughvisc.study.case import case_given

    stated = case_given(case)
    if want is None:
        return open_result(run_one(stated, result_folder(stated, out), progress=progress, threads=threads))
    from roughvisc.judge import wanted_accuracy as target

    return target.run(stated, out, want=want, progress=progress is not False, threads=threads)
