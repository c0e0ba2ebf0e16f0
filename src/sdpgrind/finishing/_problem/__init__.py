"""Problem of `finishing`."""
