"""Materials: creep compliances as a user states them, and the certified series that stand for them."""
