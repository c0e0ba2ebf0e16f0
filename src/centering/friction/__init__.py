"""Friction under the ring: laws, and what pushes teach about it."""
