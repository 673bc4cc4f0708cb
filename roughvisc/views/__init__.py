"""What people look at: figures and quantities derived from results."""
