"""The instantaneous contact state: an elastic contact problem under given load or given approach."""

from roughvisc.mechanics.contact.solver import ContactState, solve_contact

__all__ = ["ContactState", "solve_contact"]
