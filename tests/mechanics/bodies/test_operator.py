"""Displacement by transforms against direct sums and closed forms."""

import numpy as np
import pytest
from hypothesis import given
from strategies import boundaries, examples, seeds, shapes
from support import direct

from roughvisc.errors import InputError
from roughvisc.mechanics import arrays as threads_module
from roughvisc.mechanics.bodies import operator as operators
from roughvisc.mechanics.bodies.operator import Operator

GRIDS = [(7, 5), (8, 6), (1, 9), (13, 1), (1, 1), (31, 34)]


@pytest.mark.parametrize("shape", GRIDS)
def test_free_displacement__is_the_sum_over_cells(shape):
    pressure = np.random.default_rng(1).random(shape)
    found = Operator(shape, (1.3, 0.7)).displacement(pressure)
    expected = direct(pressure, (1.3, 0.7))
    assert np.abs(found - expected).max() < 1e-14 * expected.max()


@pytest.mark.parametrize(
    ("shape", "waves"), [((9, 8), (0, 3)), ((9, 8), (2, 1)), ((12, 15), (3, 2)), ((12, 15), (0, 3)), ((1, 21), (0, 3))]
)
def test_periodic_displacement__of_a_wave(shape, waves):
    spacing = (0.4, 0.9)
    phase = sum(2 * np.pi * k * index / n for k, index, n in zip(waves, np.indices(shape), shape, strict=True))
    wave_number = np.hypot(*(2 * np.pi * k / (n * d) for k, n, d in zip(waves, shape, spacing, strict=True)))
    found = Operator(shape, spacing, "periodic").displacement(np.cos(phase))
    assert found == pytest.approx(2 / wave_number * np.cos(phase), abs=1e-13)


@given(
    shape=shapes(1, 12),
    boundary=boundaries,
    seed=seeds,
)
@examples(40)
def test_operators__are_symmetric_and_positive(shape, boundary, seed):
    operator = Operator(shape, (1.0, 0.6), boundary)
    a, b = np.random.default_rng(seed).standard_normal((2, *shape))
    for applied, precision in ((operator.displacement, 1e-12), (operator.inverse, 1e-5)):
        scale = np.linalg.norm(applied(a)) * np.linalg.norm(b) + 1e-300
        assert np.sum(applied(a) * b) == pytest.approx(np.sum(a * applied(b)), abs=precision * scale)
        assert np.sum(applied(a) * a) >= -precision * scale


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_inverse__inverts_what_is_far_from_the_border(boundary):
    x, y = np.indices((45, 64))
    pressure = np.cos(2 * np.pi * 9 * x / 45) * np.exp(-(((x - 22) / 6.0) ** 2) - ((y - 32) / 6.0) ** 2)
    operator = Operator((45, 64), (1.0, 1.0), boundary)
    back = operator.inverse(operator.displacement(pressure))
    assert np.linalg.norm(back - pressure) < (0.35 if boundary == "free" else 0.05) * np.linalg.norm(pressure)


@pytest.fixture
def in_small_blocks(monkeypatch):
    """Blocks and threads as on a large grid."""
    monkeypatch.setattr(threads_module, "_THREADED", 1)
    for name, value in {"_BLOCKED": 1, "_COLUMN_BYTES": 1, "_COLUMNS": 5, "_ROW_POINTS": 500}.items():
        monkeypatch.setattr(operators, name, value)


FIELDS = pytest.mark.parametrize("boundary", ["free", "periodic"])
KINDS = pytest.mark.parametrize("mirrored", [False, True])


@FIELDS
@KINDS
def test_fields__do_not_depend_on_threads(in_small_blocks, boundary, mirrored):
    pressure = np.random.default_rng(4).random((65, 70))
    found = []
    for threads in (1, 2, 3):
        operator = Operator((65, 70), (1.0, 1.0), boundary, workers=threads, mirrored=mirrored)
        assert operator.threads == threads
        found.append([operator.displacement(pressure), operator.inverse(pressure.astype(np.float32))])
    for others in found[1:]:
        assert all(np.array_equal(*pair) for pair in zip(found[0], others, strict=True))


def test_boundary__is_named_when_unknown():
    with pytest.raises(InputError, match=r"boundary is 'open': expected 'free' or 'periodic'"):
        Operator((4, 4), (1.0, 1.0), "open")


def unfolded(corner):
    return np.block([[corner[::-1, ::-1], corner[::-1]], [corner[:, ::-1], corner]])


@pytest.mark.parametrize("shape", GRIDS)
@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_mirrored__is_the_quarter_of_a_surface(boundary, shape):
    corner = np.random.default_rng(3).random(shape)
    quarter = Operator(shape, (1.3, 0.7), boundary, mirrored=True)
    surface = Operator(quarter.surface_shape, (1.3, 0.7), boundary)
    assert surface.shape == (2 * shape[0], 2 * shape[1])
    assert quarter.cell_area == 4 * surface.cell_area
    for name, precision in (("displacement", 1e-13), ("inverse", 1e-5)):
        kind = np.float64 if name == "displacement" else np.float32
        expected = getattr(surface, name)(unfolded(corner).astype(kind))
        found = getattr(quarter, name)(corner.astype(kind))
        assert found.dtype == kind
        np.testing.assert_allclose(unfolded(found), expected, rtol=0, atol=precision * np.abs(expected).max())
    if max(shape) > 1:  # of one cell and its images nothing is periodic
        assert quarter.stiffest == pytest.approx(surface.stiffest, rel=1e-12)


@pytest.mark.parametrize("shape", [(7, 5), (8, 6), (1, 9)])
def test_self_influence__is_that_of_a_uniformly_loaded_rectangle(shape):
    """Johnson, Contact Mechanics, eq. (3.25) at the centre; a cell in a corner and its images lie side by side."""
    a, b = 1.3, 0.7

    def at_centre(a, b):
        return 2 / np.pi * (a * np.arcsinh(b / a) + b * np.arcsinh(a / b))

    assert Operator(shape, (a, b)).self_influence == pytest.approx(at_centre(a, b), rel=1e-12)
    # seen from the centre of one of four: quarters of the rectangles of one and of three cells along each axis
    four = sum(at_centre(i * a, j * b) for i in (1, 3) for j in (1, 3)) / 4
    assert Operator(shape, (a, b), mirrored=True).self_influence == pytest.approx(four, rel=1e-12)


@pytest.mark.parametrize("boundary", ["free", "periodic"])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("shape", [(7, 6), (8, 5), (1, 4), (1, 1)])
def test_self_influence__is_the_displacement_of_a_cell_that_is_loaded_alone(boundary, mirrored, shape):
    operator = Operator(shape, (1.3, 0.7), boundary, mirrored=mirrored)
    alone = np.zeros(shape)
    alone[0, 0] = 1
    assert operator.self_influence == pytest.approx(operator.displacement(alone)[0, 0], rel=1e-13)


def test_self_influence__with_periodic_boundaries_is_the_mean_of_the_symbol():
    found = Operator((7, 6), (1.3, 0.7), "periodic").self_influence
    qx, qy = (2 * np.pi * np.fft.fftfreq(n, d) for n, d in zip((7, 6), (1.3, 0.7), strict=True))
    q = np.hypot(qx[:, None], qy).ravel()[1:]
    assert found == pytest.approx((2 / q).sum() / 42, rel=1e-12)


@pytest.mark.parametrize("shape", [(9, 14), (12, 7), (8, 10)])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_parseval__gives_the_work_of_a_pressure_on_its_displacement(shape, mirrored, boundary):
    operator = Operator(shape, (1.0, 2.0), boundary, mirrored=mirrored)
    pressure = np.random.default_rng(4).random(shape)
    displacement = operator.displacement(pressure)
    spectrum = operator.spectrum(pressure)
    response = spectrum.copy()
    operator.multiply(response, operator.symbol_of(operator.kernel))
    found = float(np.sum(operator.parseval * (spectrum * response.conj()).real))
    assert found == pytest.approx(float((pressure * displacement).sum()) * operator.cell_area)
