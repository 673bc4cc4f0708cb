"""Scripts that start worker processes: these import the script, whose calls have to stand below a guard."""

from __future__ import annotations

import ast
import sys
from pathlib import Path
from types import FrameType

from roughvisc.errors import InputError


def refuse_unguarded_script() -> None:
    """Refuse to start processes for a script's line that each of them would run again.

    Raises
    ------
    InputError
        If the call comes from the top level of the script that Python was started with, and not from below
        ``if __name__ == "__main__":``.
    """
    main = sys.modules.get("__main__")
    path = getattr(main, "__file__", None)
    if path is None or getattr(main, "__spec__", None) is not None:  # a prompt, a notebook, python -c, python -m
        return
    frame: FrameType | None = sys._getframe()
    while frame is not None:
        code = frame.f_code
        if code.co_name == "<module>" and frame.f_globals.get("__name__") == "__main__" and code.co_filename == path:
            if not _guarded(Path(path), frame.f_lineno):
                raise InputError(
                    f"{path}, line {frame.f_lineno}: rv.sweep starts processes that import this script, and each would "
                    'start its own: expected the call below `if __name__ == "__main__":`, or workers=0'
                )
            return
        frame = frame.f_back


def _guarded(path: Path, line: int) -> bool:
    """Whether a line of a script stands in a block that depends on ``__name__``; true where that cannot be told."""
    try:
        tree = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return True
    return any(
        isinstance(node, ast.If)
        and any(isinstance(one, ast.Name) and one.id == "__name__" for one in ast.walk(node.test))
        and node.lineno <= line <= (node.end_lineno or line)
        for node in ast.walk(tree)
    )
