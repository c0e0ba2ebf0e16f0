"""The loop between controller and plant: `run`, `compare`, `repeat`, `check`."""
