"""Weld-bead grinding (Brown 1988)."""
