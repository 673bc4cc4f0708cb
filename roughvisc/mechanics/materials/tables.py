"""Materials from measurements: creep, relaxation, or dynamic moduli, in shear or in tension.

Each table is fitted by a positive series of exponentials (non-negative least squares), which is a passive material.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
import scipy  # which imports a submodule when it is first used: scipy.optimize takes 0.2 s
from numpy.typing import ArrayLike, NDArray

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.material import Prony, ThermalLaw, remembers_model
from roughvisc.mechanics.materials.models import Kind, relaxation_series, tensile_to_shear
from roughvisc.mechanics.materials.series import lattice, nonnegative
from roughvisc.mechanics.materials.superposition import Vertical, groups_of, superpose
from roughvisc.units import Quantity, format_quantity, listed, number, quantities

Array = NDArray[np.float64]
#: Columns of a table.
Columns = tuple[Array, ...]

#: Numbers of terms per decade to try in turn.
_OFFERED = (1, 1.5, 2, 3, 4, 6, 12, 24)
#: A fit with fewer terms may have an rms misfit larger by this factor than the smallest one.
_FEWER = 1.1
#: Number of values per decade below which a smooth spectrum is fitted, and the terms per decade of this spectrum.
#: Weight of the differences between neighbouring terms, relative to the misfit of the rows.
_FEW = 2.5
_SMOOTH = 3
_STEPS = 0.01
#: Largest time of a term, over the last time: a slower term is a plateau.
_SLOWER = 3.0
#: First time over the shortest time of a term, and rms misfit below which more terms are not tried. For moduli: the
#: rows hardly determine a faster term, and rheometers are not more accurate. For creep: a fast term rises from the
#: given instantaneous compliance, and the terms are chosen later, for a program.
_MODULI = (3.0, 2e-4)
_CREEP = (10.0, 1e-7)
#: Largest ratio of moduli measured at one frequency and one temperature, and largest relative difference of frequencies
#: that count as equal. The ratio refuses all of 14 tables with several temperatures or amplitudes, and none of 56
#: others, whose largest ratio was 1.02 to 1.06.
_ONE_TEMPERATURE = 1.1
_SAME_FREQUENCY = 1e-3
#: Decades before the first time of a relaxation test that are extrapolated, and scale of these rows over their modulus.
#: Then for the first rows, from which the extrapolation starts: their largest time over the first time, their smallest
#: number, and the ratio of the first to the mean slope above which they are the tail of one process.
_EXTRAPOLATED = 1.5
_BEFORE = 10.0
_FIRST_ROWS = 4.0
_FEWEST_ROWS = 4
_STEEPER = 2.0
#: Largest ratio of values at equal, rounded times.
_EQUAL_TIMES = 2.0
#: Part of the largest compliance below which a row at most zero is left out, if the noise is less.
_LEFT_OUT = 0.05
#: Remedy of a table with several temperatures or steps.
_TELL = "state their column as temperature, or the step of an export as part"
#: Largest ratio of the times of neighbouring rows without a warning.
_DECADE = 10.0 * (1 + 1e-9)


@quantities(times="s ...", compliances="1/Pa ...", noise="1 >= 0", temperatures="K ...", temperature="K > 0")
@remembers_model
def creep_table(
    times: Sequence[Quantity],
    compliances: Sequence[Quantity],
    kind: Kind,
    noise: float = 0.0,
    poisson: float = 0.5,
    *,
    temperatures: Sequence[Quantity] = (),
    temperature: Quantity | None = None,
    vertical: Vertical | None = None,
    note: str = "",
) -> Prony:
    """Material from a creep test: ``J(t)`` in shear, or ``D(t)`` in tension with ``J = 2 (1 + nu) D``.

    Parameters
    ----------
    times : sequence of float or str
        Times, which do not decrease; the first may be zero. Rows of equal, rounded times are averaged. [s]
    compliances : sequence of float or str
        ``J`` or ``D`` at these times. Rows at most zero are left out as noise. [1/Pa]
    kind : {"shear", "tensile"}
        Kind of the compliance; without a default, since a wrong one changes the material by ``2 (1 + nu)``.
    noise : float
        Largest decrease below an earlier row that counts as noise, relative to the largest compliance, such as 0.01.
        Smaller deviations of the fit from the rows cause no warning.
    poisson : float
        Poisson ratio, constant in time.
    temperatures : sequence of float or str
        Temperature of each row, if there are several. The times begin again at each. [K]
    temperature : float or str
        Temperature of the contact, within the range of the rows; without a default if there are several. [K]
    vertical : {"none", "rubber"}
        Whether moduli are proportional to the absolute temperature too; without a default if there are several.
    note : str
        Origin of the rows, for the note of the material.

    Returns
    -------
    Prony
        A positive series of exponentials fitted to the rows, up to the last row and not beyond. Its ``note`` states
        the number of terms and the misfit.

    Raises
    ------
    InputError
        If a row is not finite, not in order of time, negative by more than noise, or lower than an
        earlier one by more than the noise; the message names the row, counted from 0. Programs longer than the table
        are refused later.

    See Also
    --------
    roughvisc.read_material, roughvisc.relaxation_table, roughvisc.dynamic_table, roughvisc.creep

    Notes
    -----
    A compliance at time zero is the instantaneous compliance. Before a first row at a later time, the first decade of
    rows is extrapolated to time zero as a power of time or by a decade of logarithmic creep, whichever falls less, and
    to a tenth of the first row at least. For several temperatures see :func:`dynamic_table`.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rubber = rv.creep_table(["0 s", "1 s", "10 s"], ["1 1/MPa", "1.5 1/MPa", "2 1/MPa"], kind="shear")
    >>> bool(abs(rubber.creep_compliance(1.0) - 1.5e-6) < 1e-7)
    True
    """
    columns = _columns(("time", "compliance"), times, compliances)
    known = _Measured("creep", kind, noise, poisson, vertical, note)
    return known.at_temperature(columns, temperatures, temperature)


@quantities(times="s ...", moduli="Pa ...", noise="1 >= 0", temperatures="K ...", temperature="K > 0")
@remembers_model
def relaxation_table(
    times: Sequence[Quantity],
    moduli: Sequence[Quantity],
    kind: Kind,
    noise: float = 0.05,
    poisson: float = 0.5,
    *,
    temperatures: Sequence[Quantity] = (),
    temperature: Quantity | None = None,
    vertical: Vertical | None = None,
    note: str = "",
) -> Prony:
    """Material from a relaxation test, by a positive series of exponentials.

    Parameters
    ----------
    times : sequence of float or str
        Times, which do not decrease; the first may be zero. Rows of equal, rounded times are averaged. [s]
    moduli : sequence of float or str
        ``G`` or ``E`` at these times. [Pa]
    kind : {"shear", "tensile"}
        Kind of the modulus, ``G = E / (2 (1 + nu))``; without a default.
    noise : float
        Root mean square of the relative misfit above which the material warns. If rows are at most zero, moduli are
        known to this part of the largest one.
    poisson : float
        Poisson ratio, constant in time.
    temperatures, temperature, vertical, note
        As for :func:`creep_table`.

    Returns
    -------
    Prony
        Its ``note`` states the number of terms, the misfit at the rows, and the measured times.

    Raises
    ------
    InputError
        If a row is not finite, not in order of time, or negative by more than noise; the row is named, counted from 0.

    See Also
    --------
    roughvisc.read_material, roughvisc.creep_table, roughvisc.dynamic_table, roughvisc.from_relaxation

    Notes
    -----
    ``G(t) = G_e + sum G_k exp(-t / theta_k)`` by non-negative least squares of the relative misfit on a lattice of
    ``theta``; then :func:`~roughvisc.mechanics.materials.models.relaxation_series`, which is exact. Outside the
    measured times its slowest and its fastest terms determine the series. For several temperatures see
    :func:`dynamic_table`.

    Examples
    --------
    >>> import numpy as np
    >>> import roughvisc as rv
    >>> times = np.logspace(-2, 1, 13)
    >>> rubber = rv.relaxation_table(times, 1e6 + 2e6 * np.exp(-times), kind="shear")
    >>> bool(abs(rubber.creep_compliance(100.0) - 1e-6) < 1e-7)
    True
    """
    columns = _columns(("time", "modulus"), times, moduli)
    known = _Measured("relaxation", kind, noise, poisson, vertical, note)
    return known.at_temperature(columns, temperatures, temperature)


@quantities(
    frequencies="1 ...", storage="Pa ...", loss="Pa ...", noise="1 >= 0", temperatures="K ...", temperature="K > 0"
)
@remembers_model
def dynamic_table(
    frequencies: Sequence[float],
    storage: Sequence[Quantity],
    loss: Sequence[Quantity],
    *,
    frequency_unit: Literal["rad/s", "Hz"],
    kind: Kind,
    shift_factors: float | Sequence[float] = 1.0,
    noise: float = 0.05,
    poisson: float = 0.5,
    temperatures: Sequence[Quantity] = (),
    temperature: Quantity | None = None,
    vertical: Vertical | None = None,
    note: str = "",
) -> Prony:
    """Material from dynamic moduli at one or several temperatures, or from a master curve, by a positive series.

    Parameters
    ----------
    frequencies : sequence of float
        Frequencies in any order. [`frequency_unit`]
    storage, loss : sequence of float or str
        ``G'`` and ``G''``, or ``E'`` and ``E''``. [Pa]
    frequency_unit : {"rad/s", "Hz"}
        Angular frequency, or cycles per second. It has no default, because the wrong unit changes all times by the
        factor 2 pi.
    kind : {"shear", "tensile"}
        Which moduli, ``G = E / (2 (1 + nu))``; without a default.
    shift_factors : float or sequence of float
        ``a_T`` of each row, or one for all: the factor for its frequency.
    noise : float
        Root mean square of the relative misfit above which the material warns. If rows are negative, moduli are known
        to this part of ``|G*|``.
    poisson : float
        Poisson ratio, constant in time.
    temperatures : sequence of float or str
        Temperature of each row, instead of shift factors. Rows within 1.5 K of each other count as one temperature. [K]
    temperature : float or str
        Temperature of the contact, within the range of the rows; without a default if there are several. [K]
    vertical : {"none", "rubber"}
        Whether moduli are proportional to the absolute temperature too; without a default if there are several.
        ``"rubber"`` suits melts and rubbers, ``"none"`` polymers near the glass transition.
    note : str
        Origin of the rows, for the note of the material.

    Returns
    -------
    Prony
        Its ``note`` states the number of terms, the misfit at the rows, the measured frequencies, and the shifts.

    Raises
    ------
    InputError
        If a number is not finite or negative by more than noise, or a frequency or a shift factor is not positive; if
        rows of one frequency have moduli that differ by more than 10 % or twice the noise; if all rows have one
        frequency; or if the temperature is outside the range of the rows. The message names the row.

    See Also
    --------
    roughvisc.read_material, roughvisc.creep_table, roughvisc.relaxation_table, roughvisc.plot.master_curve

    Notes
    -----
    ``G' = G_e + sum G_k w^2 theta_k^2 / (1 + w^2 theta_k^2)`` and ``G'' = sum G_k w theta_k / (1 + w^2 theta_k^2)``
    are fitted together by non-negative least squares, each relative to itself, or to a thousandth of ``|G*|`` where
    it is smaller. A large misfit means that the two moduli do not belong to one passive material.

    The shift factors of several temperatures are those with which the moduli agree best with one positive
    series (:func:`~roughvisc.mechanics.materials.superposition.superpose`). Between the measured temperatures
    ``log a_T`` is interpolated over ``1/T``. ``material.at(temperature)`` is the material at another temperature.

    Examples
    --------
    >>> import numpy as np
    >>> import roughvisc as rv
    >>> w = np.logspace(-1, 1, 9)  # a Maxwell fluid with the relaxation time 1 s
    >>> storage, loss = 1e6 * w**2 / (1 + w**2), 1e6 * w / (1 + w**2)
    >>> fluid = rv.dynamic_table(w, storage, loss, frequency_unit="rad/s", kind="shear")
    >>> bool(abs(fluid.creep_compliance(1.0) - 2e-6) < 1e-7)
    True
    """
    one_of("frequency_unit", frequency_unit, ("rad/s", "Hz"))
    if isinstance(shift_factors, Sequence | np.ndarray):
        factors = listed(shift_factors, "1", "shift_factors")
    else:
        factors = np.full(len(frequencies), number(shift_factors, "1", "shift_factors"))
    is_master = len(set(factors.tolist())) > 1
    if is_master and len(temperatures):
        raise InputError(key="shift_factors", found=shift_factors, expected="either shift_factors or temperatures")
    names = ("frequency", "storage modulus", "loss modulus", "shift factor")
    omega, elastic, viscous, factors = _columns(names, frequencies, storage, loss, factors)
    omega = omega * factors * (2 * math.pi if frequency_unit == "Hz" else 1.0)
    known = _Measured("dynamic", kind, noise, poisson, vertical, note, is_master=is_master)
    return known.at_temperature((omega, elastic, viscous), temperatures, temperature)


class _Checked(NamedTuple):
    """Columns of one temperature without rows that are noise; a note of these rows, and their number."""

    columns: Columns
    note: str = ""
    left_out: int = 0


@dataclass(frozen=True)
class _Measured:
    """Statements about the rows of a table, and the series fitted to rows."""

    quantity: Literal["creep", "relaxation", "dynamic"]
    kind: Kind
    noise: float
    poisson: float
    vertical: Vertical | None
    note: str
    is_master: bool = False

    def at_temperature(self, columns: Columns, temperatures: Sequence[float], temperature: float | None) -> Prony:
        """Return the material at the temperature of the rows, or at one of several temperatures."""
        if not len(temperatures):
            for key, value in (("temperature", temperature), ("vertical", self.vertical)):
                if value is not None:
                    raise InputError(key=key, found=value, expected="temperatures, one for each row")
            return self.series(self.checked(columns))
        names = ("frequency or time", *["value"] * (len(columns) - 1), "temperature")
        *_, measured = _columns(names, *columns, temperatures)
        _, group = groups_of(measured)
        lowest = float(measured.min())
        highest = float(measured.max())
        within = f"{lowest - 273.15:.4g} to {highest - 273.15:.4g} degC"
        if group.max() == 0:
            if temperature is not None and not lowest <= temperature <= highest:
                raise InputError(key="temperature", found=temperature, expected=f"the measured temperature, {within}")
            return replace(self, note=joined(self.note, f"measured at {within}")).series(self.checked(columns))
        if temperature is None:
            expected = f"the temperature of the contact, within the measured ones, {within}"
            raise InputError(key="temperature", found=None, expected=expected)
        law = _superposed(self, *(tuple(column.tolist()) for column in (*columns, measured)))
        material = law.at(temperature)
        assert isinstance(material, Prony)
        return material

    def checked(self, columns: Columns, rows: NDArray[np.intp] | None = None) -> _Checked:
        """Return the columns of one temperature without rows that are noise.

        Parameters
        ----------
        columns : tuple of ndarray
            Frequency or time, and values.
        rows : ndarray of int, optional
            Number of each row in the table, for messages.
        """
        rows = np.arange(columns[0].size) if rows is None else rows
        if self.quantity == "dynamic":
            return _Checked(self._checked_moduli(columns, rows))
        t, values = columns
        name = "compliance" if self.quantity == "creep" else "modulus"
        largest = float(values.max())
        noise = max(self.noise, _LEFT_OUT) if self.quantity == "creep" else self.noise
        for place in np.flatnonzero(~(values >= -noise * largest))[:1]:
            expected = f"at least zero, less {noise:g} of the largest, which is noise"
            raise InputError(f"table row {rows[place]}: {name} is {values[place]:g}: expected {expected}")
        for place in np.flatnonzero(np.diff(t) < 0)[:1] + 1:
            again = f"time {t[place]:g} after {t[place - 1]:g}: expected ascending time"
            raise InputError(f"table row {rows[place]}: {again}; several temperatures? {_TELL}")
        notes = []
        left_out = 0
        if self.quantity == "creep":
            kept = (values > 0) | ((t == 0) & (values == 0))
            left_out = int(np.count_nonzero(~kept))
            if left_out:
                notes.append(f"{left_out} rows at most zero left out")
            t = t[kept]
            values = values[kept]
            rows = rows[kept]
        elif values[t == 0].size and values[t == 0].min() <= 0:
            raise InputError(f"table row {rows[0]}: modulus is {values[0]:g} at time zero: expected a positive modulus")
        first = np.flatnonzero(np.diff(t, prepend=-1.0) > 0)
        if equal := t.size - first.size:
            counts = np.diff(first, append=t.size)
            ratio = np.maximum.reduceat(values, first) / np.maximum(np.minimum.reduceat(values, first), noise * largest)
            for place in first[np.flatnonzero((ratio > _EQUAL_TIMES) & (t[first] > 0))][:1]:
                again = f"other {name} than a row with the same time, {t[place]:g} s"
                raise InputError(f"table row {rows[place]}: {again}: several temperatures? expected one; {_TELL}")
            t = t[first]
            values = np.add.reduceat(values, first) / counts
            rows = rows[first]
            notes.append(f"{equal + np.count_nonzero(counts > 1)} rows of equal times averaged")
        if t.size < 2:
            raise InputError(f"table has {t.size} rows with a time of their own: expected at least two")
        if self.quantity == "creep":
            highest = np.maximum.accumulate(values)
            for place in np.flatnonzero(highest - values > self.noise * highest[-1])[:1]:
                below = f"compliance is {1 - values[place] / highest[place]:.2%} below an earlier row"
                expected = "ascending compliances or more noise"
                problem = f"{below}, noise is {self.noise:g} of the largest"
                raise InputError(f"table row {rows[place]}: {problem}: expected {expected}")
        return _Checked((t, values), "; ".join(notes), left_out)

    def _checked_moduli(self, columns: Columns, rows: NDArray[np.intp]) -> Columns:
        """Return frequency, storage and loss of one temperature; refuse rows of several."""
        omega, elastic, viscous = columns
        size = np.hypot(elastic, viscous)
        for name, value in (("storage modulus", elastic), ("loss modulus", viscous)):
            for place in np.flatnonzero(~(value >= -self.noise * size))[:1]:
                expected = f"at least zero, less {self.noise:g} of |G*|, which is noise"
                raise InputError(f"table row {rows[place]}: {name} is {value[place]:g}: expected {expected}")
        for place in np.flatnonzero((omega <= 0) | (size == 0))[:1]:
            zero = "a frequency, a shift factor or both moduli are 0"
            raise InputError(f"table row {rows[place]}: {zero}: expected positive")
        order = np.argsort(omega, kind="stable")
        first = np.flatnonzero(np.diff(np.log(omega[order]), prepend=-np.inf) > _SAME_FREQUENCY)
        if first.size < 2:
            problem = f"table has one frequency, {omega[0]:g} rad/s: expected several frequencies"
            raise InputError(f"{problem}; an amplitude sweep or a temperature ramp? {_TELL}")
        if self.is_master:
            return columns
        ratio = np.maximum.reduceat(size[order], first) / np.minimum.reduceat(size[order], first)
        for place in np.flatnonzero(ratio > max(_ONE_TEMPERATURE, 1 + 2 * self.noise))[:1]:
            same = order[first[place] : np.append(first, omega.size)[place + 1]]
            row = int(same[np.abs(np.log(size[same] / size[same[0]])).argmax()])
            again = f"|G*| differs by a factor {ratio[place]:.3g} among rows of one frequency, {omega[row]:g} rad/s"
            raise InputError(f"table row {rows[row]}: {again}: several temperatures? expected one; {_TELL}")
        return columns

    def series(self, checked: _Checked) -> Prony:
        """Return the series fitted to rows of one temperature."""
        factor = tensile_to_shear(self.kind, self.poisson)
        about = joined(self.note, checked.note)
        columns = checked.columns
        if self.quantity == "creep":
            return self._creep(columns[0], columns[1] * factor, about, checked.left_out > 0)
        if self.quantity == "relaxation":
            return self._relaxation(columns[0], columns[1] / factor, about)
        return self._dynamic(columns[0], columns[1] / factor, columns[2] / factor, about)

    def _creep(self, t: Array, values: Array, note: str, is_late: bool) -> Prony:
        # equal weights of relative deviations; a compliance of zero comes first and does not move
        highest = float(values.max())
        weights = (highest / np.where(values > 0, values, highest)) ** 2
        ascending = np.maximum.accumulate(scipy.optimize.isotonic_regression(values, weights=weights).x)
        rows = t[t > 0]
        measured = values[t > 0]
        before = np.zeros(0)
        softer = np.zeros(0)
        glassy = float(ascending[0])
        if t[0] > 0:
            glassy = _instantaneous(rows, ascending)
        if t[0] > 0 and is_late:
            before, softer = _earlier_creep(rows, ascending, glassy)
        times = np.append(before, rows)
        course = np.append(softer, measured)
        scale = np.append(_BEFORE * softer, measured)

        def columns(tau: Array) -> Array:
            return np.column_stack([times / times[-1], -np.expm1(-times[:, None] / tau)])

        weights, tau, fit = _fitted(columns, times, course, course - glassy, scale, _CREEP, before.size)
        text = f"{fit.note}, times {t[0]:g} to {t[-1]:g} s"
        if t[0] > 0:
            missing = f"nothing was measured before {t[0]:g} s"
            text += f"; {missing}: instantaneous compliance of {glassy:.3g} 1/Pa extrapolated"
        return Prony(
            glassy,
            float(weights[0] / rows[-1]),
            tuple(weights[1:]),
            tuple(tau),
            self.poisson,
            note=joined(text, note),
            warning=fit.warning,
            longest=float(t[-1]),
            misfit=fit.largest if fit.largest > self.noise else 0.0,
        )

    def _relaxation(self, t: Array, shear: Array, note: str) -> Prony:
        # rows at most zero state that all moduli are known to the noise of the largest
        scale = np.maximum(shear, self.noise * shear.max()) if shear.min() <= 0 else shear
        before, stiffer = _earlier(t, scale)
        times = np.append(before, t)
        target = np.append(stiffer, shear)
        course = np.append(stiffer, scale)
        scale = np.append(_BEFORE * stiffer, scale)
        later = times > 0

        def columns(theta: Array) -> Array:
            return np.column_stack([np.ones(times.size), np.exp(-times[:, None] / theta)])

        weights, theta, fit = _fitted(columns, times[later], course[later], target, scale, _MODULI, before.size)
        text = f"{fit.note}, times {t[0]:g} to {t[-1]:g} s"
        if before.size:
            text += f"; nothing was measured before {t[0]:g} s: modulus extrapolated to {before[0]:.3g} s"
        if shear.min() <= 0:
            text += f"; moduli are known to {self.noise:g} of the largest, since some are at most zero"
        about = {"note": joined(text, note), "warning": joined(fit.warning, self._misfit(fit), " ")}
        return relaxation_series(float(weights[0]), weights[1:], theta, self.poisson, **about)

    def _dynamic(self, omega: Array, elastic: Array, viscous: Array, note: str) -> Prony:
        size = np.hypot(elastic, viscous)
        ages = 1 / omega
        order = np.argsort(ages, kind="stable")
        is_noisy = min(elastic.min(), viscous.min()) < 0
        least = (self.noise if is_noisy else 1e-3) * size
        target = np.append(elastic, viscous)
        scale = np.append(np.maximum(elastic, least), np.maximum(viscous, least))

        def columns(theta: Array) -> Array:
            x = omega[:, None] * theta
            in_phase = np.column_stack([np.ones(omega.size), x**2 / (1 + x**2)])
            return np.vstack([in_phase, np.column_stack([np.zeros(omega.size), x / (1 + x**2)])])

        weights, theta, fit = _fitted(columns, ages[order], size[order], target, scale, _MODULI)
        text = f"{fit.note}, frequencies {omega.min():g} to {omega.max():g} rad/s"
        if is_noisy:
            text += f"; moduli are known to {self.noise:g} of |G*|, since some are negative"
        about = {"note": joined(text, note), "warning": joined(fit.warning, self._misfit(fit), " ")}
        return relaxation_series(float(weights[0]), weights[1:], theta, self.poisson, **about)

    def _misfit(self, fit: _Fit) -> str:
        """Return a warning of a misfit above the noise, else ''."""
        if fit.rms <= self.noise:
            return ""
        table = "dynamic" if self.quantity == "dynamic" else "relaxation"
        deviation = (
            f"The rows of the {table} table deviate by {fit.rms:.2g} (rms, {fit.largest:.2g} at most) from every"
        )
        causes = "a wrong column or unit, several temperatures, or the compliance of the instrument"
        return f"{deviation} passive material, more than the noise {self.noise:g}: {causes}?"


@lru_cache(maxsize=8)
def _superposed(known: _Measured, *columns: tuple[float, ...]) -> ThermalLaw:
    """Return the law of a table with several temperatures; once for all temperatures of a sweep.

    Parameters
    ----------
    known : _Measured
        Statements about the rows.
    *columns : tuple of float
        Frequency or time, values, and temperature of each row.
    """
    *given, temperatures = (np.array(column) for column in columns)
    one_of("vertical", known.vertical, get_args(Vertical))
    factor = tensile_to_shear(known.kind, known.poisson)
    _, group = groups_of(temperatures)
    parts = []
    of_parts = []
    for number_of_group in range(int(group.max()) + 1):
        rows = np.flatnonzero(group == number_of_group)
        one_temperature = known.checked(tuple(column[rows] for column in given), rows)
        parts.append(one_temperature)
        of_parts.append(np.full(one_temperature.columns[0].size, temperatures[rows].mean()))
    ages, *values = (
        np.concatenate(column) for column in zip(*(one_temperature.columns for one_temperature in parts), strict=True)
    )
    names: tuple[Any, ...] = ("storage", "loss") if known.quantity == "dynamic" else (known.quantity,)
    later = ages > 0  # a row at time zero has no reduced time
    values = [value[later] for value in values]
    is_noisy = known.quantity == "relaxation" and values[0].min() <= 0
    least = known.noise * float(values[0].max()) if is_noisy else 0.0
    rows_of = dict(zip(names, values, strict=True))
    superposed = superpose(np.concatenate(of_parts)[later], ages[later], rows_of, known.vertical, least)
    superposed = replace(superposed, bounds=(float(temperatures.min()), float(temperatures.max())), factor=factor)
    reduced, rows_at_reference = superposed.reduced()
    order = np.argsort(reduced, kind="stable")
    master = (reduced[order], *(value[order] for value in rows_at_reference.values()))
    notes = [superposed.note, *dict.fromkeys(one_temperature.note for one_temperature in parts)]
    checked = _Checked(
        master, "; ".join(filter(None, notes)), sum(one_temperature.left_out for one_temperature in parts)
    )
    material = known.series(checked)
    material = replace(material, warning=joined(material.warning, superposed.warning, " "))
    shift = superposed.shift_factor
    moduli = superposed.modulus_factor if known.vertical == "rubber" else None
    return ThermalLaw(material, superposed.reference_temperature, shift, moduli)


def joined(first: str, second: str, sign: str = "; ") -> str:
    """Return two notes as one; an empty one is left out."""
    return sign.join(filter(None, (first, second)))


def _columns(names: tuple[str, ...], *columns: ArrayLike) -> Columns:
    """Return the columns of a table of measurements as arrays.

    Parameters
    ----------
    names : tuple of str
        Names of the columns, for the messages; the first is the time or the frequency.
    columns : array_like
        Columns of equal length.

    Raises
    ------
    InputError
        If the lengths differ, there are fewer than two rows, a number is not finite, or the time, the frequency or a
        shift factor is negative; the message names the row, counted from 0.
    """
    arrays = tuple(np.asarray(column, dtype=float) for column in columns)
    sizes = [array.size for array in arrays]
    if any(array.ndim != 1 for array in arrays) or len(set(sizes)) > 1 or sizes[0] < 2:
        sizes_text = ", ".join(f"{size} of {name}" for size, name in zip(sizes, names, strict=True))
        raise InputError(f"table has {sizes_text}: expected as many, at least two")
    for name, array in zip(names, arrays, strict=True):
        is_possible = np.isfinite(array) & ((array >= 0) | (name not in ("time", "frequency", "shift factor")))
        for row in np.flatnonzero(~is_possible)[:1]:
            raise InputError(f"table row {row}: {name} is {array[row]:g}: expected a finite number, not negative")
    return arrays


class _Fit(NamedTuple):
    """Misfit of a fitted series: root mean square and largest, relative; a note and a warning."""

    rms: float
    largest: float
    note: str
    warning: str


def _fitted(
    columns: Callable[[Array], Array],
    at: Array,
    course: Array,
    target: Array,
    scale: Array,
    most: tuple[float, float],
    unmeasured: int = 0,
) -> tuple[Array, Array, _Fit]:
    """Return the non-negative weights of a series, its times [s], and its misfit.

    Parameters
    ----------
    columns : callable
        Function of the times of the terms; the first of its columns has no time.
    at, course : ndarray
        Ascending times of the measurements [s] and their values, by which the size of a term is judged.
    target, scale : ndarray
        Target of the sum of the columns, and scale of the misfit of each row.
    most : tuple of float
        See :data:`_MODULI`.
    unmeasured : int
        Number of first rows that are extrapolated and do not count in the misfit.

    Notes
    -----
    The fit with the fewest terms among those with about the smallest misfit. If the rows are too few to determine the
    spectrum, neighbouring terms are fitted to differ little.
    """
    fits = []
    sparse = target.size - 1 < _FEW * np.log10(at[-1] / at[0])
    for per_decade in (_SMOOTH,) if sparse else _OFFERED:
        times = lattice(float(at[0]) / most[0], float(at[-1]) * _SLOWER, per_decade)
        terms = columns(times)
        rows = terms / scale[:, None]
        wanted = target / scale
        if sparse:
            sizes = np.interp(np.log(times), np.log(at), course)
            smooth = np.pad(np.diff(np.diag(_STEPS / sizes), axis=0), ((0, 0), (1, 0)))
            rows = np.vstack([rows, smooth])
            wanted = np.append(wanted, np.zeros(len(smooth)))
        weights = nonnegative(rows, wanted, np.ones(len(rows)))
        misfit = np.abs((terms @ weights - target) / scale)
        used = np.append(True, weights[1:] > 0)
        misfit = misfit[unmeasured:]
        rms = float(np.sqrt(np.mean(misfit**2)))
        fits.append((rms, float(misfit.max()), weights[used], times[used[1:]]))
    enough = max(_FEWER * min(fit[0] for fit in fits), most[1])
    rms, largest, weights, times = min((fit for fit in fits if fit[0] <= enough), key=lambda fit: fit[3].size)
    count = np.count_nonzero(weights)
    misfits = f"largest misfit {largest:.2g}, rms {rms:.2g} (relative)"
    note = f"{count} terms fitted to {target.size - unmeasured} values, {misfits}"
    return weights, times, _Fit(rms, largest, note, _gap(at))


def _gap(times: Array) -> str:
    """Return a warning of neighbouring rows more than a decade apart, else ''.

    Three rows over six decades of a power law gave approaches 0.74 to 1.16 times as large as the true ones.
    """
    ratios = times[1:] / times[:-1]
    if ratios.max(initial=1.0) <= _DECADE:
        return ""
    before, after = (format_quantity(float(time), "s") for time in times[ratios.argmax() :][:2])
    what = f"The table of the material has no row between {before} and {after}, more than a decade"
    return f"{what}: the material between is a guess that stated errors do not include. Use one row per decade."


def _earlier(times: Array, moduli: Array) -> tuple[Array, Array]:
    """Return times before the first of a relaxation test, ascending [s], and moduli there.

    On logarithmic axes the modulus has the flatter one of two slopes: the mean slope of the first rows or of the first
    decade, and a slope that flattens towards earlier times like the first rows. It is not continued if the first rows
    are the tail of one fast process. A series without these rows ends at a third of the first time: its
    compliance there is a quarter too large for a polymer in the glass transition.
    """
    nothing = np.zeros(0)
    first = times <= _FIRST_ROWS * times[0]
    if times[0] == 0 or np.count_nonzero(first) < _FEWEST_ROWS:
        return nothing, nothing
    x = np.log(times[first] / times[0])
    y = np.log(moduli[first])
    decade = times <= 10 * times[0]
    of_decade, _ = np.polyfit(np.log(times[decade]), np.log(moduli[decade]), 1)
    mean = max(np.polyfit(x, y, 1)[0], of_decade)
    bend, slope, level = np.polyfit(x, y, 2)
    if slope < _STEEPER * mean:
        return nothing, nothing
    earlier = np.linspace(-_EXTRAPOLATED * np.log(10), 0.0, int(6 * _EXTRAPOLATED) + 1)
    slopes = np.minimum(np.maximum(mean, slope + 2 * min(bend, 0.0) * earlier), 0.0)
    steps = np.diff(earlier) * (slopes[1:] + slopes[:-1]) / 2
    rise = -np.cumsum(steps[::-1])[::-1]
    return times[0] * np.exp(earlier[:-1]), np.exp(level + rise)


def _earlier_creep(times: Array, compliances: Array, glassy: float) -> tuple[Array, Array]:
    """Return times before the first of a creep test, ascending [s], and compliances there, [1/Pa].

    The compliance is a power of time above the instantaneous one, with the slope of the first rows. They replace first
    rows that are lost in noise.
    """
    first = times <= _FIRST_ROWS * times[0]
    if np.count_nonzero(first) < _FEWEST_ROWS or not compliances[0] > glassy:
        return np.zeros(0), np.zeros(0)
    slope, _ = np.polyfit(np.log(times[first]), np.log(compliances[first]), 1)
    exponent = min(slope * compliances[0] / (compliances[0] - glassy), 1.0)
    ratios = 10 ** np.linspace(-_EXTRAPOLATED, 0.0, int(6 * _EXTRAPOLATED) + 1)[:-1]
    return times[0] * ratios, glassy + (compliances[0] - glassy) * ratios**exponent


def _instantaneous(times: Array, compliances: Array) -> float:
    """Return the compliance at time zero of a table that begins later, [1/Pa], from the course of its first decade.

    The course is a power law ``J(0) + a t^alpha`` through both ends and the middle of the decade, or logarithmic creep
    that began a decade earlier, whichever falls less. An exponent above one counts as one.
    """
    first = float(compliances[0])
    span = min(10.0, times[-1] / times[0])
    logarithms = np.log(times[0]) + np.log(span) * np.array([0.5, 1.0])
    middle, end = (float(value) for value in np.interp(logarithms, np.log(times), compliances))
    ratio = min((end - middle) / (middle - first), np.sqrt(span)) if middle > first else np.sqrt(span)
    power = (middle - first) / (ratio - 1) if ratio > 1 else np.inf
    logarithmic = (end - first) / np.log(span) * (1 + np.log(10))
    return first - min(power, logarithmic, 0.9 * first)
