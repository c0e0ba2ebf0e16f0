"""Plant of `finishing`."""
