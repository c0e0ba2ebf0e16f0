"""Machine of `push`."""
