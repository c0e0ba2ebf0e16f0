"""Strategy of `cycle`."""
