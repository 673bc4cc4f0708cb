"""Materials and a body that several files of tests share."""

from dataclasses import dataclass

import numpy as np

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE, Kernel
from roughvisc.mechanics.materials import MODELS

#: Contact modulus 1.
UNIT = rv.elastic(0.25)
#: Retarded in 0.1 s; four times as compliant in the end.
RUBBER = rv.zener(3e6, 1e6, 1e5)
#: Retarded in 1 ms, for speeds of 0.1 m/s on waves of 1 mm.
QUICK_RUBBER = rv.zener(1e6, 0.3e6, 0.3e3)
#: A layer and a base that creep in different times.
COMPRESSIBLE, POLYMER = rv.zener(3e6, 1e6, 1e5, poisson=0.4), rv.zener(1e7, 2e6, 2e4, poisson=0.3)
#: Retarded in 0.1 s; twice as compliant in the end.
GEL = rv.zener(1e6, 1e6, 1e5)
SMALL_ROUGH = rv.self_affine((1e-3, 0.8e-3), (22, 17), hurst=0.8, rms_slope=0.05, shortcut=1.5e-4, seed=4)
#: The same with a hole.
HOLED = SMALL_ROUGH.where((SMALL_ROUGH.x < 1.3e-4) | (SMALL_ROUGH.x > 2.8e-4) | (SMALL_ROUGH.y > 1.9e-4))

#: A material of each model that a study may name, under this name, and further kinds.
OF_EACH_KIND = {
    "elastic": rv.elastic(2e6, 0.3),
    "maxwell": rv.maxwell(2e6, 1e6, 0.4),
    "kelvin_voigt": rv.kelvin_voigt(1e6, 3e5),
    "zener": RUBBER,
    "prony": rv.Prony(0.5, 0.1, (2.0, 1.0), (0.3, 20.0), poisson=0.3),
    "from_relaxation": rv.from_relaxation(1e6, [2e6], [0.1], bulk_modulus=2e9),
    "power_law": rv.power_law(0.2, 1.5, 0.3, time_scale=4.0, poisson=0.4),
    "pure power law": rv.power_law(0.0, 1.0, 0.7),
    "creep_series": MODELS["creep_series"](
        0.5, 0.1, (2.0, 1.0), (0.3, 20.0), 0.3, error=1e-4, shortest=1e-6, longest=1e6
    ),
    "fractional_zener": rv.fractional_zener(4.0, 1.0, 0.5, 0.4, poisson=0.3),
    "creep_table": rv.creep_table((0.0, 0.5, 2.0, 30.0, 1e3), (0.1, 0.4, 0.9, 1.1, 7.0), poisson=0.2, kind="shear"),
    "noisy table": rv.creep_table((0.5, 1.0, 30.0, 1e3), (1e-7, 2e-7, 1.99e-7, 8e-7), noise=0.1, kind="shear"),
    "relaxation_table": rv.relaxation_table((0.01, 0.1, 1.0, 1e3), (3e6, 2e6, 1.5e6, 1.2e6), kind="shear"),
    "dynamic_table": rv.dynamic_table(
        (0.1, 1.0, 10.0, 100.0), (1e6, 1.5e6, 3e6, 3.5e6), (2e5, 5e5, 6e5, 3e5), frequency_unit="Hz", kind="shear"
    ),
    "own": rv.creep(lambda t: 1.0 + np.log1p(t), poisson=0.1),
    "pair": rv.pair(rv.elastic(8e10, 0.3), RUBBER),
}
OF_EACH_KIND["mixed pair"] = rv.pair(OF_EACH_KIND["power_law"], OF_EACH_KIND["creep_table"])
OF_EACH_KIND["shifted"] = rv.shift(OF_EACH_KIND["power_law"], 20.0)


@dataclass(frozen=True)
class Scaled(Kernel):
    """A half-space of so many times the compliance."""

    factor: float
    raises_surface: bool = False

    def influence(self, shape, spacing):
        return self.factor * HALF_SPACE.influence(shape, spacing)

    def transfer(self, qx, qy):
        magnitude = np.hypot(qx, qy)
        return 2 * self.factor / np.where(magnitude > 0, magnitude, np.inf)
