"""Figures, animations and pages of results: each function of a figure takes a Dataset and returns a matplotlib Figure.

In a notebook a figure shows itself; elsewhere ``figure.savefig("name.pdf")`` writes it. Quantities are drawn with
readable prefixes. Matplotlib's global state is not changed.
"""

from roughvisc.plot.curves import area_against_load, budget, friction, history, trade
from roughvisc.plot.fields import animate, maps, section, surface
from roughvisc.plot.master import master_curve
from roughvisc.plot.result_page import page
from roughvisc.plot.sweep import sweep
from roughvisc.plot.waves import waves

__all__ = [
    "animate",
    "area_against_load",
    "budget",
    "friction",
    "history",
    "maps",
    "master_curve",
    "page",
    "section",
    "surface",
    "sweep",
    "trade",
    "waves",
]


def __dir__() -> list[str]:
    return __all__
