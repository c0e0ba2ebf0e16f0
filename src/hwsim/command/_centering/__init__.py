"""Folder of `hwsim centering`: reader of jobs, command, report, film and live view of a cycle."""
