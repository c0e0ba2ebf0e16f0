"""Processor of `hwsim`."""
