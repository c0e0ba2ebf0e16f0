"""Proof that C has the bits of the kernels: the same inputs through both, in self-test and check."""
