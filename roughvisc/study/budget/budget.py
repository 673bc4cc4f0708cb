"""``budget``: the whole error of one number, source by source, from a few more solves of the same case."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError, RoughviscError
from roughvisc.study.budget.own_statistics import own_statistics
from roughvisc.study.budget.sources import SOURCES, Asked, Found, Population
from roughvisc.study.budget.stated import stated_by
from roughvisc.study.budget.variants import Variants, check_share, with_rows
from roughvisc.study.execution.monitor import Monitor, watcher
from roughvisc.study.execution.run import result_folder
from roughvisc.study.execution.sweep import run_cases
from roughvisc.study.quantities import Observable, Observe, known_quantity
from roughvisc.study.statement.case import Case, read_study
from roughvisc.study.storage.store import result_path, whole_result
from roughvisc.units import Quantity, in_si, quantities, stated_quantity
from roughvisc.variables.axes import AXES

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger("roughvisc")
Array = NDArray[np.float64]
#: Folder of the further solves, in that of the results.
FOLDER = "budget"


@quantities(modulus_error="1", time_scale_error="1", cutoff="m")
def budget(
    case: Case | str | Path | xr.Dataset,
    quantity: str | Sequence[str] = "contact_area",
    *,
    at: Sequence[Quantity] | Quantity | None = None,
    sharp: bool = False,
    modulus_error: Quantity | None = None,
    time_scale_error: Quantity | None = None,
    cutoff: Quantity | None = None,
    population: Population | None = None,
    out: str | Path | None = None,
    client: Client | None = None,
    workers: int | None = None,
    progress: bool = True,
) -> xr.Dataset:
    r"""The whole error of a number of a case: by source, and together.

    Parameters
    ----------
    case : Case, path or xarray.Dataset
        A case, the study file that states one, or a result, whose attribute ``case`` states it.
    quantity : str or sequence of str
        ``contact_area``, ``mean_gap``, ``approach``, ``force``, ``friction_coefficient``, ``leak_rate``,
        ``thermal_conductance`` or ``incremental_stiffness``. The table ``observe`` of the study states the fluid, or
        what is conducted.
    at : float, str, or a sequence of these, optional
        Times or speeds, as the study has them; text states the unit. Default: all that the study keeps.
    sharp : bool
        Compute the case on cells half as long too, which costs four times as much as the case, takes the value from
        there, and makes the error of the grid some times smaller.
    modulus_error, time_scale_error : float or str, optional
        Relative errors of the moduli of the material and of its times, at 95 %: of a measured curve, or from batch
        to batch. Default of these and the next two: what the table ``want`` of the study states. Without them these
        sources stay open. [-]
    cutoff : float or str, optional
        Shortest wavelength that the real surface has, where it ends or where it no longer counts. Without it the
        waves that the scan does not hold stay open. [m]
    population : {"patch", "ensemble"}, optional
        Whether the number is of this patch, the default, or of the roughness that it is a sample of.
    out : path, optional
        Folder of the further solves, which are kept and used again. Default: ``budget`` in the folder of the results.
    client, workers
        Where to compute; as :func:`roughvisc.sweep` has them.
    progress : bool
        Show how far it is.

    Returns
    -------
    xarray.Dataset
        Over ``source`` and ``time`` or ``speed``: ``half_width``, of the logarithm at 95 %, missing where a source is
        open [-]; ``direction``, 1 or -1 of an error that only raises or lowers the number. Over ``source``:
        ``method``, in words; ``cost``, wall time of the solves that it took [s]; ``state``, one of ``counted``,
        ``none`` and ``open``. Over the places: ``value``, ``lower`` and ``upper``, in the unit of the quantity, and
        ``case_cost`` [s]. With ``population="ensemble"`` over the places too: ``surrogate_ratio``, the number over the
        mean of its Gaussian surrogates, and ``standing``, where it lies among them; the attribute ``kurtosis`` is that
        of the heights, and ``own_note`` says it where the surface is no random-phase surface. Of several quantities,
        over ``quantity`` too.

    Raises
    ------
    InputError
        If the input is wrong, the result states no case, or its case has no such quantity.
    RoughviscError
        If a solve fails.

    Notes
    -----
    Sources are taken as independent, in logarithms: :math:`Q e^{\pm U}`, :math:`U^2 = \sum U_i^2`; one with a
    direction counts on that side alone. An open source counts nowhere: the interval is that of the others. A number
    that is zero, as the leak rate of a closed gap, has no logarithm, and its interval is missing.

    See Also
    --------
    roughvisc.audit : what the model leaves out.
    """
    found = budgets(
        case,
        [quantity] if isinstance(quantity, str) else list(quantity),
        at=at,
        sharp=sharp,
        modulus_error=modulus_error,
        time_scale_error=time_scale_error,
        cutoff=cutoff,
        population=population,
        out=out,
        client=client,
        workers=workers,
        progress=progress,
    )
    if isinstance(quantity, str):
        return found[quantity]
    names = xr.DataArray(list(found), dims="quantity", name="quantity")
    together = xr.concat(list(found.values()), names, combine_attrs="drop_conflicts")
    return together.assign_coords(units=("quantity", [one["value"].attrs["units"] for one in found.values()]))


def budgets(
    case: Case | str | Path | xr.Dataset,
    names: Sequence[str],
    *,
    at: Sequence[Quantity] | Quantity | None = None,
    sharp: bool = False,
    modulus_error: Quantity | None = None,
    time_scale_error: Quantity | None = None,
    cutoff: Quantity | None = None,
    population: Population | None = None,
    out: str | Path | None = None,
    client: Client | None = None,
    workers: int | None = None,
    progress: bool = True,
) -> dict[str, xr.Dataset]:
    """Name of each of some quantities -> its :func:`budget`, all from the same solves."""
    kept, (case, folder) = _kept(case), case_of(case, out)
    if not names:
        raise InputError("quantity is empty: expected at least one")
    experiment = case.experiment()
    quantities = [known_quantity(name, experiment.axis, experiment.largest_speed > 0) for name in names]
    if population is not None and population not in get_args(Population):
        raise InputError(f"population is {population!r}: expected {' or '.join(map(repr, get_args(Population)))}")
    known = {
        "modulus_error": check_share("modulus_error", modulus_error),
        "time_scale_error": check_share("time_scale_error", time_scale_error),
        "cutoff": None if cutoff is None else stated_quantity(cutoff, "m", "cutoff", above=0),
        "population": population,
    }
    fields = tuple(dict.fromkeys(field for one in quantities for field in one.fields))
    axis = AXES[experiment.axis]
    given = in_si(at, axis.variables[axis.name].units, "at")
    places = None if given is None else np.atleast_1d(np.asarray(given, dtype=float)).tolist()
    base = with_rows(case, places, fields)
    stated = stated_by(kept or result_path(result_folder(case), case.key), quantities, axis.name, places)
    asked = Asked(Variants(base, base.height()), sharp, **known_errors(case, known), stated=stated)
    solves = asked.solves()
    if asked.stated.result is not None:
        del solves["own"]
    results = solved("budget", solves, folder, watch=watcher(progress), client=client, workers=workers)
    if asked.stated.result is not None:
        results["own"] = asked.stated.result
    try:
        rows = _rows_at(results["own"], experiment.axis, places)
        aligned = {name: _rows_at(one, experiment.axis, rows) for name, one in results.items()}
        return {one.name: _of_quantity(asked, one, aligned) for one in quantities}
    finally:
        for one in results.values():
            one.close()


def solved(
    what: str,
    solves: Mapping[Any, Case],
    folder: Path,
    *,
    watch: Monitor,
    client: Client | None = None,
    workers: int | None = None,
    threads: int | None = None,
    same_bits: bool = False,
    retry_failed: bool = False,
) -> dict[Any, xr.Dataset]:
    """Name -> whole result of each of some solves, from their files in a folder.

    Raises
    ------
    RoughviscError
        If one fails.
    """
    outcomes = run_cases(
        list(solves.values()),
        folder,
        watch=watch,
        client=client,
        workers=workers,
        threads=threads,
        same_bits=same_bits,
        retry_failed=retry_failed,
    )
    for name, one in solves.items():
        outcome = outcomes[one.key]
        if outcome.entry is None:
            raise RoughviscError(f"{what}: the solve {name!r} failed: {outcome.message}")
        if outcome.kind != "done":
            log.warning("%s: the solve %r: %s: %s", what, name, outcome.kind, outcome.message)
    return {name: whole_result(result_path(folder, one.key)) for name, one in solves.items()}


def case_of(case: Case | str | Path | xr.Dataset, out: str | Path | None) -> tuple[Case, Path]:
    """The case, and the folder of its further solves."""
    if isinstance(case, xr.Dataset):
        if "case" not in case.attrs:
            raise InputError("the result states no case: expected one of a study (rv.run, roughvisc run), or the study")
        stated, source = Case.from_json(case.attrs["case"]), case.encoding.get("source")
        beside = Path(source).parent if source else result_folder(stated)
    else:
        stated = case if isinstance(case, Case) else read_study(case)
        beside = result_folder(stated)
    return stated, Path(out).expanduser() if out is not None else beside / FOLDER


def _kept(case: Case | str | Path | xr.Dataset) -> Path | None:
    """The file of a result that is given."""
    source = case.encoding.get("source") if isinstance(case, xr.Dataset) else None
    return Path(source) if source else None


def known_errors(case: Case, given: Mapping[str, Any]) -> dict[str, Any]:
    """What is known of the errors of a case's numbers: as given, else as the study states it."""
    stated = case.settings.want
    found = {name: one if one is not None or stated is None else getattr(stated, name) for name, one in given.items()}
    return found | {"population": found["population"] or "patch"}


def _rows_at(result: xr.Dataset, axis: str, places: Any) -> xr.Dataset:
    """The rows of a result nearest to some places of its axis; all rows where None. Slides have theirs by the cell."""
    if places is None:
        return result
    wanted = np.asarray(places[axis].values if isinstance(places, xr.Dataset) else places, dtype=float)
    nearest = np.abs(result[axis].values[:, None] - wanted).argmin(axis=0)
    return result.isel({axis: nearest})


def _of_quantity(asked: Asked, quantity: Observable, results: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """The budget of one quantity."""
    observe = observed_with(asked.variants.case)
    values = {name: quantity.of(one, observe) for name, one in results.items()}
    own = results["own"]
    stated_error = quantity.stated_error(own, values["own"])
    judged = {source.name: source.judge(asked, quantity, values, stated_error) for source in SOURCES}
    seconds = {name: float(one["wall_time"].values[-1]) for name, one in results.items()}
    value = values["fine" if asked.sharp else "own"]
    axis = asked.variants.case.experiment().axis
    found = assembled(asked, quantity, judged, value, own[axis].values, seconds, seconds["own"])
    variables, attributes = own_statistics(asked, values, axis)
    return found.assign(variables).assign_attrs(attributes)


def observed_with(case: Case) -> Observe:
    """Keyword arguments of the observables of a case, as its study states them."""
    return {} if (stated := case.settings.observe) is None else stated.stated()


def assembled(
    asked: Asked,
    quantity: Observable,
    judged: Mapping[str, Found],
    value: Array,
    places: Array,
    seconds: Mapping[str, float],
    case_cost: float,
) -> xr.Dataset:
    """The budget of a quantity from what its sources make of it.

    Parameters
    ----------
    asked : Asked
        What is known beside the case.
    quantity : Observable
    judged : mapping
        Name -> what each source makes of it.
    value, places : ndarray
        Value of the quantity at each place of the axis, and those places.
    seconds : mapping
        Name of each solve -> its wall time [s].
    case_cost : float
        That of the case itself. [s]
    """
    case = asked.variants.case
    axis = case.experiment().axis
    with np.errstate(invalid="ignore"):
        known = np.where(np.abs(value) > 0, value, math.nan)
    down, up = (together(judged.values(), value.shape, side) for side in (-1, 1))
    half_width = [
        np.full(value.shape, math.nan) if one.half_width is None else one.half_width for one in judged.values()
    ]
    direction = [np.broadcast_to(one.direction, value.shape).astype("int8") for one in judged.values()]
    cost = [sum(seconds[name] for name in one.solves) for one in judged.values()]
    over, units = ("source", axis), {"units": quantity.units}
    return xr.Dataset(
        {
            "half_width": (over, half_width, {"units": "1", "long_name": "half-width of the logarithm at 95 %"}),
            "direction": (over, direction, _DIRECTION),
            "state": ("source", [_state(one) for one in judged.values()], {"long_name": "whether a source counts"}),
            "method": ("source", [one.method for one in judged.values()], {"long_name": "how it was found"}),
            "cost": ("source", cost, {"units": "s", "long_name": "wall time of the solves that it took"}),
            "value": (axis, value, units | {"long_name": quantity.name.replace("_", " ")}),
            "lower": (axis, known * np.exp(-down), units | {"long_name": "lower bound at 95 %"}),
            "upper": (axis, known * np.exp(up), units | {"long_name": "upper bound at 95 %"}),
            "case_cost": ((), case_cost, {"units": "s", "long_name": "wall time of the case itself"}),
        },
        coords={"source": list(judged), axis: (axis, places, {"units": AXES[axis].variables[axis].units})},
        attrs={
            "quantity": quantity.name,
            "population": asked.population,
            "case": case.to_json(),
            "title": case.title,
            "open": "; ".join(name for name, one in judged.items() if one.half_width is None),
        },
    )


_DIRECTION = {
    "long_name": "direction of the error",
    "flag_values": np.array([-1, 0, 1], dtype="int8"),
    "flag_meanings": "lowers both raises",
}


def _state(found: Found) -> Literal["counted", "none", "open"]:
    if found.half_width is None:
        return "open"
    return "counted" if found.counts else "none"


def together(found: Iterable[Found], shape: tuple[int, ...], side: int) -> Array:
    """Half-width of all sources on one side."""
    squares = np.zeros(shape)
    for one in found:
        if one.half_width is not None:
            towards = np.broadcast_to(one.direction, shape)
            squares += np.where((towards == 0) | (towards == side), one.half_width, 0.0) ** 2
    return np.sqrt(squares)
