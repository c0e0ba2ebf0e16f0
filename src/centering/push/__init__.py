"""Pushing a ring: limits, timing, lead, direction, and what the contact does."""
