"""Plant of `locus`."""
