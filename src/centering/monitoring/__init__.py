"""Monitoring of `centering`."""
