"""What flows through a contact, or past it: through its spots, and through the gap. Arrays only."""
