"""Model and problem of centering: part, contact, limits, scatter, the tolerance; presets."""
