"""What several commands put out: paths on the terminal, figures in files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roughvisc.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console


def say(console: Console, what: str, path: Path) -> None:
    """A path on one line of its own, whole, so that it can be copied or cut out by a program."""
    shown = os.path.relpath(path)
    console.print(f"{what}: {path if shown.startswith('..') else shown}", soft_wrap=True, highlight=False)


def draw(figure: Any, path: Path) -> None:
    """Write a figure to a file of the kind that its suffix names, whole or not at all."""
    from roughvisc.study.storage.store import whole_file

    kind = path.suffix.lstrip(".") or "png"
    if kind not in figure.canvas.get_supported_filetypes():
        raise InputError(f"{path}: is no kind of picture: expected one of .png, .pdf, .svg")
    with whole_file(path) as temporary:
        figure.savefig(temporary, format=kind, dpi=200)
