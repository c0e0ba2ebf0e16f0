"""`hwsim plunge`: reader, command, report."""
