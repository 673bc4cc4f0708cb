"""What a solve takes and what there is: cores and memory, and the refusal of what does not fit before it is made."""

from __future__ import annotations

import math
import multiprocessing
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy import fft

from roughvisc.errors import InputError, TooLargeError
from roughvisc.experiment.scene import memory_options
from roughvisc.mechanics.layer_memory import LayerMemory
from roughvisc.mechanics.memory import Memory
from roughvisc.mechanics.memory_choice import choose_memory
from roughvisc.mechanics.program import Program
from roughvisc.mechanics.stepping import SOFT
from roughvisc.problem import Problem
from roughvisc.recorder import chunks
from roughvisc.settings import Settings
from roughvisc.topography.grid import counts, nominal_area

_PROC_SELF, _GROUPS = Path("/proc/self"), Path("/sys/fs/cgroup")
#: Files of a control group: its limit, what is used, and what of that is a cache of files that may go at any time.
_FILES = {
    "memory": ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    "": ("memory.max", "memory.current", "inactive_file"),
}
#: Part of the memory there is that a case may take.
PART = 0.9


@dataclass(frozen=True)
class Available:
    """Memory that may yet be taken.

    Attributes
    ----------
    size : float
        [byte]
    words : str
        Whose limit that is, as the end of a sentence that begins with the size.
    """

    size: float
    words: str

    def fits(self, needed: float) -> bool:
        """Whether so much may be taken of it. [byte]"""
        return needed <= PART * self.size


def memory_available() -> Available:
    """Memory that this process may yet take, and what limits it."""
    return min([*_machine(), *_groups(), *_own(), *_worker()], key=lambda one: one.size)


def _machine() -> Iterator[Available]:
    import psutil

    yield Available(float(psutil.virtual_memory().available), "free in this machine")


def _groups() -> Iterator[Available]:
    """What the control groups of this process leave, of version 1 and 2, up to the outermost."""
    try:
        lines = (_PROC_SELF / "cgroup").read_text().split()
    except OSError:  # no Linux
        return
    for line in lines:
        _, kind, path = line.split(":", 2)
        if kind not in _FILES:
            continue
        root = _GROUPS / kind
        group = root / path.lstrip("/")
        for folder in {root, group, *(place for place in group.parents if root in place.parents)}:
            with suppress(OSError, ValueError):  # not to be seen from inside a container, or without a limit
                limit, used, cache = _FILES[kind]
                counts = dict(line.split() for line in (folder / "memory.stat").read_text().splitlines())
                taken = int((folder / used).read_text()) - int(counts.get(cache, 0))
                yield Available(float(int((folder / limit).read_text()) - taken), "left of the container's limit")


def _own() -> Iterator[Available]:
    """What is left of the address space that the process may have."""
    with suppress(ImportError):  # there is none on Windows
        import resource

        import psutil

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            yield Available(
                float(limit - psutil.Process().memory_info().vms), "left of this process's limit (ulimit -v)"
            )


def _worker() -> Iterator[Available]:
    worker = _dask_worker()
    limit = getattr(getattr(worker, "memory_manager", None), "memory_limit", None)
    if limit:
        import psutil

        taken = psutil.Process().memory_info().rss
        yield Available(float(limit - taken), "left of the Dask worker's memory limit")


def _dask_worker() -> Any:
    """The worker whose task this is; None where it is none."""
    distributed = sys.modules.get("distributed")
    if distributed is not None:
        with suppress(ValueError):
            return distributed.get_worker()
    return None


def cores() -> int:
    """Cores that this process may use."""
    from dask.system import CPU_COUNT

    return int(CPU_COUNT)


def threads_for(asked: int | None) -> int:
    """Threads of a case that is computed here.

    Parameters
    ----------
    asked : int or None
        None: as ``scipy.fft.set_workers`` has it; where nobody has set that, all cores for a case that is alone, in
        the main thread of a process that no other has started, and else one.

    Raises
    ------
    InputError
        If it is no positive whole number.
    """
    if asked is not None:
        if isinstance(asked, bool) or not isinstance(asked, int) or asked < 1:
            raise InputError(f"threads is {asked!r}: expected a whole number of at least 1, or None")
        return asked
    stated = int(fft.get_workers())
    alone = threading.current_thread() is threading.main_thread() and multiprocessing.parent_process() is None
    return cores() if stated == 1 and alone else stated


#: Interpreter and libraries, measured. [byte]
PROCESS = 190e6
#: Fields of the surface: heights, gaps, and the marks of present cells.
_SURFACE = 2.1
#: Fields of a contact problem and of the step around it, and further ones of a contact on all cells.
_SOLVE, _IN_CONTACT = 8.0, 12.0
#: Operator and spectrum.
_TRANSFORMS = {"periodic": 1.5, "mirror": 1.5, "free": 6.0}
#: Operator and spectrum of the whole surface, if a part of it is solved on.
_WHOLE = 6.0
#: Solutions at the peak, a pressure and its displacement each: of a march without memory, and of a pair with its coarse
#: solution and first guesses. A pair of soft steps also has solutions at the ends of its steps.
_SINGLE, _PAIR, _SOFT_ENDS = 4, 9, 2
#: Solutions of a pair that keep exponentials, and those whose exponentials one step ago are kept too, for BDF2.
_KEEPING, _EARLIER = 5, 2
#: Fields of each exponential if each wave has its own compliances: a spectrum, padded in free space.
_SPECTRUM = {"periodic": 1.1, "mirror": 1.1, "free": 4.2}
#: Fields of the state while the file is written, a frame among them.
_STATE = 4.5
#: Rows wait for the disk until they take more. [byte]
_WAITING = 8e6
#: Fields of a curve of friction, measured at 256 x 250: operators, the last steps that are mixed, the contact solver's.
_CURVE = 27.0
#: Contact fraction below which a contact is sparse.
SPARSE = 0.05


def march_bytes(
    settings: Settings,
    cells: float,
    memory: Memory,
    *,
    contact: float = SPARSE,
    rows: float = 1.0,
    part: float = 1.0,
    in_memory: bool = False,
) -> float:
    """Return the memory of a march at its peak, without interpreter and libraries.

    Parameters
    ----------
    settings : Settings
        Of the solve.
    cells : float
        Of the surface.
    memory : Memory
        Of the body.
    contact : float
        Largest contact fraction.
    rows : float
        Kept times.
    part : float
        Part of the cells that is solved on.
    in_memory : bool
        Whether the kept fields stay in memory, as those of :func:`roughvisc.simulate` do; else they go to a file.

    Returns
    -------
    float
        [byte]

    Notes
    -----
    The larger one of the peaks while the contact is solved and while the file is written. The fields are those of
    :mod:`roughvisc.mechanics.stepping`: two solutions with the points before them, and three trial steps. Measured by
    ``workflows/benchmarks/memory.py``.
    """
    field, boundary, count = 8.0 * cells, settings.boundary, memory.times.size
    kept = 1.0 if part == 1 else 2.0  # a part of the surface keeps the pressure that causes the displacement
    solved = _SOLVE + _TRANSFORMS[boundary] + _IN_CONTACT * contact
    if isinstance(memory, LayerMemory):
        kept = _SPECTRUM[boundary]
        solved += 0.5 * kept * (count + 1)  # symbols
    solutions, keeping, earlier, ends = _SINGLE, 0, 0, 0
    if not memory.is_elastic:
        solutions, keeping, earlier = _PAIR, _KEEPING, _EARLIER if memory.may_ring else 0
        crept = memory.glassy + float(memory.compliances[np.isfinite(memory.times)].sum())
        ends = _SOFT_ENDS if memory.glassy <= SOFT * crept else 0
    solved += (1 + kept) * (solutions + ends) + count * kept * (1 + keeping + ends + earlier)
    state = _STATE + 2 * kept * count * (1 + memory.may_ring)
    surface = (_SURFACE + (_WHOLE if part < 1 else 0.0)) * field
    frames = rows * len(settings.fields) * field
    if in_memory:
        return surface + frames + max(part * solved * field, frames)  # they are copied into one array in the end
    layer = chunks((math.ceil(rows), 1, math.ceil(cells)))[0] if rows else 0  # is written at a time
    waiting = min(max(rows - 1, 0) * len(settings.fields) * field, _WAITING)
    return surface + max(part * solved * field + waiting, (part * state + layer) * field)


def curve_bytes(settings: Settings, cells: float) -> float:
    """Memory of a curve of friction at its peak, without what the process takes in any case. [byte]"""
    return (_CURVE + len(settings.fields)) * 8.0 * cells


#: Cells from which it is asked what memory there is: on fewer a march takes less than 100 MB.
WORTH_ASKING = 512**2
#: No surface is pressed on fewer cells than these without need: the longest stride that is advised leaves them.
_FEWEST = 64
#: Fields of the grid that making or reading a surface takes.
_MADE = 4.0


def require_memory(problem: Problem, program: Program, *, in_memory: bool) -> None:
    """Refuse a march that takes more memory than there is, even if its contact stays sparse.

    Parameters
    ----------
    problem, program : Problem, Program
        Of the case.
    in_memory : bool
        Whether the kept fields stay in memory.

    Raises
    ------
    TooLargeError
        If it does not fit: what it needs, what there is, and what would fit.
    """
    height, body, settings = problem.height, problem.body, problem.settings
    cells = height.size
    if cells < WORTH_ASKING:
        return
    memory = choose_memory(body, **memory_options(program.on_area(nominal_area(height)), settings)).memory
    rows = least_rows(settings, program)
    free = settings.boundary == "free" and settings.edge == "error"
    part = 0.0 if free and body.separates and not body.kernel.raises_surface else 1.0  # of an unknown domain

    def needed(cells: float, settings: Settings = settings, in_memory: bool = in_memory) -> float:
        return march_bytes(settings, cells, memory, rows=rows, part=part, in_memory=in_memory)

    there = memory_available()
    if there.fits(needed(cells)):
        return
    one, periodic = replace(settings, fields=settings.fields[:1]), replace(settings, boundary="periodic")
    savings = []
    if in_memory and there.fits(needed(cells, in_memory=False)):
        savings.append("rv.run, which keeps the fields in a file")
    if in_memory and len(settings.fields) > 1 and there.fits(needed(cells, one)):
        savings.append(f"one kept field in place of {len(settings.fields)}")
    if settings.boundary == "free" and settings.edge == "accept" and there.fits(needed(cells, periodic)):
        savings.append("boundary = 'periodic'")
    raise TooLargeError(too_large((height.sizes["x"], height.sizes["y"]), needed, there, savings))


def require_memory_of_curve(shape: tuple[int, int], settings: Settings) -> None:
    """Refuse a curve of friction on a surface of so many cells that takes more memory than there is."""
    _require(shape, partial(curve_bytes, settings))


def require_surface(shape: tuple[int, int]) -> None:
    """Refuse a surface that has too many cells, or cannot be made in the memory there is. [cells]"""
    counts("shape", shape)
    _require(shape, lambda cells: 8.0 * _MADE * cells)


def _require(shape: tuple[int, int], needed: Callable[[float], float]) -> None:
    """Refuse what needs more memory than there is, by the number of cells. [byte]"""
    cells = math.prod(shape)
    if cells >= WORTH_ASKING and not (there := memory_available()).fits(needed(cells)):
        raise TooLargeError(too_large(shape, needed, there))


def too_large(
    shape: tuple[int, int], needed: Callable[[float], float], there: Available, savings: Sequence[str] = ()
) -> str:
    """What is said of a case that does not fit.

    Parameters
    ----------
    shape : tuple of int
        Cells of the surface.
    needed : callable
        Memory by the number of cells. [byte]
    there : Available
        What there is.
    savings : sequence of str
        What else would make it fit, beside the finest grid of whole strides.
    """
    advice = list(savings)
    for stride in range(2, max(min(shape) // _FEWEST, 1) + 1):
        few = [math.ceil(count / stride) for count in shape]
        size = needed(math.prod(few))
        if there.fits(size):
            wanted = f"{few[0]} x {few[1]} cells, {stride} times as long, need {amount(size)}"
            advice.insert(0, f"{wanted} (resample = {few} under [surface], rv.resample in Python)")
            break
    fitting = f"what would fit: {'; or '.join(advice)}" if advice else "expected more memory, or a coarser grid"
    return (
        f"{shape[0]} x {shape[1]} cells need about {amount(needed(math.prod(shape)))} of memory, and "
        f"{amount(there.size)} are {there.words}: {fitting}"
    )


def least_rows(settings: Settings, program: Program) -> float:
    """Kept times, at least."""
    if settings.times is None:
        return float(len(program.segments))
    return float(settings.times if isinstance(settings.times, int) else len(settings.times))


def amount(size: float) -> str:
    """A number of bytes as one reads it.

    Examples
    --------
    >>> amount(2.13e9), amount(350e6), amount(-1)
    ('2.1 GB', '350 MB', '0 MB')
    """
    return f"{size / 1e9:.2g} GB" if size >= 1e9 else f"{max(size, 0) / 1e6:.0f} MB"
