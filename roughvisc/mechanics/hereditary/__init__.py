"""The hereditary integral: what a material remembers, and the choice of the form it is kept in."""
