"""A designed experiment on the simulated finishing cell: bench, study, report."""
