"""Model and problem of plunge grinding: power, burning, deflection, wear, dressing; presets."""
