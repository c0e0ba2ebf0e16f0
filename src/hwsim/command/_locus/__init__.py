"""`hwsim locus`: job from a file, work, lines."""
