"""Opens damaged copies of scans, in a process of its own, which a fault in a library of C would end.

Arguments: how many copies of each, the seed of the damage, the scans. Writes for each scan how many copies were read,
how many refused, and by how many bytes the largest memory of this process has grown since the whole scan was read.
"""

import resource
import sys
from functools import partial
from pathlib import Path

import numpy as np
from damage import attempt, damaged_bytes

import roughvisc as rv

#: Seconds that one copy may take.
_PATIENCE = 20.0


def main(count, seed, *scans):
    rng = np.random.default_rng(int(seed))
    for path in map(Path, scans):
        whole, found = path.read_bytes(), []
        rv.open_scan(path)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for number in range(int(count)):
            path.write_bytes(damaged_bytes(rng, whole))
            read, message = attempt(partial(rv.open_scan, path), _PATIENCE, f"{path.name}, copy {number}")
            assert path.name in message if read is None else np.isfinite(read.values).any()
            found.append(read is not None)
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        print(sum(found), len(found) - sum(found), grown * (1 if sys.platform == "darwin" else 1024))


if __name__ == "__main__":
    main(*sys.argv[1:])
