"""Contact of `push`."""
