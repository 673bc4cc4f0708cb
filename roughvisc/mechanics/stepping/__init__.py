"""The march through time: loading program, state, steps and their errors."""
