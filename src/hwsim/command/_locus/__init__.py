"""Folder of `hwsim locus`: reader of jobs, command, report."""
