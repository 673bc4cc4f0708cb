"""Quantities derived from a result: what the contact looks like, and what it means mechanically.

Every function takes a result and returns a Dataset of the new variables alone (``xarray.merge`` or
``Dataset.update`` puts them beside the others). Leading dimensions other than time, such as ``case``, pass through;
fields on Dask are worked on frame by frame, lazily unless a docstring says otherwise. Names and units are declared in
:mod:`roughvisc.variables`.
"""

from __future__ import annotations

import xarray as xr

from roughvisc.observables.area_theories import area_by_theory
from roughvisc.observables.conductance import conductance
from roughvisc.observables.cycles import cycle_energy
from roughvisc.observables.densities import gap_distribution, gap_statistics, pressure_distribution
from roughvisc.observables.frozen import incremental_stiffness
from roughvisc.observables.leakage import leakage
from roughvisc.observables.response import area_growth, history, older_name, secant_stiffness, stiffness, work
from roughvisc.observables.spots import cluster_areas, clusters, contact, percolation
from roughvisc.observables.tables import asked

__all__ = [
    "area_by_theory",
    "area_growth",
    "asked",
    "cluster_areas",
    "clusters",
    "conductance",
    "contact",
    "cycle_energy",
    "gap_distribution",
    "gap_statistics",
    "history",
    "incremental_stiffness",
    "leakage",
    "observe",
    "percolation",
    "pressure_distribution",
    "secant_stiffness",
    "stiffness",
    "work",
]


def __dir__() -> list[str]:
    return __all__


def observe(dataset: xr.Dataset) -> xr.Dataset:
    """Compute all observables that the variables of a result allow.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.

    Returns
    -------
    xarray.Dataset
        Clusters, percolation, gap statistics, growth exponent, secant stiffness and work over time, each with its unit;
        ``xarray.merge([dataset, observe(dataset)])`` adds them to the result.

    Raises
    ------
    InputError
        If the cells of the grid are not equal.
    """
    found = []
    if "pressure" in dataset or "gap" in dataset:
        found += [clusters(dataset), percolation(dataset)]
    if "gap" in dataset:
        found.append(gap_statistics(dataset))
    if "contact_area" in dataset:
        found.append(area_growth(dataset))
    if "force" in dataset and "approach" in dataset:
        secant = secant_stiffness(dataset)
        found += [secant, older_name(secant), work(dataset)]
    return xr.merge(found, compat="equals", join="exact")
