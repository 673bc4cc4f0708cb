r"""Flow through a map by nested dissection: boxes of cells, joined two by two along the border that they share.

A box answers the pressures :math:`p` on the faces of its border by the fluxes that flow in through them,
:math:`S p + r`, where :math:`r` comes from sources in its cells. Two boxes are joined by the balance on the faces that
they share, :math:`S_{ss} p_s + S_{se} p_e + r_s = 0`; what is left is the response of one larger box to the others. The
whole map has no faces left, and from there the pressures follow back to the cells.

Tiles of the map are joined from their cells side by side, many at once; then the tiles, one by one, with the faces
alone through which anything flows. The joins within the tiles are done again on the way back: to keep them would cost
more memory than all others.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = NDArray[np.intp]
Place = tuple[int, int]
#: Side of a tile over the fourth root of the number of cells: smaller tiles mean more joins one by one, larger ones
#: more work that takes no notice of closed faces.
_TILE = 0.7
#: Cells of the tiles that are joined side by side: as many as fit into the processor's cache.
_AT_A_TIME = 2**15
#: Cells of a tile that are not divided any more.
_LEAF = 16


class Cells(NamedTuple):
    """A map of cells, or many tiles of one shape.

    Attributes
    ----------
    faces : ndarray, shape (4, ..., nx, ny)
        Conductance from the centre of a cell to its faces, west, south, east and north: twice that of the face, whose
        halves are alike; zero where nothing flows. [-]
    ground : ndarray, shape (..., nx, ny)
        Conductance to the sides of the map, where the pressure is zero. [-]
    source : ndarray, shape (..., nx, ny)
        What comes into the cell from elsewhere; zero of closed cells.
    """

    faces: Array
    ground: Array
    source: Array


class Part(NamedTuple):
    """One of two boxes that were joined.

    Attributes
    ----------
    joined : Joined or None
        What it was joined from itself.
    faces : int
        Number of its faces.
    outer : tuple of pair of slice
        Its faces that stay, among its own and among those of both.
    shared : slice
        Its faces that it shares with the other box.
    """

    joined: Joined | None
    faces: int
    outer: tuple[tuple[slice, slice], ...]
    shared: slice


class Joined(NamedTuple):
    """How the pressures on what two boxes share follow from those on their other faces.

    Attributes
    ----------
    parts : tuple of Part
        The two boxes; the second has the shared faces in the opposite order.
    answer : ndarray, shape (..., shared, faces + 2)
        ``S_ss^-1 (S_se, g_s, r_s)``: minus the pressures for one on each face, and, last, for the sources.
    """

    parts: tuple[Part, Part]
    answer: Array


class Box(NamedTuple):
    """A box of cells, or many of one shape.

    Attributes
    ----------
    response : ndarray, shape (..., faces, faces + 2)
        ``(S, g, r)``: fluxes into the box for a pressure on each face; their sums, which flow on to the sides of the
        map; and the fluxes due to the sources.
    sides : tuple of int
        Number of its faces in the west, south, east and north: once around, in this order.
    joined : Joined or None
        What it was joined from, where that is kept.
    """

    response: Array
    sides: tuple[int, ...]
    joined: Joined | None = None


def pressures(cells: Cells) -> Array:
    """Pressures at which all that comes in flows out at the sides of the map.

    Parameters
    ----------
    cells : Cells
        The map. Each open cell is connected to a side. Where faces in the south of the map are open, those in the north
        are the same ones.

    Returns
    -------
    ndarray, shape (nx, ny)
        Zero in closed cells.

    Notes
    -----
    Work grows with the power 3/2 of the number of cells, in products of matrices; memory a little faster than with the
    number itself [1]_. Outside the diagonal the responses have one sign: a join adds to them, and nothing cancels. The
    diagonal is what makes up the sum of the row, so that rounding takes nothing from what narrow slits let through
    [2]_.

    References
    ----------
    .. [1] A. George, Nested dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10 (1973) 345-363.
    .. [2] W. K. Grassmann, M. I. Taksar, D. P. Heyman, Regenerative analysis and steady state distributions for Markov
       chains, Operations Research 33 (1985) 1107-1116.
    """
    shape = cells.ground.shape
    cuts = [np.linspace(0, count, _tiles_along(count, shape) + 1).round().astype(int) for count in shape]
    boxes = np.empty([len(cut) - 1 for cut in cuts], dtype=object)
    for places, tiles in _tiles(cells, cuts):
        joined = _tile(tiles, keep=False)
        for place, response, is_open in zip(places, joined.response, _open_faces(tiles), strict=True):
            sides = tuple(int(side.sum()) for side in np.split(is_open, np.cumsum(joined.sides)[:-1]))
            boxes[place] = Box(response[np.ix_(is_open, [*is_open, True, True])], sides)
    whole = _assembled(boxes)
    around = np.empty(boxes.shape, dtype=object)
    _spread(whole.joined, _where_borders_meet(whole), around)

    pressure = np.zeros(shape)
    for places, tiles in _tiles(cells, cuts):
        joined = _tile(tiles, keep=True)
        on_faces = np.zeros(joined.response.shape[:-1])
        for row, is_open, place in zip(on_faces, _open_faces(tiles), places, strict=True):
            row[is_open] = around[place]
        for field, place in zip(_inside(joined.joined, on_faces, tiles), places, strict=True):
            pressure[_limits(cuts, place)] = field
    return pressure


def _tiles_along(count: int, shape: tuple[int, ...]) -> int:
    """Number of tiles along a side of so many cells; one that divides them, if there is one."""
    wanted = count / max(_TILE * math.prod(shape) ** 0.25, 1.0)
    near = range(max(1, round(wanted / 1.3)), max(1, round(wanted * 1.3)) + 1)
    return min(near, key=lambda number: (count % number > 0, abs(number - wanted)))


def _tiles(cells: Cells, cuts: list[Numbers]) -> Iterator[tuple[list[Place], Cells]]:
    """Some tiles of one shape at a time: their places, and their cells."""
    alike: dict[tuple[int, int], list[Place]] = {}
    for x, width in enumerate(np.diff(cuts[0]).tolist()):
        for y, height in enumerate(np.diff(cuts[1]).tolist()):
            alike.setdefault((width, height), []).append((x, y))
    for (width, height), places in alike.items():
        count = max(1, _AT_A_TIME // (width * height))
        for chosen in (places[first : first + count] for first in range(0, len(places), count)):
            limits = [_limits(cuts, place) for place in chosen]
            yield chosen, Cells(*(np.stack([field[..., x, y] for x, y in limits], axis=-3) for field in cells))


def _limits(cuts: list[Numbers], place: Place) -> tuple[slice, slice]:
    """Cells of a tile."""
    x, y = (slice(cut[number], cut[number + 1]) for cut, number in zip(cuts, place, strict=True))
    return x, y


def _around(tiles: Cells) -> Array:
    """Conductance of the faces around each tile, once around."""
    west, south, east, north = tiles.faces
    return np.concatenate([west[:, 0, ::-1], south[:, :, 0], east[:, -1], north[:, ::-1, -1]], axis=1)


def _open_faces(tiles: Cells) -> NDArray[np.bool_]:
    """Through which faces around each tile something may flow: the same ones on both sides."""
    return _around(tiles) > 0


def _tile(cells: Cells, *, keep: bool) -> Box:
    """Many tiles of one shape; whether it is kept what they were joined from."""
    if cells.ground[0].size <= _LEAF:
        return _leaf(cells)
    axis, halves = _halves(cells)
    boxes = [_tile(half, keep=keep) for half in halves]
    if len(boxes) == 1:  # both halves of all
        response, sides, joined = boxes[0]
        boxes = [Box(half, sides, joined) for half in np.split(response, 2)]
    return _join(boxes, axis, keep)


def _inside(joined: Joined | None, around: Array, cells: Cells) -> Array:
    """Pressures in the cells of many tiles, from those on the faces around each."""
    if joined is None:
        inverse, outer, owner = _equations(cells)
        inflow = cells.source.reshape(len(outer), -1) + (outer * around) @ np.eye(inverse.shape[-1])[owner]
        return (inverse @ inflow[..., None]).reshape(cells.ground.shape)
    axis, halves = _halves(cells)
    on_faces = _on_faces(joined, around)
    if len(halves) == 1:
        found = np.split(_inside(joined.parts[0].joined, np.concatenate(on_faces), halves[0]), 2)
    else:
        found = [_inside(one.joined, own, half) for one, own, half in zip(joined.parts, on_faces, halves, strict=True)]
    return np.concatenate(found, axis=axis + 1)


def _halves(cells: Cells) -> tuple[int, list[Cells]]:
    """The axis along which tiles are halved, and the halves; of equal halves one with twice as many tiles."""
    axis = int(np.argmax(cells.ground.shape[1:]))
    middle = cells.ground.shape[axis + 1] // 2
    ends = (slice(None, middle), slice(middle, None))
    one, other = (Cells(*(field[..., end, :] if axis == 0 else field[..., end] for field in cells)) for end in ends)
    if one.ground.shape == other.ground.shape:
        return axis, [Cells(*(np.concatenate(pair, axis=-3) for pair in zip(one, other, strict=True)))]
    return axis, [one, other]


def _leaf(cells: Cells) -> Box:
    """Tiles of a few cells, whose pressures are eliminated at once."""
    inverse, outer, owner = _equations(cells)
    count = len(owner)
    response = np.empty((len(inverse), count, count + 2))
    rows = inverse[:, owner]
    np.take(rows, owner, axis=2, out=response[..., :count])
    response[..., :count] *= -outer[:, None, :]
    right = (field.reshape(len(inverse), -1) for field in (cells.ground, -cells.source))
    response[..., count:] = rows @ np.stack([*right], axis=-1)
    response *= outer[..., None]
    width, height = cells.ground.shape[1:]
    return Box(_with_diagonal(response), (height, width, height, width))


def _equations(cells: Cells) -> tuple[Array, Array, Numbers]:
    """Of tiles of a few cells the inverse of their equations, the faces around, and to which cell each belongs."""
    count, width, height = cells.ground.shape
    number = np.arange(width * height).reshape(width, height)
    _, _, east, north = cells.faces
    matrix = np.zeros((count, number.size, number.size))
    for faces, one, other in (
        (east[:, :-1], number[:-1].ravel(), number[1:].ravel()),
        (north[:, :, :-1], number[:, :-1].ravel(), number[:, 1:].ravel()),
    ):
        matrix[:, one, other] = matrix[:, other, one] = -faces.reshape(count, -1) / 2
    outer, owner = _around(cells), np.concatenate([number[0, ::-1], number[:, 0], number[-1], number[::-1, -1]])
    total = cells.ground.reshape(count, -1) - matrix.sum(axis=-1) + outer @ np.eye(number.size)[owner]
    diagonal = np.einsum("...ii->...i", matrix)
    diagonal[...] = total
    return _inverse(matrix), outer, owner


def _assembled(boxes: NDArray[np.object_]) -> Box:
    """All boxes of a grid joined to one, halves of halves."""
    if boxes.size == 1:
        box: Box = boxes[0, 0]
        return box
    axis = int(np.argmax(boxes.shape))
    return _join([_assembled(half) for half in np.split(boxes, [boxes.shape[axis] // 2], axis)], axis, keep=True)


def _spread(joined: Joined | None, around: Array, found: NDArray[np.object_]) -> None:
    """Set the pressures on the faces of each box of a grid, from those around all."""
    if joined is None:
        found[0, 0] = around
        return
    axis = int(np.argmax(found.shape))
    halves = np.split(found, [found.shape[axis] // 2], axis)
    for part, own, half in zip(joined.parts, _on_faces(joined, around), halves, strict=True):
        _spread(part.joined, own, half)


def _join(boxes: Sequence[Box], axis: int, keep: bool) -> Box:
    """Two boxes that share a border: the second lies east or north of the first.

    Around both, from the west on: one box up to what is shared, all of the other one, and the rest of the former.
    """
    one, other = boxes
    around, within = (one, other) if axis == 0 else (other, one)
    shared, begin = around.sides[2 - axis], sum(around.sides[: 2 - axis])
    all_around, all_within = sum(around.sides), sum(within.sides)
    end, count = begin + all_within - shared, all_around + all_within - 2 * shared
    on_border, beyond = slice(0, shared), slice(shared, all_within)
    if axis == 1:
        on_border, beyond = slice(all_within - shared, all_within), slice(0, all_within - shared)
    before, after = (slice(0, begin), slice(0, begin)), (slice(begin + shared, all_around), slice(end, count))
    parts = (
        Part(around.joined, all_around, (before, after), slice(begin, begin + shared)),
        Part(within.joined, all_within, ((beyond, slice(begin, end)),), on_border),
    )
    if axis == 1:
        parts = parts[1], parts[0]

    batch = one.response.shape[:-2]
    response, between = np.zeros((*batch, count, count + 2)), np.empty((*batch, shared, count + 2))
    between[..., -2:] = 0.0
    inside = np.zeros((*batch, shared, shared))
    for box, part, order in zip((one, other), parts, (1, -1), strict=True):
        faces = box.response[..., part.shared, :][..., ::order, :]
        inside += faces[..., part.shared][..., ::order]
        between[..., -2:] += faces[..., -2:]
        for rows, place in part.outer:
            between[..., place] = faces[..., rows]
            response[..., place, -2:] = box.response[..., rows, -2:]
            for columns, places in part.outer:
                response[..., place, places] = box.response[..., rows, columns]
    answer = _inverse(inside) @ between
    response -= np.swapaxes(between[..., :count], -1, -2) @ answer
    west, south, east, north = (first + second for first, second in zip(one.sides, other.sides, strict=True))
    sides = (one.sides[0], south, other.sides[2], north) if axis == 0 else (west, one.sides[1], east, other.sides[3])
    return Box(_with_diagonal(response), sides, Joined(parts, answer) if keep else None)


def _on_faces(joined: Joined, around: Array) -> list[Array]:
    """Pressures on the faces of two boxes, from those around both."""
    between = -(joined.answer[..., :-2] @ around[..., None])[..., 0] - joined.answer[..., -1]
    found = [np.empty((*around.shape[:-1], part.faces)) for part in joined.parts]
    for part, own, order in zip(joined.parts, found, (1, -1), strict=True):
        own[..., part.shared] = between[..., ::order]
        for place, in_both in part.outer:
            own[..., place] = around[..., in_both]
    return found


def _where_borders_meet(whole: Box) -> Array:
    """Pressures on the faces around the whole map: none, or those on the south, which are those on the north."""
    count = whole.sides[1]
    both = whole.response[:count] + whole.response[count:][::-1]
    found = -_inverse(both[:, :count] + both[:, count:-2][:, ::-1]) @ both[:, -1]
    return np.concatenate([found, found[::-1]])


def _with_diagonal(response: Array) -> Array:
    """A response whose diagonal makes up the sums of its rows; changed in place."""
    square = response[..., :-2]
    diagonal = np.einsum("...ii->...i", square)
    diagonal[...] = 0.0
    diagonal[...] = response[..., -2] - square.sum(axis=-1)
    return response


def _inverse(matrix: Array) -> Array:
    """Inverses of positive definite matrices, which are changed; where a row is zero, nothing flows and all is well."""
    diagonal = np.einsum("...ii->...i", matrix)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaling = scale[..., :, None] * scale[..., None, :]
    if matrix.shape[-1] == 1:
        return scaling
    matrix *= scaling
    diagonal[...] = 1.0
    inverse = np.linalg.inv(matrix)
    inverse *= scaling
    return np.asarray(inverse)
