"""What the conductance of a frame costs: one punch, against the contact problem that the frame itself was."""

import numpy as np
from scenes import load_for_area, rough_gap, seconds

from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.transport.spots import frozen_contact


def measure(sizes=(128, 256, 512), areas=(0.05, 0.3), boundaries=("periodic", "free"), repeats=3):
    """Rows: iterations and seconds of a frame, those of the same elastic contact solved cold, and the error stated."""
    for boundary in boundaries:
        for cells in sizes:
            operator, gap = Operator((cells, cells), (1.0, 1.0), boundary), rough_gap(cells)
            if boundary == "free":  # a ball, so that the contact ends with the gap and not with the grid
                x = np.arange(cells) - cells / 2
                gap = 0.2 * gap + (x[:, None] ** 2 + x**2) / (2 * cells)
            for area in areas:
                load = load_for_area(operator, gap, area) * gap.size
                cold, state = seconds(lambda h=operator, g=gap, w=load: solve_contact(h, g, load=w), repeats)
                contact = state.pressure > 0
                spent, found = seconds(lambda c=contact, b=boundary: frozen_contact(c, (1.0, 1.0), b), repeats)
                yield {
                    "case": f"{boundary}, {cells} x {cells}, {100 * contact.mean():.2g} % in contact",
                    "iterations": found.iterations,
                    "seconds": spent,
                    "iterations_of_contact": state.iterations,
                    "seconds_of_contact": cold,
                    "stated_error": found.error / found.stiffness,
                }


if __name__ == "__main__":
    for line in measure():
        print("  ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in line.items()), flush=True)
