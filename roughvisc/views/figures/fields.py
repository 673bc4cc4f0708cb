"""Maps of pressure, gap and displacement at chosen times."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator

from roughvisc.errors import InputError
from roughvisc.topography.grid import cell_edges
from roughvisc.units import quantities
from roughvisc.variables import FIELDS, VARIABLES
from roughvisc.views.figures.axes import (
    ABSENT,
    VERMILION,
    Unit,
    frame_at,
    new_figure,
    require,
    row_text,
    rows_of,
    styled,
    telling_frames,
    unit_for,
)
from roughvisc.views.figures.coarsened import note, present, stride, touching

#: Perceptually even maps, the same order of lightness in grey: pressure, flux darken as they rise, gap as it closes.
COLOUR_MAPS = {"pressure": "magma_r", "gap": "cividis", "displacement": "viridis", "height": "cividis"}
COLOUR_MAPS["flux"] = "YlGnBu"
_MOST_MAPS = 24
#: Colour of cells in contact on maps of the gap that have no outline; values from which some may lie beyond a scale.
_TOUCHING, _MANY = VERMILION, 1_000
#: Part of a map that the outline of the contact may cover: beyond it cells in contact have a colour instead.
_MOST_INK = 0.1
#: Length of a map's longer side, about. [point]
_LONG_SIDE = 126.0
#: Share of the values within the colour scale; a few higher ones are drawn as its end.
_SHOWN = 99.8
#: A map's short over its long side below which ticks along the short one would lie on each other.
_THIN = 0.1


def colour_map(name: str) -> Colormap:
    """Colour map of a field: absent cells in light grey, cells without pressure in white, no gap as the least one."""
    found = matplotlib.colormaps[COLOUR_MAPS[name]].with_extremes(bad=ABSENT)
    return found if name == "gap" else found.with_extremes(bad=ABSENT, under="w")


def plane_unit(dataset: xr.Dataset | xr.DataArray) -> Unit:
    """Unit for both sides of the map."""
    sides = [np.ptp(cell_edges(dataset[name])) for name in ("x", "y")]
    return unit_for(max(sides), "m")


def plane_ratio(dataset: xr.Dataset | xr.DataArray) -> float:
    """Side of the map along y over its side along x."""
    return float(np.ptp(cell_edges(dataset["y"])) / np.ptp(cell_edges(dataset["x"])))


def measured_part(dataset: xr.Dataset) -> xr.Dataset:
    """The part of a result that was measured, where the surface was made to repeat by its mirror images."""
    if "mirrored along x and y" not in str(dataset.attrs.get("history", "")):
        return dataset
    return dataset.isel({axis: slice(0, dataset.sizes[axis] // 2) for axis in ("x", "y")})


def draw_map(ax: Axes, field: xr.DataArray, unit: Unit, plane: Unit, **limits) -> AxesImage:
    """One map, x to the right and y upwards, with equal scales along both.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    field : xarray.DataArray, dims (x, y)
        Missing where the profile is absent. [SI]
    unit, plane : Unit
        Of the field and of the coordinates.
    **limits
        ``vmin`` and ``vmax`` in the unit of the field.

    Returns
    -------
    matplotlib.image.AxesImage
    """
    x, y = plane(cell_edges(field["x"])), plane(cell_edges(field["y"]))
    values = np.ma.masked_invalid(unit(field.transpose("y", "x")))
    image = ax.imshow(
        values,
        origin="lower",
        extent=(x[0], x[-1], y[0], y[-1]),
        cmap=colour_map(str(field.name)),
        aspect="equal",
        **limits,
    )
    image.set_gid(str(field.name))
    return image


def label_plane(
    ax: Axes, field: xr.DataArray | xr.Dataset, plane: Unit, most: int = 5, x: bool = True, y: bool = True
) -> None:
    """Ticks and labels of a map's axes, where they are shown; the limits of a thin strip stand in its label."""
    ratio = plane_ratio(field)
    for axis, name, share, room, is_shown in ((ax.xaxis, "x", 1 / ratio, 0.5, x), (ax.yaxis, "y", ratio, 0.25, y)):
        label = plane.label(name)
        if share < _THIN:
            low, high = plane(cell_edges(field[name]))[[0, -1]]
            label = plane.label(f"{name} = {low:.3g} to {high:.3g}" + ("\n" if name == "x" else ""))
            axis.set_major_locator(NullLocator())
            axis.label.set(rotation=0, ha="center" if name == "x" else "right", va="top" if name == "x" else "center")
        else:
            axis.set_major_locator(MaxNLocator(most if share > room else 1, steps=[1, 2, 5, 10]))
        axis.set_label_text(label if is_shown else "")
    ax.tick_params(direction="out", labelbottom=x, labelleft=y)


def draw_outline(ax: Axes, spots: xr.DataArray, plane: Unit, colour: str):
    """Outline of the cells in contact; None where there is nothing to outline."""
    mask = spots.transpose("y", "x").values
    if mask.all() or not mask.any() or not can_be_outlined(mask):
        return None
    # a rim out of contact closes the outline at the border of the map
    x, y = (plane(_with_rim(spots[name].values)) for name in ("x", "y"))
    lines = ax.contour(x, y, np.pad(mask.astype(float), 1), levels=[0.5], colors=colour, linewidths=_line_width(mask))
    lines.set_gid("contact outline")
    return lines


def can_be_outlined(mask: np.ndarray) -> bool:
    """Whether there is a gap on a map, and a line along all faces between contact and gap buries little of it."""
    if mask.all() or min(mask.shape) < 2:
        return False
    faces = sum(np.count_nonzero(np.diff(mask, axis=axis)) for axis in (0, 1))
    return bool(faces * _line_width(mask) * max(mask.shape) / _LONG_SIDE <= _MOST_INK * mask.size)


def _line_width(mask: np.ndarray) -> float:
    """Of the outline. [point]"""
    return 0.7 if mask.size < 2e4 else 0.3


def _with_rim(centres: np.ndarray) -> np.ndarray:
    limits = cell_edges(centres)
    return np.concatenate([limits[:1], centres, limits[-1:]])


def outline_colour(name: str) -> str:
    """Colour of the outline that shows on a field's map."""
    return "k" if name == "pressure" else "w"


def _chosen_frames(dataset: xr.Dataset, times) -> list[int]:
    if times is None:
        return telling_frames(dataset, 4)
    chosen = np.atleast_1d(np.asarray(times, dtype=float))
    if not 0 < chosen.size <= _MOST_MAPS:
        raise InputError(f"{chosen.size} times to map: choose 1 to {_MOST_MAPS}, or use animate for all of them")
    return [frame_at(rows_of(dataset), float(time)) for time in chosen.ravel()]


@styled
@quantities(times="s")
def maps(dataset: xr.Dataset, times=None, fields: Sequence[str] = ("pressure", "gap")) -> Figure:
    """Maps of fields at chosen times, with the outline of the contact; one colour scale a field for all times.

    Of more than 1024 cells a side a cell drawn stands for a block of them: for their largest pressure, their smallest
    gap, and contact if any of them touches; the figure says so. One frame is read at a time, some rows at a time.
    Contact that is too ragged for an outline has a colour of its own on maps of the gap. The scale holds all but two of
    a thousand values: an arrow says that there are higher ones. Of a surface that repeats by its mirror images the
    part that was measured is drawn.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result; with fields on Dask only the frames drawn are loaded.
    times : float or str, or list of them, optional
        The nearest kept times are drawn; negative whole numbers count frames from the end, -1 the last.
        By default up to four over the time in contact, that of the largest contact area among them. [s]
    fields : sequence of str
        Any of ``"pressure"``, ``"gap"``, ``"displacement"``; those that the result does not hold are left out.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the result holds none of the fields, or more than 24 times are asked for.
    """
    require(dataset, "x", "y")
    fields = [fields] if isinstance(fields, str) else list(fields)
    for name in fields:
        if name not in FIELDS:
            raise InputError(f"field {name!r} is unknown: expected some of {', '.join(FIELDS)}")
    stored = [name for name in fields if name in dataset]
    if not stored:
        require(dataset, *fields)
    whole, dataset = dataset, measured_part(dataset)
    frames = _chosen_frames(dataset, times)
    figure, axes = map_panels(dataset, len(frames), len(stored))
    for name, panels in zip(stored, axes, strict=True):
        draw_field(figure, panels, dataset, name, frames)
    label_maps(axes, dataset, [_frame_text(dataset, frame) for frame in frames])
    notes = ["The part that was measured; its mirror images are not drawn"] if dataset is not whole else []
    notes += [coarse] if (coarse := note(dataset, *stored)) else []
    if notes:
        figure.suptitle("\n".join(notes), fontsize=7)
    return figure


def map_panels(dataset: xr.Dataset, frames: int, fields: int):
    """Figure and axes [field, row, column]; frames fill the rows of each field, a long strip of a map alone in its."""
    ratio = float(np.clip(plane_ratio(dataset), 0.05, 3.0))
    rows = frames if ratio < 0.4 else -(-frames // (4 if ratio < 2 else 8))
    columns = -(-frames // rows)
    width = 4.0 if ratio < 0.4 else 3.0 if columns == 1 and ratio < 1.5 else 1.75 if ratio < 2 else 1.1
    height = width * ratio + (0.27 if rows > 1 else 0.12)
    size = (width * columns + 0.17 * (columns - 1) + 1.25, max(height * rows, 1.2) * fields + 0.6)
    # side by side, maps that are narrower than their titles need the whole width
    figure = new_figure(*size, layout="constrained" if plane_ratio(dataset) * _THIN > 1 else "compressed")
    axes = figure.subplots(rows * fields, columns, sharex=True, sharey=True, squeeze=False)
    return figure, axes.reshape(fields, rows, columns)


def draw_field(figure: Figure, axes: np.ndarray, dataset: xr.Dataset, name: str, frames: list[int]) -> None:
    """One field in its panels, on one colour scale, with the outline of the contact."""
    shown = [present(dataset, name, frame) for frame in frames]
    low, high, beyond = value_scale(name, np.concatenate([one.values[np.isfinite(one.values)] for one in shown]))
    unit, plane = unit_for([high], VARIABLES[name].units), plane_unit(dataset)
    low, high = float(unit(low)), float(unit(high))
    limits = {"vmin": low, "vmax": high if high > low else low + 1.0}
    if name == "pressure":
        limits["vmin"] = 1e-12 * limits["vmax"]  # so that zero lies under the scale
    images = [draw_map(ax, one, unit, plane, **limits) for ax, one in zip(axes.ravel(), shown, strict=False)]
    known = "pressure" in dataset or "gap" in dataset
    spots = [touching(dataset, frame) for frame in frames] if known else []
    outlined = all(can_be_outlined(one.values) for one in spots)
    for image, one in zip(images, spots, strict=False):
        if outlined:
            draw_outline(image.axes, one, plane, outline_colour(name))
        elif name == "gap":
            image.set(cmap=colour_map(name).with_extremes(bad=ABSENT, under=_TOUCHING))
            image.set_clim(1e-12 * limits["vmax"], limits["vmax"])  # so that no gap lies under the scale
    extend = "max" if beyond else "neither"
    across = {"pad": 0.02, "aspect": max(15, 15 * len(axes)), "fraction": 0.06}
    bar = figure.colorbar(images[0], ax=list(axes.ravel()), extend=extend, **across)
    above = "" if outlined or name != "gap" else "contact in orange\n"
    if beyond and name == "pressure" and stride(dataset) > 1:
        above = f"at most {unit.text(max(float(one.max()) for one in shown))}\n"
    bar.set_label(above + unit.label(VARIABLES[name].label))
    bar.locator = (
        MaxNLocator(4 if len(axes) < 3 else 6, steps=[1, 2, 2.5, 5, 10]) if high > low else FixedLocator([low])
    )
    bar.outline.set_linewidth(0.6)


def value_scale(name: str, values: np.ndarray) -> tuple[float, float, bool]:
    """Ends of the colour scale of some values of a field, and whether any lie beyond. [SI]"""
    low = float(values.min()) if name == "displacement" and values.size else 0.0
    telling = values if name == "displacement" else values[values > 0]
    if not telling.size:
        return low, float(values.max(initial=0.0)), False
    highest = float(telling.max())
    high = float(np.percentile(telling, _SHOWN)) if telling.size > _MANY else highest
    return low, high, highest > high


def label_maps(axes: np.ndarray, dataset: xr.Dataset, titles: Sequence[str]) -> None:
    """Titles above, coordinates on the outer panels only; panels without a frame removed."""
    plane = plane_unit(dataset)
    fields, rows, columns = axes.shape
    for (field, row, column), ax in np.ndenumerate(axes):
        number = row * columns + column
        if number >= len(titles):
            ax.remove()
            continue
        lowest = field == fields - 1 and number + columns >= len(titles)
        label_plane(ax, dataset, plane, 4, x=lowest, y=column == 0)
        if field == 0 or rows > 1:
            ax.set_title(titles[number], pad=3)


def _frame_text(dataset: xr.Dataset, frame: int) -> str:
    """Time of a frame; below it the nominal pressure of a scan that stands for a larger surface."""
    text = row_text(rows_of(dataset)[frame])
    if "nominal_pressure" not in dataset or dataset.attrs.get("boundary") != "periodic":
        return text
    nominal = float(dataset["nominal_pressure"][frame])
    return f"{text}\nnominal {unit_for([nominal], 'Pa').text(nominal)}"
