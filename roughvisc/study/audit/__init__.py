"""What the model leaves out, and whether that matters in a scene: a number, a verdict and a sentence each."""
