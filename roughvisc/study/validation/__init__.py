"""Validation against closed forms on the machine of the user."""
