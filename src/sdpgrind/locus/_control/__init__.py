"""Control of `locus`."""
