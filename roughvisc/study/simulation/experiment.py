"""What a case asks to be done with a surface, carried out: one experiment gives one Dataset."""

from __future__ import annotations

from collections.abc import Callable

import xarray as xr
from scipy import fft

from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.stepping.program import Program
from roughvisc.study.simulation.available import threads_for
from roughvisc.study.simulation.friction import rub
from roughvisc.study.simulation.simulate import press
from roughvisc.study.statement.curve import SteadySliding
from roughvisc.study.statement.settings import Settings
from roughvisc.study.storage.checkpoint import CheckpointWriter


def carry_out(
    experiment: Program | SteadySliding,
    height: xr.DataArray,
    material: Material,
    settings: Settings,
    *,
    progress: bool | Callable[[float, float], None],
    keeper: CheckpointWriter | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Press a surface through a program, or slide it at the speeds of a curve.

    Parameters
    ----------
    experiment : Program or Curve
        What is done.
    height : xarray.DataArray, dims (x, y)
        Profile, peaks up. [m]
    material : Material
        Of the body.
    settings : Settings
        How it is computed and what is kept.
    progress : bool or callable
        A progress bar, or a function called with how far it is of how much.
    keeper : Keeper, optional
        Takes to the disk what is computed, and knows where to go on from.
    threads : int, optional
        As :func:`roughvisc.simulate` has them.

    Returns
    -------
    xarray.Dataset
        Over ``time``, as :func:`roughvisc.simulate` gives it, or over ``speed``, as :func:`roughvisc.friction` does.
    """
    if isinstance(experiment, SteadySliding):
        with fft.set_workers(threads_for(threads)):
            return rub(height, material, experiment, settings, progress=progress, keeper=keeper)
    return press(height, material, experiment, settings, progress=progress, keeper=keeper, threads=threads)
