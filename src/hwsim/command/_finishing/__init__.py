"""Folder of `hwsim finishing`: reader of jobs, command, report, study."""
