"""`hwsim weldbead`: reader, command, report."""
