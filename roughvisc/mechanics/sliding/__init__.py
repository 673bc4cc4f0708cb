"""A profile that slides at constant speed on a viscoelastic body, in its steady state. Arrays only."""
