"""Profile of `push`."""
