"""A log as a plant: it replays the measurements and reports the first command that differs."""
