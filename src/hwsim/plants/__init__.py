"""Simulated machines; users find them in `hwsim` itself, as `hwsim.PlungeGrinder`."""
