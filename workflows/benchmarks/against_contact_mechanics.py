"""Against ContactMechanics 1.8 (Python, and C++ transforms), one thread each: elastic contact."""

import numpy as np
from scenes import elastic, grid, load_for_area, rough_gap, sphere_gap


def measure(sizes=(256, 512), areas=(0.05, 0.3, 0.95), repeats=3):
    try:
        import ContactMechanics
        from ContactMechanics.Systems import NonSmoothContactSystem
        from SurfaceTopography import Topography
    except ImportError:
        return
    half_spaces = {
        "periodic": ContactMechanics.PeriodicFFTElasticHalfSpace,
        "free": ContactMechanics.FreeFFTElasticHalfSpace,
    }

    def press(gap, mean, boundary):
        sides = tuple(float(n) for n in gap.shape)

        def run():
            topography = Topography(gap.max() - gap, sides, periodic=boundary == "periodic")
            system = NonSmoothContactSystem(half_spaces[boundary](gap.shape, 1.0, sides), topography)
            found = system.minimize_proxy(external_force=mean * gap.size, pentol=1e-6 * gap.max(), maxiter=20_000)
            return np.asarray(found.jac)[: gap.shape[0], : gap.shape[1]]

        return run

    peer = "ContactMechanics"
    for cells in sizes:
        gap, operator = rough_gap(cells), grid(cells, "periodic")
        for area in areas:
            mean = load_for_area(operator, gap, area)
            name = f"elastic periodic rough, {area:.0%} area, {cells}^2"
            yield elastic(peer, name, press(gap, mean, "periodic"), operator, gap, mean, repeats)
        gap, mean = sphere_gap(cells)
        name = f"elastic free-space sphere, {cells}^2"
        yield elastic(peer, name, press(gap, mean, "free"), grid(cells, "free"), gap, mean, repeats)
