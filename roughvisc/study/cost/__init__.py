"""What will be modelled and what it will cost, before anything runs."""
