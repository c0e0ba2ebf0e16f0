"""Simulated machines; they stand flat in `hwsim`."""
