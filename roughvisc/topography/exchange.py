"""Heights from and to the objects of other libraries: SurfaceTopography and surfalize."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.borders import is_periodic
from roughvisc.topography.grid import checked, labelled, noted, spacing
from roughvisc.topography.readers import finite
from roughvisc.units import number


def from_topography(topography: Any) -> xr.DataArray:
    """Convert a surface of SurfaceTopography or surfalize to a labelled height grid.

    Parameters
    ----------
    topography : SurfaceTopography.Topography or surfalize.Surface
        A uniform map of heights with a unit and its size. SurfaceTopography has heights over (x, y). surfalize has
        lines along x in micrometres, the top line first.

    Returns
    -------
    xarray.DataArray
        Height over (x, y), peaks up, NaN where missing. [m] The attribute ``period`` states the sides of a map that is
        marked as periodic.

    Raises
    ------
    InputError
        If the object is another one, is a line scan, or states no unit or size.

    See Also
    --------
    roughvisc.to_topography, roughvisc.from_array, roughvisc.open_scan

    Examples
    --------
    >>> import numpy as np, roughvisc as rv
    >>> from SurfaceTopography import Topography
    >>> surface = Topography(np.arange(6.0).reshape(2, 3), physical_sizes=(4.0, 3.0), unit="um")
    >>> h = rv.from_topography(surface)
    >>> h.x.values.tolist(), round(float(h[1, 2]), 12)
    ([1e-06, 3e-06], 5e-06)
    """
    if callable(getattr(topography, "heights", None)) and hasattr(topography, "physical_sizes"):
        return _of_surface_topography(topography)
    if hasattr(topography, "step_x") and hasattr(topography, "step_y") and hasattr(topography, "data"):
        values = 1e-6 * np.asarray(topography.data, dtype=float)[::-1].T
        sides = 1e-6 * float(topography.step_x), 1e-6 * float(topography.step_y)
        return _checked(labelled(values, sides), "from surfalize")
    expected = "a Topography of SurfaceTopography, or a Surface of surfalize"
    raise InputError(key="topography", found=topography, expected=expected)


def _of_surface_topography(topography: Any) -> xr.DataArray:
    sizes = topography.physical_sizes
    unit = topography.unit
    if topography.dim != 2 or not topography.is_uniform or sizes is None:
        raise InputError(key="topography", found=topography, expected="a uniform map with its size")
    if unit is None:
        raise InputError(key="topography", found=topography, expected="a unit, as topography.to_unit sets it")
    metres = number(f"1 {unit}", "m", "topography")
    values = np.ma.filled(np.ma.asarray(topography.heights(), dtype=float), np.nan) * metres
    sides = [float(f"{size * metres / count:.15g}") for size, count in zip(sizes, values.shape, strict=True)]
    h = _checked(labelled(values, (sides[0], sides[1])), "from SurfaceTopography")
    if topography.is_periodic:
        h.attrs["period"] = [count * side for count, side in zip(values.shape, sides, strict=True)]
    return h


def _checked(h: xr.DataArray, line: str) -> xr.DataArray:
    finite(h)
    return noted(h, line)


def to_topography(height: xr.DataArray, unit: str = "m") -> Any:
    """Convert heights to a Topography of SurfaceTopography.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        Heights, NaN where missing. [m]
    unit : str
        Unit of length of the object.

    Returns
    -------
    SurfaceTopography.Topography
        The same heights, masked at missing points, periodic if :func:`roughvisc.simulate` takes the boundary
        ``auto`` as periodic.

    Raises
    ------
    InputError
        If `height` is not a height grid, or the unit is not a length.

    See Also
    --------
    roughvisc.from_topography

    Examples
    --------
    >>> import roughvisc as rv
    >>> surface = rv.to_topography(rv.wavy("1 um", "1 mm", "1 mm", 16), unit="um")
    >>> surface.unit, surface.is_periodic, float(round(surface.physical_sizes[0], 9))
    ('um', True, 1000.0)
    """
    from SurfaceTopography import Topography  # slow to import

    h = checked(height, "height")
    metres = number(f"1 {unit}", "m", "unit")
    values = np.ma.masked_invalid(h.values / metres)
    sizes = tuple(count * side / metres for count, side in zip(h.shape, spacing(h), strict=True))
    return Topography(values if values.mask.any() else values.data, sizes, periodic=is_periodic(h), unit=unit)
