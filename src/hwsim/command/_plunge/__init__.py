"""Folder of `hwsim plunge`: reader of jobs, command, report."""
