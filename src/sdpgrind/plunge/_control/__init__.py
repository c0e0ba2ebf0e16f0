"""Control of `plunge`."""
