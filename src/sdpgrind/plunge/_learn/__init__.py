"""Learn of `plunge`."""
