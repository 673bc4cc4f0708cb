"""``boundary="auto"``: as the surface was made; and the nominal pressure on a surface that grows."""

import pytest
import xarray as xr
from support import at_rows

import roughvisc as rv

PRESS = rv.Program().pressure(1e3, over=0)
STEEL = rv.elastic(1e6)
ROUGH = rv.self_affine(1e-3, (16, 18), hurst=0.8, rms_slope=0.05, seed=1)
BALL = rv.sphere(1e-2, 1e-3, (16, 18))
SCAN = rv.from_array(ROUGH.values, (1e-3 / 16, 1e-3 / 18))


def pressed(height, **settings):
    return rv.simulate(height, STEEL, PRESS, progress=False, fields=("pressure",), **settings)


@pytest.mark.parametrize(("height", "word"), [(BALL, "free"), (ROUGH, "periodic"), (rv.mirror(SCAN), "periodic")])
def test_auto__is_what_the_surface_was_made_for(height, word):
    found, said = pressed(height), pressed(height, boundary=word)
    assert found.attrs["boundary"] == word
    xr.testing.assert_equal(found.pressure, said.pressure)
    assert pressed(height.chunk()).attrs["boundary"] == word, "also of what is read late"


def test_auto__with_an_accepted_edge_is_free(caplog):
    assert pressed(SCAN, edge="accept").attrs["boundary"] == "free"
    assert "Contact reached the border of the surface" in caplog.text, "the outline is that of a punch"


def test_pressure__refers_to_the_surface_as_given_where_the_grid_grows():
    ball = rv.sphere(1e-3, 1e-4, 16)
    ds = rv.simulate(ball, STEEL, rv.Program().pressure("0.2 MPa", over=0), times=[0], progress=False)
    assert ds.sizes["x"] > 16
    pressure = ds.pressure.values[-1]
    assert not any(line.any() for line in (pressure[0], pressure[-1], pressure[:, 0], pressure[:, -1]))
    assert float(ds.force[0]) == pytest.approx(0.2e6 * 1e-8)
    assert float(at_rows(ds).nominal_pressure[0]) == pytest.approx(0.2e6)
    whole = ds.pressure[0].size * (1e-4 / 16) ** 2
    assert float(ds.contact_fraction[0] * whole) == pytest.approx(float(ds.contact_area[0]))
