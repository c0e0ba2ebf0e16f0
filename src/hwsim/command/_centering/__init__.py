"""`hwsim centering`: reader, command, report, film and live view of a cycle."""
