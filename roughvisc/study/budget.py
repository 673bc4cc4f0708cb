"""``budget``: the total uncertainty of a number, by source, from a few further solves of the same case."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.study.case import Case, read_study
from roughvisc.study.execution.run import is_result_of, result_folder
from roughvisc.study.neighbours import compared, sources_of, with_kept
from roughvisc.study.quantities import quantity_of
from roughvisc.study.storage.folder import result_path
from roughvisc.study.storage.netcdf import open_result
from roughvisc.units import Quantity, quantities

if TYPE_CHECKING:
    from distributed import Client

    from roughvisc.study.neighbours import Population

#: Folder of the further solves, in the folder of the results.
FOLDER = "budget"


@quantities(modulus_error="1", time_scale_error="1", cutoff="m")
def budget(
    case: Case | str | Path | xr.Dataset,
    quantity: str | Sequence[str] = "contact_area",
    *,
    modulus_error: Quantity | None = None,
    time_scale_error: Quantity | None = None,
    cutoff: Quantity | None = None,
    population: Population | None = None,
    out: str | Path | None = None,
    client: Client | None = None,
    workers: int | None = None,
    progress: bool = True,
) -> xr.Dataset:
    r"""Estimate the total uncertainty of a number of a case, by source.

    Parameters
    ----------
    case : Case, path or xarray.Dataset
        A case, its study file, or a result, whose attribute ``case`` contains the case.
    quantity : str or sequence of str
        ``contact_area``, ``mean_gap``, ``approach``, ``force``, ``friction_coefficient``, ``leak_rate`` or
        ``thermal_conductance``. The table ``observe`` of the study states the fluid or the conductivities.
    modulus_error, time_scale_error : float or str, optional
        Relative errors of the moduli and the times of the material at 95 %, such as the error of a measured curve or
        the scatter between batches. Without an error its source stays open. [-]
    cutoff : float or str, optional
        Shortest wavelength of the real surface. Without it the waves that the scan does not resolve stay open. [m]
    population : {"patch", "ensemble"}, optional
        Whether the number describes this patch, the default, or the roughness from which the patch is a sample.
    out : path, optional
        Folder of the further solves, which are kept and used again. Default: ``budget`` in the folder of the results.
    client, workers
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
        If the input is invalid, the result contains no case, or its case has no such quantity.
    RoughviscError
        If a solve fails.

    Notes
    -----
    Sources are taken as independent, in logarithms: :math:`Q e^{\pm U}`, :math:`U^2 = \sum U_i^2`. A source with a
    direction counts only on this side, and an open source does not count. A number that is zero, such as the leak rate
    of a closed gap, has no logarithm, and its interval is missing.

    See Also
    --------
    roughvisc.audit : the assumptions of the model.
    """
    names = [quantity] if isinstance(quantity, str) else list(quantity)
    if not names:
        raise InputError(key="quantity", found=names, expected="at least one")
    known = {
        "modulus_error": modulus_error,
        "time_scale_error": time_scale_error,
        "cutoff": cutoff,
        "population": population,
    }
    path = None
    if isinstance(case, xr.Dataset):
        path, case = case.encoding.get("source"), Case.of_result(case)
    elif not isinstance(case, Case):
        case = read_study(case)
    finished = Path(path or result_path(result_folder(case), case.key))
    folder = Path(out).expanduser() if out is not None else finished.parent / FOLDER
    observed = [quantity_of(case, name) for name in names]
    base, own = with_kept(case, [field for one in observed for field in one.fields]), None
    if set(base.settings.fields) <= set(case.settings.fields) and is_result_of(case, finished):
        own = open_result(finished)
    computing = {"progress": progress, "client": client, "workers": workers}
    found = compared(base, sources_of(base, base.height(), known), observed, folder, own, **computing)
    if isinstance(quantity, str):
        return found[quantity]
    return xr.concat(list(found.values()), "quantity", combine_attrs="drop_conflicts")
