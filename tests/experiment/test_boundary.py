"""``boundary="auto"``: as the surface was made, and a question where it was not."""

import pytest
import xarray as xr

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
    xr.testing.assert_equal(found.drop_vars("wall_time", errors="ignore").pressure, said.pressure)
    assert pressed(height.to_dataset(name="height").chunk()).attrs["boundary"] == word, "also of what is read late"


def test_auto__with_an_accepted_edge_is_free(caplog):
    assert pressed(SCAN, edge="accept").attrs["boundary"] == "free"
    assert "Contact reached the border of the surface" in caplog.text, "the outline is that of a punch"


def test_friction__is_periodic_whatever_slides():
    ds = rv.friction(SCAN, rv.zener(1e6, 1e6, 1e5), pressure=1e3, speeds=[1e-3], progress=False)
    assert ds.attrs["boundary"] == "periodic"
