"""Realisations of one case drawn as one: their mean, the prediction interval, and the measured scan."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from roughvisc.study.realisations import statistics
from roughvisc.study.sweep_table import ITSELF
from roughvisc.variables import NOT_CONVERGED, axis_of

#: How the measured surface itself is drawn.
ITSELF_STYLE = {"ls": (0, (4, 1.5)), "lw": 1.1}


@dataclass(frozen=True)
class Band:
    """Prediction interval of a single realisation of a case.

    Attributes
    ----------
    lower, upper : xarray.Dataset
        Ends of the interval at 95 %, of every history; missing where there is none.
    count : int
        Number of realisations.
    itself : xarray.Dataset or None
        The measured surface itself, whose surrogates they are.
    """

    lower: xr.Dataset
    upper: xr.Dataset
    count: int
    itself: xr.Dataset | None


def pooled(members: Sequence[xr.Dataset], numbers: Sequence[int]) -> tuple[xr.Dataset, Band]:
    """Mean of the realisations of one case over common rows, and their band.

    Parameters
    ----------
    members : sequence of xarray.Dataset
        Histories of each, over rows of its own.
    numbers : sequence of int
        Number of each realisation.
    """
    itself = next((one for one, number in zip(members, numbers, strict=True) if number == ITSELF), None)
    drawn = [one for one, number in zip(members, numbers, strict=True) if number != ITSELF] or list(members)
    rows = axis_of(drawn[0].variables)
    mean, lower, upper = _of_rows(drawn, rows)
    if itself is not None and not np.array_equal(itself[rows], mean[rows]):
        common = np.asarray(mean[rows].values)
        names = [str(name) for name, one in itself.data_vars.items() if one.dims == (rows,)]
        at_rows = {name: xr.Variable(rows, _at(itself, name, rows, common), itself[name].attrs) for name in names}
        itself = itself.drop_dims(rows).assign(at_rows).assign_coords({rows: mean[rows]})
    band = Band(xr.Dataset(lower), xr.Dataset(upper), len(drawn), itself)
    return xr.Dataset(mean, attrs=drawn[0].attrs), band


def _of_rows(drawn: Sequence[xr.Dataset], rows: str) -> tuple[dict, dict, dict]:
    places = [one[rows].values for one in drawn]
    if all(np.array_equal(one, places[0]) for one in places):
        common = places[0]
    else:
        common = np.unique(np.concatenate(places))
        common = common[(common >= max(one.min() for one in places)) & (common <= min(one.max() for one in places))]
    held = (str(name) for name, one in drawn[0].data_vars.items() if one.dims == (rows,))
    names = [name for name in held if all(name in one for one in drawn)]
    return _moments(drawn, names, rows, common)


def _moments(
    drawn: Sequence[xr.Dataset], names: Sequence[str], rows: str, common: np.ndarray
) -> tuple[dict, dict, dict]:
    """Mean and band of some histories at common places, and these."""
    mean, lower, upper = ({rows: xr.Variable(rows, common, drawn[0][rows].attrs)} for _ in range(3))
    for name in names:
        attrs = drawn[0][name].attrs
        if "flag_values" in attrs:
            told = np.array([_at(one, name, rows, common, nearest=True) for one in drawn])
            bad = (told == NOT_CONVERGED).any(axis=0)  # the worst that any of them tells
            mean[name] = xr.Variable(rows, np.where(bad, NOT_CONVERGED, told[0]), attrs)
            continue
        found = statistics(np.array([_at(one, name, rows, common) for one in drawn], dtype=float))
        mean[name] = xr.Variable(rows, found["mean"], attrs)
        lower[name] = xr.Variable(rows, found["patch_lower"], attrs)
        upper[name] = xr.Variable(rows, found["patch_upper"], attrs)
    return mean, lower, upper


def _at(member: xr.Dataset, name: str, rows: str, common: np.ndarray, nearest: bool = False) -> np.ndarray:
    """Values of a history at some places."""
    places, values = member[rows].values, member[name].values
    known = np.isfinite(places)
    places, values = places[known], values[known]
    order = np.argsort(places, kind="stable")
    places, values = places[order], values[order]
    if np.array_equal(places, common):
        return values
    if nearest:
        return values[np.clip(np.searchsorted(places, common), 0, len(places) - 1)]
    return np.interp(common, places, values)


def draw_band(ax: Axes, x: np.ndarray, lower: np.ndarray, upper: np.ndarray, colour, joined: bool = True) -> None:
    """Shade a band, or draw a bar at each place where places are not joined."""
    if joined:
        ax.fill_between(x, lower, upper, color=colour, alpha=0.22, lw=0, zorder=1)
    else:
        ax.vlines(x, lower, upper, color=colour, alpha=0.35, lw=5, zorder=1)


def band_legend(bands: Iterable[Band | None]) -> dict[str, Artist]:
    """Entries of a legend that say what lines and bands are; none without realisations."""
    known = [band for band in bands if band is not None]
    if not known:
        return {}
    counts = sorted({band.count for band in known})
    number = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    surrogates = any(band.itself is not None for band in known)
    drawn = "Gaussian surrogates" if surrogates else "realisations"
    named: dict[str, Artist] = {f"mean of {number} {drawn}": Line2D([], [], color="0.3", lw=1.6)}
    named["95 % prediction interval"] = Patch(color="0.3", alpha=0.22, lw=0)
    if surrogates:
        named["measured scan"] = Line2D([], [], color="0.3", **ITSELF_STYLE)
    return named
