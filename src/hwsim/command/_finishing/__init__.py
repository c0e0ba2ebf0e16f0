"""`hwsim finishing`: job from a file, work, lines, study."""
