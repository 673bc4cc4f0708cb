"""A strip, one cell wide, in everything that people look at: its width is that of its cells."""

import io

import numpy as np
import pytest

import roughvisc as rv
from roughvisc import observables
from roughvisc.plot.maps import plane_ratio, plane_unit
from roughvisc.topography.grid import labelled

LENGTH, WIDTH, COUNT = 200e-6, 2e-6, 50
CELL = LENGTH / COUNT * WIDTH


@pytest.fixture(scope="module", params=["x", "y"])
def strip(request):
    """A result on a strip along one of the axes, with every field."""
    height = rv.wavy(1e-6, LENGTH / 2, (LENGTH, WIDTH), (COUNT, 1), waves=1)
    if request.param == "y":
        height = labelled(height.values.T, (WIDTH, LENGTH / COUNT))
    fields = ("pressure", "gap", "displacement")
    press = rv.Program().load(1e-5, over=0).hold(1.0)
    return rv.simulate(
        height, rv.zener(3e6, 3e6, 3e5), press, boundary="periodic", fields=fields, times=2, tolerance=1e-4
    )


def test_strip__is_drawn_as_wide_as_it_is(strip):
    ratio = WIDTH / LENGTH if strip.sizes["y"] == 1 else LENGTH / WIDTH
    assert plane_ratio(strip) == pytest.approx(ratio, rel=1e-12)
    assert plane_unit(strip).symbol == "µm"
    extent = rv.plot.maps(strip).axes[0].images[0].get_extent()
    sides = (LENGTH * 1e6, WIDTH * 1e6)[:: 1 if strip.sizes["y"] == 1 else -1]
    np.testing.assert_allclose(extent, (0, sides[0], 0, sides[1]), atol=1e-9)


@pytest.mark.parametrize("draw", ["history", "maps", "section", "surface"])
def test_strip__in_every_figure(strip, draw):
    getattr(rv.plot, draw)(strip).savefig(io.BytesIO(), dpi=40)


def test_strip__clusters_have_the_area_of_their_cells(strip):
    found = observables.clusters(strip)
    assert found.cluster_count.values.tolist() == [2, 2]
    np.testing.assert_allclose(found.cluster_count * found.cluster_area_mean, strip.contact_area_counted, rtol=1e-12)
    np.testing.assert_allclose(observables.cluster_areas(strip).cluster_area.sum("cluster"), strip.contact_area_counted)
    assert float(found.cluster_area_largest[0]) >= CELL


def test_strip__deformed_surface_has_the_strips_cells(strip):
    surface = rv.deformed(strip)
    assert surface.shape == strip.height.shape
    np.testing.assert_array_equal(surface.x, strip.x)
    np.testing.assert_array_equal(surface.y, strip.y)
    touching = strip.pressure[-1].values > 0
    np.testing.assert_allclose(surface.values[touching], strip.height.values[touching], rtol=0, atol=1e-12)
    assert float(rv.parameters(surface).Sz) < float(rv.parameters(strip.height).Sz)
