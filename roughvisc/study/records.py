"""Records of indentation: read, fitted by a material, and turned into programs for a prediction."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.mechanics.materials.indentation import Indentation, bands, contact_point, fitted_weights, noise_of
from roughvisc.mechanics.materials.material import Prony, check_poisson
from roughvisc.mechanics.materials.models import relaxation_series
from roughvisc.mechanics.program import Program
from roughvisc.paths import path_of
from roughvisc.study.machine_history import thinned
from roughvisc.tables import Wanted, read_table, read_text
from roughvisc.topography.recipes import indenter_of
from roughvisc.units import Quantity, listed, quantities

Array = NDArray[np.float64]

#: Mark of an export of JPK and of Optics11, and its columns.
_EXPORTS: tuple[tuple[re.Pattern[str], dict[str, str]], ...] = (
    (
        re.compile("# fancyNames:"),
        {"time": "Series Time", "force": "Vertical deflection", "height": "Height (measured)"},
    ),
    (
        re.compile(r"Load \(uN\).*Cantilever \(nm\)\tPiezo \(nm\)"),
        {"time": "Time", "force": "Load", "piezo": "Piezo", "deflection": "Cantilever"},
    ),
)
#: Part of the largest force or depth from which on a row is at the end of the approach, part of the largest force at
#: which depths begin, and shortest hold over the approach.
_REACHED = 0.98
_TOUCHED = 0.05
_HELD = 0.1
#: Smallest fall of the depth, over its largest value, that begins the retraction.
_FALL = 0.005
#: Largest number of rows of a fit; more are averaged. Smallest number of rows in contact.
_MOST_ROWS = 600
_LEAST_ROWS = 20
#: Largest half-width of an interval of 90 %, over the modulus: beyond it the modulus is not determined.
_WIDEST = 0.5
#: Largest noise of the depth, over its rise: with 3e-4 and 1e-3, intervals of 90 % cover 86 and 20 %.
_NOISIEST = 5e-4
#: Part of the largest force below which the contact point lies.
_SEARCHED = 0.2


@quantities(spring="N/m > 0")
def read_record(
    path: str | Path,
    *,
    time: str = "time",
    force: str = "force",
    approach: str | None = None,
    height: str | None = None,
    spring: Quantity | None = None,
) -> xr.Dataset:
    """Read a record of indentation: force and depth against time.

    Parameters
    ----------
    path : path
        A text export of JPK or Optics11, without any other argument, or a table with a heading; see Notes.
    time, force : str
        Names of the columns of time and force, compression positive.
    approach : str, optional
        Name of the column of the depth of the tip, larger towards the sample, from any zero. Default: ``"approach"``
        unless `height` is given; of Optics11 the piezo minus the cantilever.
    height : str, optional
        Name of the column of the height of the piezo, smaller towards the sample, instead of `approach`. The depth is
        the fall of the height minus the deflection, which is the force over `spring`.
    spring : float or str, optional
        Stiffness of the cantilever, with `height`. Default for JPK: as the file states. [N/m]

    Returns
    -------
    xarray.Dataset, dims (time)
        ``force`` [N] and ``approach`` [m], from the first row; coordinate ``segment`` with the words ``approach``,
        ``hold`` and ``retract``.

    Raises
    ------
    InputError
        If the file or a column cannot be read, times do not increase, the stiffness is absent, or no force is positive.

    See Also
    --------
    roughvisc.fit_material, roughvisc.read_program

    Notes
    -----
    The approach ends where the force or the depth reaches 98 % of its largest value. The retraction begins where the
    depth falls by 0.5 % and by more than its noise. Without a hold, both are the row of the largest depth.

    Units are in the heading, as in :func:`roughvisc.read_program`. Calibration, the zero of the force, tilt and drift
    are the task of the programs of the instrument; ``record["force"] -= ...`` subtracts an offset.

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open(f"{folder}/curve.csv", "w") as file:
    ...         _ = file.write("time [s], force [uN], approach [um]\\n0, 0, 0\\n1, 1, 1\\n2, 3, 2\\n3, 1, 1\\n")
    ...     record = rv.read_record(f"{folder}/curve.csv")
    >>> record.force.max().item()
    3e-06
    """
    path = path_of(path, "path")
    try:
        text = read_text(path)
    except UnicodeError as error:
        raise InputError(f"{path}: cannot be read as text: {error}", key="path", found=str(path)) from error
    if stated := re.search(r"^# springConstant: (\S+)", text, re.MULTILINE):
        spring = float(stated[1]) if spring is None else spring
    names: dict[str, Any] = {"time": time, "force": force, "approach": "approach"}
    for is_export, columns_of_export in _EXPORTS:
        if is_export.search(text):
            names = dict(columns_of_export)
    if approach is not None or height is not None:
        names = {"time": names["time"], "force": names["force"]}
        names |= {"height": height} if approach is None else {"approach": approach}
    units = {"time": "s", "force": "N"}
    columns, lines = read_table(path, {key: Wanted(name, units.get(key, "m")) for key, name in names.items()})
    falls = np.diff(columns["time"]) < 0
    if falls.any():
        row = falls.argmax() + 1
        key = f"{path}, line {lines[row]}: time"
        raise InputError(key=key, found=columns["time"][row], expected="increasing times")
    if columns["force"].max() <= 0:
        highest = float(columns["force"].max())
        raise InputError(key="force", found=highest, expected="a positive force, compression positive")
    if "height" in columns:
        if spring is None:
            raise InputError(key="spring", found=spring, expected="the stiffness of the cantilever [N/m], with height")
        depth = -columns["height"] - columns["force"] / spring
    elif "piezo" in columns:
        depth = columns["piezo"] - columns["deflection"]
    else:
        depth = columns["approach"]
    rows = np.append(True, np.diff(columns["time"]) > 0)
    kept, force_rows, depth = (values[rows] for values in (columns["time"], columns["force"], depth))
    record = label(xr.Dataset({"force": ("time", force_rows), "approach": ("time", depth - depth[0])}, {"time": kept}))
    record["approach"].attrs["comment"] = "depth of the tip from the first row"
    return record.assign_coords(segment=("time", _segments(kept, force_rows, depth)))


def _segments(time: Array, force: Array, depth: Array) -> NDArray[np.str_]:
    """Return the segment of each row."""
    force = force - np.median(force[: max(1, force.size // 50)])
    touched = int(np.argmax(force > _TOUCHED * force.max()))
    rise = depth - depth[touched]
    reached = (force >= _REACHED * force.max()) | (rise >= _REACHED * rise.max())
    first = int(np.argmax(reached))
    noise = 1.5 * float(np.median(np.abs(np.diff(depth[reached])))) if np.count_nonzero(reached) > 1 else 0.0
    last = int(np.flatnonzero(rise >= rise.max() - max(4 * noise, _FALL * rise.max()))[-1])
    if last <= first or time[last] - time[first] < _HELD * (time[first] - time[touched]):
        first = last = int(np.argmax(rise))
    words = np.full(time.size, "hold", dtype="<U8")
    words[: first + 1] = "approach"
    words[last + 1 :] = "retract"
    return words


@dataclass(frozen=True)
class MaterialFit:
    """Material that fits a record of indentation.

    Attributes
    ----------
    material : Prony
        Positive series; its ``note`` states the rows, the misfit and the time up to which it is known.
    contact_point, contact_point_error : float
        Approach at first touch, and half-width of its interval of 90 %; zero if it was given. [m]
    bands : xarray.Dataset, dims (time)
        ``relaxation_modulus`` with the ends of its interval of 90 %, ``relaxation_modulus_low`` and
        ``relaxation_modulus_high``, at the times since a step at which the record determines it. [Pa]
    misfit : float
        Root mean square of the misfit, over the largest force, or over the largest power of the depth in creep. [-]
    """

    material: Prony
    contact_point: float
    contact_point_error: float
    bands: xr.Dataset = field(repr=False)
    misfit: float

    def contact_time(self, record: xr.Dataset) -> float:
        """Return the time of the last row before the contact point is passed, which is time zero of the program. [s]"""
        return float(record["time"][self._contact_row(record)])

    def _contact_row(self, record: xr.Dataset) -> int:
        return max(int(np.argmax(record["approach"].values > self.contact_point)) - 1, 0)

    def program(self, record: xr.Dataset, control: Literal["approach", "load"] = "approach") -> Program:
        """Return the course of a record since first touch as a program, for :func:`roughvisc.simulate`.

        Parameters
        ----------
        record : xarray.Dataset
            A record, up to any row. Time zero of the program is :meth:`contact_time`.
        control : {"approach", "load"}
            Prescribed quantity. Negative loads count as zero.

        Returns
        -------
        Program
            Straight lines that pass every row within 0.1 % of the largest value.
        """
        one_of("control", control, ("approach", "load"))
        time, depth, force = (record[name].values for name in ("time", "approach", "force"))
        start = self._contact_row(record)
        values = depth[start:] - self.contact_point if control == "approach" else np.maximum(force[start:], 0.0)
        values[0] = 0.0
        kept = thinned(time[start:], values, 1e-3 * float(np.abs(values).max()))
        times = (time[start:] - time[start])[kept]
        return Program.table(times.tolist(), values[kept].tolist(), control)


@quantities(contact_point="m", drift="m/s >= 0")
def fit_material(
    record: xr.Dataset,
    tip: xr.DataArray,
    terms: Sequence[Quantity] | None = None,
    *,
    kind: Literal["auto", "relaxation", "creep"] = "auto",
    poisson: float = 0.5,
    contact_point: Quantity | None = None,
    drift: Quantity = 0.0,
) -> MaterialFit:
    r"""Fit a material to the approach and the hold of a record of indentation.

    Parameters
    ----------
    record : xarray.Dataset, dims (time)
        A record as :func:`roughvisc.read_record` returns it, or a part of its rows. Retraction is left out.
    tip : xarray.DataArray
        A sphere or a cone, from :func:`roughvisc.sphere` or :func:`roughvisc.cone`, of any grid.
    terms : sequence of float or str, optional
        Relaxation or retardation times of a solid. Default: as many as the record shows, and flow. [s]
    kind : {"auto", "relaxation", "creep"}
        ``relaxation`` fits the force at the measured depths by a relaxation modulus. ``creep`` fits the depth at the
        measured forces by a creep compliance; contact point and intervals are the same. ``auto`` is ``creep`` if the
        force is held.
    poisson : float
        Poisson ratio, constant in time. [-]
    contact_point : float or str, optional
        Approach at first touch. Default: a search, of which the intervals include the error. [m]
    drift : float or str
        Standard deviation of an unknown constant drift of the height, which the intervals include. A record cannot
        distinguish drift from slow relaxation. [m/s]

    Returns
    -------
    MaterialFit

    Raises
    ------
    InputError
        If the tip is another one; if the record has too few rows in contact, no rows before the contact, or depths
        with a noise of more than 5e-4 of the largest one (of the mean of rows beyond 600); if it does not determine the
        modulus at any time, or a requested time of a term.

    See Also
    --------
    roughvisc.read_record, roughvisc.closed_forms.lee_radok

    Notes
    -----
    While the contact grows, with :math:`k = 8 \sqrt R / 3 (1 - \nu)` and :math:`n = 3/2` for a sphere of radius
    :math:`R`, and :math:`k = 4 / \pi m (1 - \nu)` and :math:`n = 2` for a cone of slope :math:`m` [1]_,

    .. math:: F(t) = k \int_0^t G(t - s) \, \mathrm d \delta^n(s), \quad
              \delta^n(t) = \frac{1}{k} \int_0^t J(t - s) \, \mathrm d F(s).

    Non-negative least squares give the moduli or compliances of a series of exponentials. The intervals of 90 % do not
    depend on `terms`: they contain the series of any times that fit the record as well, see
    :func:`roughvisc.mechanics.materials.indentation.bands`.
    The sphere is a paraboloid, the sample a half-space without adhesion.

    References
    ----------
    .. [1] E. H. Lee, J. R. M. Radok, *J. Appl. Mech.* 27 (1960) 438-444.

    Examples
    --------
    >>> import numpy as np
    >>> import roughvisc as rv
    >>> import xarray as xr
    >>> time = np.linspace(0.0, 2.0, 201)
    >>> depth = 1e-6 * np.minimum(time, 1.0)
    >>> force = 16 / 3 * 1e3 * 1e-5**0.5 * depth**1.5  # Hertz, for a shear modulus of 1 kPa
    >>> segment = np.where(time < 1.0, "approach", "hold")
    >>> rows = {"force": ("time", force), "approach": ("time", depth), "segment": ("time", segment)}
    >>> record = xr.Dataset(rows, {"time": time}).set_coords("segment")
    >>> fit = rv.fit_material(record, rv.sphere("10 um", "12 um", 16), contact_point=0.0)
    >>> round(1 / float(fit.material.creep_compliance(0.0)), 3)
    1000.0
    """
    check_poisson(poisson)
    one_of("kind", kind, ("auto", "relaxation", "creep"))
    rows, is_creep = _rows(record, *_elastic_contact(tip, poisson))
    is_creep = kind == "creep" or (kind == "auto" and is_creep)
    searched = contact_point is None
    contact = _found_contact(rows) if contact_point is None else float(contact_point)
    in_contact = np.count_nonzero(rows.depth > contact)
    if in_contact < _LEAST_ROWS:
        raise InputError(key="record", found=f"{in_contact} rows in contact", expected=f"at least {_LEAST_ROWS}")
    known = bands(rows, contact, drift, searched=searched)
    is_known = known.high - known.low <= 2 * _WIDEST * known.modulus
    if not is_known.any():
        expected = "a record that determines the modulus to half of itself: less noise, or a longer hold"
        raise InputError(key="record", found="wider intervals at all times", expected=expected)
    times = rows.terms() if terms is None else listed(terms, "s", "terms")
    shortest = known.time[is_known][0]
    longest = 3 * known.time[is_known][-1]
    for i, time in enumerate(() if terms is None else times):
        if not shortest <= time <= longest:
            expected = f"a relaxation time that the record determines, from {shortest:.3g} to {longest:.3g} s"
            raise InputError(key=f"terms.{i}", found=float(time), expected=expected)
    columns, target = (
        (rows.creep_columns(times), rows.power(contact)) if is_creep else (rows.columns(contact, times), rows.force)
    )
    if is_creep and terms is not None:
        columns[:, 1] = 0.0  # no flow
    weights, misfit = fitted_weights(columns, target)
    misfit = misfit / float(np.sqrt(target.size) * target.max())
    first = weights.size - times.size
    used = weights[first:] > 0
    note = f"{np.count_nonzero(used)} terms fitted to {target.size} rows of an indentation, rms misfit {misfit:.2g} "
    note += f"of the largest {'power of the depth' if is_creep else 'force'}; known up to {known.time[-1]:.3g} s"
    strengths: Any = weights[first:][used]
    own_times: Any = times[used]
    if is_creep:
        material = Prony(float(weights[0]), float(weights[1]) / rows.length, strengths, own_times, poisson, note=note)
    else:
        material = relaxation_series(float(weights[0]), strengths, own_times, poisson, note=note)
    ends = {"": known.modulus, "_low": known.low, "_high": known.high}
    described = {f"relaxation_modulus{end}": ("time", values[is_known]) for end, values in ends.items()}
    return MaterialFit(
        material,
        contact,
        known.contact_error,
        label(xr.Dataset(described, {"time": known.time[is_known]})),
        misfit,
    )


def _elastic_contact(tip: Any, poisson: float) -> tuple[float, float]:
    """Return ``k`` and ``n`` of the elastic contact, ``F = k G depth^n``."""
    known: Any = indenter_of(tip)
    about = known[0].keywords if known is not None else {}
    if "slope" in about:
        return 4 / (np.pi * about["slope"] * (1 - poisson)), 2.0
    if "radius" in about and np.isfinite(tip).all():
        return 8 * np.sqrt(about["radius"]) / (3 * (1 - poisson)), 1.5
    raise InputError(key="tip", found=type(tip).__name__, expected="a tip from rv.sphere or rv.cone, as it was made")


def _rows(record: xr.Dataset, factor: float, exponent: float) -> tuple[Indentation, bool]:
    """Return the rows of approach and hold, averaged if there are many, and whether the force is held."""
    for name in ("approach", "force", "segment"):
        if name not in getattr(record, "variables", ()):
            raise InputError(key="record", found=f"no {name!r}", expected="a record from rv.read_record")
    loading = record.isel(time=record["segment"].values != "retract")
    columns = [np.asarray(loading[name].values, dtype=float) for name in ("time", "force", "approach")]
    size = columns[0].size
    if size < _LEAST_ROWS or columns[1].max() <= 0:
        expected = f"at least {_LEAST_ROWS} rows of approach and hold, with a positive force"
        raise InputError(key="record", found=f"{size} rows", expected=expected)
    starts = np.unique(np.linspace(0, size, min(size, _MOST_ROWS), endpoint=False).astype(int))
    counts = np.diff(np.append(starts, size))
    time, force, depth = (np.add.reduceat(column, starts) / counts for column in columns)
    rows = Indentation(time, force, depth, factor, exponent)
    noise = noise_of(depth) / float(np.ptp(depth[force > _TOUCHED * force.max()]))
    if noise > _NOISIEST:
        expected = f"at most {_NOISIEST:g} of the largest depth; average or smooth the depths"
        raise InputError(
            key="record", found=f"depths with a noise of {noise:.2g} of the largest depth", expected=expected
        )
    is_held = loading["segment"].values == "hold"
    share_in_hold = [np.ptp(column[is_held]) / np.ptp(column) if is_held.any() else 1.0 for column in columns[1:]]
    return rows, bool(share_in_hold[0] < share_in_hold[1])


def _found_contact(rows: Indentation) -> float:
    """Return the contact point; refuse a record that does not show it."""
    above = int(np.argmax(rows.force > _SEARCHED * rows.force.max()))
    low = float(rows.depth.min())
    high = float(rows.depth[above])
    contact = contact_point(rows, low, high) if high > low else low
    if contact <= low + 1e-3 * (high - low):
        expected = "a record that begins before the contact, with an offset of the force subtracted, or contact_point"
        raise InputError(key="contact_point", found="no rows before the contact", expected=expected)
    return contact
