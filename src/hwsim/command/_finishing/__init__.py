"""`hwsim finishing`: reader, command, report, study."""
