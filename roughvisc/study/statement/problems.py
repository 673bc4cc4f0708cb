"""Error messages for studies: one line for each problem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import indent
from typing import Any

from roughvisc.errors import InputError
from roughvisc.units import shown


class Problems(InputError):
    """All that is wrong with one case, one line each."""

    def __init__(self, lines: Sequence[str]) -> None:
        super().__init__("\n".join(lines))
        self.lines = list(lines)


def in_sweep(problem: str, where: Sequence[int], changes: Sequence[Mapping[str, Any]]) -> str:
    """The problem, and the first case that has it where not all do."""
    if len(where) == len(changes):
        return problem
    values = ", ".join(f"{key} = {shown(value)}" for key, value in changes[where[0]].items())
    head, *rows = problem.split("\n")
    return "\n".join([f"{head} (case {where[0] + 1} of {len(changes)}: {values})", *rows])


def line(path: Path | None, key: str, problem: str) -> str:
    """One line: the file, the key, what is wrong."""
    return f"{path}: {key}: {problem}" if path else f"{key}: {problem}"


def report(path: Path | None, lines: Sequence[str]) -> str:
    """One message: a single line, or a line for each problem below the name of the file."""
    name = str(path) if path else "case"
    if len(lines) == 1:
        return f"{name}: {lines[0]}"
    return "\n".join([f"{name}: {len(lines)} problems", *(indent(one, "  ") for one in lines)])
