"""Plant of `centering`."""
