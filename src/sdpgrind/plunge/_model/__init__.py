"""Model of `plunge`."""
