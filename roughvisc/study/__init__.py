"""One case becomes a Dataset; many cases become files seen as one Dataset."""
