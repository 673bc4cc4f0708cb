"""Linear viscoelastic materials, and the certified exponential series that the solver uses."""
