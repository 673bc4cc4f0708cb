"""``open_scan``: the entry to instrument files, grid files and surface cards."""

from __future__ import annotations

import os

import xarray as xr

from roughvisc.topography.cards import is_card, open_card
from roughvisc.topography.readers import existing, finite, read_file
from roughvisc.units import Quantity, quantities


@quantities(spacing="m", grid="m")
def open_scan(
    path: str | os.PathLike[str],
    *,
    format: str | None = None,
    channel: int | str | None = None,
    unit: str | None = None,
    height_unit: str | None = None,
    spacing: Quantity | tuple[Quantity, Quantity] | None = None,
    grid: Quantity | None = None,
    no_data: float | None = None,
    height_scale: float | None = None,
) -> xr.DataArray:
    """Open a scanned surface from an instrument file, a grid file or a surface card.

    Parameters
    ----------
    path : path
        X3P, SDF, NetCDF, CSV, a surface card (``.toml``), or any format that SurfaceTopography reads.
    format : str, optional
        A key of :func:`~roughvisc.supported_formats`, or ``"auto"`` to guess the format from the content. Default: by
        the suffix.
    channel : int or str, optional
        Number or name of the channel, see :func:`~roughvisc.list_channels`. Default: the height channel, or the default
        of the library if there are several; the attribute ``other_channels`` then lists the others.
    unit : str, optional
        Unit of length in a file that states none, such as ``"um"``.
    height_unit : str, optional
        Unit of the heights in a file that states none, if it differs from that of x and y: for points in mm, mm, um use
        ``unit="mm", height_unit="um"``.
    spacing : float or str, or pair of them, optional
        Cell sides (dx, dy), instead of those in the file. [m]
    grid : float or str, optional
        Side of the square cells into which points x, y, z are sorted: each has the mean height of its points. Default:
        the lattice on which the points lie, to a hundredth of its steps. [m]
    no_data : float, optional
        Number that stands for a missing point, in the unit of the file. Default: an extreme that at least four points
        share, further from all other heights than ten times their range; a warning states it.
    height_scale : float, optional
        Factor of the heights, of a file that states a wrong unit: 1e-6 for micrometres in place of metres. [-]

    Returns
    -------
    xarray.DataArray
        Height over (x, y), peaks up, NaN where missing. [m] Coordinates are those of the cell centres; the spacing is
        the size over the number of points. The attributes contain the name and checksum of the file, format,
        instrument, channel, orientation (whether y is known to point up, or the map may be a mirror image) and
        ``history``. Rows of a matrix in text, CSV or NumPy run along x: row j of the file is ``y[j]``.

    Raises
    ------
    InputError
        If the file is absent, damaged, of an unknown format, not an areal height scan, without unit or size, or
        implausible: wider than 1 m, cells below 10 pm, heights beyond 1 m; or if points lie on no lattice.

    Warns
    -----
    UserWarning
        If the checksum in an X3P file is wrong, an index row or column is removed, a number is taken for missing
        points, or cells of `grid` hold no point.
    """
    options = {"channel": channel, "unit": unit, "height_unit": height_unit, "spacing": spacing, "grid": grid}
    options |= {"no_data": no_data, "height_scale": height_scale}
    path = existing(path)
    if not is_card(path, format):
        return read_file(path, format=format, **options)
    h = open_card(path, **options)
    finite(h, str(path))
    return h
