"""Tables of a study that say what is done with the surface, each in place of the segments of a program."""

from __future__ import annotations

from roughvisc.experiment.protocol import Experiment
from roughvisc.study.statement.schema.section import Section


class ExperimentSection(Section):
    """A table that states an experiment."""

    def experiment(self) -> Experiment:
        """What is done, as the solver takes it."""
        raise NotImplementedError
