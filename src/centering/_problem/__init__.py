"""Model and problem of centering: part, contact, friction, machine limits, scatter, tolerance; presets."""
