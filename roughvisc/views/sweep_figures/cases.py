"""Many results as rows of a table: their histories, and what was varied in them."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import own_rows
from roughvisc.study.si_tables import unit_of
from roughvisc.study.storage.parameters import combinations, identifier
from roughvisc.study.sweep_table import DRAWN, REALISATION
from roughvisc.units import Unit, unit_for
from roughvisc.variables import AXES, CONDUCTANCES, ROW, ROWS, VARIABLES, axis_of
from roughvisc.views.figures import style
from roughvisc.views.sweep_figures.case_text import ENDLESS, names_of, readable_setting, setting_unit
from roughvisc.views.sweep_figures.ensembles import Band, pooled

#: Quantities that span decades, and of which zero means that there is none.
_SPANNING = ("leak_rate", "transmissivity", "hydraulic_aperture")
_NO_PARAMETERS = ("case", "case_key", ROWS)


@dataclass(frozen=True)
class Parameter:
    """Something that was varied: its value in every case.

    Parameters
    ----------
    key : str
        Dotted key of the study.
    values : ndarray, shape (cases,)
        Numbers in SI, or strings.
    si : str
        Unit of numbers as the vocabulary writes it.
    name : str
        How it is called on an axis.
    """

    key: str
    values: np.ndarray
    si: str
    name: str

    @property
    def numeric(self) -> bool:
        """Whether it lies on an axis of numbers: every value is one, and no seed; the largest may be infinite."""
        if self.key.endswith("seed") or self.values.dtype.kind not in "iuf":
            return False
        known = self.values > -np.inf  # a missing one is not
        return bool(known.all() and np.isfinite(self.values).any())

    @property
    def endless(self) -> bool:
        """Whether its largest value is infinite, as the thickness of a half-space among sheets."""
        return self.numeric and bool(np.isinf(self.values).any())

    @property
    def levels(self) -> np.ndarray:
        """Its different values: numbers by size, others in the order of the cases."""
        if self.numeric:
            return np.unique(self.values)
        return np.array(list(dict.fromkeys(self.values.tolist())), dtype=self.values.dtype)

    @property
    def places(self) -> np.ndarray:
        """Number of each case's value among the levels."""
        levels = self.levels.tolist()
        return np.array([_index(levels, value) for value in self.values.tolist()])

    @property
    def unit(self) -> Unit:
        """Unit to show numbers in: of numbers over decades, the one that suits their middle."""
        return setting_unit(middle_of_decades(self.values), self.si) if self.numeric else Unit(1.0, "")

    @property
    def label(self) -> str:
        """Axis label: its name and, in brackets, the unit."""
        return self.unit.label(self.name)

    def texts(self) -> list[str]:
        """Every level as a reader wants it: numbers with their unit, files without their folders."""
        if self.numeric:
            return [ENDLESS if np.isinf(value) else self.unit.text(value, 4) for value in self.levels]
        texts = _category_texts(self.levels.tolist(), self.key)
        return [style.verbatim(textwrap.shorten(text, 60, placeholder="…")) for text in texts]


def _index(levels: list, value: Any) -> int:
    return next(i for i, level in enumerate(levels) if level == value or (level != level and value != value))


def _category_texts(levels: list[Any], key: str) -> list[str]:
    read = [_json(level) for level in levels]
    if all(isinstance(one, dict) for one in read):
        differing = [k for k in dict.fromkeys(k for one in read for k in one) if len({str(o.get(k)) for o in read}) > 1]
        texts = [", ".join(_entry(f"{key}.{k}", one[k]) for k in differing if k in one) for one in read]
        return texts if len(set(texts)) == len(texts) else [str(level) for level in levels]
    shown = [str(level) for level in levels]
    files = [PurePath(text).name for text in shown]
    named = files if len(set(files)) == len(files) else shown
    return ["none" if text in ("", "nan") else text for text in named]


def _entry(key: str, value: Any) -> str:
    """A setting as a part of a category: a word alone, a number with its name."""
    text = readable_setting(key, value).replace("_", " ")
    return text if isinstance(value, str) else f"{key.rpartition('.')[2].replace('_', ' ')} {text}"


def _json(text: Any) -> Any:
    try:
        return json.loads(text) if isinstance(text, str) else text
    except ValueError:
        return text


@dataclass(frozen=True)
class Cases:
    """Results side by side.

    Parameters
    ----------
    members : list of xarray.Dataset
        Histories of each case over its own times, or over the places on another axis; of realisations of one case
        their mean.
    parameters : list of Parameter
        What was varied, but what says the same as one before it.
    bands : list of Band or None
        Where a patch lies among the realisations of each case; None of a case that has none.
    """

    members: list[xr.Dataset]
    parameters: list[Parameter]
    bands: list[Band | None]

    def parameter(self, key: str) -> Parameter:
        """Parameter of a dotted key, or of the identifier that it has in the files.

        Raises
        ------
        InputError
            If it was not varied.
        """
        for one in self.parameters:
            if key in (one.key, identifier(one.key)):
                return one
        raise InputError(f"{key!r} was not varied: expected one of {', '.join(one.key for one in self.parameters)}")

    @property
    def axis(self) -> str:
        """Name of the axis that the results lie over."""
        return axis_of(self.members[0].variables)

    def lies_over_axis(self, name: str) -> bool:
        """Whether every case has a history of a name."""
        return all(name in member and member[name].dims == (self.axis,) for member in self.members)

    @property
    def alike_in_size(self) -> bool:
        """Whether all surfaces are of one size, as far as the results tell."""
        told = [(m["force"], m["nominal_pressure"]) for m in self.members if "nominal_pressure" in m]
        sizes = np.array([float(force.max() / mean.max()) for force, mean in told if float(mean.max()) > 0])
        return not sizes.size or bool(np.ptp(sizes) <= 1e-6 * sizes.max())

    @property
    def area(self) -> str:
        """Name of the contact area to compare: the fraction where sizes differ and all cases have it."""
        if not self.alike_in_size and all("contact_fraction" in member for member in self.members):
            return "contact_fraction"
        return "contact_area"

    def history_named(self, quantity: str | None) -> str:
        """Name of a history that every case has; by default that of the contact area.

        Raises
        ------
        InputError
            If a case has none of that name.
        """
        quantity = self.area if quantity is None else quantity
        if not self.lies_over_axis(quantity):
            known = [str(name) for name in self.members[0].data_vars if self.lies_over_axis(str(name))]
            raise InputError(f"quantity is {quantity!r}: expected a history of every case: {', '.join(known)}")
        return quantity


def cases_of(results: Any) -> Cases:
    """Histories and varied parameters of many results.

    Parameters
    ----------
    results : xarray.Dataset
        As :func:`roughvisc.open_results` gives them.

    Raises
    ------
    InputError
        If they are something else, or one case only.
    """
    if not isinstance(results, xr.Dataset) or "case" not in results.dims:
        raise InputError("expected the Dataset of rv.open_results or rv.sweep, with a dimension 'case'")
    over = [dim for dim in ("case", REALISATION) if dim in results.dims]
    held = [name for name in results.data_vars if set(results[name].dims) <= {*over, ROW, *AXES}]
    table = results[held].load()
    keys = results["case_key"].values if "case_key" in results.coords else np.full(results.sizes["case"], "one")
    members = [own_rows(table.isel(dict(zip(over, place, strict=True)))) for place in np.argwhere(keys != "")]
    if len(members) < 2:
        raise InputError("found one case: expected several, as a sweep leaves them")
    scalars = [one for name, one in members[0].coords.items() if not one.dims and name not in _NO_PARAMETERS]
    parameters = {
        _key(one): (np.array([member[one.name].item() for member in members]), one)
        for one in scalars
        if all(one.name in member.coords for member in members)
    }
    # what is infinite, the conductance of full contact, has no place on an axis
    members = [
        one.assign({name: one[name].where(np.isfinite(one[name])) for name in CONDUCTANCES if name in one})
        for one in members
    ]
    numbers = parameters[REALISATION][0] if REALISATION in parameters else np.full(len(members), np.nan)
    settings = {key: found for key, found in parameters.items() if key not in (REALISATION, *DRAWN)}
    if not np.isfinite(numbers).any():
        settings = parameters
    of_case = combinations((values for values, _ in settings.values()), len(members))
    groups: dict[Any, list[int]] = {}
    for place, number in enumerate(numbers):
        groups.setdefault(of_case[place] if np.isfinite(number) else place, []).append(place)
    first = [mine[0] for mine in groups.values()]
    together = [members[place] for place in first]
    bands: list[Band | None] = [None] * len(groups)
    for group, mine in enumerate(groups.values()):
        if np.isfinite(numbers[mine[0]]):
            drawn = [members[place] for place in mine], [int(numbers[place]) for place in mine]
            together[group], bands[group] = pooled(*drawn)
    varied = [
        Parameter(key, _numbers(values[first]), str(source.attrs.get("units") or unit_of(key)), "")
        for key, (values, source) in settings.items()
    ]
    return Cases(together, _independent(varied), bands)


def _key(coordinate: xr.DataArray) -> str:
    """Dotted key of a varied parameter, which its identifier does not tell."""
    said = str(coordinate.attrs.get("long_name", ""))
    return said if identifier(said) == identifier(str(coordinate.name)) else str(coordinate.name)


def middle_of_decades(values: np.ndarray) -> np.ndarray:
    """Values that tell a unit: as they are or, of positive ones over two decades or more, their geometric middle."""
    known = values[np.isfinite(values)]
    if known.size and known.min() > 0 and known.max() >= 100 * known.min():
        return np.sqrt([known.min()]) * np.sqrt(known.max())
    return values


def _numbers(values: np.ndarray) -> np.ndarray:
    """Numbers, where every value is a list of one number, as of a material with one relaxation."""
    if values.dtype.kind not in "OU":
        return values
    read = [_json(value) for value in values.tolist()]
    alone = all(isinstance(one, list) and len(one) == 1 and type(one[0]) in (int, float) for one in read)
    return np.array([one[0] for one in read], dtype=float) if alone else values


def _independent(varied: Sequence[Parameter]) -> list[Parameter]:
    """Parameters that vary, by their names, without those that follow one to one from another before them."""
    kept: list[Parameter] = []
    for one in varied:
        pairs = [len(set(zip(one.places, other.places, strict=True))) for other in kept]
        alike = any(p == len(one.levels) == len(o.levels) for p, o in zip(pairs, kept, strict=True))
        if len(one.levels) > 1 and not alike:
            kept.append(one)
    names = names_of([one.key for one in kept])
    return [replace(one, name=names[one.key]) for one in kept]


def combined(others: list[Parameter]) -> Parameter:
    """One parameter that stands for several: every combination a category."""
    if len(others) == 1:
        return others[0]
    texts = [np.array(named_texts(one))[one.places] for one in others]
    values = np.array([", ".join(parts) for parts in zip(*texts, strict=True)])
    return Parameter("", values, "", ", ".join(one.name for one in others))


def named_texts(parameter: Parameter) -> list[str]:
    """Levels as texts that say what they are: numbers with the name of the parameter."""
    word = parameter.values.dtype.kind in "OU"
    return parameter.texts() if word else [f"{parameter.name} {text}" for text in parameter.texts()]


def quantity_unit(cases: Cases, quantity: str, values) -> Unit:
    """Unit to show values [SI] of a quantity in."""
    if quantity == "contact_fraction":
        return Unit(0.01, "%")
    declared = VARIABLES[quantity].units if quantity in VARIABLES else ""
    return unit_for(middle_of_decades(np.ravel(values)), str(cases.members[0][quantity].attrs.get("units", declared)))


def without_zeros(quantity: str, values: np.ndarray) -> np.ndarray:
    """Values as they are drawn: a leak rate spans decades, and where nothing leaks it has no place among them."""
    return np.where(values > 0, values, np.nan) if quantity in _SPANNING else values


def label_of(cases: Cases, quantity: str, unit: Unit) -> str:
    """Axis label of a quantity."""
    if quantity in VARIABLES:
        return unit.label(VARIABLES[quantity].label)
    said = str(cases.members[0][quantity].attrs.get("long_name", quantity)).replace("_", " ")
    return unit.label(said[:1].upper() + said[1:])
