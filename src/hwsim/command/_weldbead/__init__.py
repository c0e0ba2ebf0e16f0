"""Folder of `hwsim weldbead`: reader of jobs, command, report."""
