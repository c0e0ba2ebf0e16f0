"""`hwsim locus`: reader, command, report."""
