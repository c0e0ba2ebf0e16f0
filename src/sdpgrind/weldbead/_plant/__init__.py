"""Plant of `weldbead`."""
