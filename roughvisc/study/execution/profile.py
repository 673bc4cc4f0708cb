"""Where the time of a run goes: transforms, vector work, memory, storing."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from typing import Any

from roughvisc.experiment import loading
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.bodies.window import FarFieldDisplacement
from roughvisc.mechanics.hereditary.direct import History
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.mechanics.sliding import steady
from roughvisc.mechanics.sliding.steady import Sliding
from roughvisc.mechanics.stepping import step as attempt
from roughvisc.mechanics.stepping.wave_memory import WaveMemory
from roughvisc.study.execution import run
from roughvisc.study.statement.case import Case
from roughvisc.study.storage.checkpoint import CheckpointWriter, RowFile

#: What is timed, by whose attribute it is; time in one that another one calls counts for the inner one.
_PARTS: dict[str, tuple[tuple[Any, str], ...]] = {
    "transforms": (
        *((Operator, name) for name in ("displacement", "displacement_single")),
        *((Operator, name) for name in ("approximate_inverse", "approximate_inverse_within")),
        (FarFieldDisplacement, "spread"),
        *((Sliding, name) for name in ("displacement", "full_contact", "lagging", "force_across")),
    ),
    "vector work of the solver": ((attempt, "solve_contact"), (steady, "solve_complementarity")),
    "memory": tuple(
        (kind, name) for kind in (Modes, History, WaveMemory) for name in ("predict", "advance", "enlarged")
    ),
    "surface and kernels": (
        (Case, "height"),
        (loading, "build_scene"),
        *((kind, "__init__") for kind in (Operator, FarFieldDisplacement, Sliding)),
    ),
    "kept rows": ((loading.LoadingRows, "row"), (RowFile, "append")),
    "checkpoints": ((CheckpointWriter, "save"), (CheckpointWriter, "resume")),
    "result file": ((run, "keep"),),
}
REST = "stepping, figures and the rest"


@dataclass
class TimeProfile:
    """Seconds and calls of each part of a run, and of the whole.

    Attributes
    ----------
    seconds : Counter
        Wall time of each part, without what it spent in another part; with the rest they sum up to ``whole``. [s]
    calls : Counter
        How often each part was entered.
    whole : float
        Wall time of everything. [s]
    """

    seconds: Counter[str] = field(default_factory=Counter)
    calls: Counter[str] = field(default_factory=Counter)
    whole: float = 0.0
    _inner: list[float] = field(default_factory=lambda: [0.0])  # time in parts called by each that is running

    def share(self, part: str) -> float:
        """Part of the whole time."""
        return self.seconds[part] / self.whole if self.whole else 0.0

    def timed(self, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, its time counted for a part."""

        @wraps(function)
        def call(*given: Any, **named: Any) -> Any:
            self._inner.append(0.0)
            began = time.perf_counter()
            try:
                return function(*given, **named)
            finally:
                took = time.perf_counter() - began
                self.seconds[part] += took - self._inner.pop()
                self.calls[part] += 1
                self._inner[-1] += took

        return call


@contextmanager
def profiled() -> Iterator[TimeProfile]:
    """Time what runs inside, in this process; what it costs is below a microsecond a call."""
    profile = TimeProfile()
    before = [(owner, name, getattr(owner, name)) for places in _PARTS.values() for owner, name in places]
    for part, places in _PARTS.items():
        for owner, name in places:
            setattr(owner, name, profile.timed(part, getattr(owner, name)))
    began = time.perf_counter()
    try:
        yield profile
    finally:
        profile.whole = time.perf_counter() - began
        profile.seconds[REST] = profile.whole - sum(profile.seconds.values())
        for owner, name, function in before:
            setattr(owner, name, function)
