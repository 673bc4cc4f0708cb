"""Solver of the elastic contact problem of one instant, under a given load or approach."""

from roughvisc.mechanics.contact.solver import ContactState, solve_contact

__all__ = ["ContactState", "solve_contact"]
