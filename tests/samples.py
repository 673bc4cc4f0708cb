"""Materials and a body that several files of tests share."""

from dataclasses import dataclass

import numpy as np

import roughvisc as rv
from roughvisc.mechanics.body import Kernel
from roughvisc.mechanics.half_space import love_kernel

#: Contact modulus 1.
UNIT = rv.elastic(0.25)
#: Retarded in 0.1 s; four times as compliant in the end.
RUBBER = rv.zener(3e6, 1e6, 1e5)
#: Retarded in 1 ms, for speeds of 0.1 m/s on waves of 1 mm.
QUICK_RUBBER = rv.zener(1e6, 0.3e6, 0.3e3)
#: A layer and a base that creep in different times.
COMPRESSIBLE, POLYMER = rv.zener(3e6, 1e6, 1e5, poisson=0.4), rv.zener(1e7, 2e6, 2e4, poisson=0.3)


@dataclass(frozen=True)
class Scaled(Kernel):
    """A half-space of so many times the compliance."""

    factor: float
    raises_surface: bool = False

    def influence(self, shape, spacing):
        return self.factor * love_kernel(shape, spacing)

    def transfer(self, qx, qy):
        magnitude = np.hypot(qx, qy)
        return 2 * self.factor / np.where(magnitude > 0, magnitude, np.inf)
