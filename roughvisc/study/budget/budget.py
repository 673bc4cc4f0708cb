"""``budget``: the whole error of one number, source by source, from a few more solves of the same case."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.study.budget.solves import FOLDER, Array, Bench, Reading, finished_result, nearest_rows, read
from roughvisc.study.budget.sources import SURROGATES, Asked, Found, Population, Values, judge, known_errors, together
from roughvisc.study.budget.variants import Variants, with_rows
from roughvisc.study.case import Case, read_study
from roughvisc.study.ensembles import STANDING, STANDING_ATTRIBUTES, ratio, standing
from roughvisc.study.execution.monitor import watcher
from roughvisc.study.execution.run import result_folder
from roughvisc.study.quantities import Observable, known_quantity
from roughvisc.study.storage.store import result_path
from roughvisc.topography.parameters import parameters
from roughvisc.units import Quantity, in_si, quantities
from roughvisc.variables import AXES, VARIABLES

if TYPE_CHECKING:
    from distributed import Client


@quantities(modulus_error="1", time_scale_error="1", cutoff="m")
def budget(
    case: Case | str | Path | xr.Dataset,
    quantity: str | Sequence[str] = "contact_area",
    *,
    at: Sequence[Quantity] | Quantity | None = None,
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
    modulus_error, time_scale_error : float or str, optional
        Relative errors of the moduli of the material and of its times, at 95 %: of a measured curve, or from batch
        to batch. Without them these sources stay open. [-]
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
        known={
            "modulus_error": modulus_error,
            "time_scale_error": time_scale_error,
            "cutoff": cutoff,
            "population": population,
        },
        out=out,
        client=client,
        workers=workers,
        progress=progress,
    )
    if isinstance(quantity, str):
        return found[quantity]
    names = xr.DataArray(list(found), dims="quantity", name="quantity")
    over_all = xr.concat(list(found.values()), names, combine_attrs="drop_conflicts")
    return over_all.assign_coords(units=("quantity", [one["value"].attrs["units"] for one in found.values()]))


def budgets(
    case: Case | str | Path | xr.Dataset,
    names: Sequence[str],
    *,
    known: Mapping[str, Any] | None = None,
    at: Sequence[Quantity] | Quantity | None = None,
    out: str | Path | None = None,
    client: Client | None = None,
    workers: int | None = None,
    progress: bool = True,
) -> dict[str, xr.Dataset]:
    """Name of each of some quantities -> its :func:`budget`, all from the same solves.

    Parameters
    ----------
    known : mapping, optional
        Errors that are known: ``modulus_error``, ``time_scale_error``, ``cutoff``, ``population``.
    case, names, at, out, client, workers, progress
        As :func:`budget` has them.
    """
    source = case.encoding.get("source") if isinstance(case, xr.Dataset) else None
    case, folder = case_of(case, out)
    if not names:
        raise InputError(key="quantity", found=names, expected="at least one")
    quantities = [known_quantity(name, case) for name in names]
    errors = known_errors(known or {})
    axis = AXES[case.experiment().axis]
    given = in_si(at, VARIABLES[axis.name].units, "at")
    places = None if given is None else np.atleast_1d(np.asarray(given, dtype=float)).tolist()
    base = with_rows(case, places, [field for one in quantities for field in one.fields])
    finished = Path(source) if source else result_path(result_folder(case), case.key)
    whole = finished_result(finished, quantities, axis.name, places)
    asked = Asked(Variants(base, base.height()), **errors)
    solves = asked.solves()
    if whole is not None:
        del solves["own"]
    watch = partial(watcher, progress)
    bench = Bench(quantities, folder, watch, client=client, workers=workers, retry_failed=False, what="budget")
    with bench.results(solves) as results:
        one = results["own"] if whole is None else whole
        if places is not None:  # slides have theirs by the cell
            one = one.isel({axis.name: nearest_rows(one[axis.name], places)})
        own = read(one, base, quantities)
        readings = {name: read(result, base, quantities).at(own.places) for name, result in results.items()}
    readings["own"] = own
    return {one.name: _of_quantity(asked, one, readings) for one in quantities}


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


def _of_quantity(asked: Asked, quantity: Observable, readings: Mapping[str, Reading]) -> xr.Dataset:
    """The budget of one quantity."""
    own = readings["own"]
    values = {name: one.values[quantity.name] for name, one in readings.items()}
    judged = judge(asked, quantity, values, own.stated[quantity.name])
    seconds = {name: one.seconds for name, one in readings.items()}
    case = asked.variants.case
    found = assembled(case, asked.population, quantity, judged, values["own"], own.places, seconds)
    return _with_own_statistics(found, asked, values) if asked.draws else found


def assembled(
    case: Case,
    population: Population,
    quantity: Observable,
    judged: Mapping[str, Found],
    value: Array,
    places: Array,
    seconds: Mapping[str, float],
) -> xr.Dataset:
    """The budget of a quantity of a case from what its sources make of it.

    Parameters
    ----------
    case : Case
    population : {"patch", "ensemble"}
    quantity : Observable
    judged : mapping
        Name -> what each source makes of it.
    value, places : ndarray
        Value of the quantity at each place of the axis, and those places.
    seconds : mapping
        Name of each solve -> its wall time; ``own``: that of the case itself. [s]
    """
    axis, shape = case.experiment().axis, value.shape
    with np.errstate(invalid="ignore"):
        known = np.where(np.abs(value) > 0, value, math.nan)
    down, up = (together(judged.values(), shape, side) for side in (-1, 1))
    half_width = [
        np.broadcast_to(math.nan if one.half_width is None else one.half_width, shape) for one in judged.values()
    ]
    direction = [np.broadcast_to(one.direction, shape).astype("int8") for one in judged.values()]
    cost = [sum(seconds[name] for name in one.solves) for one in judged.values()]
    over, units = ("source", axis), {"units": quantity.units}
    return xr.Dataset(
        {
            "half_width": (over, half_width, {"units": "1", "long_name": "half-width of the logarithm at 95 %"}),
            "direction": (over, direction, _DIRECTION),
            "state": ("source", [one.state for one in judged.values()], {"long_name": "whether a source counts"}),
            "method": ("source", [one.method for one in judged.values()], {"long_name": "how it was found"}),
            "cost": ("source", cost, {"units": "s", "long_name": "wall time of the solves that it took"}),
            "value": (axis, value, units | {"long_name": quantity.name.replace("_", " ")}),
            "lower": (axis, known * np.exp(-down), units | {"long_name": "lower bound at 95 %"}),
            "upper": (axis, known * np.exp(up), units | {"long_name": "upper bound at 95 %"}),
            "case_cost": ((), seconds["own"], {"units": "s", "long_name": "wall time of the case itself"}),
        },
        coords={"source": list(judged), axis: (axis, places, {"units": VARIABLES[axis].units})},
        attrs={
            "quantity": quantity.name,
            "population": population,
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


def _with_own_statistics(found: xr.Dataset, asked: Asked, values: Values) -> xr.Dataset:
    """A budget that states how its number compares with surfaces of random phases and the same spectrum.

    The number is that on cells twice as long, on which the surrogates are.
    """
    drawn = np.array([values[name] for name in SURROGATES])
    over_mean, stands = ratio(values["coarse"], drawn.mean(axis=0)), standing(values["coarse"], drawn)
    kurtosis = float(parameters(asked.variants.height)["Sku"])
    attributes: dict[str, Any] = {"kurtosis": kurtosis}
    apart = [STANDING[number] not in ("inside", "not_known") for number in stands]
    if any(apart):
        ends = dict.fromkeys(f"{one:.2g}" for one in (over_mean[apart].min(), over_mean[apart].max()))
        attributes["own_note"] = (
            f"not a random-phase surface: the number is {' to '.join(ends)} of the mean of {len(SURROGATES)} Gaussian "
            f"surrogates, outside the 99 % in which they scatter. Heights have a kurtosis of {kurtosis:.2g} "
            "(3: Gaussian). The spectrum alone does not give the number; the value stays that of the surface"
        )
    of_mean = {"units": "1", "long_name": "ratio to the mean of its surrogates"}
    (axis,) = found["value"].dims
    return found.assign(
        surrogate_ratio=(axis, over_mean, of_mean), standing=(axis, stands, STANDING_ATTRIBUTES)
    ).assign_attrs(attributes)
