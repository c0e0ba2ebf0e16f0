"""The loop between a controller and a plant: `run`, `compare`, `repeat`, and what `check` says is missing."""
