"""Maps of pressure, gap and displacement at chosen times."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator, NullLocator

from roughvisc.errors import InputError
from roughvisc.observables import asked, leakage
from roughvisc.plot import style
from roughvisc.plot.coarsened import note, present, touching
from roughvisc.plot.rows import RowAxis, frames_at, require, rows_of, telling_frames
from roughvisc.topography.borders import MIRRORED, is_mirrored
from roughvisc.topography.grid import cell_edges
from roughvisc.units import Unit, in_si, unit_for
from roughvisc.variables import AXES, FIELDS, VARIABLES, axis_of

#: Perceptually even maps without the colour of contact: pressure and flux darken as they rise, gap as it closes.
COLOUR_MAPS = {"pressure": "viridis_r", "gap": "cividis", "displacement": "viridis", "height": "cividis"}
COLOUR_MAPS["flux"] = "cividis_r"
_MOST_MAPS = 24
#: Decades of the flux below its largest that a map shows.
_DECADES = 3
#: Values from which some may lie beyond a scale.
_MANY = 1_000
#: Width of the outline of the contact, and part of a map that it may cover: beyond it there is none. [point], [-]
_OUTLINE, _MOST_INK = 0.7, 0.1
#: Length of a map's longer side, about. [point]
_LONG_SIDE = 126.0
#: Share of the values within the colour scale, and by how much the outermost must exceed it to lie beyond the scale.
_SHOWN, _SPIKE = 99.8, 1.2
#: Part of the largest pressure from which on a field of contact everywhere is shown from its least pressure.
_EVEN = 0.5
#: A map's short over its long side below which ticks along the short one would lie on each other.
_THIN = 0.1
#: Length that every colour bar at the right has for its label. [inch]
_LABELLED = 1.1


def colour_map(name: str) -> Colormap:
    """Colour map of a field, with colours for missing values and for values below the scale.

    Missing cells are grey; a flux is missing in contact. Contact lies below the scale of the gap, no contact below that
    of the pressure, fluid at rest below that of the flux.
    """
    under = {"pressure": style.NO_CONTACT, "gap": style.CONTACT, "flux": style.NO_CONTACT}.get(name)
    bad = style.CONTACT if name == "flux" else style.ABSENT
    return matplotlib.colormaps[COLOUR_MAPS[name]].with_extremes(bad=bad, under=under)


def plane_unit(dataset: xr.Dataset | xr.DataArray) -> Unit:
    """Unit for both sides of the map."""
    sides = [np.ptp(cell_edges(dataset[name])) for name in ("x", "y")]
    return unit_for(max(sides), "m")


def plane_ratio(dataset: xr.Dataset | xr.DataArray) -> float:
    """Side of the map along y over its side along x."""
    return float(np.ptp(cell_edges(dataset["y"])) / np.ptp(cell_edges(dataset["x"])))


def bar_side(dataset: xr.Dataset | xr.DataArray) -> str:
    """Where the colour bar of a single map stands: at its right, or above a strip."""
    return "top" if plane_ratio(dataset) < 0.4 else "right"


def measured_part(surface: Any) -> Any:
    """Return the measured part of a result, or of heights, of a surface that was given its mirror images.

    The history stays if a surface is cropped afterwards, so the heights must still be their own mirror images.
    """
    mirrored = MIRRORED in str(surface.attrs.get("history", "")).split("\n")
    height = surface if isinstance(surface, xr.DataArray) else surface.get("height")
    if not mirrored or height is None or not is_mirrored(height.transpose("x", "y").values):
        return surface
    return surface.isel({axis: slice(0, surface.sizes[axis] // 2) for axis in ("x", "y")})


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


def draw_outline(ax: Axes, spots: xr.DataArray, plane: Unit):
    """Outline of the cells in contact; None where there is nothing to outline."""
    mask = spots.transpose("y", "x").values
    if mask.all() or not mask.any() or not can_be_outlined(mask):
        return None
    limits = {name: cell_edges(spots[name])[[0, -1]] for name in ("x", "y")}
    # a rim out of contact closes the outline at the border of the map
    x, y = (plane(np.r_[low, spots[name], high]) for name, (low, high) in limits.items())
    lines = ax.contour(x, y, np.pad(mask.astype(float), 1), levels=[0.5], colors=style.CONTACT, linewidths=_OUTLINE)
    lines.set_gid("contact outline")
    return lines


def can_be_outlined(mask: np.ndarray) -> bool:
    """Whether there is a gap on a map, and a line along all faces between contact and gap buries little of it."""
    if mask.all() or min(mask.shape) < 2:
        return False
    faces = sum(np.count_nonzero(np.diff(mask, axis=axis)) for axis in (0, 1))
    return bool(faces * _OUTLINE * max(mask.shape) / _LONG_SIDE <= _MOST_INK * mask.size)


def as_shown(dataset: xr.Dataset, name: str, frame: int) -> xr.DataArray:
    """One frame of a field; rounding leaves no gap in contact."""
    field = present(dataset, name, frame)
    return field.where(field.isnull() | ~touching(dataset, frame), 0.0) if name == "gap" else field


def map_legend(images: Sequence[AxesImage]) -> dict[str, Artist]:
    """What the maps of some panels show besides their scales: contact, no contact, missing cells."""
    named: dict[str, Artist] = {}
    outlined = any(one.get_gid() == "contact outline" for image in images for one in image.axes.collections)
    shown = [(str(image.get_gid()), np.ma.asarray(image.get_array()), image.norm.vmin or 0.0) for image in images]
    below = {name for name, values, low in shown if (values.filled(np.inf) < low).any()}
    if outlined:
        named["contact"] = Line2D([], [], color=style.CONTACT, lw=1.0)
    if "gap" in below:
        named["contact"] = Patch(color=style.CONTACT, lw=0)
    if "pressure" in below:
        named["no contact"] = Patch(facecolor=style.NO_CONTACT, edgecolor="0.5", lw=0.4)
    masked = {name for name, values, _ in shown if np.ma.getmaskarray(values).any()}
    if "flux" in masked:
        named["contact"] = Patch(color=style.CONTACT, lw=0)
    if "flux" in below:
        named["no flow"] = Patch(facecolor=style.NO_CONTACT, edgecolor="0.5", lw=0.4)
    if masked - {"flux"}:
        named["missing"] = Patch(color=style.ABSENT, lw=0)
    return named


def _chosen_frames(dataset: xr.Dataset, times) -> list[int]:
    over = axis_of(dataset.variables)
    rows, telling = rows_of(dataset).values, AXES[over].telling
    if times is None and telling in dataset:
        chosen = {int(rows.argmin()), AXES[over].telling_row(dataset) % rows.size, int(rows.argmax())}
        return sorted(chosen, key=lambda row: float(rows[row]))
    if times is None:
        return telling_frames(dataset, 4)
    asked = in_si(times, VARIABLES[over].units, "times")
    return frames_at(rows, asked, _MOST_MAPS, "map", ", or use animate for all of them")


@style.apply
def maps(dataset: xr.Dataset, times=None, fields: Sequence[str] | str = ("pressure", "gap")) -> Figure:
    """Maps of fields at chosen times, or speeds, with the contact; one colour scale a field for all of them.

    Contact is orange: an outline, or the colour of its cells on maps of the gap and the flux. The outline is omitted if
    it would cover more than 10 % of the map. Of more than 1024 cells a side one cell is drawn for a block of them, with
    their largest pressure and their smallest gap, and in contact if any of them is; the figure says so. One frame is
    read at a time, some rows at a time. The colour scale may leave out two of a thousand values: an arrow and the
    maximum at the colour bar indicate them. The flux is drawn on a logarithmic scale of three decades. Of a mirrored
    surface only the measured part is drawn. Of a friction curve an arrow shows the direction in which the profile
    moves; the maps are in its frame.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result; with fields on Dask only the frames drawn are loaded.
    times : float or str, or list of them, optional
        The nearest kept times, or speeds [m/s], are drawn; negative whole numbers count frames from the end, -1 the
        last. By default up to four over the time in contact, that of the largest contact area among them; of a curve of
        friction the lowest speed, that of the largest friction, and the highest. [s]
    fields : sequence of str
        Any of ``"pressure"``, ``"gap"``, ``"displacement"``; those that the result does not hold are left out. Or
        ``"flux"`` of the fluid that leaks, which is computed from the gap with the arguments of the ``leak_rate`` in
        the result or of ``[observe]``, else with the defaults of :func:`roughvisc.observables.leakage`.

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
        if name not in (*FIELDS, "flux"):
            raise InputError(key="fields", found=name, expected=f"some of {', '.join(FIELDS)}, flux")
    if "flux" in fields:
        require(dataset, "gap")
        dataset = dataset.assign(flux=_flux_of(dataset))
    stored = [name for name in fields if name in dataset]
    if not stored:
        require(dataset, *fields)
    whole, dataset = dataset, measured_part(dataset)
    frames = _chosen_frames(dataset, times)
    figure, axes = _map_panels(dataset, len(frames), len(stored))
    images = [_draw_field(figure, p, dataset, name, frames) for name, p in zip(stored, axes, strict=True)]
    _label_maps(axes, dataset, _frame_texts(dataset, frames))
    style.legend_above(figure, map_legend(list(chain.from_iterable(images))))
    mirrored = "" if dataset is whole else "Measured area only; mirror images are not shown."
    style.note_below(figure, mirrored, _nominal(dataset, frames), note(dataset, *stored))
    return figure


def _flux_of(dataset: xr.Dataset) -> xr.DataArray:
    """Magnitude of the flux over (time, x, y), missing in contact, lazily."""
    stated = dataset if "leak_rate" in dataset else asked(dataset)
    options = {}
    if "leak_rate" in stated:
        attributes = stated["leak_rate"].attrs
        options = {name: attributes[name] for name in ("along", "sides", "viscosity", "pressure_drop")}
    lazily = dataset[["gap"]].chunk({axis_of(dataset.variables): 1, "x": -1, "y": -1})
    lazily.attrs = dataset.attrs
    found = leakage(lazily, flow=True, **options)
    size = np.hypot(found["flux_x"], found["flux_y"]).where(lazily["gap"] > 0)
    return size.rename("flux").assign_attrs(VARIABLES["flux"].attributes())


def _map_panels(dataset: xr.Dataset, frames: int, fields: int) -> tuple[Figure, np.ndarray]:
    """Figure and axes [field, row, column]; frames fill the rows of each field, a long strip of a map alone in its."""
    ratio = float(np.clip(plane_ratio(dataset), 0.05, 3.0))
    rows = frames if ratio < 0.4 else -(-frames // (4 if ratio < 2 else 6))
    columns = -(-frames // rows)
    width = 4.0 if ratio < 0.4 else 2.6 if columns == 1 and ratio < 1.5 else 1.55 if ratio < 2 else 1.3
    height = width * min(ratio, 2.5) + (0.3 if rows > 1 else 0.15)
    size = (width * columns + 0.17 * (columns - 1) + 1.3, max(height * rows, 1.3) * fields + 0.9)
    # side by side, maps that are narrower than their titles need the whole width
    figure = style.new_figure(*size, layout="constrained" if ratio > 2 else "compressed")
    axes = figure.subplots(rows * fields, columns, sharex=True, sharey=True, squeeze=False)
    return figure, axes.reshape(fields, rows, columns)


def _draw_field(figure: Figure, axes: np.ndarray, dataset: xr.Dataset, name: str, frames: list[int]) -> list[AxesImage]:
    """One field in its panels, on one colour scale, with the contact."""
    shown = [as_shown(dataset, name, frame) for frame in frames]
    scale = value_scale(name, np.concatenate([one.values.ravel() for one in shown]))
    unit, plane = unit_for([scale.high], VARIABLES[name].units), plane_unit(dataset)
    limits: dict[str, Any] = scale.limits(unit)
    if name == "flux":
        limits = {"norm": LogNorm(**limits)}
        shown = [one.clip(min=0.1 * scale.low) for one in shown]  # a logarithm of zero is missing, not low
    images = [draw_map(ax, one, unit, plane, **limits) for ax, one in zip(axes.ravel(), shown, strict=False)]
    spots = [touching(dataset, frame) for frame in frames] if {"pressure", "gap"} & set(dataset) else []
    if name not in ("gap", "flux") and all(can_be_outlined(one.values) for one in spots):
        for image, one in zip(images, spots, strict=False):
            draw_outline(image.axes, one, plane)
    colour_bar(figure, images, scale, unit)
    return images


@dataclass(frozen=True)
class Scale:
    """Colour scale of some values of a field. [SI]

    Attributes
    ----------
    name : str
        Of the field.
    low, high : float
        Its ends.
    lowest, highest : float
        Of all values: a spike lies beyond the end.
    marked : bool
        Whether some values lie below it that have a colour of their own: cells out of contact, or in contact.
    """

    name: str
    low: float
    high: float
    lowest: float
    highest: float
    marked: bool

    def limits(self, unit: Unit) -> dict[str, float]:
        """Ends of the scale in a unit; zero lies below a scale that begins there."""
        low, high = float(unit(self.low)), float(unit(self.high))
        high = high if high > low else low + 1.0
        return {"vmin": 1e-12 * high if self.marked and low == 0 else low, "vmax": high}

    @property
    def extend(self) -> str:
        """Arrows of the colour bar: what lies beyond, and what has a colour of its own below."""
        below, above = self.marked or self.lowest < self.low, self.highest > self.high
        return ("both" if above else "min") if below else "max" if above else "neither"

    def spikes(self, unit: Unit) -> str:
        """What the scale leaves out, such as ``"max 120 MPa"``; empty if nothing."""
        low = "" if self.marked or self.lowest >= self.low else f"min {unit.text(self.lowest)}"
        high = f"max {unit.text(self.highest)}" if self.highest > self.high else ""
        return ", ".join(filter(None, (low, high)))


def value_scale(name: str, values: np.ndarray) -> Scale:
    """Colour scale of the known values of a field: by quantiles, where a few values lie far beyond all others. [SI]

    Those of pressure and gap begin at zero, but that of pressure in contact everywhere may begin higher. That of the
    flux has three decades.
    """
    values = values[np.isfinite(values)]
    if not values.size and name != "flux":
        return Scale(name, 0.0, 0.0, 0.0, 0.0, False)
    if name == "flux":
        highest = float(values.max(initial=0.0)) or 1.0
        return Scale(name, highest * 10.0**-_DECADES, highest, 0.0, highest, True)
    lowest, highest = float(values.min()), float(values.max())
    positive = name not in ("displacement", "height")
    marked = positive and lowest <= 0
    telling = values[values > 0] if positive else values
    if not telling.size:
        return Scale(name, 0.0, 0.0, lowest, highest, marked)
    low, high = (float(one) for one in np.percentile(telling, (100 - _SHOWN, _SHOWN)))
    reach = (_SPIKE - 1) * (high - (0.0 if positive else low))
    high = high if telling.size > _MANY and highest > high + reach else highest
    even = name == "pressure" and not marked and lowest > _EVEN * highest
    if positive and not even:
        low = 0.0
    elif telling.size <= _MANY or lowest >= low - reach:
        low = lowest
    return Scale(name, low, high, lowest, highest, marked)


def joint_scale(fields: Iterable[xr.DataArray]) -> Scale:
    """The scale that holds those of some maps of one field, of which one is in memory at a time."""
    scales = [value_scale(str(field.name), field.values) for field in fields]
    low, high = min(one.low for one in scales), max(one.high for one in scales)
    lowest, highest = min(one.lowest for one in scales), max(one.highest for one in scales)
    return Scale(scales[0].name, low, high, lowest, highest, marked=any(one.marked for one in scales))


def colour_bar(
    figure: Figure, images: Sequence[AxesImage], scale: Scale, unit: Unit, label: str = "", location: str = ""
) -> Colorbar:
    """Colour bar as tall as its maps, or as wide as those of a strip, with its unit and the spikes that it leaves out.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    images : list of matplotlib.image.AxesImage
        Of the maps that it belongs to.
    scale : Scale
        What it leaves out.
    unit : Unit
        Of the values drawn.
    label : str
        What it shows; by default as the vocabulary has it.
    location : {"", "right", "top", "bottom"}
        Where it stands; by default at the right, and below what is flat.
    """
    panels = [image.axes for image in images]
    image = images[0]
    x0, x1, y0, y1 = image.get_extent()
    flat = (y1 - y0) * len({ax.get_subplotspec().rowspan.start for ax in panels}) < 0.4 * (x1 - x0)
    location = location or ("bottom" if flat else "right")
    bar = figure.colorbar(image, ax=panels, location=location, pad=0.02, fraction=0.06, aspect=22, extend=scale.extend)
    said = unit.label(label or VARIABLES[scale.name].label)
    upright = location == "right"
    said = style.broken(said, _LABELLED) if upright else said
    bar.set_label(("\n" if upright else ", ").join(filter(None, (said, scale.spikes(unit)))))
    if type(image.norm) is Normalize:
        bar.locator = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10])
    if not scale.high > scale.low:
        bar.set_ticks([image.norm.vmin], labels=[f"{float(unit(scale.low)):.3g}"])
    bar.outline.set_linewidth(0.6)
    return bar


def _label_maps(axes: np.ndarray, dataset: xr.Dataset, titles: Sequence[str]) -> None:
    """Letters and titles above, coordinates on the outer panels only; panels without a frame removed."""
    plane, said = plane_unit(dataset), {}
    fields, rows, columns = axes.shape
    for (field, row, column), ax in np.ndenumerate(axes):
        number = row * columns + column
        if number >= len(titles):
            ax.remove()
            continue
        lowest = field == fields - 1 and number + columns >= len(titles)
        label_plane(ax, dataset, plane, 4, x=lowest, y=column == 0)
        said[ax] = titles[number] if field == 0 or rows > 1 else ""
    style.letter_panels(list(said), list(said.values()))


#: Direction of the motion -> where it points on a map.
_ARROWS = {"x": "→", "-x": "←", "y": "↑", "-y": "↓"}


def _frame_texts(dataset: xr.Dataset, frames: list[int]) -> list[str]:
    """Place of each frame, all in one unit; below it what else tells it from the others."""
    rows = rows_of(dataset)
    axis = RowAxis.of(rows)
    texts = [axis.text(rows[frame]) for frame in frames]
    if AXES[str(rows.name)].telling == "friction_coefficient" and "friction_coefficient" in dataset:
        arrow = _ARROWS[str(dataset.attrs.get("direction", "x"))]
        shown = [_power(float(dataset["friction_coefficient"][frame])) for frame in frames]
        return [f"{arrow} {text}\nµ = {friction}" for text, friction in zip(texts, shown, strict=True)]
    if _stands_for_more(dataset) and not _nominal(dataset, frames):
        nominal = dataset["nominal_pressure"].values[frames]
        unit = unit_for(nominal, "Pa")
        return [f"{text}\nnominal {unit.text(one)}" for text, one in zip(texts, nominal, strict=True)]
    return texts


def _power(value: float) -> str:
    """Two digits of a number, a power of ten as one writes it."""
    number, _, power = f"{value:.2g}".partition("e")
    return rf"{number}$\times 10^{{{int(power)}}}$" if power else number


def _stands_for_more(dataset: xr.Dataset) -> bool:
    """Whether a nominal pressure is known of a scan that stands for a larger surface."""
    return "nominal_pressure" in dataset and dataset.attrs.get("boundary") in ("periodic", "mirror")


def _nominal(dataset: xr.Dataset, frames: list[int]) -> str:
    """The nominal pressure where it is the same in all frames, else nothing."""
    if not _stands_for_more(dataset):
        return ""
    shown = {unit_for([one], "Pa").text(one) for one in dataset["nominal_pressure"].values[frames].tolist()}
    return f"Nominal pressure {shown.pop()}." if len(shown) == 1 else ""
