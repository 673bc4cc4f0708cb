"""What all figures have in common: contact, letters, colour bars, labels, legends, and the ends of colour scales."""

import string
import subprocess
import sys

import numpy as np
import pytest
import sample_results as made
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import same_color
from matplotlib.image import AxesImage
from matplotlib.patches import Patch

from roughvisc.labels import annotate
from roughvisc.observables import conductance
from roughvisc.units import unit_for
from roughvisc.views import plot
from roughvisc.views.figures import animate, fields, style


def slid():
    """A result of a program that slides."""
    ds = made.rough_creep((40, 30))
    distance = np.linspace(0, 1e-4, ds.sizes["time"])
    over = {"sliding_distance": distance, "friction_coefficient": np.linspace(0, 0.3, ds.sizes["time"])}
    return annotate(ds.assign({name: ("time", values) for name, values in over.items()}))


def closed(ds):
    """A result without absent cells: what a fluid does there is not known, and leakage is refused."""
    return ds.assign(gap=ds["gap"].fillna(0.0))


SAMPLES = {
    "rough": lambda: made.rough_creep((60, 45)),
    "ball": lambda: made.hertz_creep((33, 28), 9),
    "one frame": made.one_frame,
    "open": made.open_contact,
    "slid": slid,
}
DRAWN = {
    "history": (plot.history, ("rough", "ball", "one frame", "open")),
    "diagnostics": (plot.diagnostics, ("rough", "open")),
    "maps": (plot.maps, ("rough", "ball", "one frame", "open")),
    "displacement": (lambda ds: plot.maps(ds, fields="displacement"), ("ball",)),
    "section": (plot.section, ("rough", "ball", "open")),
    "surface": (plot.surface, ("rough", "ball")),
    "distributions": (plot.distributions, ("rough", "open")),
    "clusters": (plot.contact_clusters, ("rough", "open")),
    "slide": (plot.friction_against_distance, ("slid",)),
    "leakage": (lambda ds: plot.leakage(closed(ds)), ("rough",)),
    "conductance": (lambda ds: plot.conductance(ds.merge(conductance(ds, (5.0, 0)))), ("rough",)),
    "film": (lambda ds: animate._moving(ds, None, 3)[0], ("rough", "one frame", "open", "slid")),
    "film of the flow": (lambda ds: animate._moving(closed(ds), "flux", 2)[0], ("rough",)),
}
#: Every figure of one sample in the default suite, and of all samples in the thorough one.
PAIRS = [
    pytest.param(name, sample, marks=pytest.mark.thorough if place else [])
    for name, (_, samples) in DRAWN.items()
    for place, sample in enumerate(samples)
]


@pytest.fixture(scope="module")
def drawn():
    """Figures with their layout, each drawn once."""
    known = {}

    def figure(name, sample):
        if (name, sample) not in known:
            known[name, sample] = DRAWN[name][0](SAMPLES[sample]())
            FigureCanvasAgg(known[name, sample]).draw()
        return known[name, sample]

    return figure


def panels(figure):
    """Axes that are neither a colour bar nor a second axis of a panel."""
    return [ax for ax in figure.axes if ax.get_label() != "<colorbar>" and ax.get_subplotspec() is not None]


def bars(figure):
    return [ax for ax in figure.axes if ax.get_label() == "<colorbar>"]


@pytest.mark.parametrize(("name", "sample"), PAIRS)
def test_every_panel__has_a_letter_where_there_are_several(drawn, name, sample):
    found = [ax.get_title(loc="left") for ax in panels(drawn(name, sample))]
    letters = [rf"$\mathbf{{({one})}}$" for one in string.ascii_lowercase]
    if len(found) == 1:
        assert not found[0].startswith(letters[0])
    else:
        assert [title.split("  ")[0] for title in found] == letters[: len(found)]


@pytest.mark.parametrize(("name", "sample"), PAIRS)
def test_labels__are_no_longer_than_their_panels(drawn, name, sample):
    figure = drawn(name, sample)
    renderer = FigureCanvasAgg(figure).get_renderer()
    for ax in figure.axes:
        box = ax.get_window_extent(renderer)
        if ax.yaxis.label.get_visible():
            assert ax.yaxis.label.get_window_extent(renderer).height <= box.height + 1, ax.get_ylabel()
        assert ax.xaxis.label.get_window_extent(renderer).width <= box.width + 1, ax.get_xlabel()


@pytest.mark.parametrize(("name", "sample"), PAIRS)
def test_legends__lie_outside_all_panels(drawn, name, sample):
    figure = drawn(name, sample)
    renderer = FigureCanvasAgg(figure).get_renderer()
    legends = [*figure.legends, *(ax.get_legend() for ax in figure.axes if ax.get_legend())]
    for text in [text for legend in legends for text in legend.get_texts()]:
        box = text.get_window_extent(renderer)
        assert not any(box.overlaps(ax.get_window_extent(renderer)) for ax in figure.axes), text.get_text()


@pytest.mark.parametrize("name", ["maps", "displacement", "surface", "leakage", "film", "film of the flow"])
def test_colour_bars__are_as_tall_as_their_maps(drawn, name):
    for sample in DRAWN[name][1]:
        figure = drawn(name, sample)
        renderer = FigureCanvasAgg(figure).get_renderer()
        mapped = [ax.get_window_extent(renderer) for ax in panels(figure) if ax.images]
        for bar in bars(figure):
            arrows = [one.get_window_extent(renderer) for one in bar.findobj(Patch) if one.get_visible()]
            low = min([bar.get_window_extent(renderer).y0, *(one.y0 for one in arrows)])
            high = max([bar.get_window_extent(renderer).y1, *(one.y1 for one in arrows)])
            assert any(abs(low - one.y0) < 3 and abs(high - one.y1) < 3 for one in mapped), (name, sample)


@pytest.mark.parametrize(("name", "sample"), PAIRS)
def test_contact__has_one_colour_and_is_named(drawn, name, sample):
    """The outline, the cells of the gap and of the flux, the line of a section; and no map has that colour else."""
    figure = drawn(name, sample)
    told = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    for ax in figure.axes:
        for outline in ax.findobj(lambda one: one.get_gid() == "contact outline"):
            assert same_color(outline.get_edgecolor(), style.CONTACT)
            assert outline.get_linestyle() == [(0.0, None)], "solid"
            assert "contact" in told
        for line in ax.lines:
            if line.get_label() == "contact":
                assert same_color(line.get_color(), style.CONTACT)
                assert "contact" in told
        for image in ax.findobj(AxesImage):
            colours = image.to_rgba(image.get_array())
            marked = np.isclose(colours, [*np.array(style.matplotlib.colors.to_rgba(style.CONTACT))]).all(axis=-1)
            if marked.any():
                assert image.get_gid() in ("gap", "flux")
                assert "contact" in told


def test_maps__tell_missing_cells_no_contact_and_low_pressure_apart():
    ds = made.rough_creep()
    figure = plot.maps(ds, times=-1, fields="pressure")
    (image,) = [image for ax in figure.axes for image in ax.images]
    colours = image.to_rgba(image.get_array())
    pressure = ds["pressure"].isel(time=-1).where(ds["height"].notnull()).T.values
    seen = [colours[np.isnan(pressure)][0], colours[pressure == 0][0], image.to_rgba(image.norm.vmin), (1, 1, 1, 1)]
    for number, one in enumerate(seen):
        for other in seen[:number]:
            assert np.abs(np.subtract(one, other)).max() > 0.1
    told = [text.get_text() for text in figure.legends[0].get_texts()]
    assert told == ["contact", "no contact", "missing"]


def test_value_scale__leaves_out_spikes_and_says_them():
    values = np.r_[np.linspace(1e5, 2e5, 5000), 1.2e8]
    scale = fields.value_scale("pressure", np.r_[values, np.zeros(100)])
    assert scale.low == 0
    assert 1.99e5 < scale.high <= 2e5
    assert scale.extend == "both", "a spike above, and no contact below"
    assert scale.spikes(unit_for([scale.high], "Pa")) == "max 120000 kPa"
    assert scale.spikes(unit_for([1e8], "Pa")) == "max 120 MPa"
    even = fields.value_scale("pressure", np.r_[values[:-1], np.zeros(100)])
    assert (even.high, even.extend) == (values[-2], "min"), "what is no spike stays on the scale"
    few = fields.value_scale("pressure", np.r_[1.0, 2.0, 100.0, 0.0])
    assert (few.high, few.extend) == (100.0, "min"), "of a few values none is a spike"


def test_value_scale__of_contact_everywhere_shows_its_variation():
    full = fields.value_scale("pressure", np.linspace(1.9e5, 2.1e5, 50))
    assert (full.low, full.high, full.extend) == (1.9e5, 2.1e5, "neither")
    depths = fields.value_scale("displacement", np.r_[np.linspace(-2e-6, -1e-6, 5000), -9e-6])
    assert depths.extend == "min"
    assert depths.spikes(unit_for([1e-6], "m")) == "min -9 µm"


def test_colour_bar__says_a_spike_beside_its_arrow():
    ds = made.rough_creep((120, 90), absent=False)
    pressure = ds["pressure"].copy()
    pressure[-1, 3, 4] = 40 * float(pressure.max())
    figure = plot.maps(ds.assign(pressure=pressure), times=-1, fields="pressure")
    (bar,) = bars(figure)
    assert bar.get_ylabel().split("\n")[1].startswith("max ")
    assert bar._colorbar.extend == "both"


def test_figures__import_no_more_than_is_drawn():
    heavy = ("matplotlib.animation", "roughvisc.study.trade", "roughvisc.views.figures.surfaces")
    code = (
        f"from roughvisc.views import plot; plot.history; plot.maps; import sys; print({{*{heavy}}} & {{*sys.modules}})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_default_figures__are_two():
    ds = made.rough_creep((40, 30))
    assert plot.default_figures(ds) == ["history", "maps"]
    assert [name for name, _ in plot.figures_of(ds, every=False)] == ["history", "maps"]
    assert plot.default_figures(ds[["force"]]) == ["history"]
