"""Problem of `locus`."""
