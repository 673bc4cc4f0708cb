"""``budget``: the total uncertainty of a number, by source, from a few neighbours of a case.

Neighbours are copies with one change each, solved by the ordinary sweep and compared with the case.

Each neighbour shows one source of error of a number :math:`Q`. With other cells, fewer waves, another material or
another patch the logarithm of :math:`Q` changes, and the error is a weight times this change: :math:`\\ln Q \\pm U`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.arguments import listed_names, one_of
from roughvisc.errors import InputError, RoughviscError
from roughvisc.experiment.grid_error import coarser_shape
from roughvisc.experiment.loading import Loading
from roughvisc.observables import conductance, leakage
from roughvisc.paths import path_of
from roughvisc.runs.display import Display
from roughvisc.runs.folder import case_path
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.run import is_result_of, result_folder
from roughvisc.runs.sweep import run_cases
from roughvisc.study.case import Case, case_given, changed
from roughvisc.study.study_file import shift_factor, split_thermal
from roughvisc.topography.conditioning import FACE_STEPS
from roughvisc.topography.grid import spacing
from roughvisc.topography.spectrum import is_narrow_band, last_octave
from roughvisc.units import Quantity, number, quantities, unit_for
from roughvisc.variables import VARIABLES

if TYPE_CHECKING:
    from distributed import Client

Array = NDArray[np.float64]
Population = Literal["patch", "ensemble"]
#: Keyword arguments of the observables, as ``[observe]`` of a study states them.
Observe = Mapping[str, Mapping[str, Any]]
#: Inputs of a budget that the user has to state.
KNOWN = ("modulus_error", "time_scale_error", "work_error", "range_error", "cutoff", "population")
#: Folder of the further solves of a budget, in the folder of the results.
FOLDER = "budget"
STEPS = "time steps and solver"
GRID = "grid"
SAMPLE = "sample"
OCTAVE = "next octave of waves"
MODULUS = "modulus"
TIME_SCALE = "time scale"
WORK = "work of adhesion"
RANGE = "range of adhesion"
#: Recipes that give the same surface on any grid.
_ANY_GRID = ("sphere", "cone", "flat_punch", "wavy")
#: Relative change of a modulus or a time scale, for the derivative of a number.
_CHANGE = 1.1
#: Roache's factor of safety of the error of a grid, from two grids.
GRID_SAFETY = 3.0
#: Number of other patches, and half-width of the logarithm at 95 % over its standard deviation. For six patches
#: Student's factor is 2.57. A larger factor is used, because all patches have the spectrum of one patch, whose longest
#: waves vary from patch to patch.
_PATCHES = 6
_SAMPLE_FACTOR = 3.3
#: Largest ratio of two shortest wavelengths that count as equal: the wavelength above which 99 % of the slope lie, and
#: the shortest wavelength of the spectrum.
_SAME = 1.15


# ----------------------------------------------------------------------------------------------------------------
# quantities


@dataclass(frozen=True)
class Observable:
    """A number that a result has at each of its rows.

    Attributes
    ----------
    name : str
        Name of the number in a result.
    derive : callable, optional
        Returns the number over the axis, from a result and the arguments of its observable. Default: the result
        contains the number.
    fields : tuple of str
        Fields that `derive` needs.
    octave_factor : float
        Largest change by the next octave of waves, over the change by the last octave. The factors were chosen on 45
        rough surfaces, and their coverage was measured on others (workflows/benchmarks/whole_error.py). [-]
    grid_order, wave_order : float
        Powers of the cells per wave and of the wavelength, with which the relative effect of an unresolved wave falls
        and grows; chosen on the same surfaces. An effect on the gap goes with the amplitude of the wave. [-]
    follows : {"pressure", "approach", "area", "gap"}
        Quantity whose stated error determines the error of the number.
    """

    name: str
    derive: Callable[[xr.Dataset, Observe], xr.DataArray] | None = None
    fields: tuple[str, ...] = ()
    octave_factor: float = 1.1
    grid_order: float = 1.5
    wave_order: float = 1.0
    follows: Literal["pressure", "approach", "area", "gap"] = "pressure"

    def of(self, result: xr.Dataset, case: Case) -> Array:
        """Return the values of the number in a result of a case, over the axis."""
        values = result[self.name] if self.derive is None else self.derive(result, case.observed)
        return np.asarray(values.values, dtype=float)

    def stated_error(self, result: xr.Dataset, values: Array) -> Array:
        """Return the error of the number's logarithm by steps and solver, from the stated errors of the rows. [-]

        The mean gap of a periodic surface has the error of the approach. The relative change of a leak rate is up to
        six times the change of the mean gap, near the load that closes the gap. A conductance follows the contact area.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.follows == "area" and "contact_area_error" in result:
                error = result["contact_area_error"].values
                relative = error / (result["contact_area"].values + error)
            elif self.follows in ("approach", "gap") and "approach_error" in result:
                size = values if self.follows == "approach" else result["mean_gap"].values / 6
                relative = result["approach_error"].values / np.abs(size)
            else:
                relative = result["stated_error"].values * float(np.nanmax(np.abs(values))) / np.abs(values)
        return np.log1p(np.where(values == 0, np.nan, relative))


def _thermal_conductance(result: xr.Dataset, observe: Observe) -> xr.DataArray:
    conductances = conductance(result, **observe.get("conductance", {"resistivity": (1.0, 1.0)}))
    if "thermal_conductance" not in conductances:
        expected = "a study that observes a thermal conductance, not an electrical one"
        raise InputError(key="quantity", found="thermal_conductance", expected=expected)
    return conductances["thermal_conductance"]


def _leak_rate(result: xr.Dataset, observe: Observe) -> xr.DataArray:
    return leakage(result, **observe.get("leakage", {}))["leak_rate"]


#: Name -> quantity.
QUANTITIES = {
    one.name: one
    for one in (
        Observable("contact_area", octave_factor=2.0, wave_order=0.5, follows="area"),
        Observable("mean_gap", grid_order=2.0, follows="approach"),
        Observable("approach", follows="approach"),
        Observable("force"),
        Observable("friction_coefficient", octave_factor=1.8),
        Observable("leak_rate", _leak_rate, ("gap",), follows="gap"),
        Observable("thermal_conductance", _thermal_conductance, ("pressure",), 1.5, follows="area"),
    )
}


def quantities_of(case: Case) -> dict[str, Observable]:
    """Return the quantities that the results of a case have, by name."""
    slides = not isinstance(case.experiment, Loading) or case.experiment.program.slides
    return {name: one for name, one in QUANTITIES.items() if slides or name != "friction_coefficient"}


def quantity_of(case: Case, name: str) -> Observable:
    """Return a quantity by its name.

    Raises
    ------
    InputError
        If the results of the case have no such quantity.
    """
    known = quantities_of(case)
    return known[one_of("quantity", name, known)]


# ----------------------------------------------------------------------------------------------------------------
# changes


def is_data(case: Case) -> bool:
    """Return whether the surface is measured on its grid, so that another grid means another surface."""
    treated = any(case.surface.get(step, False) is not False for step in (*FACE_STEPS, "second"))
    return case.surface.get("generate") not in _ANY_GRID or treated


def is_sample(case: Case, height: xr.DataArray) -> bool:
    """Return whether the surface is a sample of a larger surface, which has other patches and shorter waves."""
    return case.settings.boundary != "free" and is_data(case) and bool(np.isfinite(height.values).all())


def shortest_wave(height: xr.DataArray) -> float:
    """Return the wavelength above which 99 % of the mean square slope lie, at least two cells; 0 without slopes. [m]

    The grid resolves waves shorter than two cells along its diagonals only.
    """
    _, _, begins = last_octave(height.values - float(height.mean()), spacing(height))
    return max(math.pi / begins, 2 * max(spacing(height))) if begins else 0.0


def shape_on(case: Case, height: xr.DataArray, coarsening: float) -> tuple[int, int]:
    """Return the numbers of cells along x and y of a grid whose cells are `coarsening` times as long."""
    shape = height.sizes["x"], height.sizes["y"]
    return shape if coarsening == 1 else coarser_shape(shape, coarsening, not is_data(case))


def on_cells(case: Case, height: xr.DataArray, coarsening: float) -> Case:
    """Return the case with the same waves on cells `coarsening` times as long.

    A recipe without conditioning is generated on the new grid. Any other surface keeps the waves that the cells
    resolve; finer cells add none.
    """
    if coarsening == 1:
        return case
    shape = list(shape_on(case, height, coarsening))
    if not is_data(case):
        return changed(case, {"surface.shape": shape})
    changes: dict[str, Any] = {"surface.resample": [max(2, n) for n in shape]}
    if coarsening < 1 and case.surface.get("resample"):
        changes["surface.shortest_wave"] = max(case.surface.get("shortest_wave") or 0.0, 2 * max(spacing(height)))
    return changed(case, changes)


def with_kept(case: Case, fields: Iterable[str], times: Any = None) -> Case:
    """Return a case that keeps more fields, and other times if given, without an estimate of the grid error.

    The changes do not count as varied values, so the title of the result does not name them.
    """
    kept = list(dict.fromkeys([*case.settings.fields, *fields]))
    changes: dict[str, Any] = {"keep.fields": kept, "solve.grid_error": False}
    if times is not None and case.experiment.axis == "time":
        changes["keep.times"] = times
    return changed(case, changes).with_fields(varied=case.varied)


# ----------------------------------------------------------------------------------------------------------------
# sources of error


@dataclass(frozen=True)
class Neighbour:
    """A case with one change.

    Attributes
    ----------
    case : Case
    weight : float
        Half-width of the logarithm of a number at 95 %, over the change of the logarithm; on a coarser grid, over the
        error of the case's own grid. [-]
    against : Case
        Case for the comparison, with the same waves.
    resolution : float, optional
        Cells per shortest wave on a coarser grid, over the cells per shortest wave of the case. Default: the grid is
        the same. [-]
    longer : float
        Shortest wave on a coarser grid, over the shortest wave of the case. [-]
    """

    case: Case
    weight: float
    against: Case
    resolution: float | None = None
    longer: float = 1.0

    def weight_of(self, quantity: Observable) -> float:
        """Return the half-width of the logarithm of a quantity at 95 %, over its change. [-]

        The error of a grid goes with powers of its resolution and of the shortest wave. From long cells to cells half
        as long, with the same waves, it changes by ``1 - 2**-grid_order`` times its value on the long cells.
        """
        if self.resolution is None:
            return self.weight
        on_long_cells = self.weight / (1 - 2**-quantity.grid_order)
        return on_long_cells * self.resolution**quantity.grid_order / self.longer**quantity.wave_order


@dataclass(frozen=True)
class Source:
    """A source of error.

    Attributes
    ----------
    method : str
        Method of the estimate, or the missing input of an open source.
    neighbours : tuple of Neighbour
        Cases from which the error is estimated.
    is_open : bool
        Whether an input is missing, so that the source is not part of the total error.
    """

    method: str
    neighbours: tuple[Neighbour, ...] = ()
    is_open: bool = False


def coarser_grids(base: Case, height: xr.DataArray, coarsening: float) -> tuple[Neighbour, ...]:
    """Return a case on cells twice and four times as long, each against the same waves on cells half as long.

    A long cell cannot hold the shortest waves of a sample. Therefore they are left out on the shorter cells, too: the
    change is an error of the grid, without the effect of the waves.

    Parameters
    ----------
    base : Case
        The case.
    height : xarray.DataArray
        Its surface. [m]
    coarsening : float
        Length of the cells whose error is wanted, over the length of the cells of the case.
    """
    cell = coarsening * max(spacing(height))
    is_limited = is_sample(base, height)
    wave = max(shortest_wave(height), 2 * cell) if is_limited else math.inf
    fine = on_cells(base, height, coarsening)
    before = wave
    coarser = []
    for part in (2.0, 4.0):  # two grids may agree by chance
        coarse = on_cells(base, height, part * coarsening)
        shortest = max(wave, 2 * part * cell)
        against = changed(fine, {"surface.shortest_wave": shortest}) if shortest > _SAME * before else fine
        longer = shortest / wave if is_limited else 1.0
        coarser.append(Neighbour(coarse, GRID_SAFETY, against, longer / part, longer))
        fine = coarse
        before = shortest
    return tuple(coarser)


def finer_grid(base: Case, height: xr.DataArray, coarsening: float) -> tuple[Neighbour, ...]:
    """Return a case with adhesion on its own cells, against cells half as long.

    Longer cells may not resolve the range of the attraction. Parameters as in :func:`coarser_grids`.
    """
    own, fine = (on_cells(base, height, part * coarsening) for part in (1.0, 0.5))
    return (Neighbour(own, GRID_SAFETY, fine, 1.0),)


def sources_of(
    base: Case, height: xr.DataArray, known: Mapping[str, Any], coarsening: float = 1.0, others: float | None = None
) -> dict[str, Source]:
    """Return the sources of error that apply to the numbers of a case, by name.

    Parameters
    ----------
    base : Case
        The case.
    height : xarray.DataArray
        Its surface. [m]
    known : mapping
        Inputs of :data:`KNOWN`, as in :func:`roughvisc.budget`.
    coarsening, others : float
        Length of the cells over the length of the cells of the case, for the error of the grid, and for the other
        sources, by default the same.

    Raises
    ------
    InputError
        If a stated value is invalid.
    """
    population = one_of("population", known.get("population") or "patch", get_args(Population))
    cutoff = known.get("cutoff")
    if cutoff is not None:
        cutoff = number(cutoff, "m", "cutoff", above=0)
    sample = is_sample(base, height)
    others = others or coarsening
    attracts = base.settings.adhesion
    sticks = attracts is not None
    own, coarse = (on_cells(base, height, part * others) for part in (1.0, 1.0 if sticks else 2.0))
    sources = {STEPS: Source("errors that the result states")}
    if sticks:
        sources[GRID] = Source("cells half as long", finer_grid(base, height, coarsening))
    else:
        sources[GRID] = Source("cells twice and four times as long", coarser_grids(base, height, coarsening))

    if sample and population == "ensemble":
        few = list(coarse.height().shape) if sticks else [max(2, round(n / (2 * others))) for n in height.shape]
        patches = [changed(base, {"surface.resample": few, "surface.realisation": n + 1}) for n in range(_PATCHES)]
        near = tuple(Neighbour(patch, _SAMPLE_FACTOR, coarse) for patch in patches)
        sources[SAMPLE] = Source(f"{_PATCHES} Gaussian surrogates" + " on cells twice as long" * (not sticks), near)
    if sample and cutoff is None:
        sources[OCTAVE] = Source("cutoff is not given: the shortest wavelength that the real surface has", is_open=True)
    elif sample:
        assert cutoff is not None
        end = unit_for(cutoff, "m").text(cutoff, 3)
        shortest = shortest_wave(height)
        sources[OCTAVE] = Source(f"the grid holds all waves down to {end}")
        if is_narrow_band(height):
            sources[OCTAVE] = Source("the surface has waves of one length, and no shorter ones")
        elif shortest >= _SAME * cutoff:
            octaves = math.log2(shortest / cutoff)
            words = f"without the shortest octave; {octaves:.2g} octaves down to {end} are missing"
            smooth = changed(own, {"surface.shortest_wave": 2 * shortest})
            sources[OCTAVE] = Source(words, (Neighbour(smooth, octaves, own),))

    # the contact of an indenter has few cells, so changes of its material are solved on the grid of the case
    compared = coarse if sample else own
    material = base.tables["material"]
    stiffer: dict[str, Any] = {"material.modulus_factor": _CHANGE * material.get("modulus_factor", 1.0)}
    slower: dict[str, Any] = {f"material.{key}": None for key in split_thermal(material)[0]}
    slower["material.shift_factor"] = _CHANGE * shift_factor(material)
    creeps = base.material.contact_compliance(math.inf) > base.material.contact_compliance(0.0)
    inputs = [
        (MODULUS, "modulus_error", "moduli", stiffer),
        (TIME_SCALE, "time_scale_error", "times of the material", slower),
    ]
    if attracts is not None:  # less work or a longer range does not require shorter cells
        work = attracts.work
        reach = attracts.range
        of_work = {"adhesion.work": work / _CHANGE, "adhesion.range": reach, "adhesion.strength": None}
        of_range = {"adhesion.work": work, "adhesion.range": _CHANGE * reach, "adhesion.strength": None}
        inputs += [(WORK, "work_error", "work of adhesion", of_work)]
        inputs += [(RANGE, "range_error", "range of the attraction", of_range)]
    for name, key, what, changes in inputs:
        if (error := known.get(key)) is not None:
            error = number(error, "1", key, least=0, below=1)
        if name == TIME_SCALE and not creeps:
            continue
        sources[name] = Source(f"{what} are exact")
        if error is None:
            sources[name] = Source(f"{key} is not given: the relative error of the {what}", is_open=True)
        elif error > 0:
            weight = math.log1p(error) / math.log(_CHANGE)
            one = Neighbour(changed(compared, changes), weight, compared)
            sense = "smaller by the factor 1.1" if name == WORK else f"{100 * (_CHANGE - 1):.0f} % larger"
            sources[name] = Source(f"{what} {sense}", (one,))
    return sources


# ----------------------------------------------------------------------------------------------------------------
# solves


def solve(
    cases: Iterable[Case],
    folder: Path,
    *,
    progress: bool = True,
    client: Client | None = None,
    workers: int | None = 0,
    threads: int | None = None,
) -> dict[str, xr.Dataset]:
    """Solve some cases and return the results by their keys; results in the folder are not computed again.

    Parameters
    ----------
    cases : iterable of Case
    folder : Path
        Folder of the results.
    progress : bool
        Show a progress bar.
    client, workers, threads
        As in :func:`roughvisc.sweep`.

    Raises
    ------
    RoughviscError
        If a case fails.
    """
    distinct = {case.key: case for case in cases}
    outcomes = run_cases(
        list(distinct.values()),
        folder,
        display=Display(progress),
        client=client,
        workers=workers if client is None else None,
        threads=threads,
    )
    for key, outcome in outcomes.items():
        if outcome.entry is None:
            raise RoughviscError(f"a neighbouring case failed ({distinct[key].varied}): {outcome.message}")
    return {key: open_result(case_path(folder, key, "result")) for key in outcomes}


def at_rows(result: xr.Dataset, axis: str, places: Any) -> xr.Dataset:
    """Return the rows of a result nearest to some times or speeds."""
    apart = np.abs(result[axis].values[:, None] - np.asarray(places, dtype=float))
    return result.isel({axis: apart.argmin(axis=0)})


# ----------------------------------------------------------------------------------------------------------------
# comparison


def compared(
    case: Case,
    sources: Mapping[str, Source],
    observed: Sequence[Observable],
    folder: Path,
    own: xr.Dataset | None = None,
    **computing: Any,
) -> dict[str, xr.Dataset]:
    """Solve the neighbours of a case and return the budget of each quantity by name.

    Parameters
    ----------
    case : Case
    sources : mapping
        Sources of error, as :func:`sources_of` returns them.
    observed : sequence of Observable
    folder : Path
        Folder of the results.
    own : xarray.Dataset, optional
        Those rows of the result of the case that count. Default: the case is solved, and all of its rows count.
    **computing
        Further arguments of :func:`solve`.

    Returns
    -------
    dict of str to xarray.Dataset
        As :func:`roughvisc.budget` returns them.
    """
    near = [one for source in sources.values() for one in source.neighbours]
    wanted = [case, *(one.case for one in near), *(one.against for one in near)]
    results = solve([one for one in wanted if own is None or one.key != case.key], folder, **computing)
    results = results if own is None else results | {case.key: own}
    axis = case.experiment.axis
    rows = {key: at_rows(result, axis, results[case.key][axis].values) for key, result in results.items()}
    return {one.name: _budget(case, sources, one, rows) for one in observed}


def _budget(
    case: Case, sources: Mapping[str, Source], quantity: Observable, rows: Mapping[str, xr.Dataset]
) -> xr.Dataset:
    """Return the budget of a quantity from the results of a case and its neighbours, at the same rows."""
    own = rows[case.key]
    axis = case.experiment.axis
    units = VARIABLES[quantity.name].units
    values = {key: quantity.of(result, case) for key, result in rows.items()}
    value = values[case.key]
    half_width, direction = np.zeros((2, len(sources), value.size))
    with np.errstate(divide="ignore", invalid="ignore"):
        # a tension or a negative approach has the logarithm of its size; after a change of sign there is none
        logarithms = {key: np.log(np.where(one * value < 0, math.nan, np.abs(one))) for key, one in values.items()}
        for i, (name, source) in enumerate(sources.items()):
            change = [
                n.weight_of(quantity) * (logarithms[n.case.key] - logarithms[n.against.key]) for n in source.neighbours
            ]
            if name == STEPS:
                half_width[i] = quantity.stated_error(own, value)
            elif not change:
                half_width[i] = math.nan if source.is_open else 0.0
            elif name == SAMPLE:
                half_width[i] = np.std(change, axis=0, ddof=1)
            else:
                half_width[i] = np.max(np.abs(change), axis=0)
            if change and name == OCTAVE:
                half_width[i] *= quantity.octave_factor
                direction[i] = -np.sign(np.nan_to_num(change[0]))
    table = xr.Dataset(
        {
            "half_width": (("source", axis), half_width, {"units": "1"}),
            "direction": (("source", axis), direction.astype("int8")),
            "method": ("source", [source.method for source in sources.values()]),
            "value": (axis, value, {"units": units}),
        },
        {"source": list(sources), axis: own[axis].variable, "quantity": quantity.name},
        {
            "case": case.to_json(),
            "title": case.title,
            "open": "; ".join(name for name, source in sources.items() if source.is_open),
        },
    )
    size = np.where(value == 0, math.nan, value)
    bounds = [size * np.exp(side * together(table, side)) for side in (-1, 1)]
    for name, bound in (("lower", np.minimum(*bounds)), ("upper", np.maximum(*bounds))):
        table[name] = (axis, bound, {"units": units})
    return table


def together(table: xr.Dataset, side: int) -> Array:
    """Return the half-width of all sources of a budget but the open ones, on the upper (1) or lower (-1) side. [-]"""
    counts = table["direction"].isin((0, side)) & ~table["source"].isin(table.attrs["open"].split("; "))
    squares = table["half_width"].where(counts, 0.0) ** 2
    return np.asarray(np.sqrt(squares.sum("source", skipna=False)))


# ----------------------------------------------------------------------------------------------------------------
# budget


@quantities(modulus_error="1", time_scale_error="1", work_error="1", range_error="1", cutoff="m")
def budget(
    case: Case | str | Path,
    quantity: str | Sequence[str] = "contact_area",
    *,
    modulus_error: Quantity | None = None,
    time_scale_error: Quantity | None = None,
    work_error: Quantity | None = None,
    range_error: Quantity | None = None,
    cutoff: Quantity | None = None,
    population: Population | None = None,
    out: str | Path | None = None,
    client: Client | None = None,
    workers: int | None = None,
    threads: int | None = None,
    progress: bool = True,
) -> xr.Dataset:
    r"""Estimate the total uncertainty of a number of a case, by source.

    Parameters
    ----------
    case : Case or path
        A case, or its study file.
    quantity : str or sequence of str
        ``contact_area``, ``mean_gap``, ``approach``, ``force``, ``friction_coefficient``, ``leak_rate`` or
        ``thermal_conductance``. The table ``observe`` of the study states the fluid or the conductivities.
    modulus_error, time_scale_error : float or str, optional
        Relative errors of the moduli and the times of the material at 95 %, such as the error of a measured curve or
        the scatter between batches. Without an error its source stays open. [-]
    work_error, range_error : float or str, optional
        Relative errors of the work of adhesion and of its range at 95 %, likewise. [-]
    cutoff : float or str, optional
        Shortest wavelength of the real surface. Without it the waves that the scan does not resolve stay open. [m]
    population : {"patch", "ensemble"}, optional
        Whether the number describes this patch, the default, or the roughness from which the patch is a sample.
    out : path, optional
        Folder of the further solves, which are kept and used again. Default: ``budget`` in the folder of the results.
    client, workers, threads
        As in :func:`roughvisc.sweep`.
    progress : bool
        Show a progress bar.

    Returns
    -------
    xarray.Dataset
        Over ``source`` and ``time`` or ``speed``: ``half_width``, of the logarithm at 95 %, missing if a source is
        open [-]; ``direction``, 1 or -1 for an error that only raises or lowers the number. Over ``source``:
        ``method``, in words. Sources that do not apply are absent; the attribute ``open`` lists those that lack an
        input. Over the times or speeds of the study: ``value``, ``lower`` and ``upper``, in the unit of the quantity.
        For several quantities also over ``quantity``.

    Raises
    ------
    InputError
        If the input is invalid, or the results of the case have no such quantity.
    RoughviscError
        If a solve fails.

    Notes
    -----
    Sources are taken as independent, in logarithms: :math:`Q e^{\pm U}`, :math:`U^2 = \sum U_i^2`. A source with a
    direction counts only on this side, and an open source does not count. A number that is zero, such as the leak rate
    of a closed gap, has no logarithm, and its interval is missing. A negative number, such as the force of a contact
    under tension, has the logarithm of its size; its interval is missing if it changes sign in a neighbour.

    See Also
    --------
    roughvisc.audit : the assumptions of the model.

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sources = rv.budget(case, "approach", modulus_error="5 %", out=folder, workers=0, progress=False).load()
    >>> "modulus" in sources.source.values
    True
    """
    known = {
        "modulus_error": modulus_error,
        "time_scale_error": time_scale_error,
        "work_error": work_error,
        "range_error": range_error,
        "cutoff": cutoff,
        "population": population,
    }
    names = listed_names(quantity)
    if not names:
        raise InputError(key="quantity", found=quantity, expected="at least one")
    case = case_given(case)
    finished = case_path(result_folder(case), case.key, "result")
    folder = path_of(out, "out").expanduser() if out is not None else finished.parent / FOLDER
    observed = [quantity_of(case, name) for name in names]
    base = with_kept(case, [field for one in observed for field in one.fields])
    own = None
    if set(base.settings.fields) <= set(case.settings.fields) and is_result_of(case, finished):
        own = open_result(finished)
    computing = {"progress": progress, "client": client, "workers": workers, "threads": threads}
    budgets = compared(base, sources_of(base, base.height(), known), observed, folder, own, **computing)
    if isinstance(quantity, str):
        return budgets[quantity]
    return xr.concat(list(budgets.values()), "quantity", combine_attrs="drop_conflicts")
