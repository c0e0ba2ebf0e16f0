"""Plan of `push`."""
