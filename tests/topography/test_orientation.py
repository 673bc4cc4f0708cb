"""Which way up a map lies, told by features: a letter, the camera image in a file."""

import struct

import numpy as np
import pytest
from scan_files import SCANS, real

from roughvisc.topography.formats.registry import supported_formats
from roughvisc.topography.orientation import orientation, top_line_first
from roughvisc.topography.scans import open_scan

#: The letter F as it is read, first line at the top.
LETTER = np.array([[1, 1, 1, 1], [1, 0, 0, 0], [1, 1, 1, 0], [1, 0, 0, 0], [1, 0, 0, 0]], dtype="<f4")


def write_tmd(path, lines):
    """A file of GelSight's, as readtmd.m of the maker reads it: lines from the top, lengths and heights in mm."""
    head = b"Binary TrueMap Data File v2.0\r\n\0" + b"Created by TrueMap v6\r\n\0"
    rows, columns = lines.shape
    path.write_bytes(head + struct.pack("<2I4f", columns, rows, 0.4, 0.5, 0, 0) + (1e-3 * lines).tobytes())
    return path


def test_tmd__letter_is_read_as_it_stands(tmp_path):
    h = open_scan(write_tmd(tmp_path / "coin.tmd", LETTER))
    assert h.shape == (4, 5)
    as_drawn = h.values.T[::-1]  # y upwards: the first line drawn is that of the largest y
    np.testing.assert_allclose(as_drawn, 1e-6 * LETTER, atol=1e-12)
    assert h.attrs["orientation"].startswith("verified")


@real
def test_al3d__heights_lie_as_the_camera_image_in_the_file_does():
    """Bright spots are curved places; only in the right orientation do the two maps have to do with each other."""
    scipy_ndimage = pytest.importorskip("scipy.ndimage")
    path = SCANS / "al3d-1.al3d"
    h = open_scan(path)
    nx, ny = h.shape
    offset = 238061  # TextureImageOffset of its header; image lines from the top
    image = np.frombuffer(path.read_bytes(), "u1", count=nx * ny, offset=offset).reshape(ny, nx).astype(float)
    drawn = h.values.T[::-1]
    curvature = scipy_ndimage.laplace(scipy_ndimage.gaussian_filter(drawn, 1.5))
    image = image - scipy_ndimage.gaussian_filter(image, 15)

    def alike(a):
        return np.corrcoef(a.ravel(), curvature.ravel())[0, 1]

    assert alike(image) > 0.1
    assert max(alike(turned) for turned in (image[::-1], image[:, ::-1], image[::-1, ::-1])) < 0.05


def test_every_format__says_how_its_orientation_was_told():
    for format in supported_formats():
        assert orientation(format).startswith(("verified: ", "not verified: "))
    assert not any(top_line_first(format) for format in ("x3p", "sdf", "nc", "asc", "xyz"))
