"""Meshes of triangles as scans: STL and PLY. The height of a cell is the highest triangle above its centre."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from roughvisc.errors import InputError
from roughvisc.paths import read_bytes
from roughvisc.topography.formats.scan_file import Channel, ScanFile

#: Record of a triangle in a binary STL file.
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
#: Types of numbers in PLY, in both notations.
_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
_TYPES |= {"float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2"}
_TYPES |= {"int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"}
_VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)")
#: Largest number of pairs of a triangle and a cell that are tested together, and rounding of a corner on a centre.
_PAIRS = 1_000_000
_ON_EDGE = 1e-9


def read_stl(path: Path) -> ScanFile:
    """Read an STL file, binary or text."""
    content = read_bytes(path)
    count = int.from_bytes(content[80:84], "little")
    if len(content) == 84 + count * _TRIANGLE.itemsize:
        corners = np.frombuffer(content, _TRIANGLE, count, 84)["corners"].astype(float)
    else:
        vertices = _VERTEX.findall(content)
        if not content.lstrip().startswith(b"solid") or len(vertices) % 3 or b"endsolid" not in content:
            raise ValueError("neither a binary nor a text STL file, or not a complete one")
        corners = np.array(vertices, dtype=float).reshape(-1, 3, 3)
    return _mesh("stl", corners)


def read_ply(path: Path) -> ScanFile:
    """Read a PLY file of triangles, binary or text."""
    content = read_bytes(path)
    head, mark, body = content.partition(b"end_header")
    lines = [line.split() for line in head.decode("ascii", "replace").splitlines()]
    if not mark or lines[:1] != [["ply"]]:
        raise ValueError("the header of a PLY file is missing or incomplete")
    body = body[body.index(b"\n") + 1 :]
    notation = next(words[1] for words in lines if words[:1] == ["format"])
    elements = [(words[1], int(words[2]), list[list[str]]()) for words in lines if words[:1] == ["element"]]
    place = -1
    for words in lines:
        place += words[:1] == ["element"]
        if words[:1] == ["property"]:
            elements[place][2].append(words[1:])
    rows: dict[str, Any] = {}
    numbers = np.array(body.split(), dtype=float) if notation == "ascii" else np.zeros(0)
    position = 0
    for name, count, properties in elements:
        kind = _record(properties, ">" if notation == "binary_big_endian" else "<")
        if notation == "ascii":
            width = sum(int(np.prod(kind[field].shape)) for field in kind.names or ())
            block = numbers[position : position + count * width].reshape(count, width)
            position += count * width
            rows[name] = {}
            for field in kind.names or ():
                size = int(np.prod(kind[field].shape))
                rows[name][field] = np.squeeze(block[:, :size])
                block = block[:, size:]
        else:
            table = np.frombuffer(body, kind, count, position)
            position += count * kind.itemsize
            rows[name] = {field: table[field] for field in kind.names or ()}
    if not {"vertex", "face"} <= rows.keys() or (rows["face"]["corners in a face"] != 3).any():
        raise InputError("it has no triangles: expected a mesh of triangles", key="format", found=path.suffix)
    points = np.column_stack([rows["vertex"][axis] for axis in "xyz"]).astype(float)
    return _mesh("ply", points[rows["face"]["corners"].astype(int)])


def _record(properties: list[list[str]], order: str) -> np.dtype:
    """Return the type of the rows of an element; a list has three entries, the corners of a triangle."""
    fields: list[tuple] = []
    for words in properties:
        if words[0] == "list":
            fields += [("corners in a face", order + _TYPES[words[1]]), ("corners", order + _TYPES[words[2]], 3)]
        else:
            fields.append((words[1], order + _TYPES[words[0]]))
    return np.dtype(fields)


def _mesh(format: str, corners: np.ndarray) -> ScanFile:
    return ScanFile(format, [Channel("mesh", lambda: corners, kind="triangles")])


def heights_above(corners: np.ndarray, side: float) -> np.ndarray:
    """Return the height of the highest triangle above the centre of each square cell, missing without a triangle.

    Parameters
    ----------
    corners : ndarray, shape (n, 3, 3)
        x, y and z of the three corners of each triangle.
    side : float
        Side of the cells, in the unit of the corners. The first cell begins at the smallest x and y.

    Returns
    -------
    ndarray, shape (nx, ny)
        Only whole cells inside the bounding box of the mesh.
    """
    low = corners[..., :2].min(axis=(0, 1))
    shape = np.floor((corners[..., :2].max(axis=(0, 1)) - low) / side * (1 + _ON_EDGE)).astype(int)
    in_cells = (corners[..., :2] - low) / side - 0.5  # in cells, with the centres at whole numbers
    first = np.clip(np.ceil(in_cells.min(axis=1) - _ON_EDGE).astype(int), 0, shape)
    last = np.clip(np.floor(in_cells.max(axis=1) + _ON_EDGE).astype(int), -1, shape - 1)
    size = np.maximum(last - first + 1, 0)
    counts = size[:, 0] * size[:, 1]
    heights = np.full(shape[0] * shape[1], -np.inf)
    groups = np.cumsum(counts) // _PAIRS
    for group in np.unique(groups):
        chosen = np.flatnonzero((groups == group) & (counts > 0))
        triangle = np.repeat(chosen, counts[chosen])
        number = np.arange(triangle.size) - np.repeat(np.cumsum(counts[chosen]) - counts[chosen], counts[chosen])
        i = first[triangle, 0] + number // size[triangle, 1]
        j = first[triangle, 1] + number % size[triangle, 1]
        a, b, c = np.moveaxis(in_cells[triangle], 1, 0)
        area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        with np.errstate(divide="ignore", invalid="ignore"):  # a vertical triangle has no area
            of_b = ((i - a[:, 0]) * (c[:, 1] - a[:, 1]) - (j - a[:, 1]) * (c[:, 0] - a[:, 0])) / area
            of_c = ((b[:, 0] - a[:, 0]) * (j - a[:, 1]) - (b[:, 1] - a[:, 1]) * (i - a[:, 0])) / area
        inside = (of_b >= -_ON_EDGE) & (of_c >= -_ON_EDGE) & (of_b + of_c <= 1 + _ON_EDGE)
        z = corners[triangle, :, 2]
        values = z[:, 0] + of_b * (z[:, 1] - z[:, 0]) + of_c * (z[:, 2] - z[:, 0])
        np.maximum.at(heights, (i * shape[1] + j)[inside], values[inside])
    return np.where(np.isfinite(heights), heights, np.nan).reshape(shape)
