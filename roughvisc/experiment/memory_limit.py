"""Memory of a run: available memory, memory of a run, and the refusal of a run that does not fit."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from roughvisc.errors import TooLargeError
from roughvisc.experiment.accuracy import memory_of
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.grid import arrays_of
from roughvisc.mechanics.heap import FROM_HEAP
from roughvisc.mechanics.memory import LayerMemory, Memory
from roughvisc.mechanics.program import Program
from roughvisc.mechanics.scene import SOFT
from roughvisc.mechanics.stepping import PACKED_FROM
from roughvisc.settings import Settings, attraction
from roughvisc.topography.grid import counts
from roughvisc.units import format_quantity

#: Part of the available memory that a case may take.
PART = 0.9
#: Interpreter and libraries, measured. [byte]
PROCESS = 190e6
#: Number of cells from which the memory is checked: a smaller run takes less than 100 MB.
WORTH_ASKING = 512**2
#: Cells of the shorter side of the smallest grid that a refusal recommends.
_FEWEST = 64


@dataclass(frozen=True)
class Available:
    """Memory available to this process.

    Attributes
    ----------
    size : float
        Size. [byte]
    words : str
        Origin of the limit, as the end of a sentence that begins with the size.
    """

    size: float
    words: str


def memory_available(device: str = "cpu") -> Available:
    """Return the memory of a device that is available to this process, and the origin of the limit."""
    if device == "gpu":
        xp = arrays_of(device)
        kept = xp.get_default_memory_pool().free_bytes()  # of earlier runs in this process, which this one reuses
        return Available(float(xp.cuda.runtime.memGetInfo()[0] + kept), "free on the GPU")
    import psutil
    from distributed import get_worker  # slow to import
    from distributed.system import MEMORY_LIMIT

    taken = psutil.Process().memory_info().rss
    limits = [
        Available(float(psutil.virtual_memory().available), "free in this machine"),
        Available(float(MEMORY_LIMIT - taken), "left of the limit of this machine or container"),
    ]
    with suppress(ValueError):  # raised outside a Dask worker
        limit = get_worker().memory_manager.memory_limit
        if limit:
            limits.append(Available(float(limit - taken), "left of the Dask worker's memory limit"))
    return min(limits, key=lambda one: one.size)


# ---------------------------------------------------------------------------------------------------- memory of a run

#: Fields of a surface in a run (heights, gaps and the mask of present cells), and of one that is generated or read.
_SURFACE = 2.1
_MADE = 4.0
#: Fields of a contact problem and its time step, and additional fields for contact on all cells.
_SOLVE = 8.4
_IN_CONTACT = 13.5
#: Fields of operator and spectrum, and of both on the whole surface if the domain is smaller.
_TRANSFORMS = {"periodic": 1.5, "mirror": 1.5, "free": 6.0}
_WHOLE = 6.0
#: Memory of the transforms over these fields: cuFFT also has work areas (not measured).
_PLANS = {"cpu": 1.0, "gpu": 3.0}
#: Number of solutions (pressure and displacement) and number of copies of each exponential at the peak. The first row
#: is without memory. The second is for a pair of steps with its coarse solution and first guesses. The third is for a
#: pair of soft steps, with the ends of its steps and the exponentials of the step before.
_ELASTIC = (2, 0)
_PAIR = (5, 5)
_SOFT_PAIR = (7, 9)
#: Fields of an exponential if the compliances depend on the wave: a spectrum, padded in free space.
_SPECTRUM = {"periodic": 1.1, "mirror": 1.1, "free": 4.2}
#: Fields of a friction curve, measured at 256 x 250: operators, Newton's steps, the vectors of GMRES that are in use; a
#: GPU holds all 61.
_CURVE = {"cpu": 27.0, "gpu": 82.0}
#: Fields of a contact with adhesion, whose unknowns are all points of the transforms (measured at 256 x 256).
_ADHESIVE = {"periodic": 20.0, "mirror": 21.0, "free": 70.0}
#: Contact fraction below which a contact is sparse.
SPARSE = 0.05


def march_bytes(
    settings: Settings, memory: Memory, cells: float, *, contact: float = SPARSE, rows: float = 0.0, part: float = 1.0
) -> float:
    """Return the memory of a loading at its peak, without interpreter and libraries.

    Parameters
    ----------
    settings : Settings
        Settings of the solve.
    memory : Memory
        Memory of the body.
    cells : float
        Number of cells of the surface.
    contact : float
        Largest contact fraction.
    rows : float
        Number of rows whose fields stay in memory, as in :func:`roughvisc.simulate`; others go to a file.
    part : float
        Part of the cells that the domain covers.

    Returns
    -------
    float
        Memory. [byte]

    Notes
    -----
    The numbers of fields are measured by ``workflows/benchmarks/memory.py``. At the end the fields kept in memory are
    copied into one array, while half the memory of the solve is still in use. Large ones are freed one by one; the
    memory of small ones does not return to the system. Packed pressures take little memory until then.
    """
    exponentials = memory.times.size
    layered = isinstance(memory, LayerMemory)
    # a smaller domain also keeps the pressure that causes the displacement
    kept = _SPECTRUM[settings.boundary] if layered else 1.0 if part == 1 else 2.0
    crept = memory.glassy + float(memory.compliances[np.isfinite(memory.times)].sum())
    solutions, copies = _ELASTIC if memory.is_elastic else _SOFT_PAIR if crept >= SOFT * memory.glassy else _PAIR
    solved = _SOLVE + _TRANSFORMS[settings.boundary] * _PLANS[settings.device] + _IN_CONTACT * contact
    if attraction(settings) is not None:
        solved += _ADHESIVE[settings.boundary]
    can_pack = attraction(settings) is None and part * cells >= PACKED_FROM
    is_packed = can_pack and contact < 0.5  # a pressure takes 18 bytes per contact cell (measured)
    solved += solutions * ((2.25 * contact if is_packed else 1.0) + kept) + copies * kept * exponentials
    if layered:
        solved += 0.5 * kept * (exponentials + 1)  # symbols
    frames = rows * len(settings.fields)
    surface = _SURFACE + (_WHOLE if part < 1 else 0.0)
    packed = rows if is_packed and part == 1 and "pressure" in settings.fields else 0.0
    dense = frames - packed
    copied = frames + (dense if 8 * cells <= FROM_HEAP else 1.0)
    return 8.0 * cells * (surface + part * solved / 2 + max(part * solved / 2 + dense, copied))


def curve_bytes(settings: Settings, cells: float) -> float:
    """Return the memory of a friction curve at its peak, without interpreter and libraries. [byte]"""
    unfolded = 4 if settings.boundary == "mirror" else 1
    return (_CURVE[settings.device] + len(settings.fields)) * 8.0 * cells * unfolded


# ------------------------------------------------------------------------------------------------------------- refusal


def require_loading(shape: tuple[int, int], program: Program, settings: Settings, body: Body, in_memory: bool) -> None:
    """Check that a loading fits in memory if its contact stays sparse; its fields may stay in memory.

    Raises
    ------
    TooLargeError
        If it does not fit. The message gives the needed and the available memory, and a grid that fits.
    """
    memory = memory_of(body, program, settings)
    times = program.segments if settings.times is None else settings.times  # one row for each segment, or more
    rows = times if isinstance(times, int) else len(times)
    rows = rows if in_memory and settings.device == "cpu" else 0  # kept fields are on the host
    is_free = settings.boundary == "free" and settings.edge == "error" and attraction(settings) is None
    share = 0.0 if is_free and not body.kernel.raises_surface else 1.0  # the domain is not known yet
    require_memory(shape, partial(march_bytes, settings, memory, rows=rows, part=share), settings.device)


def require_surface(shape: Any) -> None:
    """Check that a surface can be made in the available memory. [cells]"""
    require_memory(counts("shape", shape), lambda cells: 8.0 * _MADE * cells)


def require_memory(shape: tuple[int, int], needed: Callable[[float], float], device: str = "cpu") -> None:
    """Check that a case fits in the available memory of a device; see :func:`too_large` for the parameters.

    Raises
    ------
    TooLargeError
        If it does not fit. The message gives the needed and the available memory, and a grid that fits.
    """
    if math.prod(shape) >= WORTH_ASKING and (why := too_large(shape, needed, memory_available(device))):
        raise TooLargeError(why)


def too_large(shape: tuple[int, int], needed: Callable[[float], float], there: Available) -> str:
    """Return a message that a case does not fit in memory, with a grid that would; empty if it fits.

    Parameters
    ----------
    shape : tuple of int
        Numbers of cells of the surface.
    needed : callable
        Needed memory by the number of cells. [byte]
    there : Available
        Available memory.
    """
    size = needed(math.prod(shape))
    fits = PART * there.size
    if size <= fits:
        return ""
    fitting = "expected more memory, or a coarser grid"
    for stride in range(2, max(min(shape) // _FEWEST, 1) + 1):
        few = [math.ceil(count / stride) for count in shape]
        if needed(math.prod(few)) <= fits:
            fitting = f"{few[0]} x {few[1]} cells would fit (resample = {few} under [surface], rv.resample in Python)"
            break
    lacking = f"{shape[0]} x {shape[1]} cells need about {amount(size)} of memory, and {amount(there.size)}"
    return f"{lacking} are {there.words}: {fitting}"


def amount(size: float) -> str:
    """Return a number of bytes in words.

    Examples
    --------
    >>> amount(2.13e9), amount(350e6), amount(-1)
    ('2.1 GB', '350 MB', '0 B')
    """
    return format_quantity(float(f"{max(size, 0.0):.2g}"), "B")
