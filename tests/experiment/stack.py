"""An experiment of one's own, of 60 lines: elastic states of a periodic surface under several loads."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from roughvisc.experiment.profile import Profile
from roughvisc.experiment.protocol import Experiment, Row, Rows
from roughvisc.experiment.sliding_grid import areas
from roughvisc.mechanics.contact import solve_contact
from roughvisc.study.statement.schema.experiments import ExperimentSection
from roughvisc.study.statement.schema.section import listed, measured
from roughvisc.variables import STATUS_MEANINGS, Variable, over_axis
from roughvisc.variables.axes import Axis

SHARED = """pressure gap force nominal_pressure approach contact_area contact_area_counted contact_fraction mean_gap
 stated_error grid_error grid_error_area iterations convolutions status wall_time"""
LOADS = Axis(
    "load",
    over_axis("load", SHARED.split())
    | {"load": Variable(("load",), "N", "load on the surface", short="load", in_table="last")},
    needed=("load", "force", "approach"),
    residual="stated_error",
    rows="loads",
    symbol="F",
    advice="a looser tolerance",
    model="Elastic contact at once, under each of several loads.",
)


@dataclass(frozen=True)
class Stack(Experiment):
    """The contact at once under each load [N]."""

    loads: tuple[float, ...]
    axis: ClassVar[str] = "load"
    table: ClassVar[str] = "stack"
    called: ClassVar[str] = "a stack of loads"

    def rows(self, problem, state=None, *, in_memory=True):
        return Rows(problem.height, self._found(problem, state or 0), end=len(self.loads))

    def content(self):
        return list(self.loads)

    def _found(self, problem, done):
        body, settings = problem.body, problem.settings
        profile = Profile(problem.height, settings.missing, kernel=body.kernel)
        operator = profile.operator(settings.boundary)
        cell, alpha = operator.cell_area, float(body.material.contact_compliance(0.0))
        for number, load in enumerate(self.loads[done:], done + 1):
            options = {"error_tolerance": settings.tolerance, "estimate_error": True, "tolerance": settings.tolerance}
            found = solve_contact(operator, profile.gap, load=load * alpha / cell, **options)
            contact = found.pressure > 0
            counted, area = areas(contact, profile.spacing)
            gap = np.where(contact, 0.0, np.maximum(profile.gap + found.displacement - found.approach, 0.0))
            row = {
                "force": load,
                "nominal_pressure": load / profile.nominal_area,
                "approach": found.approach,
                "contact_area": area,
                "contact_area_counted": counted,
                "contact_fraction": profile.contact_fraction(area),
                "mean_gap": float(gap.mean()),
                "stated_error": found.error,
                "iterations": found.iterations,
                "convolutions": found.convolutions,
                "status": STATUS_MEANINGS.index("converged" if found.converged else "not_converged"),
            }
            fields = {"pressure": found.pressure / alpha, "gap": gap}
            yield Row(load, row, {name: fields[name] for name in settings.fields}, state=number, done=number)


class StackSection(ExperimentSection):
    """``[stack]`` of a study."""

    loads: listed(measured("N", above=0), "loads [N]")

    def experiment(self):
        return Stack(self.loads)
