"""Source of `cycle`."""
