"""Contact of measured rough surfaces with linear viscoelastic materials."""
