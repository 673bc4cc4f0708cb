"""Figures and animations of results: each function takes a result and returns a matplotlib Figure.

In a notebook a figure shows itself; elsewhere ``figure.savefig("name.pdf")`` writes it. Quantities are drawn with
readable prefixes; nothing here touches matplotlib's global state.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.plot.files import write_figure
from roughvisc.plot.rows import fullest_frame, require, rows_of
from roughvisc.variables import axis_of

if TYPE_CHECKING:  # for editors; at run time each is imported when it is first used
    from matplotlib.figure import Figure


#: Public function -> module that it is imported from when it is first used.
_HOMES = {
    "animate": "animations",
    "animation": "animations",
    "area_against_load": "histories",
    "budget": "budgets",
    "friction": "friction_curves",
    "friction_against_distance": "friction_curves",
    "history": "histories",
    "maps": "fields",
    "save_sweep_figures": "sweep_files",
    "section": "sections",
    "surface": "surfaces",
    "sweep": "sweeps",
    "trade": "trades",
}
__all__ = sorted([*_HOMES, "save_figures"])


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = getattr(import_module(f"roughvisc.plot.{_HOMES[name]}"), name)
    return globals()[name]


def __dir__() -> list[str]:
    return __all__


def _leak_flow(dataset: xr.Dataset) -> Figure:
    """Maps of the flux of the fluid that leaks."""
    return __getattr__("maps")(dataset, fields="flux")


#: What :func:`save_figures` draws: name -> (function, or the name of one of this module, variables of which all,
#: variables of which one is needed).
FIGURES: dict[str, tuple[Any, tuple[str, ...], tuple[str, ...]]] = {
    "friction": ("friction", ("speed", "friction_coefficient", "contact_fraction"), ()),
    "history": ("history", (), ("force", "approach", "contact_area")),
    "maps": ("maps", ("x", "y"), ("pressure", "gap")),
    "leakage": (_leak_flow, ("leak_rate", "gap", "x", "y"), ()),
    "section": ("section", ("height",), ("gap", "displacement")),
    "slide": ("friction_against_distance", ("time", "sliding_distance", "friction_coefficient"), ()),
    "surface": ("surface", ("height",), ()),
}
#: Figures that are drawn unless all are requested.
DEFAULT = ("friction", "history", "maps", "leakage")


def allowed_figures(dataset: xr.Dataset) -> list[str]:
    """Names of the figures that the variables of a result allow; a friction curve needs no history besides."""
    names = [
        name
        for name, (_, needed, wanted) in FIGURES.items()
        if all(one in dataset for one in needed) and (not wanted or any(one in dataset for one in wanted))
    ]
    return [name for name in names if name != "history" or "friction" not in names]


def default_figures(dataset: xr.Dataset) -> list[str]:
    """Names of the figures that are drawn unless all are requested: history or friction curve, maps, leakage."""
    return [name for name in allowed_figures(dataset) if name in DEFAULT]


def figures_of(dataset: xr.Dataset, leave: str = "", *, every: bool = True) -> Iterator[tuple[str, Figure]]:
    """Name and figure of all that the variables of a result allow.

    The section is drawn in the last row of the largest contact area.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.
    leave : str
        Name of one to leave out.
    every : bool
        False: only those of :func:`default_figures`; others are not imported.
    """
    for name in allowed_figures(dataset) if every else default_figures(dataset):
        if name == leave:
            continue
        draw = FIGURES[name][0]
        draw = draw if callable(draw) else __getattr__(draw)
        options = {"time": float(rows_of(dataset)[fullest_frame(dataset)])} if name == "section" else {}
        yield name, draw(dataset, **options)


def save_figures(
    dataset: xr.Dataset,
    folder: Any,
    stem: str,
    *,
    suffix: str = ".png",
    dpi: float = 200.0,
    title: str = "",
    every: bool = True,
) -> list[Path]:
    """Write the figures that the variables of a result allow, as ``STEM-history.png`` and so on.

    Of a friction curve these are the curve and maps of the pressure.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.
    folder : path-like
        Where to write; made if absent.
    stem : str
        First part of every file name.
    suffix : str
        Kind of file, as matplotlib knows it: ``".png"``, ``".pdf"``, ``".svg"``.
    dpi : float
        Resolution of pictures made of pixels.
    title : str
        What stands above each figure, such as the case that it shows.
    every : bool
        False: only history or friction curve, maps, and the leak flow.

    Returns
    -------
    list of pathlib.Path
        The files written.

    Raises
    ------
    InputError
        If the Dataset is not one case's result or allows no figure.
    """
    require(dataset, axis_of(dataset))
    written = [
        write_figure(figure, Path(folder, f"{stem}-{name}{suffix}"), dpi, title)
        for name, figure in figures_of(dataset, every=every)
    ]
    if not written:
        stored = ", ".join(str(known) for known in dataset.variables)
        raise InputError(f"the result allows no figure: it holds {stored or 'nothing'}")
    return written
