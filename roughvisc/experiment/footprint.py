"""Memory of a march, counted in fields of its grid (8 bytes a cell) before there is any."""

from __future__ import annotations

import math

from roughvisc.mechanics.fields.threads import is_wide
from roughvisc.mechanics.hereditary.direct import History, history_bytes
from roughvisc.mechanics.hereditary.exponentials import Memory, Modes
from roughvisc.settings import Settings
from roughvisc.variables.chunks import chunks

#: What the interpreter and the libraries take, measured. [byte]
PROCESS = 210e6
#: Fields of the surface: heights and gaps, and the marks of present cells.
_SURFACE = 2.1
#: Fields of a march without a past, what a contact on all cells adds to them, and what a narrow grid adds: transforms
#: of whole fields, and the separation.
_ELASTIC, _IN_CONTACT, _NARROW = 7.0, 11.0, 1.5
#: Spectrum, symbols and what a transform gives.
_TRANSFORMS = {"periodic": 2.0, "free": 6.0}
#: Fields of the companion beside those of the memories; fields of each exponential in both marches' memories, before
#: and after a step, and in the checkpoint that may be asked for.
_COMPANION, _EXPONENTIAL = 1.5, 5.2
#: What a march adds whose window or grid follows the contact, since it may go back to the state before; and what moving
#: a state to a larger one adds. Measured on balls at 770 x 460 to 1131 x 1096.
_FOLLOWING, _MOVED = 13.0, 12.0
#: What the direct history adds beside the companion: total displacements and effective pressures.
_DIRECT = 6.5
#: What the two-step rule adds: states of the memory one step ago, and the short solve that shows the end of a step.
_SHOWN = 3.0
#: Fields of the state while the file is written, a frame as it was kept among them.
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
    steps: float = 0.0,
    rows: float = 1.0,
    part: float = 1.0,
    in_memory: bool = False,
    grows: bool = False,
) -> float:
    """Memory of a march at its peak, without what the process takes in any case.

    Parameters
    ----------
    settings : Settings
        Of the solve.
    cells : float
        Of the surface.
    memory : Memory
        Of the material's past.
    contact : float
        Largest contact fraction.
    steps, rows : float
        Accepted steps, and kept ones.
    part : float
        Part of the cells that is solved on.
    in_memory : bool
        Whether the kept fields stay in memory, as those of :func:`roughvisc.simulate` do; else they go to a file.
    grows : bool
        Whether the window or the grid, which the cells are those of in the end, was smaller before.

    Returns
    -------
    float
        [byte]

    Notes
    -----
    The larger one of the peaks while the contact is solved and while the file is written. Measured by
    ``workflows/benchmarks/memory.py``.
    """
    field = 8.0 * cells
    state, past = _STATE, 0.0
    solved = _ELASTIC + _TRANSFORMS[settings.boundary] + _IN_CONTACT * contact
    if not is_wide(math.ceil(part * cells)):
        solved += _NARROW
    if isinstance(memory, Modes):
        modes = len(memory.material.times) + bool(memory.material.fluidity)
        if modes:
            solved += _COMPANION + _EXPONENTIAL * modes
            state += 3 * modes
            if "bdf2" in memory.rules:
                solved += _SHOWN + _EXPONENTIAL * modes
            if memory.acts_on != "displacement":
                solved += _FOLLOWING + (_EXPONENTIAL * modes if memory.acts_on == "both" else 0.0)
                solved += _MOVED if grows else 0.0
    elif isinstance(memory, History):
        past = 1.5 * history_bytes(contact * cells, steps)
        solved += _COMPANION + _DIRECT
    frames = rows * len(settings.fields) * field
    surface = _SURFACE * field + past
    if in_memory:
        return surface + frames + max(part * solved * field, frames)  # they are copied into one array in the end
    layer = chunks((math.ceil(rows), 1, math.ceil(cells)))[0] if rows else 0  # is written at a time
    waiting = min(max(rows - 1, 0) * len(settings.fields) * field, _WAITING)
    return surface + max(part * solved * field + waiting, (part * state + layer) * field)


def curve_bytes(settings: Settings, cells: float) -> float:
    """Memory of a curve of friction at its peak, without what the process takes in any case. [byte]"""
    return (_CURVE + len(settings.fields)) * 8.0 * cells
