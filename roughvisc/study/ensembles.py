"""Statistics of a number over the realisations of a surface: mean, scatter, and intervals."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.stats
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.study.sweep_table import ITSELF, REALISATION

Array = NDArray[np.float64]
#: Confidence of the intervals.
LEVEL = 0.95
#: Confidence from which on a surface stands outside its surrogates.
APART = 0.99
#: Where a measured surface stands among its surrogates; the values of ``standing``, in order.
STANDING = ("inside", "below", "above", "not_known")
_NOT_KNOWN = STANDING.index("not_known")


def over_realisations(values: xr.DataArray) -> xr.Dataset:
    r"""Mean, scatter and 95 % intervals of a quantity over the realisations of a surface.

    Parameters
    ----------
    values : xarray.DataArray
        A quantity with a dimension ``realisation``, such as ``results.contact_area`` of a sweep with ``realisations``,
        in any unit. Realisation 0, a measured surface itself, is no sample of its surrogates and does not count among
        them.

    Returns
    -------
    xarray.Dataset
        Over the other dimensions, in the unit of the quantity:

        - ``mean`` and ``standard_deviation`` (of the sample, with :math:`n - 1`);
        - ``lower`` and ``upper``, the interval of the mean;
        - ``patch_lower`` and ``patch_upper``, the interval of one more patch, to which a single measurement belongs;
        - with realisation 0 its value ``itself``, its ``ratio`` to the mean [-], and ``standing``, whether it lies
          inside the interval of a patch at 99 %, one of its ``flag_values``.

        ``count`` is the number of known values, and ``zeros`` how many of them are zero.

    Raises
    ------
    InputError
        If there is no such dimension.

    Notes
    -----
    Values that are not finite are missing. If all others are positive, the intervals are taken in logarithms, with the
    mean :math:`m` and the standard deviation :math:`s` of the :math:`n` logarithms and Student's quantile :math:`t` of
    :math:`n - 1`: that of the mean is :math:`m + s^2/2 \pm t \sqrt{s^2/n + s^4/(2(n-1))}` [1]_, which holds the mean
    of log-normal values in 92 to 95 of 100 samples of 4 or more with :math:`s \le 1.2`; that of a patch is
    :math:`m \pm t s \sqrt{1 + 1/n}`. With values of both signs they are those of Student. A quantity that is never
    negative, but zero in some realisations, such as the leak rate of a closed gap, has no interval: how often it is
    zero is told by ``zeros``. Nor is there one of fewer than two values.

    References
    ----------
    .. [1] U. Olsson, Confidence intervals for the mean of a log-normal distribution, J. Stat. Educ. 13 (2005) 1.

    Examples
    --------
    >>> import numpy as np, roughvisc as rv, xarray as xr
    >>> area = xr.DataArray(np.exp([0.1, -0.1, 0.2, -0.2]), dims="realisation", attrs={"units": "m^2"})
    >>> found = rv.over_realisations(area)
    >>> [round(float(found[name]), 3) for name in ("lower", "mean", "upper")]
    [0.758, 1.013, 1.364]
    """
    if REALISATION not in values.dims:
        over = ", ".join(map(str, values.dims)) or "nothing"
        raise InputError(
            f"{values.name or 'values'} lies over {over}: expected a dimension {REALISATION!r}, as a sweep with "
            "realisations = 24 has it"
        )
    drawn = values
    if REALISATION in values.coords:
        drawn = values.isel({REALISATION: values[REALISATION].values != ITSELF})
    found = statistics(drawn.transpose(REALISATION, ...).values)
    rest = values.isel({REALISATION: 0}, drop=True)
    rest = rest.drop_vars([name for name, one in values.coords.items() if REALISATION in one.dims], errors="ignore")
    dims = tuple(str(dim) for dim in values.dims if dim != REALISATION)
    units = {"units": values.attrs["units"]} if "units" in values.attrs else {}
    called = str(values.attrs.get("long_name", values.name or "values"))
    attributes: dict[str, dict[str, Any]] = {
        name: (units if name not in _COUNTS else {"units": "1"}) | {"long_name": f"{words} of {called}"}
        for name, words in _WORDS.items()
    }
    variables = {name: (dims, one, attributes[name]) for name, one in found.items()}
    if drawn.sizes[REALISATION] < values.sizes[REALISATION]:
        itself = values.sel({REALISATION: ITSELF}).transpose(*dims).values
        variables |= {
            "itself": (dims, itself, units | {"long_name": f"{called} of the measured surface itself"}),
            "ratio": (dims, ratio(itself, found["mean"]), {"units": "1", "long_name": "ratio to the mean"}),
            "standing": (dims, standing(itself, drawn.transpose(REALISATION, ...).values), STANDING_ATTRIBUTES),
        }
    return xr.Dataset(variables, rest.coords, {"quantity": str(values.name or ""), "confidence": LEVEL})


_WORDS = {
    "mean": "mean",
    "standard_deviation": "standard deviation",
    "lower": "lower bound of the mean at 95 %",
    "upper": "upper bound of the mean at 95 %",
    "patch_lower": "lower bound at 95 % of a patch",
    "patch_upper": "upper bound at 95 % of a patch",
    "count": "number of known values",
    "zeros": "number of zeros",
}
_COUNTS = ("count", "zeros")
STANDING_ATTRIBUTES = {
    "long_name": "where the surface itself stands in the interval of a patch at 99 %",
    "flag_values": np.arange(len(STANDING), dtype="int8"),
    "flag_meanings": " ".join(STANDING),
}


def statistics(values: Array, level: float = LEVEL) -> dict[str, Array]:
    """What :func:`over_realisations` gives, of values over (realisation, ...), at a level of confidence."""
    known = np.isfinite(values)
    count = known.sum(axis=0)
    with np.errstate(all="ignore"):  # what is missing or zero gives no number, and is meant to
        mean, deviation = _moments(values, known, count)
        positive = np.where(known, values, 1.0).min(axis=0, initial=1.0) > 0
        logarithms = np.where(known & positive, np.log(np.where(known & positive, values, 1.0)), np.nan)
        middle, spread = _moments(logarithms, known & positive, count)
        student = scipy.stats.t.ppf((1 + level) / 2, np.where(count > 1, count - 1, np.nan))
        of_mean, of_patch = student / np.sqrt(count), student * np.sqrt(1 + 1 / count)
        half = student * np.sqrt(spread**2 / count + spread**4 / (2 * (count - 1)))
        centre = middle + spread**2 / 2
        found = {
            "lower": np.where(positive, np.exp(centre - half), mean - of_mean * deviation),
            "upper": np.where(positive, np.exp(centre + half), mean + of_mean * deviation),
            "patch_lower": np.where(positive, np.exp(middle - of_patch * spread), mean - of_patch * deviation),
            "patch_upper": np.where(positive, np.exp(middle + of_patch * spread), mean + of_patch * deviation),
        }
        zeros = (values == 0).sum(axis=0)
        unknown = (zeros > 0) & (np.where(known, values, 0.0).min(axis=0, initial=0.0) >= 0)
    found = {name: np.where(unknown, np.nan, one) for name, one in found.items()}
    return {"mean": mean, "standard_deviation": deviation, **found, "count": count, "zeros": zeros}


def _moments(values: Array, known: NDArray[np.bool_], count: NDArray[np.intp]) -> tuple[Array, Array]:
    """Mean, and standard deviation of the sample, of the known values over the first axis."""
    mean = np.where(count > 0, np.where(known, values, 0.0).sum(axis=0) / count, np.nan)
    squares = (np.where(known, values - mean, 0.0) ** 2).sum(axis=0)
    return mean, np.where(count > 1, np.sqrt(squares / (count - 1)), np.nan)


def standing(itself: Array, values: Array) -> NDArray[np.int8]:
    """Where a value stands among those of other patches, over (realisation, ...): numbers of :data:`STANDING`."""
    found = statistics(values, APART)
    below, above = itself < found["patch_lower"], itself > found["patch_upper"]
    known = np.isfinite(itself) & np.isfinite(found["patch_lower"])
    return np.where(known, np.where(below, 1, np.where(above, 2, 0)), _NOT_KNOWN).astype("int8")


def ratio(itself: Array, mean: Array) -> Array:
    """A value over the mean of others; missing where that is zero. [-]"""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(mean != 0, itself / mean, np.nan)
