"""Which way up a map lies: told by the camera image in a file, and said for every format."""

import numpy as np
import pytest
from scan_files import SCANS, real

from roughvisc.topography.formats import TOP_FIRST, orientation, supported_formats
from roughvisc.topography.scans import open_scan


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
    assert not {"x3p", "sdf", "nc", "asc", "xyz"} & set(TOP_FIRST)
