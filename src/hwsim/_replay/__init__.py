"""Replay of `hwsim`."""
