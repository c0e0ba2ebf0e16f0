"""A log in the place of a plant: what was recorded is measured again, and the first command that differs is told."""
