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
from roughvisc.variables.axes import axis_of
from roughvisc.variables.spots import CONDUCTANCES
from roughvisc.views.figures.files import write_figure
from roughvisc.views.figures.rows import fullest_frame, require, rows_of

if TYPE_CHECKING:  # for editors; at run time each is imported when it is first used
    from matplotlib.figure import Figure

    from roughvisc.views.figures.animate import animate, animation
    from roughvisc.views.figures.budget import budget
    from roughvisc.views.figures.diagnostics import diagnostics
    from roughvisc.views.figures.distributions import contact_clusters, distributions
    from roughvisc.views.figures.fields import maps
    from roughvisc.views.figures.friction import friction, friction_against_distance
    from roughvisc.views.figures.histories import area_against_load, history, hysteresis
    from roughvisc.views.figures.sections import section
    from roughvisc.views.figures.stability import stability_map
    from roughvisc.views.figures.surfaces import surface
    from roughvisc.views.figures.trade import trade
    from roughvisc.views.figures.transport import conductance, leakage
    from roughvisc.views.sweep_figures.curves import friction_of_cases, histories_of_cases
    from roughvisc.views.sweep_figures.files import save_sweep_figures
    from roughvisc.views.sweep_figures.sweeps import sweep

__all__ = [
    "animate",
    "animation",
    "area_against_load",
    "budget",
    "conductance",
    "contact_clusters",
    "diagnostics",
    "distributions",
    "friction",
    "friction_against_distance",
    "friction_of_cases",
    "histories_of_cases",
    "history",
    "hysteresis",
    "leakage",
    "maps",
    "save_figures",
    "save_sweep_figures",
    "section",
    "stability_map",
    "surface",
    "sweep",
    "trade",
]

#: Modules that the figures are imported from when one is first used -> their figures.
_MODULES = {
    "figures.animate": ("animate", "animation"),
    "figures.budget": ("budget",),
    "figures.diagnostics": ("diagnostics",),
    "figures.distributions": ("contact_clusters", "distributions"),
    "figures.fields": ("maps",),
    "figures.friction": ("friction", "friction_against_distance"),
    "figures.histories": ("area_against_load", "history", "hysteresis"),
    "figures.sections": ("section",),
    "figures.stability": ("stability_map",),
    "figures.surfaces": ("surface",),
    "figures.trade": ("trade",),
    "figures.transport": ("conductance", "leakage"),
    "sweep_figures.curves": ("friction_of_cases", "histories_of_cases"),
    "sweep_figures.files": ("save_sweep_figures",),
    "sweep_figures.sweeps": ("sweep",),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name == "friction_maps":
        raise AttributeError("rv.plot.friction_maps is no more: write rv.plot.maps(ds), where times= takes speeds too")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = _imported(_HOMES[name], name)
    return globals()[name]


def _imported(module: str, name: str) -> Any:
    return getattr(import_module(f"roughvisc.views.{module}"), name)


def __dir__() -> list[str]:
    return __all__


#: What :func:`save_figures` draws: name -> (function, or the name of one of this module, variables of which all,
#: variables of which one is needed).
FIGURES: dict[str, tuple[Any, tuple[str, ...], tuple[str, ...]]] = {
    "friction": ("friction", ("speed", "friction_coefficient", "contact_fraction"), ()),
    "history": ("history", (), ("force", "approach", "contact_area")),
    "maps": ("maps", ("x", "y"), ("pressure", "gap")),
    "section": ("section", ("height",), ("gap", "displacement")),
    "distributions": ("distributions", (), ("pressure", "gap")),
    "clusters": ("contact_clusters", ("x", "y"), ("pressure", "gap")),
    "hysteresis": ("hysteresis", ("time", "force", "approach"), ()),
    "leakage": ("leakage", ("leak_rate", "gap"), ()),
    "conductance": ("conductance", (), CONDUCTANCES),
    "slide": ("friction_against_distance", ("time", "sliding_distance", "friction_coefficient"), ()),
    "surface": ("surface", ("height",), ()),
    "diagnostics": ("diagnostics", (), ("iterations", "convolutions", "stated_error")),
}

#: Those of them that are drawn only where they say something, and what tells that: module and function.
TELLING = {"clusters": ("figures.distributions", "has_clusters"), "hysteresis": ("figures.histories", "has_loop")}

#: What is drawn unless more is asked for, of each line the first that a result allows.
DEFAULT = (("friction", "history"), ("maps",), ("leakage",), ("conductance",))


def allowed_figures(dataset: xr.Dataset) -> list[str]:
    """Names of the figures that the variables of a result allow."""
    return [
        name
        for name, (_, needed, wanted) in FIGURES.items()
        if all(one in dataset for one in needed) and (not wanted or any(one in dataset for one in wanted))
    ]


def default_figures(dataset: xr.Dataset) -> list[str]:
    """Names of the few figures that are drawn unless more is asked for: histories, or a curve of friction, and maps."""
    allowed = allowed_figures(dataset)
    return [next(name for name in line if name in allowed) for line in DEFAULT if {*line} & {*allowed}]


def figures_of(dataset: xr.Dataset, leave: str = "", *, every: bool = True) -> Iterator[tuple[str, Figure]]:
    """Name and figure of all that the variables of a result allow and that says something of it.

    The section is drawn in the last row of the largest contact area.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.
    leave : str
        Name of one to leave out.
    every : bool
        False: only the few of :func:`default_figures`; others are not imported.
    """
    for name in allowed_figures(dataset) if every else default_figures(dataset):
        if name == leave or (name in TELLING and not _imported(*TELLING[name])(dataset)):
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

    Of a curve of friction these are the curve and maps of the pressure. Clusters are drawn where the contact has three
    or more, hysteresis where the approach comes back.

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
        False: only the first two, history and maps, or curve and maps of friction, and those of observables.

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
