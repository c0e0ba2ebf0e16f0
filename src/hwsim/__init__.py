"""Hardware simulation."""
