"""How variables are cut into the chunks of a result's file."""

from __future__ import annotations

import math

#: Chunk of a field over (time, x, y). At 512 x 512 x 50, compressed, one frame and one cell's history take, in ms:
#: (1, 512, 512) 9 and 370; (4, 128, 128) 18 and 22; (8, 64, 64) 35 to 65 and 4 to 7; (16, 64, 64) 60 to 145 and 4 to 7;
#: (50, 32, 32) 170 and 1.5. A fifth of that or less where it is not compressed.
_CHUNK = (8, 64, 64)
#: The same of a grid of more cells than this: a frame is read without its neighbours in time, which no memory has room
#: for. At 4096 x 4096 x 20, in ms, compressed: (8, 64, 64) 2809 and 12; (2, 256, 256) 1277 and 51; (1, 256, 256) 331
#: and 41; (1, 1024, 1024) 309 and 302. ``workflows/benchmarks/big_results.py`` measures it.
_MANY_CELLS, _CHUNK_OF_MANY = 1 << 20, (1, 256, 256)
#: The longest side of a chunk of anything else: a map of 1024 x 1024 doubles is 8 MB.
_LONGEST_CHUNK = 1024


def chunks(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Sides of the chunks: as equal as they can be, since a chunk that sticks out takes its whole space."""
    many = len(shape) > 1 and shape[-2] * shape[-1] > _MANY_CELLS
    fields = _CHUNK_OF_MANY if many else _CHUNK
    longest = fields[-len(shape) :] if len(shape) == 3 or many else (_LONGEST_CHUNK,) * len(shape)
    return tuple(math.ceil(n / math.ceil(n / most)) for n, most in zip(shape, longest, strict=True))
