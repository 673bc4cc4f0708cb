"""Figures and animations of results: each function takes a result and returns a matplotlib Figure.

In a notebook a figure shows itself; elsewhere ``figure.savefig("name.pdf")`` writes it. Quantities are drawn with
readable prefixes; nothing here touches matplotlib's global state.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.variables.axes import axis_of
from roughvisc.variables.spots import CONDUCTANCES
from roughvisc.views.figures.animate import animate, animation
from roughvisc.views.figures.axes import fullest_frame, require, rows_of
from roughvisc.views.figures.distributions import contact_clusters, distributions, has_clusters
from roughvisc.views.figures.fields import maps
from roughvisc.views.figures.friction import friction, friction_against_distance, friction_maps
from roughvisc.views.figures.histories import area_against_load, has_loop, history, hysteresis
from roughvisc.views.figures.sections import section
from roughvisc.views.figures.stability import stability_map
from roughvisc.views.figures.surfaces import surface
from roughvisc.views.figures.trade import trade
from roughvisc.views.figures.transport import conductance, leakage
from roughvisc.views.sweep_figures.case_histories import histories_of_cases
from roughvisc.views.sweep_figures.files import save_sweep_figures, write_figure
from roughvisc.views.sweep_figures.friction_curves import friction_of_cases
from roughvisc.views.sweep_figures.sweeps import sweep

__all__ = [
    "animate",
    "animation",
    "area_against_load",
    "conductance",
    "contact_clusters",
    "distributions",
    "friction",
    "friction_against_distance",
    "friction_maps",
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


def __dir__() -> list[str]:
    return __all__


#: What :func:`save_figures` draws: name -> (function, variables of which all, variables of which one is needed).
FIGURES = {
    "friction": (friction, ("speed", "friction_coefficient", "contact_fraction"), ()),
    "pressure_maps": (friction_maps, ("speed", "x", "y", "pressure"), ()),
    "history": (history, (), ("force", "approach", "contact_area")),
    "maps": (maps, ("x", "y"), ("pressure", "gap")),
    "section": (section, ("height",), ("gap", "displacement")),
    "distributions": (distributions, (), ("pressure", "gap")),
    "clusters": (contact_clusters, ("x", "y"), ("pressure", "gap")),
    "hysteresis": (hysteresis, ("time", "force", "approach"), ()),
    "leakage": (leakage, ("leak_rate", "gap"), ()),
    "conductance": (conductance, (), CONDUCTANCES),
    "slide": (friction_against_distance, ("time", "sliding_distance", "friction_coefficient"), ()),
    "surface": (surface, ("height",), ()),
}

#: Those of them that a run draws, and `roughvisc plot` without --all: two, and what a study has asked to be observed.
FIRST = ("friction", "pressure_maps", "history", "maps", "leakage", "conductance")

#: Those of them that are drawn only where they say something.
TELLING = {
    "clusters": has_clusters,
    "hysteresis": has_loop,
    "maps": lambda dataset: "speed" not in dataset.dims,  # these have maps with arrows
}


def figures_of(dataset: xr.Dataset, leave: str = "", *, every: bool = True) -> Iterator[tuple[str, Figure]]:
    """Name and figure of all that the variables of a result allow and that says something of it, but of one to leave.

    Without `every`, only of the first ones. The section is drawn in the last row of the largest contact area.
    """
    for name, (draw, needed, wanted) in FIGURES.items():
        if name == leave or not (every or name in FIRST):
            continue
        stored = all(one in dataset for one in needed) and (not wanted or any(one in dataset for one in wanted))
        if not stored or (name in TELLING and not TELLING[name](dataset)):
            continue
        options = {"time": float(rows_of(dataset)[fullest_frame(dataset)])} if name == "section" else {}
        yield name, draw(dataset, **options)


def save_figures(
    dataset: xr.Dataset,
    folder,
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
