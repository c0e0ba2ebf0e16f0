"""Designed experiment on the simulated finishing cell: bench, study, report."""
