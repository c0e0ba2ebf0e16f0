"""Plan of `plunge`."""
