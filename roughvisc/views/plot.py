"""Figures and animations of results: each function takes a result and returns a matplotlib Figure.

In a notebook a figure shows itself; elsewhere ``figure.savefig("name.pdf")`` writes it. Quantities are drawn with
readable prefixes; nothing here touches matplotlib's global state.
"""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.views.figures.animate import animate
from roughvisc.views.figures.area_load import area_against_load
from roughvisc.views.figures.axes import fullest_frame, require
from roughvisc.views.figures.distributions import contact_clusters, distributions
from roughvisc.views.figures.fields import maps
from roughvisc.views.figures.friction import friction
from roughvisc.views.figures.histories import history
from roughvisc.views.figures.loops import hysteresis
from roughvisc.views.figures.sections import section
from roughvisc.views.figures.stability import stability_map
from roughvisc.views.figures.surfaces import surface
from roughvisc.views.figures.trade import trade
from roughvisc.views.sweep_figures.case_histories import histories_of_cases
from roughvisc.views.sweep_figures.files import save_sweep_figures, write_figure
from roughvisc.views.sweep_figures.sweeps import sweep

__all__ = [
    "animate",
    "area_against_load",
    "contact_clusters",
    "distributions",
    "friction",
    "histories_of_cases",
    "history",
    "hysteresis",
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
    "history": (history, (), ("force", "approach", "contact_area")),
    "maps": (maps, ("x", "y"), ("pressure", "gap")),
    "section": (section, ("height",), ("gap", "displacement")),
    "distributions": (distributions, (), ("pressure", "gap")),
    "clusters": (contact_clusters, ("x", "y"), ("pressure", "gap")),
    "hysteresis": (hysteresis, ("force", "approach"), ()),
    "surface": (surface, ("height",), ()),
}


def save_figures(dataset: xr.Dataset, folder, stem: str, *, suffix: str = ".png", dpi: float = 200.0) -> list[Path]:
    """Write the figures that the variables of a result allow, as ``STEM-history.png`` and so on.

    The section is drawn at the last time of the largest contact area.

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

    Returns
    -------
    list of pathlib.Path
        The files written.

    Raises
    ------
    InputError
        If the Dataset is not one case's result or allows no figure.
    """
    require(dataset)
    written = []
    for name, (draw, needed, wanted) in FIGURES.items():
        if not all(one in dataset for one in needed) or (wanted and not any(one in dataset for one in wanted)):
            continue
        if name == "hysteresis" and dataset.sizes["time"] < 3:
            continue  # two states are no loop
        options = {"time": float(dataset["time"][fullest_frame(dataset)])} if name == "section" else {}
        written.append(write_figure(draw(dataset, **options), Path(folder, f"{stem}-{name}{suffix}"), dpi))
    if not written:
        stored = ", ".join(str(known) for known in dataset.variables)
        raise InputError(f"the result allows no figure: it holds {stored or 'nothing'}")
    return written
