"""The hereditary integral: what a material remembers, in exponentials."""
