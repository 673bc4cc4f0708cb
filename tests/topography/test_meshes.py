"""Meshes of triangles as scans."""

import struct

import numpy as np
import pytest
from support import refused

import roughvisc as rv

#: Corners of the lattice of a mesh, unequal along x and y; heights are linear within its triangles. [mm]
X, Y = np.linspace(1, 4, 8), np.linspace(-2, 0, 5)
Z = 0.1 * np.sin(2 * X[:, None]) + 0.05 * Y**2


def triangles():
    """Two triangles in each cell of the lattice, with the diagonal from the lower left; a floor below a part."""
    p = np.stack([*np.broadcast_arrays(X[:, None], Y), Z], axis=-1)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    top = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2).reshape(-1, 3, 3)
    floor = [[[1, -2, -1], [2, -2, -1], [1, 0, -1]], [[1, -2, -1], [1, -2, 0], [1, 0, -1]]]  # below, and vertical
    return np.concatenate([top, floor]).astype("f4").astype(float)


def exact(x, y):
    """Linear interpolation in the triangle of a point."""
    i = np.clip(np.searchsorted(X, x) - 1, 0, X.size - 2)
    j = np.clip(np.searchsorted(Y, y) - 1, 0, Y.size - 2)
    u, v = (x - X[i]) / (X[i + 1] - X[i]), (y - Y[j]) / (Y[j + 1] - Y[j])
    a, b, c, d = Z[i, j], Z[i + 1, j], Z[i + 1, j + 1], Z[i, j + 1]
    return np.where(u > v, a + u * (b - a) + v * (c - b), a + u * (c - d) + v * (d - a))


def binary_stl(corners):
    rows = (struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0) for triangle in corners)
    return b"made".ljust(80) + struct.pack("<I", len(corners)) + b"".join(rows)


def text_stl(corners):
    facets = ("\n".join(f"vertex {x!r} {y!r} {z!r}" for x, y, z in triangle.tolist()) for triangle in corners)
    return ("solid made\n" + "\n".join(f"facet\nouter loop\n{one}\nendloop" for one in facets) + "\nendsolid").encode()


def ply(corners, notation):
    count = 3 * len(corners)
    head = f"ply\nformat {notation} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n"
    head += f"property uchar red\nelement face {len(corners)}\nproperty list uchar int vertex_indices\nend_header\n"
    points, faces = corners.reshape(-1, 3), np.arange(count).reshape(-1, 3)
    if notation == "ascii":
        lines = [f"{x!r} {y!r} {z!r} 9" for x, y, z in points.tolist()] + [f"3 {a} {b} {c}" for a, b, c in faces]
        return (head + "\n".join(lines)).encode()
    order = "<" if "little" in notation else ">"
    rows = [struct.pack(f"{order}3fB", *point, 9) for point in points]
    return head.encode() + b"".join(rows + [struct.pack(f"{order}B3i", 3, *face) for face in faces])


FILES = {
    "binary.stl": binary_stl,
    "text.STL": text_stl,
    "text.ply": lambda corners: ply(corners, "ascii"),
    "little.ply": lambda corners: ply(corners, "binary_little_endian"),
    "big.ply": lambda corners: ply(corners, "binary_big_endian"),
}


@pytest.mark.parametrize("name", FILES)
def test_mesh__has_the_height_of_its_highest_triangle(name, tmp_path):
    (tmp_path / name).write_bytes(FILES[name](triangles()))
    h = rv.open_scan(tmp_path / name, unit="mm", grid="0.07 mm")
    assert h.shape == (42, 28)
    x, y = np.meshgrid(h.x * 1e3 + 1, h.y * 1e3 - 2, indexing="ij")
    assert h.values == pytest.approx(1e-3 * exact(x, y), abs=1e-9)


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("kept", [0, 60, -7])
def test_mesh__that_is_cut_short_is_refused(name, kept, tmp_path):
    content = FILES[name](triangles())
    (tmp_path / name).write_bytes(content[:kept])
    with pytest.raises(rv.InputError):
        rv.open_scan(tmp_path / name, unit="mm", grid="0.07 mm")


@pytest.mark.parametrize(
    ("key", "given"), [("grid", {"unit": "mm"}), ("unit", {"grid": 7e-5}), ("grid", {"unit": "mm", "grid": "2 mm"})]
)
def test_mesh__needs_a_unit_and_a_grid(key, given, tmp_path):
    (tmp_path / "mesh.stl").write_bytes(binary_stl(triangles()))
    with refused(key):
        rv.open_scan(tmp_path / "mesh.stl", **given)


def test_mesh__with_a_hole_warns_and_has_missing_cells(tmp_path):
    (tmp_path / "mesh.stl").write_bytes(binary_stl(triangles()[1:-2]))
    with pytest.warns(UserWarning, match="no triangle"):
        h = rv.open_scan(tmp_path / "mesh.stl", unit="mm", grid="0.07 mm")
    assert int(h.isnull().sum()) == pytest.approx(0.5 * 3 / 7 / 2 / 0.07**2, abs=3), "a half of a cell of the lattice"
