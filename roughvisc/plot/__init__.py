"""Figures and animations of results: each function takes a Dataset and returns a matplotlib Figure.

In a notebook a figure shows itself; elsewhere ``figure.savefig("name.pdf")`` writes it. Quantities are drawn with
readable prefixes. Matplotlib's global state is not changed.
"""

from roughvisc.plot.fields import animate, maps, section, surface
from roughvisc.plot.history import area_against_load, friction, history
from roughvisc.plot.save import FIGURES as FIGURES
from roughvisc.plot.save import save_figures, save_sweep_figures
from roughvisc.plot.sweep import sweep
from roughvisc.plot.trade import budget, trade

__all__ = [
    "animate",
    "area_against_load",
    "budget",
    "friction",
    "history",
    "maps",
    "save_figures",
    "save_sweep_figures",
    "section",
    "surface",
    "sweep",
    "trade",
]


def __dir__() -> list[str]:
    return __all__
