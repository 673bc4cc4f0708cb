"""Files of figures."""

from __future__ import annotations

import textwrap
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from roughvisc.errors import InputError
from roughvisc.plot import style
from roughvisc.study.storage.files import atomic_write


def write_figure(figure: Figure, path: Path, dpi: float = 200.0, title: str = "") -> Path:
    """Write a figure to a file of the kind that its suffix names, whole or not at all.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        What to write.
    path : Path
        Where to.
    dpi : float
        Resolution of pictures made of pixels.
    title : str
        What stands above it, such as which case it shows; the picture is so much higher.

    Raises
    ------
    InputError
        If the suffix names no kind of picture, or the folder cannot be written to.
    """
    kind = path.suffix.lstrip(".") or "png"
    if kind not in figure.canvas.get_supported_filetypes():
        raise InputError(f"{path}: is no kind of picture: expected one of .png, .pdf, .svg")
    box = _with_title(figure, title) if title else None
    with atomic_write(path) as temporary:
        figure.savefig(temporary, format=kind, dpi=dpi, bbox_inches=box)
    return path


def _with_title(figure: Figure, title: str) -> Bbox:
    """Write a title above a figure, whose own contents stay where they are; the area of both. [inch]"""
    figure.draw_without_rendering()  # lays it out
    figure.set_layout_engine("none")
    for legend in figure.legends:  # else it would stand at the top of what is saved
        legend.set_bbox_to_anchor((0, 0, 1, 1), transform=figure.transFigure)
    width, height = figure.get_size_inches()
    whole = title.replace(" ", "\N{NO-BREAK SPACE}").replace(",\N{NO-BREAK SPACE}", ", ")  # lines end at commas
    lines = textwrap.wrap(whole, int(13 * width))
    figure.text(0.5, 1 + 0.03 / height, "\n".join(map(style.verbatim, lines)), ha="center", va="bottom", fontsize=9)
    return Bbox.from_extents(0, 0, width, height + 0.08 + 0.16 * len(lines))
