"""One self-contained page of one or many results."""
