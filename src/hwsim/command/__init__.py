"""Command of `hwsim`."""
